"""Pages say "distinguished" only at full rank, "proved" only of the list that was proved, error by its own name."""

import re
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

import capture_plan
from capture_plan.anatomy.delta_relations import duplicates
from capture_plan.expressions.settings import PackingSettings
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.make import make_plan
from capture_plan.plan.settings import Settings
from capture_plan.plan.summary import expression_words, summary
from capture_plan.report.contents import tiles
from capture_plan.report.proofs import packing_proof
from capture_plan.sheets.marker_pages import nearest_words
from capture_plan.sheets.write import packed_words

PACKAGE = Path(capture_plan.__file__).parent
PAGES = [*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.jinja"), *(PACKAGE.parent / "notebooks").glob("*.py")]


@pytest.fixture(scope="module")
def cut(rig):
    """Few landmarks, and half of the list."""
    settings = Settings(landmarks=LayoutSettings(method="cover"), expressions=PackingSettings(limit=10))
    return make_plan(rig, settings)


def test_of_a_list_that_is_cut_the_whole_is_what_was_proved(cut):
    whole = cut.packing.objective
    assert len(cut.packing.expressions) == 10 < whole
    message = f"10 of {whole} expressions; {whole} proved the fewest"
    assert expression_words(cut.packing) == message
    assert any(line.startswith(message) for line in summary(cut))
    assert packed_words(cut).startswith(message)
    assert packing_proof(cut) == f"10 of {whole} are shown. Proved: fewer than {whole} cannot show every blendshape"
    assert not re.search(r"\b10 (expressions, )?proved", " ".join(summary(cut)))


def test_a_whole_list_is_proved_itself_and_a_gap_is_no_proof(cut):
    ten = replace(cut.packing, objective=10, bound=10)
    assert expression_words(ten) == "10 expressions, proved the fewest"
    assert expression_words(replace(ten, bound=9)) == "10 expressions, not proved the fewest (at least 9)"


def test_distinguished_is_said_at_full_rank_alone_and_otherwise_which_are_not_and_why(cut):
    information = cut.layout.information
    rank, full = information.rank, information.full_rank
    assert rank < full
    lost = f"Not distinguished by these landmarks: {full - rank} of {full} mixes"
    assert any(line.startswith(lost) for line in summary(cut))
    assert "Distinguished" not in {tile.name for tile in tiles(cut)}
    full = replace(cut, layout=replace(cut.layout, information=replace(information, rank=information.full_rank)))
    assert not [line for line in summary(full) if "Not distinguished" in line]
    assert "Distinguished" in {tile.name for tile in tiles(full)}
    less = replace(information, rank=information.full_rank - 2, full_rank=information.full_rank - 2)
    poor = replace(cut, layout=replace(cut.layout, information=less))
    assert any(line.startswith("Not distinguished by any landmarks: 2 of ") for line in summary(poor))


def test_the_nearest_two_are_said_straight_and_along_the_skin(rig, cut):
    words = re.fullmatch(r" · nearest two (\S+) mm straight, (\S+) mm along the skin", nearest_words(cut.layout, rig))
    assert words
    at = [m.vertex for m in cut.layout.markers]
    apart = np.linalg.norm(rig.neutral[at][:, None] - rig.neutral[at][None], axis=2)
    assert float(words[1]) == round(apart[np.triu_indices(len(at), 1)].min(), 1) <= float(words[2])


def test_a_blendshape_that_is_the_negative_of_another_is_no_duplicate():
    d = np.random.default_rng(0).normal(size=(3, 30))
    same, negative = 0.5 * d[0], -d[0]
    names = ("a", "b", "c", "negative", "same")
    rows = np.stack([*d, negative, same])
    assert [finding.blendshapes for finding in duplicates(names, rows @ rows.T)] == [("same",)]


def test_no_page_speaks_of_all_movement_or_of_a_list_proven_fewest():
    for path in PAGES:
        text = path.read_text(encoding="utf-8")
        for words in ("of all movement covered", "% of all movement", "%} of all movement", "proven fewest"):
            assert words not in text, f"{path.name}: {words}"


def test_the_first_expressions_are_told_of_longer_lists_alone(cut):
    packing = cut.packing
    few = replace(cut, packing=replace(packing, expressions=packing.expressions[:4]))
    assert any("; the first 5 cover " in line for line in summary(cut)) == (len(packing.expressions) > 5)
    assert not any("; the first 5 cover " in line for line in summary(few))


def test_what_is_proved_of_a_plan_that_does_not_see_all_is_not_said_of_all(cut):
    blind = replace(cut, layout=replace(cut.layout, uncovered=("jawOpen",)))
    for plan, what in ((cut, "every blendshape"), (blind, "all of the others")):
        assert any(line.startswith(f"Proved: under these constraints, to see {what} at all") for line in summary(plan))
