"""Takes: what a full weight is, by words, by the whole distribution, or as a person says; what is unlikely is said."""

import json

import numpy as np
import pytest

from capture_plan.curves.outliers import wild_cells
from capture_plan.curves.scale import judge
from capture_plan.errors import RigError
from capture_plan.names.name_map import read_name_map
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from tests.curves.test_take_dialects import NAMES, T, driven, named, read, table, weights


def uncertain(take):
    return any("not certain" in note for note in take.notes)


@pytest.mark.parametrize("full", [10, 100, 255, 1000, 65535])
@pytest.mark.parametrize("whole", [True, False])
def test_every_usual_scale_is_found_by_how_far_values_get(tmp_path, full, whole):
    w = full * weights()
    take = read(tmp_path / "a.csv", table(np.round(w) if whole else w, digits="{:.5f}"))
    assert driven(take) == pytest.approx(weights(), abs=0.51 / full if whole else 1e-6)
    assert uncertain(take) == (full != 100)


@pytest.mark.parametrize("share", [0.004, 0.01, 1.4, 2.5, 4, 17, 45, 127])
def test_a_scale_with_two_answers_or_an_unlikely_one_is_said_with_the_remedy(tmp_path, share):
    take = read(tmp_path / "a.csv", table(share * weights(), digits="{:.5f}"))
    assert uncertain(take)
    assert any("name map, such as full =" in note for note in take.notes)
    assert driven(take).max() < 3


@pytest.mark.parametrize("share", [0.3, 1, 65, 100, 110])
def test_usual_takes_raise_no_doubt(tmp_path, share):
    assert not uncertain(read(tmp_path / "a.csv", table(share * weights(), digits="{:.5f}")))


def test_a_byte_that_is_full_is_sure(tmp_path):
    w = np.round(255 * weights() / weights().max(axis=0))
    assert not judge(NAMES, w).note.startswith("it is not certain")
    assert judge(NAMES, w).full == 255


HEADS = {
    " (%)": 100,
    " [%]": 100,
    "_percent": 100,
    " pct": 100,
    " [0-255]": 255,
    " (0..1000)": 1000,
}


@pytest.mark.parametrize(("words", "full"), HEADS.items())
@pytest.mark.parametrize("top", [0.03, 0.2, 1])
def test_words_in_the_names_state_the_scale(tmp_path, words, full, top):
    w = top * full * weights()
    take = read(tmp_path / "a.csv", table(w, names=[name + words for name in NAMES], digits="{:.5f}"))
    assert driven(take) == pytest.approx(top * weights(), abs=1e-6)
    assert uncertain(take) == (top < 0.05)


@pytest.mark.parametrize(("unit", "full"), [("%", 100), ("percent", 100), ("[0-255]", 255), ("weight", 1)])
def test_a_row_of_units_is_no_frame_and_states_the_scale(tmp_path, unit, full):
    lines = table(0.9 * full * weights(), digits="{:.5f}").splitlines()
    take = read(tmp_path / "a.csv", "\n".join([lines[0], ",".join(["s", *[unit] * len(NAMES)]), *lines[1:]]))
    assert len(take) == T
    assert driven(take) == pytest.approx(0.9 * weights(), abs=1e-6)
    assert not uncertain(take)
    assert any("1 line holds no frame" in note for note in take.notes)


def test_names_that_stand_again_and_last_words_are_no_lost_faces(tmp_path):
    lines = table(weights()).splitlines()
    take = read(tmp_path / "a.csv", "\n".join([*lines[:40], lines[0], *lines[40:], "total,,,", "end of file"]))
    assert driven(take) == pytest.approx(weights())
    assert not any("no face" in note for note in take.notes)
    assert any("3 lines hold no frame" in note for note in take.notes)


def test_weights_written_with_a_sign_that_lie_within_1_are_said(tmp_path):
    take = read(tmp_path / "a.csv", table(weights(), names=[name + " (%)" for name in NAMES]))
    assert driven(take) == pytest.approx(weights())
    assert uncertain(take)


@pytest.mark.parametrize("mixed", ["columns", "frames"])
def test_two_scales_in_one_take_are_said(tmp_path, mixed):
    w = 100 * weights()
    where = np.s_[:, 3:] if mixed == "columns" else np.s_[: T // 2]
    w[where] /= 100
    assert uncertain(read(tmp_path / "a.csv", table(w, digits="{:.5f}")))


@pytest.mark.parametrize("full", [0.01, 50, 127, 100])
def test_the_person_settles_it(tmp_path, full):
    (tmp_path / "names.toml").write_text(f"full = {full}\n")
    (tmp_path / "a.json").write_text(json.dumps({"fps": 60, "frames": named(full * weights())}))
    mine = read_name_map(tmp_path / "names.toml")
    take = read_sequence(tmp_path / "a.json", rig=sample_rig(), name_map=mine)
    assert driven(take) == pytest.approx(weights())
    assert not uncertain(take)


def test_what_is_no_scale_is_refused(tmp_path):
    (tmp_path / "names.toml").write_text("full = -1\n")
    with pytest.raises(RigError, match="expected a number above 0"):
        read_name_map(tmp_path / "names.toml")
    with pytest.raises(RigError, match="beyond every usual scale"):
        read(tmp_path / "a.csv", table(1e6 * weights()))


@pytest.mark.parametrize("name", ["AU{:02d}", "AU{}_inner", "au_{}", "face.AU{}"])
@pytest.mark.parametrize("most", [5.0, 3.0, 99.0])
def test_action_units_that_end_at_five_are_on_the_scale_of_five(name, most):
    columns = [name.format(unit) for unit in (1, 4, 6, 12, 26, 45)]
    verdict = judge(columns, most * weights() / weights().max())
    assert verdict.full == (100 if most > 5 else 5)
    assert verdict.sure == (most > 5)
    assert judge(NAMES, most * weights() / weights().max()).full == 100


LONG = weights(frames=300)
MANY = 40  # columns that a rig has


def many(frames=300):
    """Weights of `MANY` of the rig's blendshapes."""
    names = sample_rig().names[:MANY]
    t, rng = np.arange(frames)[:, None] / 60, np.random.default_rng(1)
    return names, np.round(0.5 + 0.49 * np.sin(t * rng.uniform(3, 9, MANY) + rng.uniform(0, 6, MANY)), 3)


@pytest.mark.parametrize("full", [1, 100])
@pytest.mark.parametrize("cells", [[(50, 0, 1e5)], [(50, 0, -1e4), (51, 2, 1e9)], [(0, 1, 2e3)], [(299, 5, 1e6)]])
def test_single_wild_cells_change_nothing_but_their_own_frames(tmp_path, full, cells):
    x = full * LONG
    for t, c, value in cells:
        x[t, c] = value
    take = read(tmp_path / "a.csv", table(x, digits="{:.5f}"))
    whole = read(tmp_path / "b.csv", table(full * LONG, digits="{:.5f}"))
    assert driven(take) == pytest.approx(np.delete(driven(whole), [t for t, _, _ in cells], axis=0))
    assert any(NAMES[cells[0][1]] in note and "left out" in note for note in take.notes)
    assert [note for note in take.notes if "far outside" not in note] == list(whole.notes)


@pytest.mark.parametrize(
    "kind",
    [
        "poses in per cent",
        "one pose",
        "one quiet take with a blink",
        "few poses, of which each is one frame",
        "overdriven",
    ],
)
def test_what_a_face_may_do_is_no_wild_cell(kind):
    x = {
        "poses in per cent": 100 * np.eye(40, len(NAMES)),
        "one pose": np.vstack([np.zeros((39, len(NAMES))), [100] * 2 + [0] * 4]),
        "one quiet take with a blink": np.where(np.arange(300)[:, None] % 100 < 4, 90, 2 + LONG),
        "few poses, of which each is one frame": np.where(np.eye(3, len(NAMES)) > 0, 90, 0.5),
        "overdriven": np.where(np.arange(300)[:, None] == 7, 5, LONG),
    }[kind]
    assert not wild_cells(x).any()


@pytest.mark.parametrize("percent", [[0], [0, 1, 2], [3, 7]])
def test_columns_in_per_cent_beside_weights_of_1_are_doubted_by_name(tmp_path, percent):
    names, w = many()
    x = w.copy()
    x[:, percent] *= 100
    take = read(tmp_path / "a.csv", table(x, names=names))
    doubt = next(note for note in take.notes if "not certain" in note)
    assert all(names[c] in doubt for c in percent)
    assert "such as 0.01 in a name map" in doubt
    assert not any(names[c] in doubt for c in range(10, MANY))


def test_a_share_in_the_name_map_settles_a_column_of_its_own_scale(tmp_path):
    names, w = many()
    x = w.copy()
    x[:, 3] *= 100
    (tmp_path / "names.toml").write_text(f'[weights]\n"{names[3]}" = {{ "{names[3]}" = 0.01 }}\n')
    take = read(tmp_path / "a.csv", table(x, names=names), name_map=read_name_map(tmp_path / "names.toml"))
    assert driven(take, names) == pytest.approx(w, abs=1e-4)
    assert not uncertain(take)


@pytest.mark.parametrize("full", [1, 100])
def test_what_goes_beyond_two_full_weights_again_and_again_is_never_certain(full):
    names, w = many()
    x = full * w
    x[10:20, 4] = 2.5 * full
    assert not judge(names, x).sure
    x[10:20, 4] = full
    assert judge(names, x).sure


@pytest.mark.parametrize(("most", "sure"), [(65, False), (85, False), (97, True), (100, True), (105, True)])
def test_whole_numbers_that_stop_below_a_hundred_may_be_bytes_of_a_quiet_take(most, sure):
    x = np.round(most * weights() / weights().max(axis=0))
    verdict = judge(NAMES, x)
    assert (verdict.full, verdict.sure) == (100, sure)
    assert ("full = 255" in verdict.note) == (not sure)
    assert judge(NAMES, 0.999 * x).sure
