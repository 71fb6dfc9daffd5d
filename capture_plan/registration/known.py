"""Names of the layouts that studios and data sets use."""

from typing import Literal, get_args

Known = Literal["ibug68", "ibug51", "mpeg4", "iemocap53", "motionbuilder17", "faceware30"]
EMPIRICAL: tuple[str, ...] = get_args(Known)
