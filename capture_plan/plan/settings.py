"""Everything a person can decide about a plan, as it stands in a settings file:

cameras = "head-mounted-pair"

[landmarks]
epsilon = 0.6
spacing_mm = 10

[expressions]
mu = 0.25

[session]
minutes = 60
"""

from msgspec import Struct, field

from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.expressions.settings import PackingSettings
from capture_plan.layout.settings import LayoutSettings


class Settings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`cameras`: a preset or a camera file, nothing where they are unknown; `target`: a file of the actor's neutral;
    `sequences`: recorded takes of the rig, each with the same say in what a layout loses of them."""

    landmarks: LayoutSettings = field(default_factory=LayoutSettings)
    expressions: PackingSettings = field(default_factory=PackingSettings)
    session: SessionSettings = field(default_factory=SessionSettings)
    cameras: str | None = None
    target: str | None = None
    sequences: tuple[str, ...] = ()
