"""Two columns of one movement are two sides where their words say so in some language; else they are said."""

import pytest

from capture_plan.names.name_map import read_name_map
from capture_plan.names.paired_sides import with_sides
from capture_plan.names.recognise import recognise_all
from tests.curves.test_take_dialects import driven, read, table, weights

EYES = ("eyeBlinkLeft", "eyeBlinkRight")
SIDED = [
    *[
        ("blink_sx", "blink_dx"),
        ("blink_vänster", "blink_höger"),
        ("clignement_G", "clignement_D"),
        ("blinkG", "blinkD"),
    ],
    *[("blink_li", "blink_re"), ("моргание_левое", "моргание_правое"), ("blink_lewe", "blink_prawe")],
    *[("sx_blink", "dx_blink"), ("parpadeo_izq", "parpadeo_dcha"), ("blink_port", "blink_starboard")],
]
UNKNOWN = [("blinkA", "blinkB"), ("eye_blink_1", "eye_blink_2"), ("blink_neg", "blink_pos"), ("eyeBlink", "eyeBlink2")]


def eyes(names, w=None):
    """A table of two blinks under these names and a jaw."""
    w = weights()[:, [1, 2, 0]] if w is None else w
    return table(w, names=(*names, "jawOpen"))


@pytest.mark.parametrize("names", SIDED)
@pytest.mark.parametrize("turned", [False, True])
def test_words_for_sides_of_many_languages_drive_their_own_side(tmp_path, names, turned):
    w = weights()[:, [2, 1, 0] if turned else [1, 2, 0]]
    take = read(tmp_path / "a.csv", eyes(names[::-1] if turned else names, w))
    assert driven(take, EYES) == pytest.approx(weights()[:, 1:3])
    assert not any("two sides" in note for note in take.notes)


def test_a_whole_face_with_sides_beside_each_other_is_one_face(tmp_path):
    stems = ("blink", "smile", "eye_wide")
    names = [f"{stem}_{side}" for stem in stems for side in "gd"]
    w = weights()
    take = read(tmp_path / "a.csv", table(w, names=names))
    truth = [f"{stem}{side}" for stem in ("eyeBlink", "mouthSmile", "eyeWide") for side in ("Left", "Right")]
    assert driven(take, truth) == pytest.approx(w)


@pytest.mark.parametrize("names", UNKNOWN)
def test_two_columns_of_one_movement_are_said_with_the_remedy(tmp_path, names):
    take = read(tmp_path / "a.csv", eyes(names))
    assert any(f"{names[0]} and {names[1]} seem to be two sides" in n and "name map" in n for n in take.notes)
    lines = [f'"{name}" = "{eye}"' for name, eye in zip(names, EYES, strict=True)]
    (tmp_path / "map.toml").write_text("\n".join(["[weights]", *lines]))
    mine = read(tmp_path / "a.csv", eyes(names), name_map=read_name_map(tmp_path / "map.toml"))
    assert driven(mine, EYES) == pytest.approx(weights()[:, 1:3])
    assert not any("two sides" in note for note in mine.notes)


def test_equal_columns_are_no_sides(tmp_path):
    w = weights()[:, [1, 1, 0]]
    assert not any("two sides" in note for note in read(tmp_path / "a.csv", eyes(UNKNOWN[0], w)).notes)


def test_short_words_are_sides_beside_each_other_only():
    for names in (["blink_g"], ["blink_d"], ["viseme_g", "viseme_d"], ["jawOpen_g", "jawOpen_d"], ["a", "d", "g"]):
        assert all(one is None or one.side is None for one in recognise_all(names).values())
    assert with_sides(["blink_g", "blink_d", "smile_g"]) == {"blink_g": "blink Left", "blink_d": "blink Right"}
