"""Names of any script on paper: in a font that has them, or told by their meaning; never an empty box."""

import unicodedata

import matplotlib
import numpy as np
import pypdfium2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capture_plan.figures.style import house
from capture_plan.names.tokens import DATA
from capture_plan.sheets.lettering import FONTS, Labels, face_with, font_runs, script_of, with_known_glyphs
from capture_plan.sheets.page import PAPERS, Booklet

RIG = ("まばたき", "微笑", "ยิ้ม", "ยิ้ม_L", "กขฃ", "שלום", "ابتسامة", "jawOpen")


@pytest.mark.parametrize(
    "name",
    [
        "まばたき",
        "ウィンク右",
        "ｳｨﾝｸ２",
        "口角上げ",
        "表情微笑",
        "惊讶",
        "張嘴",
        "眨眼",
        "미소",
        "ω□",
        "улыбка",
        "Lächeln",
    ],
)
def test_names_of_east_asia_and_europe_are_printed_as_they_are(name):
    assert all(face_with(letter) for letter in name)
    assert Labels([name])(f"{name}: 12 mm") == unicodedata.normalize("NFC", f"{name}: 12 mm")


def test_every_east_asian_word_that_names_are_read_by_has_its_letters():
    words = {letter for letter in DATA.read_text(encoding="utf-8") if ord(letter) > 0x2E7F}
    assert not {letter for letter in words if not face_with(letter)}


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("ยิ้ม", "smile"),
        ("ยิ้ม_L", "smile (left)"),
        ("กขฃ", "(name in Thai script, No. 5)"),
        ("שלום", "(name in Hebrew script, No. 6)"),
        ("ابتسامة", "smile (No. 7)"),
    ],
)
def test_a_script_without_a_font_is_told_by_its_meaning_or_its_number(name, label):
    assert Labels(RIG)(f"read {name} first").startswith(f"read {label}")


def test_two_names_are_never_told_alike():
    messages = [Labels(RIG)(name) for name in RIG]
    assert len(set(messages)) == len(RIG)


def test_what_is_no_name_of_the_rig_is_told_by_its_script():
    assert with_known_glyphs("take กขฃ สวย 3") == "take (Thai script) 3"
    assert script_of("कख") == "Devanagari"


@given(st.text(max_size=30))
def test_no_letter_without_a_face_is_ever_left(text):
    shown = Labels([text, "jawOpen"])(text)
    assert all(face_with(letter) for letter in shown)
    assert "".join(letters for _, letters in font_runs(shown)) == shown


def test_a_mixed_line_is_as_wide_as_its_runs_and_each_is_in_its_own_face():
    line = "blink まばたき 惊讶 미소 L"
    assert [face for face, _ in font_runs(line)] == ["sans", "japanese", "sans", "chinese", "sans", "korean", "sans"]
    book = Booklet(PAPERS["a4"], "test")
    assert book.width(line, 10) == pytest.approx(sum(book.width(letters, 10) for _, letters in font_runs(line)))


def test_a_japanese_name_is_ink_on_the_page_and_text_in_the_pdf():
    book = Booklet(PAPERS["a4"], "test", RIG)
    book.add_page("test")
    book.text(20, 20, "smile まばたき ยิ้ม", 20)
    page = pypdfium2.PdfDocument(book.bytes())[0]
    assert page.get_textpage().get_text_bounded().strip() == "smile まばたき smile (No. 3)"
    dark = np.asarray(page.render(scale=2).to_pil().convert("L")) < 128
    middle = book.width("smile まば", 20) + 20
    column = dark[:, int(middle / 25.4 * 144) : int((middle + 12) / 25.4 * 144)]
    assert 0.02 < column[50:120].mean() < 0.5


def test_a_page_without_foreign_names_carries_no_foreign_font():
    plain, mixed = (Booklet(PAPERS["a4"], "test") for _ in range(2))
    for book, text in ((plain, "smile"), (mixed, "笑い")):
        book.add_page("test")
        book.text(20, 20, text, 10)
    assert b"NotoSans" not in plain.bytes()
    assert b"NotoSans" in mixed.bytes()


def test_figures_fall_back_on_the_same_fonts():
    with house():
        assert len(matplotlib.rcParams["font.family"]) == len(FONTS)
        for family in matplotlib.rcParams["font.family"]:
            path = matplotlib.font_manager.findfont(family, fallback_to_default=False)
            assert path.rsplit("/", 1)[-1] in FONTS.values()
