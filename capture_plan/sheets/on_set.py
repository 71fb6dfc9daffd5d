"""What a plan gives to people on set besides the sheets, each a PDF of its own: cue cards, a deck,
the sculptor's pages.

The PDFs appear together when all of them are drawn, and nothing before.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from capture_plan.output import write_whole, written_together
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan, number_of, whose_words
from capture_plan.rig import Rig
from capture_plan.sheets.cue_cards import draw_cue_cards
from capture_plan.sheets.deck import draw_deck
from capture_plan.sheets.page import Booklet
from capture_plan.sheets.sculptor import draw_sculptor
from capture_plan.sheets.write import Sheet, refuse_other_rig

DRAWN: Mapping[str, Callable[..., Booklet]] = MappingProxyType(
    {"cards": draw_cue_cards, "deck": draw_deck, "sculptor": draw_sculptor}
)
NEXT = MappingProxyType(
    {
        "cards": "print {path} and hold each card beside the camera, in the order of the pages.",
        "deck": "open {path} on the whole screen of a monitor beside the camera; the arrow keys step.",
        "sculptor": "send {path} to who sculpts the expressions: millimetres of the head as it is planned on.",
    }
)
TO_IMITATE = ("cards", "deck")  # what an actor imitates


def write_on_set(
    plan: Plan,
    inputs: Rig | PlanInputs,
    folder: Path | str,
    *,
    kinds: tuple[str, ...] = tuple(DRAWN),
    paper: Sheet = "a4",
    dpi: int = 300,
    as_mirror: bool = False,
) -> tuple[Path, ...]:
    """Write `KIND.pdf` for each of the `kinds` into `folder`, all or none, and return the paths. With `as_mirror`
    the portraits of cards and deck stand as in a mirror, in `KIND-mirror.pdf`. A plan that was carried onto the actor's
    head is drawn on it.

    Raises:
        PlanError: the plan belongs to another rig, or the folder cannot be written.
        RenderError: this machine cannot draw.
    """
    given = inputs if isinstance(inputs, PlanInputs) else PlanInputs(inputs)
    refuse_other_rig(plan, given.rig)
    made = {
        file_of(kind, as_mirror=as_mirror): DRAWN[kind](plan, given, sheet=paper, dpi=dpi, mirrored=as_mirror)
        for kind in kinds
    }
    with written_together(Path(folder), whose_words(plan), number_of(plan)) as new:
        for name, book in made.items():
            write_whole(new / name, book.bytes())
    return tuple(Path(folder) / name for name in made)


def file_of(kind: str, *, as_mirror: bool) -> str:
    """'cards.pdf'; 'cards-mirror.pdf' of what an actor imitates as in a mirror."""
    return f"{kind}-mirror.pdf" if as_mirror and kind in TO_IMITATE else f"{kind}.pdf"
