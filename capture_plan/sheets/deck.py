"""The deck: the session on a monitor on set, a page for each item in its order, stepped through with the arrow keys.

Pages are 16:9 and dark, so that the monitor casts little light on the face; a monitor shows them as large as it is.
Letters count as read at three metres on a monitor of 24 inches, whose picture is 531 mm wide. Lengths are page
millimetres from the top left corner, y down.
"""

from capture_plan.expressions.session import Item, shot_note, shot_title
from capture_plan.plan.carry import as_worn
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan
from capture_plan.sheets.cues import (
    AS_IN_A_MIRROR,
    Cue,
    Fitted,
    Portrait,
    cues,
    draw_fitted,
    draw_portrait,
    fitted,
    name_sides,
    tell_small,
)
from capture_plan.sheets.page import Booklet, PaperSize
from capture_plan.sheets.style import INK
from capture_plan.sheets.view import pixels

SCREEN = PaperSize("screen", 190.5 * 16 / 9, 190.5)
MONITOR_MM, READ_FROM_MM = 531.0, 3000.0
PORTRAIT_MM, EDGE_MM, TOP_MM, FOOT_MM = 140.0, 12.0, 42.0, 24.0
NAME_PT, NOTE_PT, MOST_PT = 52, 22, 110
GROUND, PALE, LIGHT, SIGNAL = INK, "#aab0b8", "#f4f5f6", "#8ab4ff"  # contrast with the ground 7.6 and more
DRAFT_MM = 9.0  # of white at the top of a draft, where the reason stands


def draw_deck(plan: Plan, inputs: PlanInputs, *, sheet: str, dpi: int, mirrored: bool) -> Booklet:
    """A page for every item of the session; a monitor has one size, whatever the `sheet`."""
    book = Booklet(SCREEN, f"{inputs.rig.name}: the session", inputs.rig.names, draft="; ".join(plan.draft))
    book.fill_screen()
    shown, worn = as_worn(plan, inputs)
    how = Portrait(pixels(PORTRAIT_MM, SCREEN.height, dpi), mirrored=mirrored, ground=GROUND)
    items, small = shown.session.items, []
    for cue in cues(shown, worn, items, how):
        book.add_page(shot_title(cue.item))
        text = _page(book, cue, shot_note(cue.item, shown.session), draft=bool(plan.draft), mirrored=mirrored)
        small.append((shot_title(cue.item).lower(), text))
    tell_small(small, READ_FROM_MM, MONITOR_MM / SCREEN.width)
    return book


def _page(book: Booklet, cue: Cue, note: str, *, draft: bool, mirrored: bool) -> Fitted:
    book.box(0, 0, SCREEN.width, SCREEN.height, fill=GROUND, line=None)
    draw_portrait(book, cue, SCREEN.width - PORTRAIT_MM, 0, PORTRAIT_MM, scale=1.7)
    right = SCREEN.width - EDGE_MM - (PORTRAIT_MM if cue.front else 0)
    name = book.text(EDGE_MM, 32, shot_title(cue.item), NAME_PT, bold=True, colour=LIGHT)
    book.text(EDGE_MM + name + 5, 32, note, NOTE_PT, colour=PALE)
    if mirrored and cue.front:
        room = right - EDGE_MM - name - 5
        book.text(EDGE_MM + name + 5, 21, AS_IN_A_MIRROR, NOTE_PT, bold=True, colour=SIGNAL, fit=room)
    height = SCREEN.height - TOP_MM - FOOT_MM
    text = fitted(book, cue.words, right - EDGE_MM, height, most_pt=MOST_PT)
    draw_fitted(book, EDGE_MM, TOP_MM + (height - text.height) / 2, text, right - EDGE_MM, colour=LIGHT)
    book.text(EDGE_MM, SCREEN.height - 10, _foot(cue.item), NOTE_PT, colour=PALE, fit=right - EDGE_MM)
    name_sides(book, cue, SCREEN.width - PORTRAIT_MM, 0, PORTRAIT_MM, mirrored=mirrored, colour=LIGHT)
    if draft:
        book.box(0, 0, SCREEN.width, DRAFT_MM, fill="#ffffff", line=None)
    return text


def _foot(item: Item) -> str:
    """'hold 3 s'; what is spare is called so."""
    parts = [f"hold {item.hold_s:g} s"] if item.hold_s else []
    return " · ".join(parts if item.fits else [*parts, "spare: if time is left"])
