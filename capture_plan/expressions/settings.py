"""What a person can decide about expressions, with what we would decide for them."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

Share = Annotated[float, Meta(ge=0, le=1)]


class PackingSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Shares from 0 to 1, after Carrigan et al. 2020.

    `method`: `minimum` is the provably shortest list, `sequential` the paper's Algorithm 1. `mu`: a vertex is active
    where a blendshape moves it by this share of the blendshape's largest movement; 0.25 to 0.4 is the paper's range.
    `paired`: left and right partners are performed together. `poseable`: what no face can do at once is kept apart
    (closed and wide eyes), where names tell. `distortion`: weight of triangle distortion against
    displacement, used when a target neutral is known (1 - alpha of eq. 4). `uniqueness`: beta of eq. 4.
    `limit`: the most expressions there is time for; the rest is listed as left out.
    """

    method: Literal["minimum", "sequential"] = "minimum"
    mu: Annotated[float, Meta(gt=0, le=1)] = 0.3
    paired: bool = True
    poseable: bool = True
    distortion: Share = 0.5
    uniqueness: Share = 0.0
    limit: Annotated[int, Meta(ge=1)] | None = None
