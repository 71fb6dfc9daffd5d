"""The audit on one page to look at: how the face was understood, drawn, with the verdict and every doubt beside it.

Page lengths are millimetres from the top left corner, y down, on A4 across.
"""

import base64
import html
import io

import pypdfium2
from PIL import Image

from capture_plan.audit.audit import Audit
from capture_plan.audit.report import asked_lines, asked_of, asked_words, audit_text, verdict
from capture_plan.errors import RigError
from capture_plan.face.facts import ReadingFacts
from capture_plan.face.words import NAMED, NOT_FOUND, SPOKEN, Answer, answers, doubts, left_out_words, signs_words
from capture_plan.rig import Rig
from capture_plan.sheets.page import MARGIN_MM, PAPERS, POINT_MM, Booklet, PaperSize
from capture_plan.sheets.style import FAINT, INK, SOFT, WASH
from capture_plan.sheets.understood import CLAY, PLAIN_SKIN, REST, UnderstoodHead, draw_understood, understood

A4_ACROSS = PaperSize("a4", PAPERS["a4"].height, PAPERS["a4"].width)
KINDS = (".png", ".pdf", ".html", ".htm")
DPI = 160  # of the PNG; the head itself is drawn finer, for the PDF
HEAD_DPI = 220
VIEWS_Y, VIEWS_MM = 37.0, 91.0  # from the top of the page, and how high the heads are
SIDES_Y = 30.6
TEXT_Y = 147.0
BOTTOM_Y = 204.0
ANSWER_PT, SIGNS_PT, OUT_PT, KEY_PT = 8.0, 7.5, 7.6, 7.5
DOUBT_PTS = (8.5, 8.0, 7.5)  # the largest at which all doubts have room
MOST_MM, OUT_MM, BETWEEN_MM = 58.0, 7.6, 0.8  # of the box of doubts, of a line below it, between two doubts
GOOD, WARN, BAD = "#0f7b4f", "#9a5b00", "#b3261e"
PAPER_OF_WARNING = "#fff6e5"


def audit_bytes(found: Audit, rig: Rig, kind: str) -> bytes:
    """The page as `.pdf`, `.png` or `.html`.

    Raises:
        RigError: the audit has no reading, or is that of another rig.
        RenderError: this machine cannot draw.
    """
    pdf = audit_booklet(found, rig).bytes()
    if kind == ".pdf":
        return pdf
    return _png(pdf) if kind == ".png" else _html(found, _png(pdf))


def audit_booklet(found: Audit, rig: Rig) -> Booklet:
    """The page of an audit, drawn into a booklet."""
    if found.reading is None or found.vertices != len(rig.neutral):
        raise RigError(f"{rig.name}: the audit is not that of this rig: audit it again")
    book = Booklet(A4_ACROSS, f"Audit of {found.name}")
    book.add_page("audit")
    shown = understood(rig, found.reading)
    _draw_head_lines(book, found)
    wide = book.paper.width - 2 * MARGIN_MM
    draw_understood(book, shown, MARGIN_MM, VIEWS_Y, wide, VIEWS_MM, dpi=HEAD_DPI)
    _draw_sides(book)
    _draw_swatches(book, shown)
    _draw_answers(book, found)
    _draw_doubts(book, found)
    return book


def _draw_head_lines(book: Booklet, found: Audit) -> None:
    """What it is of, and whether it can be shot with."""
    wide, said = book.paper.width - 2 * MARGIN_MM, verdict(found)
    colour = GOOD if said.startswith("Yes") else BAD if said.startswith("No:") else WARN
    book.text(MARGIN_MM, 12.5, f"AUDIT · {found.name}", 17, bold=True, fit=wide)
    asked = book.text(MARGIN_MM, 19, "Shoot with it?", 9.5, bold=True)
    book.text(MARGIN_MM + asked + 2.5, 19, said, 9.5, bold=True, colour=colour, fit=wide - asked - 3)
    book.line((MARGIN_MM, 22.2), (MARGIN_MM + wide, 22.2), width=0.5)
    back = book.text(MARGIN_MM, 25.4, "Send back", ANSWER_PT, bold=True)
    things = asked_words(asked_of(found)).replace(", listed below", "")
    book.text(MARGIN_MM + back + 2.5, 25.4, things, ANSWER_PT, fit=wide - back - 3)


def _draw_sides(book: Booklet) -> None:
    """Whose left is left, above the front view."""
    half = book.paper.width / 2
    book.text(MARGIN_MM, SIDES_Y, "SUBJECT'S RIGHT", 12, bold=True)
    book.text(half - MARGIN_MM, SIDES_Y, "SUBJECT'S LEFT", 12, bold=True, align="right")
    book.text(half + (half - MARGIN_MM) / 2, SIDES_Y, "SEEN FROM THE SUBJECT'S LEFT", 12, bold=True, align="centre")


def _draw_swatches(book: Booklet, shown: UnderstoodHead) -> None:
    """What the colours of the head mean."""
    skin = [_hex(PLAIN_SKIN)] if shown.regions is None else [_hex(CLAY)]
    x, y = MARGIN_MM, TEXT_Y - 6.0
    words = "skin: markers may go there" + ("" if shown.regions is None else ", in the soft colours of its regions")
    for fill, text in ((skin[0], words), (_hex(REST), "the rest: no markers")):
        book.box(x, y - 2.6, 5, 3.2, fill=fill, line=SOFT, width=0.15)
        x += 6.4 + book.text(x + 6.4, y, text, KEY_PT, colour=SOFT) + 6
    if shown.regions is None:
        book.text(x, y, "regions have no names: the reading is not certain", KEY_PT, bold=True, colour=WARN)


def _draw_answers(book: Booklet, found: Audit) -> None:
    """Every answer in a row with whether it is certain, and below it as many signs that it rests on as have room."""
    assert found.reading is not None, "checked when the page is begun"
    x, y, wide = MARGIN_MM, TEXT_Y, book.paper.width / 2 - MARGIN_MM - 3
    book.text(x, y, "WHAT WAS UNDERSTOOD", 9, bold=True)
    y += 1.3
    rows = _rows(answers(found.reading))
    by_lines = [_signs(book, rows, most, wide - 40) for most in ((2, 2), (1, 2), (1, 1), (0, 0))]
    signs = next(
        (message for message in by_lines if y + _high(book, rows, message, wide - 40) <= BOTTOM_Y), by_lines[-1]
    )
    for one, rests in zip(rows, signs, strict=True):
        book.line((x, y), (x + wide, y), width=0.1, colour=FAINT)
        book.text(x, y + 3.7, one.label, ANSWER_PT, bold=True)
        colour = GOOD if one.status == "sure" else WARN
        book.text(x + 26, y + 3.7, _status(one), ANSWER_PT, bold=True, colour=colour)
        row = _lines(book, x + 40, y + 0.6, one.text, ANSWER_PT, wide - 40)
        y = _lines(book, x + 40, row, rests, SIGNS_PT, wide - 40, SOFT) + 1.0


def _lines(book: Booklet, x: float, y: float, text: str, size: float, wide: float, colour: str = INK) -> float:
    """Writes a paragraph from y down; where it ends."""
    if not text:
        return y
    lines = len(book.broken(text, size, width=wide))
    return book.paragraph(x, y, text, size, width=wide, lines=lines, colour=colour)


def _signs(book: Booklet, rows: list[Answer], most_lines: tuple[int, int], wide: float) -> list[str]:
    """For each answer its strongest signs in words, as many as go on so many lines of a sure answer and of one that is
    not; none where not one does."""
    return [
        next(
            (
                words
                for most in range(SPOKEN, 0, -1)
                if len(book.broken(words := signs_words(one.signs, most), SIGNS_PT, width=wide))
                <= most_lines[not one.sure]
            ),
            "",
        )
        for one in rows
    ]


def _high(book: Booklet, rows: list[Answer], signs: list[str], wide: float) -> float:
    """Of all answers with these signs, millimetres."""
    sized = [(one.text, ANSWER_PT) for one in rows] + [(words, SIGNS_PT) for words in signs if words]
    return sum(len(book.broken(text, pt, width=wide)) * pt * POINT_MM * 1.18 for text, pt in sized) + 1.6 * len(rows)


def _status(one: Answer) -> str:
    """The word beside an answer: of several places of which some were not found, 'in part'; none that repeats it."""
    if one.text == NOT_FOUND:
        return ""
    return "in part" if NOT_FOUND in one.text else one.status


def _rows(messages: list[Answer]) -> list[Answer]:
    """Nose, chin and ears, which are drawn and rest on eyes and mouth, in one row."""
    small = [one for one in messages if one.label in ("Nose", "Chin", "Ears")]
    unseen = [one.label.lower() for one in small if one.text == NOT_FOUND]
    sure = [one.label.lower() for one in small if one.sure and one.label.lower() not in unseen]
    rest = [one.label.lower() for one in small if not one.sure]
    groups = ((sure, "drawn above"), (rest, "drawn above, not certain"), (unseen, NOT_FOUND))
    words = NOT_FOUND if len(unseen) == len(small) else "; ".join(f"{', '.join(n)}: {said}" for n, said in groups if n)
    merged = Answer("Nose, chin, ears", words, (), all(one.sure for one in small))
    return [*(one for one in messages[:-1] if one not in small), merged, messages[-1]]


def _draw_doubts(book: Booklet, found: Audit) -> None:
    """What is in doubt with what to give, and what was left out."""
    assert found.reading is not None, "checked when the page is begun"
    x, wide = book.paper.width / 2 + 3, book.paper.width / 2 - MARGIN_MM - 3
    message, out = doubts(found.reading), _left_out(book, found.reading, wide - 22)
    words = message or ["If the picture looks wrong all the same, give --up, --facing, --unit-mm or --skin."]
    most = MOST_MM - OUT_MM * len(out)
    size = next((pt for pt in DOUBT_PTS if _height(book, words, pt, wide - 6) <= most), DOUBT_PTS[-1])
    y, high = TEXT_Y - 4, min(_height(book, words, size, wide - 6), most)
    book.box(x, y, wide, high, fill=PAPER_OF_WARNING if message else WASH, line=WARN if message else None, width=0.4)
    calm = ("NOTHING IS IN DOUBT", GOOD) if verdict(found).startswith("Yes") else ("SEE THE VERDICT ABOVE", WARN)
    title, colour = ("IN DOUBT", WARN) if message else calm
    book.text(x + 3, y + 4.6, title, 9, bold=True, colour=colour)
    row = y + 6.0
    for sentence in words:
        lines = len(book.broken(sentence, size, width=wide - 6))
        row = book.paragraph(x + 3, row, sentence, size, width=wide - 6, lines=lines) + BETWEEN_MM
    for i, (label, text) in enumerate(out):
        top = y + high + 1.5 + OUT_MM * i
        book.text(x + 3, top + 2.7, label, OUT_PT, bold=True)
        book.paragraph(x + 21, top, text, OUT_PT, width=wide - 22, lines=2)
    _draw_asked(book, found, x, y + high + 1.5 + OUT_MM * len(out), wide)


def _draw_asked(book: Booklet, found: Audit, x: float, y: float, wide: float) -> None:
    """What the rigger has to correct, as much of it as has room below the doubts; the text of the audit has it all."""
    lines = asked_lines(found)
    sized = [len(book.broken(text, OUT_PT, width=wide - 6)) * OUT_PT * POINT_MM * 1.18 + BETWEEN_MM for text in lines]
    top = y + 5.5
    fits = sum(top + sum(sized[: i + 1]) + OUT_PT * POINT_MM < BOTTOM_Y for i in range(len(lines)))
    if fits == 0:
        return
    book.text(x + 3, y + 4.2, "SEND BACK TO THE RIGGER", ANSWER_PT, bold=True)
    for text in lines[:fits]:
        top = _lines(book, x + 3, top, text, OUT_PT, wide - 6) + BETWEEN_MM
    if fits < len(lines):
        book.text(x + 3, top + 2.7, f"and {len(lines) - fits} more in the text of the audit", OUT_PT, colour=SOFT)


def _left_out(book: Booklet, read: ReadingFacts, wide: float) -> list[tuple[str, str]]:
    """What was left out or set aside, with as many names as go on two lines; the text of the audit has them all."""
    messages = (left_out_words(read, most) for most in range(NAMED, 0, -1))
    fits = (rows for rows in messages if all(len(book.broken(text, OUT_PT, width=wide)) <= 2 for _, text in rows))
    return next(fits, left_out_words(read, 1))


def _height(book: Booklet, words: list[str], size: float, width: float) -> float:
    """Of the box around these sentences, millimetres."""
    lines = sum(len(book.broken(sentence, size, width=width)) for sentence in words)
    return 8.0 + lines * size * POINT_MM * 1.18 + BETWEEN_MM * len(words)


def _png(pdf: bytes) -> bytes:
    document = pypdfium2.PdfDocument(pdf)
    image: Image.Image = document[0].render(scale=DPI / 72).to_pil()  # pyright: ignore[reportArgumentType]
    document.close()
    file = io.BytesIO()
    image.save(file, "PNG", dpi=(DPI, DPI))
    return file.getvalue()


def _html(found: Audit, png: bytes) -> bytes:
    """One file that needs no network: the page as a picture, and the whole audit as text."""
    assert found.reading is not None, "checked when the page is begun"
    name, picture = html.escape(found.name), base64.b64encode(png).decode()
    said = f"Shoot with it? {verdict(found)} {' '.join(doubts(found.reading))}"
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>Audit of {name}</title>\n'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
        'img-src data:">\n'
        "<style>body{margin:2rem auto;max-width:70rem;padding:0 1rem;font:16px/1.5 system-ui,sans-serif;color:#1d1f22}"
        "img{width:100%;height:auto;border:1px solid #c9ccd1}pre{font:13px/1.45 ui-monospace,monospace;"
        "overflow-x:auto;background:#f1f2f4;padding:1rem}</style></head>\n"
        f'<body><h1>Audit of {name}</h1>\n<img src="data:image/png;base64,{picture}" alt="{html.escape(said)}">\n'
        f"<pre>{html.escape(audit_text(found))}</pre></body></html>\n"
    ).encode()


def _hex(colour: tuple[float, float, float]) -> str:
    """(0.5, 0.5, 0.5) -> '#808080'."""
    return "#" + "".join(f"{round(255 * c):02x}" for c in colour)
