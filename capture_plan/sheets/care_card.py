"""The card that stays with the make-up artist through the day: what to do when a dot falls off.

Lengths are page millimetres from the top left corner, y down.
"""

from collections.abc import Mapping

from capture_plan.evaluation.fallen import Fallen, Falling
from capture_plan.layout.record import Landmark
from capture_plan.sheets.furniture import HeadLine, head_line
from capture_plan.sheets.marker_table import COLUMNS as TABLE
from capture_plan.sheets.marker_table import ROW_MM, begin_row
from capture_plan.sheets.markers import MarkedFace
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import INK, SOFT, Number

TOP_MM, BOTTOM_MM = 34.0, 34.0
# Left edge of each column, millimetres from the margin.
COLUMNS = TABLE | {"what": 52.0, "why": 82.0, "instead": 155.0}
PAIRS = 8  # that are named
SHOWN = 1  # blendshape that is named
ADVICE = {True: "carry on", False: "put it back first"}


def care_rows(book: Booklet) -> int:
    """How many dots stand on a card."""
    return int((book.paper.height - TOP_MM - BOTTOM_MM) // ROW_MM)


def draw_care(
    book: Booklet,
    landmarks: tuple[Landmark, ...],
    found: Falling,
    face: MarkedFace,
    placing: HeadLine,
    says: Mapping[str, str],
) -> None:
    """The card of some landmarks on the last page, the pairs below; `says` are movements of blendshapes in words."""
    head_line(book, "IF A DOT FALLS OFF", placing)
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    heads = {"number": "dot", "place": "where", "what": "what to do", "why": "why", "instead": "or a new dot"}
    for key, text in heads.items():
        book.text(left + COLUMNS[key], TOP_MM - 3, text, 7, bold=True)
    book.line((left, TOP_MM - 1.4), (right, TOP_MM - 1.4), width=0.3)
    by_name = {one.name: one for one in found.alone}
    for row, landmark in enumerate(landmarks):
        _row(book, landmark, by_name.get(landmark.name), face, TOP_MM + 2.4 + row * ROW_MM, says, shaded=row % 2 == 1)
    y = TOP_MM + 1.4 + len(landmarks) * ROW_MM
    note = "Carry on: put it back in the next pause, at its place on the marker page. A new dot: so far along the skin "
    note += "from the old place, left and right being the actor's; write down where it stands."
    y = book.paragraph(left, y, note, 7, width=right - left, lines=2, colour=SOFT) + 1
    if text := together_words(found.together):
        book.paragraph(left, y, text, 8.5, width=right - left, lines=2, bold=True)


def _row(
    book: Booklet,
    landmark: Landmark,
    one: Fallen | None,
    face: MarkedFace,
    y: Number,
    says: Mapping[str, str],
    *,
    shaded: bool,
) -> None:
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    begin_row(book, landmark, face, y, COLUMNS["what"], shaded=shaded)
    if one is not None:
        what = ADVICE[one.carry_on]
        book.text(left + COLUMNS["what"], y, what, 8.2, bold=not one.carry_on, colour=SOFT if one.carry_on else INK)
        why = why_words(one, says)
        book.text(left + COLUMNS["why"], y, why, 7.4, fit=COLUMNS["instead"] - COLUMNS["why"] - 2, colour=SOFT)
        book.text(left + COLUMNS["instead"], y, instead_words(one), 7.6, fit=right - left - COLUMNS["instead"])


def together_words(pairs: tuple[tuple[str, str], ...]) -> str:
    """Which two dots must not both be off, or where these are many, the worst."""
    names = ", ".join(f"{a} and {b}" for a, b in pairs[:PAIRS])
    if len(pairs) > PAIRS:
        return f"Two dots off at once: put one back first. The worst pairs: {names}."
    return f"Never both off at once: {names}." if pairs else ""


def why_words(one: Fallen, says: Mapping[str, str]) -> str:
    """What is lost with a dot, the movements in words; nothing where the session carries on."""
    if one.carry_on:
        return ""
    if one.unseen:
        more = f" and {len(one.unseen) - SHOWN} more" if len(one.unseen) > SHOWN else ""
        return f"the only dot that shows: {', '.join(says.get(name) or name for name in one.unseen[:SHOWN])}{more}"
    return f"without it the solved face is off by {100 * (one.factor - 1):.0f} % more"


def instead_words(one: Fallen) -> str:
    """'9 mm up and left'."""
    return "" if one.instead_mm is None else f"{one.instead_mm:.0f} mm {one.direction}"
