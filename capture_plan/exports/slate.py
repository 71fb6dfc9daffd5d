"""The shot list for who holds the slate: one line an item, with columns to tick and to write takes into."""

from pathlib import Path
from types import MappingProxyType

from capture_plan.exports.rows import Columns, write_rows
from capture_plan.expressions.session import Item, Session, shot_number

TAKES = 3
COLUMNS = (
    "shot",
    "name",
    "kind",
    "sentence",
    "hold_s",
    "minutes_so_far",
    "covered_percent",
    "difficulty",
)
ACTING = ("why_hard", "avoid", "if_it_does_not_work", "blendshapes", "weights", "held_besides", "fits_the_time")
TICKS = (*(f"take_{number}" for number in range(1, TAKES + 1)), "pass", "retake", "fallback_shot", "notes")


def write_slate(session: Session, path: Path, *, of: Columns = MappingProxyType({})) -> Path:
    """Everything that is shot, in order; the tick columns are empty, times in seconds and minutes. `of` are columns of
    one value each."""
    rows = ([*slate_row(item), *of.values()] for item in session.items)
    return write_rows(path, [[*COLUMNS, *ACTING, *TICKS, *of], *rows])


def slate_row(item: Item) -> list[object]:
    """One line; what an item does not have stays empty."""
    hard = item.difficulty
    return [
        shot_number(item),
        item.name,
        item.kind,
        item.sentence,
        f"{item.hold_s:g}" if item.hold_s else "",
        f"{item.minutes:.1f}",
        f"{100 * item.covered:.1f}",
        hard.level if hard else "",
        "; ".join(hard.reasons) if hard else "",
        "; ".join(item.mistakes),
        " / ".join(f"{part.name}: {part.sentence}" for part in item.fallback),
        " ".join(item.blendshapes),
        " ".join(f"{weight:g}" for weight in item.weights),
        " ".join(item.drivers),
        "yes" if item.fits else "only if time is left",
        *("" for _ in TICKS),
    ]
