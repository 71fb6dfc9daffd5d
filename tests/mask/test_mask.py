"""The mask of a noisy, coarse head, as a scan of an actor is: measured on its finished file, not by how it was made."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from capture_plan.anatomy.regions import face_regions
from capture_plan.errors import PlanError, RigError
from capture_plan.face.anchors import face_anchors
from capture_plan.mask import Dot, MaskSettings, make_mask, mask_lines
from capture_plan.mask.holes import holes_for
from capture_plan.mask.labels import _doubt
from capture_plan.mask.parts import parts_of
from capture_plan.mask.record import Hole, Label
from capture_plan.mask.skin import sample_skin
from capture_plan.mask.solid import as_mesh, manifold3d, solid
from capture_plan.mask.write import UUID, stl_bytes, threemf_bytes
from capture_plan.mesh import vertex_normals
from capture_plan.reader.head_scan import read_head
from capture_plan.visibility.occluder import Occluder
from tests.light import light_sample
from tests.mask.fitted import fitted_axis

NOISE_MM, SETTINGS = 0.25, MaskSettings()
GIVEN = {
    "left brow": ("eye_left", (4, 17)),
    "right brow": ("eye_right", (-4, 17)),
    "lid": ("eye_left", (0, 7)),
    "nose": ("nose_tip", (0, 0)),
    "nose side": ("nose_tip", (15, -6)),
    "crease": ("chin", (0, 19)),
    "lip": ("mouth", (6, 6)),
    "lower lip": ("mouth", (-6, -7)),
    "cheek": ("mouth", (42, 8)),
    "other cheek": ("mouth", (-42, 8)),
    "chin": ("chin", (0, 2)),
}  # places as seen from the front, millimetres from an anchor


@pytest.fixture(scope="module")
def head():
    rig = light_sample()
    noise = np.random.default_rng(0).normal(0, NOISE_MM, rig.neutral.shape)
    return replace(rig, neutral=rig.neutral + noise)


@pytest.fixture(scope="module")
def dots(head):
    anchors, skin = face_anchors(light_sample()), np.flatnonzero(head.skin)
    front = skin[head.neutral[skin, 2] > anchors.ear_left[2]]
    places = [getattr(anchors, where)[:2] + by for where, by in GIVEN.values()]
    at = [front[np.linalg.norm(head.neutral[front, :2] - p, axis=1).argmin()] for p in places]
    made = [Dot(name, str(i + 1), head.neutral[v]) for i, (name, v) in enumerate(zip(GIVEN, at, strict=True))]
    neck = face_regions(light_sample()).of_vertex == face_regions(light_sample()).names.index("neck")
    ear = skin[head.neutral[skin, 0].argmax()]
    beside = replace(made[8], name="twin", position=made[8].position + np.array([0.0, 3, 0]))
    return (
        *made,
        Dot("throat", "12", head.neutral[np.flatnonzero(neck)[0]], on_neck=True),
        Dot("ear", "13", head.neutral[ear]),
        Dot("away", "14", made[8].position + np.array([25.0, 0, 0])),
        beside,
    )


SAID = "Mask: plan 0123456789abcdef of " + 60 * "a"


@pytest.fixture(scope="module")
def mask(head, dots):
    return make_mask(head, dots, dot_mm=3.0, settings=SETTINGS)


@pytest.fixture(scope="module")
def printed(mask):
    """The STL as a program of others reads it, moved back to the head."""
    (part,) = mask.parts
    mesh = trimesh.load(io.BytesIO(stl_bytes(part.printed, SAID)), file_type="stl")
    mesh.vertices = (mesh.vertices - part.shift) @ part.turn
    return mesh


def test_the_file_says_which_plan_it_is_of(mask):
    data = stl_bytes(mask.parts[0].printed, SAID)
    assert data[:80] == SAID[:80].encode()
    assert len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")


def test_the_file_is_one_closed_solid(printed):
    m3 = manifold3d()
    corners = np.asarray(printed.vertices, dtype=np.float32)
    again = m3.Manifold(m3.Mesh(vert_properties=corners, tri_verts=np.asarray(printed.faces, dtype=np.uint32)))
    assert printed.is_watertight
    assert printed.is_winding_consistent
    assert printed.body_count == 1
    assert again.status() == m3.Error.NoError
    assert again.volume() == pytest.approx(printed.volume, rel=1e-3)


def test_every_dot_that_can_have_a_hole_has_one_and_the_others_are_told_why(mask):
    assert {hole.dot.name for hole in mask.holes} == set(GIVEN)
    assert set(mask.without) == {"throat", "ear", "away", "twin"}
    assert "neck" in mask.without["throat"]
    assert "ear" in mask.without["ear"]
    assert "off the skin" in mask.without["away"]
    assert "cheek" in mask.without["twin"]


def test_each_hole_stands_on_its_dot(mask, printed, head):
    normals = vertex_normals(head.neutral, head.triangles[head.skin[head.triangles].all(axis=1)])
    vertices, triangles = np.asarray(printed.vertices), np.asarray(printed.faces)
    for hole in mask.holes:
        around = np.linalg.norm(head.neutral - hole.dot.position, axis=1) < 7.0
        away, radius, _ = fitted_axis(vertices, triangles, hole.dot.position, normals[around].sum(axis=0))
        assert away < 0.05, hole.dot.name
        assert radius == pytest.approx(1.7, abs=0.02)


def test_a_pen_goes_through_every_hole(mask, printed):
    solid = Occluder(np.asarray(printed.vertices), np.asarray(printed.faces))
    start = np.stack([hole.dot.position + 30 * hole.axis for hole in mask.holes])
    way = solid.distance(start, -np.stack([hole.axis for hole in mask.holes]))
    assert (way > 31).all()


def test_the_wall_is_nowhere_thinner_than_plastic_bears(mask, printed, head):
    """Rays from random points of the inside: what looks at skin that is about as far away as the gap."""
    points, face = trimesh.sample.sample_surface(printed, 150_000, seed=1)
    outward = printed.face_normals[face]
    solid = Occluder(np.asarray(printed.vertices), np.asarray(printed.faces))
    own = head.triangles[head.skin[head.triangles].all(axis=1)]
    below = Occluder(head.neutral, own).distance(np.asarray(points), np.asarray(outward))
    inside = below < SETTINGS.gap_mm + 0.6
    thick = solid.distance(points[inside] - 0.01 * outward[inside], -outward[inside]) + 0.01
    assert inside.sum() > 30_000
    assert np.percentile(thick, 1) >= 1.75
    assert np.percentile(thick, 0.02) >= 1.6
    assert mask.wall.percentile_mm >= 1.75
    assert mask.wall.thin <= 1e-4 * mask.wall.rays


def bent(opening):
    """Skin bent along y as a valley (opening below 180 degrees, seen from +z) or a ridge, 60 x 60 mm, and its cover."""
    x, y = np.meshgrid(np.linspace(-30, 30, 61), np.linspace(-30, 30, 61), indexing="ij")
    vertices = np.stack([x, y, np.abs(x) / np.tan(np.radians(opening) / 2)], axis=-1).reshape(-1, 3)
    i = np.arange(61 * 61).reshape(61, 61)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    skin = sample_skin(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    return skin, 14.0 - np.abs(skin.points[:, :2]).max(axis=1)


@pytest.mark.parametrize(("opening", "at"), [(100, 4.0), (80, 3.0), (280, 1.5), (290, 3.0)])
def test_neither_a_crease_nor_a_hole_beside_it_makes_the_wall_thin(opening, at):
    skin, cover = bent(opening)
    dot = Dot("M01", "1", skin.points[np.linalg.norm(skin.points[:, :2] - [at, 0], axis=1).argmin()])
    holes, _ = holes_for((dot,), skin, 3.0, SETTINGS)
    made = as_mesh(solid(skin, cover, np.full(len(cover), SETTINGS.gap_mm), holes, (), SETTINGS))
    mesh = trimesh.Trimesh(made.vertices, made.triangles, process=False)
    points, face = trimesh.sample.sample_surface(mesh, 60_000, seed=1)
    outward = mesh.face_normals[face]
    away, near = skin.tree.query(points)
    inside = (np.einsum("nx,nx->n", outward, skin.normals[near]) < -0.3) & (away < 3.0) & (cover[near] > 2)
    thick = Occluder(made.vertices, made.triangles).distance(points[inside] - 0.01 * outward[inside], -outward[inside])
    assert len(holes) == 1
    assert inside.sum() > 3_000
    assert thick.min() >= 1.59


@pytest.mark.filterwarnings("error")
def test_a_number_behind_the_skin_of_its_hole_is_not_beside_it():
    axis = np.array([0.0, 0, 1])
    hole = Hole(Dot("M01", "1", np.zeros(3)), axis, 1.7, 0.6, 2.4, 3.8)
    label = Label("M01", "1", -12 * axis, np.eye(3), 3.0, (4.0, 4.0), 3.0)
    assert _doubt(label, np.array([2.0, 2.0]), hole, (hole,)) == np.inf


def test_the_gap_is_the_one_that_was_asked_for(mask):
    low, middle, high = mask.gap_mm
    assert middle == pytest.approx(SETTINGS.gap_mm, abs=0.05)
    assert low > 0.4
    assert high < 0.85


def test_numbers_are_engraved_and_leave_enough_beneath_them(mask, printed, head):
    solid = Occluder(np.asarray(printed.vertices), np.asarray(printed.faces))
    assert len(mask.labels) == len(mask.holes)
    for label in mask.labels:
        x, y = (np.linspace(-side / 2 + 0.6, side / 2 - 0.6, 40) for side in label.size_mm)
        on = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) @ label.frame[:2] + label.place
        up = label.frame[2]
        start = on + (label.top_mm + 2.0) * up
        depth = solid.distance(start, np.tile(-up, (len(on), 1))) - 2.0
        cut = np.abs(depth - 0.6) < 0.02
        assert (np.abs(depth) < 0.05).mean() > 0.3, label.name  # the pad is flat
        assert 0.05 < cut.mean() < 0.6, label.name  # strokes of one depth
        floor = start[cut] - (2.0 + depth[cut, None] + 0.02) * up
        assert solid.distance(floor, np.tile(-up, (len(floor), 1))).min() >= 1.6


def test_eyes_and_mouth_are_open(mask, printed, head):
    anchors = face_anchors(light_sample())
    solid = Occluder(np.asarray(printed.vertices), np.asarray(printed.faces))
    before = np.stack([anchors.eye_left, anchors.eye_right, anchors.mouth]) + np.array([0.0, 0, 60])
    assert np.isinf(solid.distance(before, np.tile([0.0, 0, -1], (3, 1)))).all()


def test_what_a_small_printer_cannot_hold_comes_in_pieces_with_whole_holes(mask):
    solid = as_solid(mask)
    small = MaskSettings(volume_mm=(100, 100, 90))
    parts = parts_of(solid, mask.holes, mask.labels, 0.0, small)
    assert len(parts) > 1
    assert all(np.all(np.array(part.size_mm) <= np.array(small.volume_mm) + 1e-6) for part in parts)
    assert 0.97 < sum(volume(part.mesh) for part in parts) / volume(mask.mesh) < 1.0001
    assert all(rings(part.mesh, hole) in (0.0, 1.0) for hole in mask.holes for part in parts)


def test_halves_leave_holes_on_the_midline_whole(mask):
    left, right = parts_of(as_solid(mask), mask.holes, mask.labels, 0.0, MaskSettings(halves=True))
    nose = next(hole for hole in mask.holes if hole.dot.name == "nose")
    assert sorted([rings(left.mesh, nose), rings(right.mesh, nose)]) == [0.0, 1.0]
    assert left.mesh.vertices[:, 0].mean() > 0 > right.mesh.vertices[:, 0].mean()


def test_a_piece_stands_on_the_bed(mask):
    (part,) = mask.parts
    assert part.printed.vertices[:, 2].min() == pytest.approx(0, abs=1e-3)
    np.testing.assert_allclose(part.turn @ part.turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(part.turn) == pytest.approx(1)


def test_3mf_is_in_millimetres_and_reads_back(mask):
    scene = trimesh.load(io.BytesIO(threemf_bytes(mask.parts)), file_type="3mf")
    np.testing.assert_allclose(np.sort(scene.extents), np.sort(mask.parts[0].size_mm), atol=0.01)
    assert scene.units in ("millimeter", "mm")


def test_the_closing_lines_name_what_was_left_out(mask):
    text = "\n".join(mask_lines(mask))
    assert all(f"No hole for {name}: " in text for name in mask.without)
    assert "11 holes of 3.4 mm" in text


@pytest.mark.parametrize(
    "wrong",
    [
        {"gap_mm": 0.1},
        {"gap_mm": 2},
        {"wall_mm": 1.2},
        {"volume_mm": (20, 200, 200)},
        {"volume_mm": (float("nan"), 200, 200)},
    ],
)
def test_settings_that_nobody_can_wear_or_print_are_refused(wrong):
    with pytest.raises(PlanError, match="mm"):
        MaskSettings(**wrong)


def test_without_a_dot_that_can_have_a_hole_there_is_no_mask(head, dots):
    with pytest.raises(PlanError, match="neck"):
        make_mask(head, (dots[11],), dot_mm=3.0)


def as_solid(mask):
    m3 = manifold3d()
    corners = np.asarray(mask.mesh.vertices, dtype=np.float32)
    made = m3.Manifold(m3.Mesh(vert_properties=corners, tri_verts=np.asarray(mask.mesh.triangles, dtype=np.uint32)))
    assert made.status() == m3.Error.NoError
    return made


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("fx,fx->f", a, np.cross(b, c)).sum() / 6)


def rings(mesh, hole):
    """Share of the directions around a hole's axis in which its plastic is met."""
    angle = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    e = np.cross(hole.axis, [0.3, 1.0, 0.2])
    e /= np.linalg.norm(e)
    out = np.cos(angle)[:, None] * e + np.sin(angle)[:, None] * np.cross(hole.axis, e)
    middle = hole.dot.position + (hole.land_mm - 0.4) * hole.axis
    way = Occluder(mesh.vertices, mesh.triangles).distance(np.tile(middle, (36, 1)), out)
    return float((np.abs(way - hole.radius_mm) < 0.05).mean())


def test_equal_pieces_are_equal_files_and_are_no_head(mask, tmp_path):
    one, other = threemf_bytes(mask.parts), threemf_bytes(mask.parts)
    assert one == other
    (tmp_path / "anna.3mf").write_bytes(one)
    (tmp_path / "anna.stl").write_bytes(stl_bytes(mask.mesh, "Mask: plan 0123456789abcdef of hero"))
    for name in ("anna.3mf", "anna.stl"):
        with pytest.raises(RigError, match="is a mask that was made of a plan"):
            read_head(tmp_path / name)
    with zipfile.ZipFile(io.BytesIO(one)) as archive:
        numbers = UUID.findall(archive.read("3D/3dmodel.model"))
    assert len(set(numbers)) == len(numbers) > 1


def test_a_head_that_nobody_has_gets_no_mask(head, dots):
    giant = replace(head, neutral=6 * head.neutral, deltas=6 * head.deltas)
    with pytest.raises(PlanError, match=r"mm between the pupils, a person 60 to 66: .*--unit-mm"):
        make_mask(giant, tuple(replace(dot, position=6 * dot.position) for dot in dots), dot_mm=3.0)
