"""What the plan page says of the session: each expression's difficulty and fallback, and the shot list as a table."""

from typing import Any

from capture_plan.expressions.session import Item, Session, easy_words, shot_number, spare_words, stop_below
from capture_plan.report.words import percent

LEVELS = 5
KINDS = {
    "calibration": "calibration",
    "neutral": "neutral",
    "teeth": "teeth",
    "turned": "turned head",
    "expression": "",
    "pause": "pause",
}


def shot_facts(item: Item) -> dict[str, Any]:
    """How hard an expression is and why, what to avoid, how long to hold it, and what to shoot instead."""
    hard = item.difficulty
    return {
        "level": hard.level if hard else 0,
        "boxes": level_boxes(hard.level if hard else 0),
        "reasons": "; ".join(hard.reasons) if hard else "",
        "avoid": "; ".join(item.mistakes),
        "hold": f"{item.hold_s:g} s",
        "fallback": [(part.name, part.sentence) for part in item.fallback],
    }


def level_boxes(level: int) -> str:
    """Filled and empty squares, which screens, printers and readers of plain text all show."""
    return "■" * level + "□" * (LEVELS - level)


def shot_rows(of: Session) -> list[dict[str, Any]]:
    """One row an item of the session, in order; times are minutes from the start."""
    return [
        {
            "shot": shot_number(item),
            "name": item.name,
            "kind": KINDS[item.kind],
            "sentence": item.sentence,
            "level": item.difficulty.level if item.difficulty else 0,
            "boxes": level_boxes(item.difficulty.level) if item.difficulty else "",
            "hold": f"{item.hold_s:g} s" if item.hold_s else "",
            "clock": f"{item.minutes:.1f}",
            "covered": percent(item.covered) if item.kind == "expression" else "",
            "framing": item.kind != "expression",
            "spare": not item.fits,
            "stop": of.stop if item.name == stop_below(of) else "",
        }
        for item in of.items
    ]


def session_intro(of: Session) -> str:
    """How long it takes and on what that rests."""
    settings = of.settings
    takes = f"About {of.minutes:.0f} minutes with neutrals, teeth and pauses."
    takes = " ".join(filter(None, (takes, spare_words(of), easy_words(of))))
    return (
        f"{takes} These are estimates: {settings.hold_s:g} s of hold, {settings.retakes:g} retakes per "
        f"expression, a pause every {settings.relax_every} expressions. Measure your first session and change "
        "them in the settings."
    )
