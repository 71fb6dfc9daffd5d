"""The shot list on paper and on screen: every item once, nothing beyond the page, the stop line where it belongs."""

import pypdfium2
import pytest
from msgspec import structs

from capture_plan.expressions.pack import pack
from capture_plan.expressions.session import LAST, session, spare_words
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.expressions.settings import PackingSettings
from capture_plan.report.shots import level_boxes, session_intro, shot_rows
from capture_plan.sample import sample_rig
from capture_plan.sheets.page import PAPERS, Booklet, paper
from capture_plan.sheets.shot_list import BOTTOM_MM, TOP_MM, draw_shot_list, height, paged

RIG = sample_rig()
PACKING = pack(RIG, RIG.names, PackingSettings(method="minimum"))
SESSION = session(RIG, RIG.names, PACKING, SessionSettings())


@pytest.mark.parametrize("name", PAPERS)
def test_pages_hold_every_item_once_and_end_above_the_foot(name):
    book = Booklet(paper(name), "shots")
    pages = paged(book, SESSION)
    assert [item for page in pages for item in page] == list(SESSION.items)
    for page in pages:
        assert TOP_MM + sum(height(book, item, SESSION) for item in page) <= book.paper.height - BOTTOM_MM


def test_the_page_says_what_the_actor_is_told_and_where_to_stop():
    book = Booklet(paper("a4"), "shots")
    for page in paged(book, SESSION):
        book.add_page("shots")
        draw_shot_list(book, SESSION, page)
    pdf = pypdfium2.PdfDocument(book.bytes())
    text = " ".join(" ".join(page.get_textpage().get_text_range() for page in pdf).split())
    for item in SESSION.items:
        assert item.sentence in text
    assert SESSION.stop in text
    assert text.index(SESSION.stop_after) < text.index(SESSION.stop)


def test_sheet_and_screen_name_what_does_not_fit_and_let_the_last_neutral_come_first():
    cut = session(RIG, RIG.names, PACKING, SessionSettings(minutes=12))
    book = Booklet(paper("a4"), "shots")
    book.add_page("shots")
    draw_shot_list(book, cut, paged(book, cut)[0])
    text = " ".join(pypdfium2.PdfDocument(book.bytes())[0].get_textpage().get_text_range().split())
    assert spare_words(cut) in text
    assert text.index("A last neutral") < text.index(cut.stop)
    assert spare_words(cut) in session_intro(cut)
    assert [row["name"] for row in shot_rows(cut) if row["stop"]] == [LAST]


def test_the_screen_shows_the_same_rows_and_one_stop_line():
    rows = shot_rows(SESSION)
    assert [row["sentence"] for row in rows] == [item.sentence for item in SESSION.items]
    assert [row["name"] for row in rows if row["stop"]] == [SESSION.stop_after]
    assert all(row["boxes"] == level_boxes(row["level"]) for row in rows if row["level"])


def test_a_list_without_a_place_to_stop_has_no_line():
    short = session(RIG, RIG.names, structs.replace(PACKING, expressions=PACKING.expressions[:1]), SessionSettings())
    assert short.stop == ""
    assert not any(row["stop"] for row in shot_rows(short))
