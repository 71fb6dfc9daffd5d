"""The audit to look at: as large as its page, points where they project, a head that lies drawn lying."""

import base64
import io
import re
from dataclasses import replace as change

import numpy as np
import pypdfium2
import pytest
from msgspec.structs import replace
from PIL import Image

from capture_plan.anatomy.delta_relations import KINDS, Finding
from capture_plan.audit.audit import audit_rig
from capture_plan.audit.report import audit_text
from capture_plan.errors import RigError
from capture_plan.face.axes import axes_matrix
from capture_plan.face.facts import PairFacts, SpotFacts, reading_facts
from capture_plan.face.words import answers
from capture_plan.rig.understood import Sign
from capture_plan.sheets.audit_sheet import A4_ACROSS, DPI, VIEWS_MM, VIEWS_Y, audit_booklet, audit_bytes
from capture_plan.sheets.page import MARGIN_MM
from capture_plan.sheets.style import rgb
from capture_plan.sheets.understood import (
    BAR_SHARE,
    COLUMN_MM,
    POINT,
    VIEWS,
    bar_mm,
    file_axis,
    head_frames,
    soft_colour,
    understood,
)
from capture_plan.sheets.view import FRONT, picture, pixels

EACH_MM = (A4_ACROSS.width - 2 * MARGIN_MM) / len(VIEWS)


@pytest.fixture(scope="module")
def found(rig):
    return audit_rig(rig)


@pytest.fixture(scope="module")
def page(found, rig):
    return drawn(found, rig)


def drawn(found, rig):
    """The page's picture as rows of columns of colours."""
    return np.asarray(Image.open(io.BytesIO(audit_bytes(found, rig, ".png"))).convert("RGB")).astype(int)


def pixel_of(rig, read, view, at):
    """The row and the column of the page's picture where a point of the rig must be."""
    width = EACH_MM - 2 * COLUMN_MM
    frame = head_frames(understood(rig, read), width / VIEWS_MM)[VIEWS.index(view)]
    x, y, _ = view.project(np.array(at)[None])[0]
    left = MARGIN_MM + VIEWS.index(view) * EACH_MM + COLUMN_MM
    mm = np.array([VIEWS_Y + (frame.top - y) / frame.height * VIEWS_MM, left + (x - frame.left) / frame.width * width])
    return tuple((mm / 25.4 * DPI).astype(int))


def test_the_picture_is_a_sheet_of_paper(page):
    assert page.shape[:2] == pytest.approx(pixels(A4_ACROSS.width, A4_ACROSS.height, DPI)[::-1], abs=1)


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.name)
@pytest.mark.parametrize("name", ["left eye", "mouth", "chin"])
def test_a_points_pixel_has_the_colour_of_points(rig, found, page, view, name):
    read = found.reading
    at = read.eyes.left.mm if name == "left eye" else getattr(read, name).mm
    assert np.abs(page[pixel_of(rig, read, view, at)] - rgb(POINT.colour)).max() < 12


def test_the_right_eye_is_on_the_left_of_the_front_view(rig, found, page):
    at = found.reading.eyes.right.mm
    row, column = pixel_of(rig, found.reading, FRONT, at)
    assert column < page.shape[1] / 4
    assert np.abs(page[row, column] - rgb(POINT.colour)).max() < 12


def test_a_point_that_is_not_certain_is_hollow(rig, found):
    doubtful = replace(found.reading, mouth=replace(found.reading.mouth, sure=False))
    png = audit_bytes(replace(found, reading=doubtful), rig, ".png")
    pixel = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)[
        pixel_of(rig, doubtful, FRONT, doubtful.mouth.mm)
    ]
    assert pixel.min() > 240


def test_regions_are_coloured_only_where_they_are_known(rig, found):
    """Without them all skin has one colour."""
    unsure = replace(found.reading, mouth=replace(found.reading.mouth, sure=False))
    known, plain = understood(rig, found.reading), understood(rig, unsure)
    assert known.regions is not None
    assert plain.regions is None
    hues = [
        len(np.unique(max(one.posed.pieces, key=lambda p: len(p.vertices)).colours.round(3), axis=0))
        for one in (known, plain)
    ]
    assert hues[0] > hues[1]
    assert not np.allclose(soft_colour("brow"), soft_colour("forehead"))


def test_a_head_that_was_read_lying_is_drawn_lying(rig, found):
    """Up and forward exchanged: what is highest in the picture from the front is the tip of the nose."""
    turn = axes_matrix("+z", "+y")
    lying = change(rig, neutral=rig.neutral @ turn.T, deltas=(rig.deltas @ turn.T).astype(np.float32))
    shown = understood(lying, reading_facts(lying))
    frame = head_frames(shown, 1.0)[0]
    rows = np.isfinite(picture(shown.posed, FRONT, frame, size_px=(400, 400)).z).any(axis=1)
    highest = frame.top - rows.argmax() / 400 * frame.height
    assert highest == pytest.approx((turn @ found.reading.nose.mm)[1], abs=2)


def test_axes_of_the_file_are_named_with_their_signs():
    assert [file_axis(np.array(axis)) for axis in ((0.0, 0, -1), (1.0, 0, 0), (0, -0.9, 0.1))] == ["-z", "+x", "-y"]


def test_the_page_comes_as_pdf_and_as_html_that_needs_no_network(found, rig):
    pdf = pypdfium2.PdfDocument(audit_bytes(found, rig, ".pdf"))
    text = pdf[0].get_textpage().get_text_bounded()
    for words in ("SUBJECT'S LEFT", "SUBJECT'S RIGHT", "100 mm", "up +y", "forward +z", "left +x", "forehead", "neck"):
        assert words in text, words
    page = audit_bytes(found, rig, ".html").decode()
    inside = re.search(r'src="data:image/png;base64,([^"]+)"', page)
    assert inside is not None
    assert Image.open(io.BytesIO(base64.b64decode(inside[1]))).width > 1000
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "WHAT WAS UNDERSTOOD" in page


@pytest.mark.parametrize("width", [0.3, 9.0, 34.0, 60.0, 166.6, 166.7, 250.0, 400.0, 6000.0])
def test_the_bar_is_a_round_length_that_fits_beside_the_axes_and_is_no_stub(width):
    mm = bar_mm(width)
    assert mm <= BAR_SHARE * width * (1 + 1e-6)
    assert mm > BAR_SHARE * width / 2.5 * (1 - 1e-6)
    assert f"{mm:.0e}"[0] in "125"


def test_the_bars_of_human_heads_are_100_mm():
    assert {bar_mm(width) for width in (170.0, 220.0, 300.0)} == {100.0}


@pytest.mark.parametrize(("size", "says"), [(0.2, "20 mm"), (0.5, "50 mm"), (20.0, "2,000 mm")])
def test_the_bar_says_how_long_it_is_on_a_head_of_any_size(found, rig, size, says):
    small = change(rig, neutral=size * rig.neutral, deltas=np.float32(size) * rig.deltas)
    pdf = pypdfium2.PdfDocument(audit_bytes(replace(found, reading=reading_facts(small)), small, ".pdf"))
    text = pdf[0].get_textpage().get_text_bounded()
    assert len(re.findall(rf"(?m)^{says}", text)) == len(VIEWS)


def test_what_is_in_doubt_is_on_the_page(found, rig):
    read = found.reading
    unsure = replace(read, axes=replace(read.axes, sure=False), left_out=("old head",), set_aside=("Hide_hat",))
    pdf = pypdfium2.PdfDocument(audit_booklet(replace(found, reading=unsure), rig).bytes())
    text = " ".join(pdf[0].get_textpage().get_text_bounded().split())
    for words in ("IN DOUBT", "give --up and --facing", "old head", "Hide_hat", "up +y?", "the axes are not certain"):
        assert words in text, words


def test_the_audit_of_another_rig_is_refused(found, rig):
    with pytest.raises(RigError, match="audit it again"):
        audit_bytes(replace(found, vertices=3), rig, ".png")
    with pytest.raises(RigError, match="audit it again"):
        audit_bytes(replace(found, reading=None), rig, ".png")


def test_the_longest_answers_are_whole_legible_and_on_the_page(found, rig):
    """Every letter at least 7 points, no line cut, the last one above the margin, however much there is to say."""
    read = found.reading
    long = tuple(Sign(f"a sign whose words are long enough for a line and a half {i}", "+y", 5.0 - i) for i in range(4))
    against = (*long, Sign("a sign that says otherwise in words of some length", "up -z", -1.0))
    wordy = replace(
        read,
        axes=replace(read.axes, signs=against, turned_degrees=44.0),
        unit=replace(read.unit, signs=against),
        eyes=replace(read.eyes, signs=against),
        mouth=replace(read.mouth, signs=against),
        sides=replace(read.sides, signs=against),
    )
    document = pypdfium2.PdfDocument(audit_bytes(replace(found, reading=wordy), rig, ".pdf"))
    words = document[0].get_textpage()
    text = words.get_text_bounded()
    boxes = [words.get_rect(i) for i in range(words.count_rects())]
    assert "…" not in text
    assert min(bottom for _, bottom, _, _ in boxes) > 8  # points from the edge of the paper
    assert min(top - bottom for _, bottom, _, top in boxes if top > bottom) > 3.3  # x-height of 7 points
    assert "Set aside" not in text or "tongueOut" in text


def words_of(found, rig):
    document = pypdfium2.PdfDocument(audit_bytes(found, rig, ".pdf"))
    words = " ".join(document[0].get_textpage().get_text_range().split())
    document.close()
    return words


def test_what_goes_back_to_the_rigger_is_beside_the_picture_or_counted(found, rig):
    finding = Finding("geometry", (), "the skin has a hole", "Close it.", False, "rigger")
    said_of_it = words_of(replace(found, findings=(finding,)), rig)
    assert "1 thing to change" in said_of_it
    assert "Mesh: The skin has a hole. Close it." in said_of_it
    kinds = list(KINDS)[:12]
    many = tuple(replace(finding, kind=kind, message="the skin has a hole " * 8) for kind in kinds)
    assert f"{len(kinds)} things to change" in words_of(replace(found, findings=many), rig)
    assert re.search(r"and \d+ more in the text of the audit", words_of(replace(found, findings=many), rig))
    assert "Nothing: the rigger has nothing to change" in words_of(replace(found, findings=()), rig)


def test_nothing_that_was_not_found_is_called_sure(found, rig):
    read = found.reading
    blind = replace(
        read, eyes=PairFacts(None, None, False), ears=PairFacts(None, None, True), nose=SpotFacts(None, None, True)
    )
    assert {one.label: one.status for one in answers(blind)}["Eyes"] == "not found"
    assert "Eyes not found" in words_of(replace(found, reading=blind), rig)
    assert "in part" in words_of(replace(found, reading=blind), rig)
    assert "Eyes (not sure)" not in audit_text(replace(found, reading=blind))
