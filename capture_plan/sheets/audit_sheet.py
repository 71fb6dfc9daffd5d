"""The audit on one page to look at: how the face was understood, drawn, with the verdict and every doubt beside it.

Page lengths are millimetres from the top left corner, y down, on A4 across.
"""

import base64
import html
import io

import pypdfium2
from PIL import Image

from capture_plan.errors import RigError
from capture_plan.rig import Rig
from capture_plan.rig.audit import Audit
from capture_plan.rig.audit_page import audit_text, verdict
from capture_plan.rig.face.words import answers, doubts, left_out_words
from capture_plan.sheets.page import MARGIN_MM, Booklet, Paper
from capture_plan.sheets.style import FAINT, INK, SOFT, WASH
from capture_plan.sheets.understood import CLAY, PLAIN_SKIN, REST, Understood, draw_understood, understood

A4_ACROSS = Paper("a4", 297.0, 210.0)
KINDS = (".png", ".pdf", ".html", ".htm")
DPI = 160  # of the PNG; the head itself is drawn finer, for the PDF
HEAD_DPI = 220
VIEWS_Y, VIEWS_MM = 37.0, 98.0  # from the top of the page, and how high the heads are
TEXT_Y = 156.0
DOUBT_PT, LINE_MM = 8.0, 3.35
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
    """The page, drawn."""
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


def _draw_sides(book: Booklet) -> None:
    """Whose left is left, above the front view."""
    half = book.paper.width / 2
    book.text(MARGIN_MM, 29.5, "SUBJECT'S RIGHT", 12, bold=True)
    book.text(half - MARGIN_MM, 29.5, "SUBJECT'S LEFT", 12, bold=True, align="right")
    book.text(half + (half - MARGIN_MM) / 2, 29.5, "SEEN FROM THE SUBJECT'S LEFT", 12, bold=True, align="centre")


def _draw_swatches(book: Booklet, shown: Understood) -> None:
    """What the colours of the head mean."""
    skin = [_hex(PLAIN_SKIN)] if shown.regions is None else [_hex(CLAY)]
    x, y = MARGIN_MM, TEXT_Y - 6.5
    words = "skin: markers may go there" + ("" if shown.regions is None else ", in the soft colours of its regions")
    for fill, text in ((skin[0], words), (_hex(REST), "the rest: no markers")):
        book.box(x, y - 2.6, 5, 3.2, fill=fill, line=SOFT, width=0.15)
        x += 6.4 + book.text(x + 6.4, y, text, 7.2, colour=SOFT) + 6
    if shown.regions is None:
        book.text(x, y, "regions have no names: eyes or mouth are not certain", 7.2, bold=True, colour=WARN)


def _draw_answers(book: Booklet, found: Audit) -> None:
    """Every answer in a row, with whether it is certain."""
    assert found.reading is not None, "checked when the page is begun"
    x, y, wide = MARGIN_MM, TEXT_Y, book.paper.width / 2 - MARGIN_MM - 3
    book.text(x, y, "WHAT WAS UNDERSTOOD", 9, bold=True)
    for label, text, sure in answers(found.reading):
        y += 5.4
        book.line((x, y - 3.8), (x + wide, y - 3.8), width=0.1, colour=FAINT)
        book.text(x, y, label, 8, bold=True)
        book.text(x + 15, y, "sure" if sure else "not sure", 7.4, bold=True, colour=GOOD if sure else WARN)
        book.text(x + 30, y, text, 7.6, colour=INK, fit=wide - 30)


def _draw_doubts(book: Booklet, found: Audit) -> None:
    """What is in doubt with what to give, and what was left out."""
    assert found.reading is not None, "checked when the page is begun"
    x, wide = book.paper.width / 2 + 3, book.paper.width / 2 - MARGIN_MM - 3
    told, out = doubts(found.reading), left_out_words(found.reading)
    words = told or ["If the picture looks wrong all the same, give --up, --facing, --unit-mm or --skin."]
    lines = [min(len(book.broken(sentence, DOUBT_PT, width=wide - 6)), 3) for sentence in words]
    y, high = TEXT_Y - 4, min(9.0 + sum(LINE_MM * n + 0.8 for n in lines), 46.0 - 8.5 * len(out))
    book.box(x, y, wide, high, fill=PAPER_OF_WARNING if told else WASH, line=WARN if told else None, width=0.4)
    book.text(
        x + 3, y + 4.6, "IN DOUBT" if told else "NOTHING IS IN DOUBT", 9, bold=True, colour=WARN if told else GOOD
    )
    row = y + 6.0
    for sentence, most in zip(words, lines, strict=True):
        row = book.paragraph(x + 3, row, sentence, DOUBT_PT, width=wide - 6, lines=most) + 0.8
    for i, (label, text) in enumerate(out):
        top = y + high + 1.5 + 8.5 * i
        book.text(x + 3, top + 3.4, label, 8, bold=True)
        book.paragraph(x + 21, top, text, 7.6, width=wide - 22, lines=2, colour=INK)


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
        "<style>body{margin:2rem auto;max-width:70rem;padding:0 1rem;font:16px/1.5 system-ui,sans-serif;color:#1d1f22}"
        "img{width:100%;height:auto;border:1px solid #c9ccd1}pre{font:13px/1.45 ui-monospace,monospace;"
        "overflow-x:auto;background:#f1f2f4;padding:1rem}</style></head>\n"
        f'<body><h1>Audit of {name}</h1>\n<img src="data:image/png;base64,{picture}" alt="{html.escape(said)}">\n'
        f"<pre>{html.escape(audit_text(found))}</pre></body></html>\n"
    ).encode()


def _hex(colour: tuple[float, float, float]) -> str:
    """(0.5, 0.5, 0.5) -> '#808080'."""
    return "#" + "".join(f"{round(255 * c):02x}" for c in colour)
