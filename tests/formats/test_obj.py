"""Folders of OBJ files: the file's vertex order, its polygons and parts, and one clear line when files do not fit."""

from pathlib import Path

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.formats.obj import read_obj_folder

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
MOVED = "v 0 0 0\nv 1 0 0\nv 1 1 2\nv 0 1 0\n"


def write(folder: Path, **files: str) -> Path:
    folder.mkdir(exist_ok=True)
    for stem, text in files.items():
        (folder / f"{stem}.obj").write_text(text)
    return folder


def test_every_vertex_keeps_its_number(tmp_path):
    """Also vertices that no face uses, and those with several texture coordinates."""
    loose = "v 9 9 9\n" + SQUARE + "vt 0 0\nvt 1 1\nf 5/1 4/2 3/1\nf 5/2 3/2 2/2\n"
    rig = read_obj_folder(write(tmp_path / "r", neutral=loose, a=loose.replace("v 1 1 0", "v 1 1 2")))
    np.testing.assert_array_equal(rig.neutral, [[9, 9, 9], [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    np.testing.assert_array_equal(rig.triangles, [[4, 3, 2], [4, 2, 1]])
    np.testing.assert_array_equal(rig.source_index, np.arange(5))
    np.testing.assert_array_equal(rig.deltas[0], [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 2], [0, 0, 0]])
    assert rig.part_names[rig.parts[0]] == "(no faces)"


@pytest.mark.parametrize(
    "faces",
    [
        "f 1 2 3 4\n",
        "f 1/7 2/7 3/7 4/7\n",
        "f 1//3 2//3 3//3 4//3\n",
        "f -4 -3 -2 -1\n",
        "f 1 2 \\\n 3 4\n",
        "f 1 2 3 4 # c\n",
    ],
)
def test_a_polygon_is_a_fan_around_its_first_vertex_however_it_is_written(tmp_path, faces):
    rig = read_obj_folder(write(tmp_path / "r", neutral=SQUARE + faces, a=MOVED + faces))
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3]])


def test_files_of_one_name_with_and_without_a_number_stand_in_its_order(tmp_path):
    stems = ("neutral", "smile10", "smile", "smile2", "smile 2b", "²", "1")
    rig = read_obj_folder(
        write(tmp_path / "r", **dict.fromkeys(stems, MOVED + "f 1 2 3\n") | {"neutral": SQUARE + "f 1 2 3\n"})
    )
    assert rig.names == ("1", "smile", "smile2", "smile10", "smile 2b", "²")


def test_negative_numbers_count_back_from_where_they_stand(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nf -4 -2 -1\n"
    rig = read_obj_folder(write(tmp_path / "r", neutral=text, a=text.replace("v 1 1 0", "v 1 1 3")))
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3]])


def test_colours_weights_windows_line_ends_and_comments_change_nothing(tmp_path):
    plain = read_obj_folder(write(tmp_path / "p", neutral=SQUARE + "f 1 2 3 4\n", a=MOVED + "f 1 2 3 4\n"))
    coloured = "# c\r\n" + SQUARE.replace("0\n", "0 0.1 0.2 0.3\r\n") + "f 1 2 3 4\r\n"
    weighted = MOVED.replace("\n", " 1.0\n") + "f 1 2 3 4"
    rig = read_obj_folder(write(tmp_path / "r", neutral=coloured, a=weighted))
    np.testing.assert_array_equal(rig.deltas, plain.deltas)
    np.testing.assert_array_equal(rig.neutral, plain.neutral)


@pytest.mark.parametrize("keyword", ["usemtl", "g", "o"])
def test_materials_groups_and_objects_become_parts(tmp_path, keyword):
    faces = f"{keyword} skin\nf 1 2 3\n{keyword} eye\nf 1 3 4\n"
    rig = read_obj_folder(write(tmp_path / "r", neutral=SQUARE + faces, a=MOVED + faces))
    assert [rig.part_names[part] for part in rig.parts] == ["skin", "skin", "skin", "eye"]


def test_only_what_tells_parts_apart_is_in_their_names(tmp_path):
    faces = "o head\ng a\nusemtl grey\nf 1 2 3\ng b\nf 1 3 4\n"
    rig = read_obj_folder(write(tmp_path / "r", neutral=SQUARE + faces, a=MOVED + faces))
    assert rig.part_names == ("a", "b")


def test_blendshapes_are_called_after_their_files_and_counted_as_people_count(tmp_path):
    files = {f"morph_{i}": MOVED + "f 1 2 3 4\n" for i in (10, 2, 1)}
    rig = read_obj_folder(write(tmp_path / "r", base=SQUARE + "f 1 2 3 4\n", **files))
    assert rig.names == ("morph_1", "morph_2", "morph_10")


@pytest.mark.parametrize("stem", ["neutral", "Neutral", "generic_neutral_mesh", "base", "Basis", "headRest", "default"])
def test_the_neutral_is_known_by_its_name(tmp_path, stem):
    rig = read_obj_folder(write(tmp_path / "r", **{stem: SQUARE + "f 1 2 3 4\n", "smile": MOVED + "f 1 2 3 4\n"}))
    assert rig.names == ("smile",)
    assert not rig.neutral[:, 2].any()


def test_equal_polygons_may_start_anywhere_and_come_in_any_order(tmp_path):
    cube = SQUARE + "v 0 0 1\n"
    moved = MOVED + "v 0 0 1\n"
    rig = read_obj_folder(write(tmp_path / "r", base=cube + "f 1 2 3 4\nf 1 2 5\n", a=moved + "f 5 1 2\nf 3 4 1 2\n"))
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 4]])


def test_files_of_macos_and_other_kinds_are_passed_over(tmp_path):
    folder = write(tmp_path / "r", neutral=SQUARE + "f 1 2 3 4\n", smile=MOVED + "f 1 2 3 4\n")
    (folder / "._smile.obj").write_bytes(b"\0\5\6")
    (folder / "notes.txt").write_text("v 1")
    assert read_obj_folder(folder).names == ("smile",)


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({"neutral": SQUARE + "f 1 2 3 4\n"}, "holds only a neutral, neutral.obj"),
        ({"a": SQUARE, "b": SQUARE}, "none of 2 OBJ files is called neutral"),
        ({"a_neutral": SQUARE, "neutral_b": MOVED}, "2 files could be the neutral, a_neutral.obj and neutral_b.obj"),
        ({"a": SQUARE + "v 1 1 1\nf 1 2 3 4\n"}, "a.obj has 5 vertices, the neutral neutral.obj has 4"),
        ({"a": MOVED + "f 1 2 3\n"}, "joins its vertices into other faces"),
        ({"a": MOVED + "f 4 3 2 1\n"}, "joins its vertices into other faces"),
        ({"a": MOVED}, "a.obj has 0 faces, the neutral neutral.obj has 1"),
        ({"a": "v 0 0 0\nv 1 0"}, "vertex 2 reads 'v 1 0'"),
        ({"a": "v 0 0\nv 1 0\n"}, "fewer than three coordinates"),
        ({"a": MOVED.replace("1 1 2", "1.0 1,5 2")}, "vertex 3 reads 'v 1.0 1,5 2'"),
        ({"a": ""}, "a.obj is empty"),
        ({"a": "PK\x03\x04"}, "a.obj has no vertices"),
        ({"a": SQUARE + "f 1 2 3 4\n"}, "every blendshape equals the neutral"),
        ({"neutral": SQUARE, "a": SQUARE}, "neutral.obj has vertices but no faces"),
        ({"neutral": SQUARE + "f 1 2 9\n", "a": MOVED}, "uses vertex 9 of 4"),
        ({"neutral": SQUARE + "f -9 2 3\n", "a": MOVED}, "uses vertex -4 of 4"),
        ({"neutral": SQUARE + "f 0 1 2\n", "a": MOVED}, "counted from 1"),
        ({"neutral": SQUARE + "f 1 2\n", "a": MOVED}, "three or more vertices"),
        ({"neutral": SQUARE + "f 1 x 2\n", "a": MOVED}, "'f 1 x 2' does not read"),
    ],
)
def test_files_that_do_not_make_one_rig_are_refused_in_one_line(tmp_path, files, says):
    neutral = {} if any(w in stem for stem in files for w in ("neutral", "b")) else {"neutral": SQUARE + "f 1 2 3 4\n"}
    with pytest.raises(RigError) as error:
        read_obj_folder(write(tmp_path / "r", **neutral, **files))
    assert says in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "odd.obj is empty"),
        ("v 0 0 0\nv 1 0", "odd.obj: vertex 2 reads 'v 1 0'"),
        ("PK\x03\x04", "odd.obj has no vertices"),
        (MOVED, "odd.obj has 0 faces"),
        (MOVED + "f 1 2 3\nf 1 3", "odd.obj has 2 faces"),
        (MOVED + "f 1 2 3\nf 1 x 4\n", "odd.obj: the face 'f 1 x 4' does not read"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "odd.obj has 3 vertices, the neutral neutral.obj has 4"),
        (None, "odd.obj cannot be read"),
    ],
)
def test_a_file_that_is_no_whole_blendshape_is_left_out_and_named_while_half_are_whole(tmp_path, text, says):
    faces = "f 1 2 3\nf 1 3 4\n"
    folder = write(tmp_path / "r", neutral=SQUARE + faces, smile=MOVED + faces)
    for stem in ("odd", "odd_2"):
        if text is None:
            (folder / f"{stem}.obj").symlink_to(folder / "nothing.obj")
        else:
            (folder / f"{stem}.obj").write_text(text)
        if stem == "odd":
            rig = read_obj_folder(folder)
            assert rig.names == ("smile",)
            assert says in rig.note
    with pytest.raises(RigError) as error:
        read_obj_folder(folder)
    assert says in str(error.value)


@pytest.mark.parametrize("others", [1, 3])
def test_files_of_other_faces_are_refused_however_few(tmp_path, others):
    files = {name: MOVED + ("f 4 3 2 1\n" if i < others else "f 1 2 3 4\n") for i, name in enumerate("abcde")}
    folder = write(tmp_path / "r", neutral=SQUARE + "f 1 2 3 4\n", **files)
    with pytest.raises(RigError, match=r"a\.obj joins its vertices into other faces than the neutral neutral\.obj"):
        read_obj_folder(folder)


def test_decimal_commas_are_read(tmp_path):
    neutral, moved = SQUARE.replace("1 1 0", "1,5 1,25 0"), MOVED.replace("1 1 2", "1,5 1,25 -2,5e-1")
    rig = read_obj_folder(write(tmp_path / "r", neutral=neutral + "f 1 2 3 4\n", a=moved + "f 1 2 3 4\n"))
    np.testing.assert_array_equal(rig.neutral[2], [1.5, 1.25, 0])
    np.testing.assert_array_equal(rig.deltas[0][2], [0, 0, -0.25])


@pytest.mark.parametrize(
    "stem",
    [
        *("hero-reference", "template", "hero_neutral", "1_neutral", "neutral pose", "neutralPose", "basemesh"),
        *("NEUTRAL", "head_neutralpose", "hero_base", "Average", "visage_neutre"),
    ],
)
def test_the_neutral_is_known_by_many_names(tmp_path, stem):
    faces = "f 1 2 3 4\n"
    rig = read_obj_folder(write(tmp_path / "r", **{stem: SQUARE + faces, "a": MOVED + faces, "b": MOVED + faces}))
    assert rig.names == ("a", "b")


def test_a_word_in_every_name_says_nothing(tmp_path):
    faces = "f 1 2 3 4\n"
    files = {"base_neutral": SQUARE, "base_smile": MOVED, "base_blink": MOVED, "base_neutralise": MOVED}
    rig = read_obj_folder(write(tmp_path / "r", **{stem: text + faces for stem, text in files.items()}))
    assert rig.names == ("base_blink", "base_neutralise", "base_smile")


def test_files_of_equal_names_are_numbered(tmp_path):
    folder, faces = write(tmp_path / "r", neutral=SQUARE + "f 1 2 3 4\n", a=MOVED + "f 1 2 3 4\n"), "f 1 2 3 4\n"
    (folder / "a.OBJ").write_text(MOVED + faces)
    rig = read_obj_folder(folder)
    assert rig.names == ("a", "a 2")
    assert "a 2" in rig.note
