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

from typing import Annotated

from msgspec import Meta, Struct, field

from capture_plan.errors import SettingsError
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.expressions.settings import PackingSettings
from capture_plan.input.documents import MOST_COUNTED
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.consent import Consent


class Settings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Everything that a person decides about a plan, each with a default.

    `cameras`: a preset or a camera file, nothing where they are unknown; `target`: a file of the actor's neutral;
    `sequences`: recorded takes of the rig, or of other people on its mesh; `sequence_weights`: how much each of them
    counts, the same where none are given; `vertex_weights`: a file of how much an error counts at each vertex;
    `consent`: what was agreed about the actor's likeness, for page one.
    """

    landmarks: LayoutSettings = field(default_factory=LayoutSettings)
    expressions: PackingSettings = field(default_factory=PackingSettings)
    session: SessionSettings = field(default_factory=SessionSettings)
    consent: Consent = field(default_factory=Consent)
    cameras: str | None = None
    target: str | None = None
    sequences: tuple[str, ...] = ()
    sequence_weights: tuple[Annotated[float, Meta(ge=1e-6, le=MOST_COUNTED)], ...] = ()
    vertex_weights: str | None = None

    def __post_init__(self) -> None:
        takes, weights = len(self.sequences), len(self.sequence_weights)
        if weights and weights != takes:
            raise SettingsError(f"{weights} sequence weights for {takes} sequences: give one for each, or none")
        if self.vertex_weights and not takes:
            raise SettingsError("vertex weights weigh the error of a take: give sequences with them")
