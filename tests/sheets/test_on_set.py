"""What stands before people on set: every item in its order, letters that are read from afar, a mirror that is one."""

import ctypes
import re

import numpy as np
import pypdfium2
import pytest
from msgspec.structs import fields, replace

from capture_plan.anatomy.regions import face_regions
from capture_plan.audit.audit import Audit
from capture_plan.errors import PlanError
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.sentences import sentence
from capture_plan.expressions.session import session, shot_title
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.layout.record import Layout
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import FORMAT_VERSION, Plan, RigReference
from capture_plan.plan.settings import Settings
from capture_plan.progress import listen
from capture_plan.sheets import write_on_set
from capture_plan.sheets.cue_cards import READ_FROM_MM, draw_cue_cards
from capture_plan.sheets.cues import AS_IN_A_MIRROR, CAP, READ_AT, YOUR_SIDES, Portrait, cues, fitted
from capture_plan.sheets.deck import GROUND, draw_deck
from capture_plan.sheets.page import PAPERS, POINT_MM, Booklet
from capture_plan.sheets.sculptor import TURNTABLE, draw_sculptor, facing_in, moved_by, turntable, way_words
from capture_plan.sheets.style import rgb
from tests.command import run
from tests.light import light_sample

RIG = light_sample()
DPI = 30
SHOWN = (
    ("jawOpen",),
    ("mouthSmileLeft", "eyeBlinkRight"),
    ("mouthLeft", "browInnerUp"),
    ("noseSneerLeft",),
    ("jawLeft",),
)


def partly(kind, **known):
    """A record with nothing in the fields that no page reads."""
    return kind(**{field.name: known.get(field.name, ()) for field in fields(kind)})


def planned(*shown):
    """A plan of these expressions, with a pause and easy ones first."""
    expressions = tuple(
        Expression(
            f"E{k + 1:02}", names, (1.0,) * len(names), 1 / len(shown), (k + 1) / len(shown), sentence(RIG, names)
        )
        for k, names in enumerate(shown)
    )
    packing = partly(Packing, expressions=expressions)
    return Plan(
        format=FORMAT_VERSION,
        rig=RigReference(RIG.name, "sample", RIG.fingerprint, len(RIG.neutral)),
        settings=Settings(),
        audit=partly(Audit, used=RIG.names),
        layout=partly(Layout, method="studio", landmarks=()),
        packing=packing,
        session=session(RIG, RIG.names, packing, SessionSettings(relax_every=1)),
        versions={},
    )


PLAN = planned(*SHOWN)
EXPRESSIONS = [item for item in PLAN.session.items if item.kind == "expression"]
SHOTS = sum(item.kind != "pause" for item in PLAN.session.items)


def pages_of(book):
    return list(pypdfium2.PdfDocument(book.bytes()))


def words_on(page):
    return " ".join(page.get_textpage().get_text_range().split())


def size_of(text):
    """Size of a text object on paper, points."""
    size = ctypes.c_float()
    assert pypdfium2.raw.FPDFTextObj_GetFontSize(text.raw, size)
    return size.value * abs(text.get_matrix().d)


def sizes(page):
    return [size_of(each) for each in page.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_TEXT])]


def names_sides(each):
    """Whether an object says whose left is left, on the foot of a portrait, which has faded there."""
    return isinstance(each, pypdfium2.PdfTextObj) and each.extract().strip() in YOUR_SIDES


def overlaps(page):
    """Pairs of lines of text or pictures on a page that lie upon each other, by more than half a millimetre."""
    kinds = [pypdfium2.raw.FPDF_PAGEOBJ_TEXT, pypdfium2.raw.FPDF_PAGEOBJ_IMAGE]
    objects = page.get_objects(filter=kinds, textpage=page.get_textpage())
    boxes = [np.array(each.get_bounds()) * 25.4 / 72 for each in objects if not names_sides(each)]
    found = []
    for k, (left, bottom, right, top) in enumerate(boxes):
        for other in boxes[:k]:
            wide, high = min(right, other[2]) - max(left, other[0]), min(top, other[3]) - max(bottom, other[1])
            found += [(k, wide, high)] if min(wide, high) > 0.5 else []
    return found


@pytest.fixture(scope="module")
def deck():
    return draw_deck(PLAN, PlanInputs(RIG), sheet="a4", dpi=DPI, mirrored=True).bytes()


@pytest.fixture(scope="module")
def cards():
    return pages_of(draw_cue_cards(PLAN, PlanInputs(RIG), sheet="a4", dpi=DPI, mirrored=False))


def test_a_card_for_each_expression_in_the_order_of_shooting_names_the_next(cards):
    assert [item.name for item in EXPRESSIONS] != sorted(item.name for item in EXPRESSIONS)
    names = [item.name for item in EXPRESSIONS]
    of = {e.name: e.sentence for e in PLAN.packing.expressions}
    assert len(cards) == len(names)
    for k, (page, name) in enumerate(zip(cards, names, strict=True)):
        text = words_on(page)
        assert text.startswith(f"{shot_title(EXPRESSIONS[k])} of {SHOTS} · {name}")
        assert of[name] in text
        assert ("next: " in text) == (k + 1 < len(names))
        assert k + 1 == len(names) or f"next: {shot_title(EXPRESSIONS[k + 1]).lower()}" in text


def test_the_sentence_of_a_card_is_read_from_the_actors_seat(cards):
    for page, item in zip(cards, EXPRESSIONS, strict=True):
        objects = page.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_TEXT], textpage=page.get_textpage())
        of = next(e for e in PLAN.packing.expressions if e.name == item.name)
        said = [each for each in objects if each.extract().strip() in of.sentence and not names_sides(each)]
        assert " ".join(each.extract().strip() for each in said) == of.sentence
        assert min(CAP * size_of(each) * POINT_MM for each in said) * READ_AT > READ_FROM_MM


@pytest.mark.parametrize("name", PAPERS)
def test_cards_lie_on_the_long_side_of_their_paper(name):
    book = draw_cue_cards(planned(("jawOpen",)), PlanInputs(RIG), sheet=name, dpi=DPI, mirrored=False)
    size = np.array(pages_of(book)[0].get_size()) * 25.4 / 72
    assert size == pytest.approx((PAPERS[name].height, PAPERS[name].width), abs=0.01)


def test_no_letters_or_pictures_lie_on_each_other_and_none_are_small(cards):
    for page in cards:
        assert overlaps(page) == []
        assert min(sizes(page)) >= 6.99


def test_text_fills_its_place_and_a_little_larger_would_not_fit():
    book = Booklet(PAPERS["a4"], "test")
    book.add_page("test")
    text = "Raise the inner ends of your eyebrows and push your closed lips forward as for a kiss."
    found = fitted(book, text, 150, 120, most_pt=200)
    larger = book.broken(text, found.size + 1, width=150, bold=True)
    assert " ".join(found.lines) == text
    assert found.height <= 120
    assert max(book.width(line, found.size, bold=True) for line in found.lines) <= 150
    assert len(larger) * (found.size + 1) / found.size * found.height / len(found.lines) > 120


def test_a_sentence_too_long_for_the_actors_seat_is_told():
    long = replace(PLAN.packing.expressions[0], sentence="Do all of this and of that at the same time. " * 12)
    plan = replace(PLAN, packing=replace(PLAN.packing, expressions=(long, *PLAN.packing.expressions[1:])))
    heard = []
    with listen(heard.extend):
        draw_cue_cards(plan, PlanInputs(RIG), sheet="a4", dpi=DPI, mirrored=False)
    assert len(heard) == 1
    assert re.match(r"note: the sentence of shot \d+ is long", heard[0])


def test_a_mirrored_portrait_is_the_plain_one_with_sides_changed_and_the_same_words():
    plain, mirror = (
        list(cues(PLAN, RIG, PLAN.session.items, Portrait((90, 120), mirrored=mirrored))) for mirrored in (False, True)
    )
    for one, other in zip(plain, mirror, strict=True):
        assert (one.item, one.words) == (other.item, other.words)
        assert (one.front is None) == (one.item.kind in ("calibration", "teeth", "pause"))
        if one.front is not None and other.front is not None:
            off = np.abs(one.front.rgb[:, ::-1].astype(int) - other.front.rgb)
            assert (off > 3).mean() < 0.01
            np.testing.assert_allclose(one.arrows * [-1, 1], other.arrows)
    assert sum(len(one.arrows) for one in plain) > len(SHOWN)


def test_in_a_mirror_what_moves_on_the_actors_left_is_on_the_left():
    smile = planned(("mouthSmileLeft",))
    for mirrored in (False, True):
        (cue,) = cues(
            smile, RIG, [i for i in smile.session.items if i.kind == "expression"], Portrait((90, 120), mirrored)
        )
        assert (cue.arrows[:, :, 0] < 0).all() == mirrored
        assert "your left" in cue.words


def test_every_mirrored_card_says_so_and_no_other(cards):
    mirror = pages_of(draw_cue_cards(PLAN, PlanInputs(RIG), sheet="a4", dpi=DPI, mirrored=True))
    assert all(AS_IN_A_MIRROR in words_on(page) for page in mirror)
    assert not any("mirror" in words_on(page) for page in cards)
    assert [overlaps(page) for page in mirror] == [[]] * len(mirror)


def test_a_deck_has_a_page_of_16_to_9_for_every_item_of_the_session_in_its_order(deck):
    pages, items = list(pypdfium2.PdfDocument(deck)), PLAN.session.items
    assert {item.kind for item in items} == {"calibration", "neutral", "teeth", "turned", "expression", "pause"}
    assert len(pages) == len(items)
    of = {e.name: e.sentence for e in PLAN.packing.expressions}
    for page, item in zip(pages, items, strict=True):
        wide, high = page.get_size()
        assert wide / high == pytest.approx(16 / 9, abs=1e-3)
        text = words_on(page)
        assert text.startswith(f"{shot_title(item)} of {SHOTS} · {item.name}" if item.slate else "Pause")
        assert of.get(item.name, item.sentence) in text
        assert overlaps(page) == []
        assert min(sizes(page)) >= 6.99
        shown = list(page.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_IMAGE]))
        assert len(shown) == (AS_IN_A_MIRROR in text) == (item.kind in ("neutral", "turned", "expression"))


@pytest.mark.parametrize("mirrored", [False, True])
def test_portraits_say_whose_left_is_left(mirrored):
    page = pages_of(draw_cue_cards(planned(("jawOpen",)), PlanInputs(RIG), sheet="a4", dpi=DPI, mirrored=mirrored))[0]
    objects = page.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_TEXT], textpage=page.get_textpage())
    at = {each.extract().strip(): each.get_bounds()[0] for each in objects if names_sides(each)}
    assert (at["your left"] < at["your right"]) == mirrored


def test_a_deck_opens_on_the_whole_screen_and_is_dark_at_every_border(deck):
    assert b"/PageMode /FullScreen" in deck
    page = np.asarray(pypdfium2.PdfDocument(deck)[1].render(scale=1).to_pil()).astype(int)
    border = np.concatenate([page[1], page[-2, : page.shape[1] // 2], page[:, 1], page[1:-1, -2]])
    assert np.abs(border - rgb(GROUND)).max() < 40


def test_the_ground_changes_nothing_within_a_portrait():
    items = [item for item in PLAN.session.items if item.name == "N1"]
    (white,), (dark,) = (list(cues(PLAN, RIG, items, Portrait((90, 120), ground=g))) for g in ("#ffffff", GROUND))
    assert white.front
    assert dark.front
    before, behind = white.front.rgb.astype(int), dark.front.rgb.astype(int)
    assert (before[30:80, 30:60] == behind[30:80, 30:60]).all()
    assert np.abs(behind[0] - rgb(GROUND)).max() < 40
    assert np.abs(before[0] - 255).max() < 40
    assert (behind <= before + 1).all()


def test_spare_expressions_are_on_the_deck_and_called_so():
    cut = session(RIG, RIG.names, PLAN.packing, SessionSettings(minutes=5))
    assert any(not item.fits for item in cut.items)
    items = [item for item in cut.items if item.kind == "expression"]
    pages = pages_of(
        draw_deck(
            replace(PLAN, session=replace(cut, items=tuple(items))),
            PlanInputs(RIG),
            sheet="a4",
            dpi=DPI,
            mirrored=False,
        )
    )
    assert ["spare" in words_on(page) for page in pages] == [not item.fits for item in items]


def test_what_is_written_is_a_pdf_of_each_kind_and_a_plan_of_another_rig_is_refused(tmp_path):
    plan = planned(("jawOpen",))
    assert [path.name for path in write_on_set(plan, RIG, tmp_path, kinds=("cards",), dpi=DPI)] == ["cards.pdf"]
    again = write_on_set(plan, RIG, tmp_path, dpi=DPI, as_mirror=True)
    assert [path.name for path in again] == ["cards-mirror.pdf", "deck-mirror.pdf", "sculptor.pdf"]
    assert (tmp_path / "cards.pdf").exists()
    other = replace(plan, rig=replace(plan.rig, fingerprint="0" * 16))
    with pytest.raises(PlanError, match="plan again or give that rig"):
        write_on_set(other, RIG, tmp_path / "new", dpi=DPI)
    assert not (tmp_path / "new").exists()


def test_a_sculptor_sees_neutral_and_expressions_from_five_sides_and_no_pause():
    many = RIG.names[:24]
    plan = planned(many, ("jawOpen",))  # the easy one is shot first
    book = draw_sculptor(plan, PlanInputs(RIG), sheet="a4", dpi=DPI, mirrored=False)
    pages = pages_of(book)
    one, other = (f"{shot_title(i)} · {i.name}" for i in plan.session.items if i.kind == "expression")
    assert one.endswith("E02")
    assert book.titles == ["NEUTRAL", one, other, *[f"{other}, continued"] * (len(pages) - 3)]
    assert all(title in words_on(page) for title, page in zip(book.titles, pages, strict=True))
    assert all(f"page {k + 1} of {len(pages)}" in words_on(page) for k, page in enumerate(pages))
    assert len(pages) > 3  # what does not fit below the pictures goes on
    images = [len(list(page.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_IMAGE]))) for page in pages]
    assert images == [10, 5, 5, *[0] * (len(pages) - 3)]
    told = " ".join(words_on(page) for page in pages[2:])
    assert all(name in told for name in many)
    assert f"{RIG.displacement[RIG.names.index('jawOpen')][RIG.skin].max():.1f}" in words_on(pages[1])
    for page in pages:
        assert overlaps(page) == []
        assert min(sizes(page)) >= 6.99
        assert "ause" not in words_on(page)


def test_what_moves_most_is_told_with_its_place_the_farthest_first():
    regions = face_regions(RIG)
    pair = planned(("eyeBlinkLeft", "jawOpen")).packing.expressions[0]
    jaw, lid, both = moved_by(RIG, regions, pair, {"jawOpen": "jaw opened"})
    assert (jaw.name, jaw.words, lid.name, both.name) == ("jawOpen", "jaw opened", "eyeBlinkLeft", "all at once")
    assert jaw.mm == pytest.approx(RIG.displacement[RIG.names.index("jawOpen")][RIG.skin].max(), rel=1e-4)
    assert lid.where == "left upper eyelid"
    assert "down" in jaw.way
    assert both.mm >= 0.99 * jaw.mm
    at = np.flatnonzero(RIG.source_index == lid.vertex)
    assert len(at) == 1
    assert np.linalg.norm(RIG.deltas[RIG.names.index("eyeBlinkLeft")][at[0]]) == pytest.approx(lid.mm)


def test_a_way_turned_round_has_the_opposite_words_and_small_parts_are_left_out():
    assert way_words(np.array([0.1, -3.0, 1.0])) == "3.0 down, 1.0 forward"
    assert way_words(np.array([-0.1, 3.0, -1.0])) == "3.0 up, 1.0 back"
    assert way_words(np.array([2.0, 0.0, 0.0])) == "2.0 left"
    assert way_words(np.zeros(3)) == ""


def test_turntables_have_one_scale_and_cut_neither_head_nor_nose():
    anchors, aspect = face_regions(RIG).anchors, 0.6
    near, whole = [facing_in(RIG, anchors, view, aspect) for view in TURNTABLE], turntable(RIG, anchors, aspect)
    head = RIG.neutral[RIG.skin & (RIG.neutral[:, 1] > anchors.chin[1])]
    nose = head[[head[:, 2].argmax()]]
    for frames, points in ((near, nose), (whole, head)):
        assert len({(round(frame.width, 6), round(frame.height, 6)) for frame in frames}) == 1
        for view, frame in zip(TURNTABLE, frames, strict=True):
            x, y = view.project(points)[:, :2].T
            assert frame.left < x.min() <= x.max() < frame.right
            assert y.max() < frame.top


def test_a_mirror_without_cards_or_deck_is_refused_with_what_to_give(tmp_path):
    for more in ((), ("--sculptor",)):
        done = run("render", "hero.plan.json", "--as-mirror", *more, cwd=tmp_path)
        assert done.returncode == 2
        assert "give --cards or --deck too" in done.stderr
