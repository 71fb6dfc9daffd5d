"""Tables of points as programs write them: any separator, a column of numbers, titles or none, faces from 0 or 1."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.formats.csv_folder import counted_from
from capture_plan.reader.read import read_raw

GRID = np.array([[x, y, 0.25 * x * y] for y in range(4) for x in range(5)])
QUADS = [[5 * y + x, 5 * y + x + 1, 5 * y + x + 6, 5 * y + x + 5] for y in range(3) for x in range(4)]
SMILE = GRID + np.where(np.arange(20)[:, None] < 6, [0.0, 0.5, 1.5], 0.0)


def write(
    folder: Path,
    kind: str = "txt",
    separator: str = " ",
    titles: str = "",
    number: int | None = None,
    start: int = 0,
    extra: str = "",
    lead: str = "",
    faces: str = "faces",
) -> Path:
    """A rig in tables: `number` and `start` are where rows and vertices are counted from."""
    folder.mkdir()
    for stem, x in (("neutral", GRID), ("smile", SMILE)):
        rows = [[f"{a:.4f}" for a in row] + ([extra] if extra else []) for row in x]
        rows = [[str(number + i), *row] if number is not None else row for i, row in enumerate(rows)]
        text = "\n".join([titles] * bool(titles) + [separator.join(row) for row in rows])
        (folder / f"{stem}.{kind}").write_text(text + "\n")
    corners = [[str(a + start) for a in quad] for quad in QUADS]
    corners = [[lead, *quad] if lead else quad for quad in corners]
    (folder / f"{faces}.{kind}").write_text("\n".join(separator.join(quad) for quad in corners) + "\n")
    return folder


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(["txt", "csv", "tsv", "xyz"]),
    separator=st.sampled_from([" ", "  ", "\t", ",", ";", ", ", " ; "]),
    titled=st.booleans(),
    number=st.sampled_from([None, 0, 1]),
    start=st.sampled_from([0, 1]),
    lead=st.sampled_from(["", "4"]),
    faces=st.sampled_from(["faces", "triangles", "head_faces", "polygons", "topology"]),
)
def test_a_rig_in_tables_reads_the_same_however_it_is_written(
    tmp_path_factory, kind, separator, titled, number, start, lead, faces
):
    titles = separator.join((["id"] if number is not None else []) + ["x", "y", "z"]) if titled else ""
    folder = tmp_path_factory.mktemp("tables") / "r"
    raw = read_raw(write(folder, kind, separator, titles, number, start, lead=lead, faces=faces))
    np.testing.assert_allclose(raw.neutral, GRID, atol=1e-4)
    np.testing.assert_allclose(raw.deltas[0], SMILE - GRID, atol=1e-3)
    np.testing.assert_array_equal(np.unique(raw.triangles), np.arange(20))
    assert len(raw.triangles) == 2 * len(QUADS)
    assert raw.names == ("smile",)
    assert "are read as x, y and z" not in raw.note
    assert ("counts vertices from 1" in raw.note) == (start == 1)


def test_titles_tell_which_columns_are_places(tmp_path):
    folder = write(tmp_path / "r", "csv", ",", "x,y,z,radius", extra="9.5")
    (folder / "smile.csv").write_text(
        "radius,z,y,x\n" + "\n".join(f"9.5,{z:.4f},{y:.4f},{x:.4f}" for x, y, z in SMILE) + "\n"
    )
    raw = read_raw(folder)
    np.testing.assert_allclose(raw.deltas[0], SMILE - GRID, atol=1e-3)
    assert "of 4 columns of the tables, 1, 2, 3 are read as x, y and z" in raw.note


@pytest.mark.parametrize("row", ["{:.3f} {:.3f} {:.3f}", "{:.3f}\t{:.3f}\t{:.3f}", "{:.3f}; {:.3f}; {:.3f}"])
def test_decimal_commas_are_read_between_spaces_too(tmp_path, row):
    folder = write(tmp_path / "r")
    for stem, x in (("neutral", GRID), ("smile", SMILE)):
        (folder / f"{stem}.txt").write_text("\n".join(row.format(*p).replace(".", ",") for p in x))
    np.testing.assert_allclose(read_raw(folder).neutral, GRID, atol=1e-3)


def test_triangles_and_quads_may_be_mixed_and_remarks_stand_anywhere(tmp_path):
    folder = write(tmp_path / "r")
    (folder / "faces.txt").write_text("# polygons\n4\n0 1 6 5\n1 2 7\n// half\n1 7 6\n2 3 8 7\n")
    assert len(read_raw(folder).triangles) == 6


@pytest.mark.parametrize("start", [0, 1])
def test_where_first_and_last_number_are_not_used_the_edges_tell_what_is_counted_from(start):
    corners = np.array([quad for quad in QUADS if not {0, 19} & set(quad)])
    sizes = np.full(len(corners), 4)
    assert counted_from(corners.ravel() + start, sizes, GRID, "faces.txt")[0] == start


def test_texts_without_faces_are_no_rig(tmp_path):
    (tmp_path / "readme.txt").write_text("how to use it")
    with pytest.raises(RigError, match="holds no OBJ files"):
        read_raw(tmp_path)


@pytest.mark.parametrize("text", ["0 1\n", "0 1 2.5\n", "0 1 99\n"])
def test_faces_that_name_no_vertices_are_refused_in_one_line(tmp_path, text):
    folder = write(tmp_path / "r")
    (folder / "faces.txt").write_text(text)
    with pytest.raises(RigError, match=r"whole vertex numbers|beyond its") as error:
        read_raw(folder)
    assert "\n" not in str(error.value)
