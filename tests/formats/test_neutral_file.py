"""Which file of a folder is the neutral: by names and shapes together; refused where they disagree or don't tell."""

from pathlib import Path

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.formats.neutral_file import plainness, words
from capture_plan.reader.read import read_raw

SIDE = 12
FLAT = np.stack([*np.meshgrid(np.arange(SIDE), np.arange(SIDE)), np.zeros((SIDE, SIDE))], axis=-1).reshape(-1, 3)
FACES = [[r * SIDE + c, r * SIDE + c + 1, (r + 1) * SIDE + c] for r in range(SIDE - 1) for c in range(SIDE - 1)]


def moved(start: int, count: int = 10, far: float = 2.0) -> np.ndarray:
    """The sheet with some vertices lifted."""
    x = FLAT.copy()
    x[start : start + count, 2] += far
    return x


SHAPES = {"smile": moved(0), "jawOpen": moved(20), "blink": moved(40), "browUp": moved(60), "puff": moved(5, 30)}


def write(folder: Path, shapes: dict[str, np.ndarray], kind: str = "obj") -> Path:
    """One file for each shape: OBJ, or ASCII PLY."""
    folder.mkdir()
    for stem, x in shapes.items():
        rows = [" ".join(f"{a:g}" for a in row) for row in x]
        if kind == "obj":
            text = "\n".join([f"v {row}" for row in rows] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES])
        else:
            head = f"ply\nformat ascii 1.0\nelement vertex {len(x)}\n" + "".join(f"property float {a}\n" for a in "xyz")
            head += f"element face {len(FACES)}\nproperty list uchar int vertex_indices\nend_header\n"
            text = head + "\n".join(rows + [f"3 {a} {b} {c}" for a, b, c in FACES])
        (folder / f"{stem}.{kind}").write_text(text + "\n")
    return folder


@pytest.mark.parametrize("kind", ["obj", "ply"])
@pytest.mark.parametrize(
    "stem",
    ["face_neutral", "neutral_closed", "00_relaxed", "rest_pose", "basemesh", "bind_pose", "Expressionless", "無表情"],
)
def test_one_file_that_says_neutral_in_other_words_is_it(tmp_path, stem, kind):
    rig = read_raw(write(tmp_path / "r", {**SHAPES, stem: FLAT}, kind))
    assert stem not in rig.names
    np.testing.assert_array_equal(rig.neutral, FLAT)


@pytest.mark.parametrize(
    ("mine", "other"),
    [
        ("face_neutral", "neutral_closed"),
        ("neutral_closed", "neutral_open"),
        ("base_head", "base_lips_parted"),
        ("rest_pose", "relaxed_brow"),
        ("default", "default_open"),
    ],
)
def test_of_two_the_one_in_the_middle_of_the_shapes_is_the_neutral_and_said(tmp_path, mine, other):
    rig = read_raw(write(tmp_path / "r", {**SHAPES, mine: FLAT, other: moved(80, 8)}))
    np.testing.assert_array_equal(rig.neutral, FLAT)
    assert other in rig.names
    assert f"{mine}.obj was taken" in rig.note


def test_of_two_files_of_one_shape_either_serves(tmp_path):
    rig = read_raw(write(tmp_path / "r", {**SHAPES, "neutral_a": FLAT, "neutral_b": FLAT}))
    np.testing.assert_array_equal(rig.neutral, FLAT)
    assert "they hold the same shape" in rig.note


def test_names_and_shapes_that_disagree_are_refused_with_the_sign_of_each(tmp_path):
    folder = write(tmp_path / "r", {**SHAPES, "base": moved(80, 8), "neutral_of_hero_two": FLAT})
    with pytest.raises(RigError, match=r"base\.obj has the plainer name, but .* changes of neutral_of_hero_two\.obj"):
        read_raw(folder)


def test_scans_of_equally_plain_names_and_no_middle_are_refused(tmp_path):
    shaken = np.random.default_rng(0).normal(size=(6, *FLAT.shape))
    shapes = {stem: FLAT + x for stem, x in zip(("neutral_a", "neutral_b", *SHAPES), shaken, strict=False)}
    with pytest.raises(RigError, match="neither names nor shapes tell"):
        read_raw(write(tmp_path / "r", shapes))


def test_the_file_called_just_neutral_stays_and_a_better_one_is_named(tmp_path):
    rig = read_raw(write(tmp_path / "r", {**SHAPES, "neutral": moved(80, 8), "base": FLAT}))
    np.testing.assert_array_equal(rig.neutral, moved(80, 8))
    assert "smaller changes of base.obj" in rig.note


@pytest.mark.parametrize("prefix", ["morph_", "hero"])
def test_without_a_word_the_shape_that_most_vertices_of_all_files_share_is_the_neutral(tmp_path, prefix):
    shapes = {f"{prefix}{i}": x for i, x in enumerate((*SHAPES.values(), FLAT))}
    rig = read_raw(write(tmp_path / "r", shapes))
    np.testing.assert_array_equal(rig.neutral, FLAT)
    assert f"{prefix}5.obj was taken" in rig.note


def test_of_numbered_scans_the_first_is_the_neutral_where_it_lies_in_the_middle(tmp_path):
    noise = np.random.default_rng(0).normal(scale=0.05, size=(6, *FLAT.shape))
    scans = [FLAT, *(x + n for x, n in zip(SHAPES.values(), noise, strict=False))]
    rig = read_raw(write(tmp_path / "a", {f"shape_{i}": x for i, x in enumerate(scans)}))
    assert "shape_0.obj was taken, its number is the first" in rig.note
    with pytest.raises(RigError, match="called neutral"):
        read_raw(write(tmp_path / "b", {f"shape_{i}": x for i, x in enumerate(scans[::-1])}))


@pytest.mark.parametrize("shapes", [SHAPES, {**SHAPES, "wink": moved(100, 1, 0.1)}])
def test_the_smallest_blendshape_is_never_taken_for_a_missing_neutral(tmp_path, shapes):
    with pytest.raises(RigError, match="called neutral"):
        read_raw(write(tmp_path / "r", shapes))


def test_a_word_that_may_be_an_expression_is_held_against_the_shapes(tmp_path):
    assert "00_relaxed.obj was taken" in read_raw(write(tmp_path / "a", {**SHAPES, "00_relaxed": FLAT})).note
    with pytest.raises(RigError, match=r"calm\.obj may be the neutral by its name, but"):
        read_raw(write(tmp_path / "b", {**SHAPES, "calm": moved(80, 8), "head": FLAT}))


def test_a_name_that_says_a_movement_is_no_neutral_whatever_its_shape(tmp_path):
    with pytest.raises(RigError, match="called neutral"):
        read_raw(write(tmp_path / "r", {**SHAPES, "mouthFrownLeft": FLAT}))


def test_every_word_beside_neutral_makes_a_name_less_plain():
    ranks = [
        plainness(words(stem), set()) for stem in ("neutral", "face_neutral", "neutral_closed", "neutral_big_closed")
    ]
    assert [rank[0] for rank in ranks if rank] == [0, 0, 1, 2]
