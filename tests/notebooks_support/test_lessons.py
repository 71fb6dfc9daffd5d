"""The lessons run, say true things, and stand as pages that need no network; the glossary explains its own words."""

import ast
import html.parser
import re
from dataclasses import replace

import pytest

import capture_plan
from capture_plan import notebooks_support as parts
from capture_plan.cli import app
from capture_plan.glossary import explained, glossary
from capture_plan.layout.face import see_face
from capture_plan.notebook import notebooks_folder
from capture_plan.notebooks_support import site
from capture_plan.notebooks_support.lessons import first_sentence, parameters
from tests.notebooks_support.test_notebooks import run
from tests.once import plan_of, shortened

LEARN = notebooks_folder() / "learn"


@pytest.fixture(scope="module")
def short_plan():
    """The sample's plan with two of its expressions: enough to draw."""
    return shortened(plan_of())


@pytest.fixture(scope="module")
def small(rig):
    """The sample head with every second blendshape: lessons say the same of it sooner."""
    few = replace(rig, names=rig.names[::2], deltas=rig.deltas[::2])
    return {"rig": few, "face": see_face(few)}


def test_every_lesson_is_on_the_site_in_the_order_of_its_number():
    assert sorted(LEARN.glob("*.py")) == sorted(LEARN / f"{name}.py" for name in site.LESSONS)
    assert [site.title_of(LEARN / f"{name}.py")[0] for name in site.LESSONS] == list("123456")


def test_the_first_lesson_ends_with_printed_pages(short_plan):
    pictures = run("learn/lesson_1_first_plan", plan=short_plan)["pictures"]
    assert all(page.startswith(b"\x89PNG") for page in pictures.values())
    assert any("mirror" in title for title in pictures)
    assert sum(title.startswith("shot ") and title != "shot list" for title in pictures) >= 2


def test_every_paper_is_reproduced_in_ten_lines(small):
    """Each cell that computes has at most ten lines, and shows what the paper shows."""
    tree = ast.parse((LEARN / "lesson_5_three_papers.py").read_text())
    cells = {cell.name: cell for cell in tree.body if isinstance(cell, ast.FunctionDef)}
    for name in ("landmarks_against_epsilon", "error_of_each_method", "expressions_against_mu"):
        body = cells[name].body
        assert body[-1].lineno - body[0].lineno <= 10
    defined = run("learn/lesson_5_three_papers", **small)
    fewest = [row.fewest for row in defined["rows"]]
    assert fewest == sorted(fewest)
    assert all(row.proven_optimal for row in defined["rows"])
    errors = {one.method: one.rmse_mm for one in defined["scored"]}
    assert errors["ours: exact swaps"] < errors["Le et al. 2013, as published"] < errors["random"]
    packed = [row.minimum for row in defined["counts"]]
    assert packed == sorted(packed, reverse=True)
    assert all(row.minimum <= row.sequential for row in defined["counts"])


def test_each_method_is_shown_with_what_it_gives(small):
    defined = run("learn/lesson_2_which_method", used=small["face"].used, **small)
    counts = {name: len(layout.landmarks) for name, layout in defined["designed"].items()}
    assert counts["cover"] == min(counts.values())
    assert defined["packed"]["minimum"].objective == min(one.objective for one in defined["packed"].values())


def test_the_numbers_of_the_third_lesson_are_those_of_the_default_noise():
    defined = run("learn/lesson_3_reading_the_numbers")
    assert defined["information"].noise_mm == 0.2
    assert defined["information"].landmarks == 34
    assert all(one.low_mm < one.error_mm < one.high_mm for one in defined["expected"])


def test_the_paper_s_sum_takes_more_landmarks_than_counting_them_first(small):
    found = run("learn/lesson_4_where_we_differ", **small)["found"]
    assert len(found["lexicographic"].landmarks) < len(found["paper"].landmarks)


def test_the_cheat_sheet_has_every_command_and_every_export():
    names = {command.split()[-1] for command, _ in parts.every_command(app)}
    assert {one.callback.__name__ for one in app.registered_commands} == names
    assert [call.split("(")[0] for call, _ in parts.every_call()] == capture_plan.__all__
    for _, says in (*parts.every_command(app), *parts.every_call()):
        assert says.endswith(".")
        assert len(says.split()) >= 4


def test_a_first_sentence_does_not_end_at_et_al():
    def shown(a, b=3):
        """After Le et al. 2013, as printed. And more."""

    assert first_sentence(shown) == "After Le et al. 2013, as printed."
    assert parameters(shown) == "(a, b=…)"
    assert parameters(3) == ""


class Links(html.parser.HTMLParser):
    """Everything that a page asks for."""

    def __init__(self):
        super().__init__()
        self.asked = []

    def handle_starttag(self, tag, attrs):
        self.asked += [value for name, value in attrs if name in ("src", "href") and value]


def test_the_site_asks_nothing_of_a_network_and_its_links_lead_somewhere(tmp_path, monkeypatch):
    """One lesson stands for all, which other tests run."""
    monkeypatch.setattr(site, "LESSONS", ("lesson_6_cheat_sheet",))
    monkeypatch.setattr(site, "WRITES", ("index.html", "reference.html", "lesson_6_cheat_sheet.html"))
    pages = site.write_site(notebooks_folder(), tmp_path)
    assert [page.name for page in pages] == ["index.html", "reference.html", "lesson_6_cheat_sheet.html"]
    for page in pages:
        text = page.read_text()
        found = Links()
        found.feed(text)
        assert {one for one in found.asked if not one.startswith("data:")} <= {other.name for other in pages}
        assert not re.findall(r"https?://(?!www\.w3\.org)", re.sub(r"<pre.*?</pre>", "", text, flags=re.DOTALL))
    assert all(f'id="{name}"' in pages[1].read_text() for name in capture_plan.__all__)


def test_code_that_a_lesson_hides_is_hidden_and_knobs_are_named():
    cells = site.run_cells(LEARN / "lesson_6_cheat_sheet.py")
    assert [cell.code for cell in cells] == [""] * len(cells)
    tree = ast.parse(source := (LEARN / "lesson_3_reading_the_numbers.py").read_text())
    knobs = next(cell for cell in tree.body if isinstance(cell, ast.FunctionDef) and cell.name == "knobs")
    assert site.code_of(knobs, source).startswith("noise = mo.ui.slider(0.1")
    assert "return" not in site.code_of(knobs, source)
    assert "Noise, mm" in site.shown(parts.comparing_knobs())


def test_every_term_is_one_sentence_with_its_source():
    assert 35 <= len(glossary()) <= 60
    for word, term in glossary().items():
        assert term.says.endswith("."), word
        assert ". " not in term.says.replace("et al. ", ""), word
        assert term.source, word
    assert explained(["noise"])[0][1].endswith("Unit: mm.")
    with pytest.raises(KeyError):
        explained(["worth"])
