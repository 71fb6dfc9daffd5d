"""What a person can decide about the session, with what we would decide; times are assumptions, printed as such."""

from typing import Annotated

from msgspec import Meta, Struct

from capture_plan.input.documents import MOST_COUNTED

Seconds = Annotated[float, Meta(ge=0, le=3600)]


class SessionSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Every time here is an assumption of ours: measure your first session and change it.

    `hold_s`: how long an expression is held, for a still camera array. `explain_s`: reading out, showing the picture
    and trying once; `harder_s` is added for every level of difficulty above 1. `slate_s`: slate, countdown and check of
    the take. `retakes`: takes beside the first, as a share of all expressions. `relax_every`: expressions between two
    pauses of `relax_s`. `neutral_s`: each neutral, teeth and turned view. `calibration_s`: colour chart and calibration
    board. `easy_first`: easy expressions that are shot before all others, so that nobody begins with what is hard; 0
    shoots in the order of gain alone. `minutes`: the time there is; what does not fit is marked.
    """

    hold_s: Seconds = 3.0
    explain_s: Seconds = 25.0
    harder_s: Seconds = 10.0
    slate_s: Seconds = 12.0
    retakes: Annotated[float, Meta(ge=0, le=10)] = 0.5
    relax_every: Annotated[int, Meta(ge=1, le=MOST_COUNTED)] = 6
    relax_s: Seconds = 45.0
    neutral_s: Seconds = 30.0
    calibration_s: Seconds = 120.0
    easy_first: Annotated[int, Meta(ge=0, le=MOST_COUNTED)] = 2
    minutes: Annotated[float, Meta(gt=0, le=MOST_COUNTED)] | None = None
