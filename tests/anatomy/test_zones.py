"""Laws of keep-out zones: where they lie, that they grow, that both sides have them; and zones painted by hand."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.eye_corners import eye_corners
from capture_plan.anatomy.painted_zone import painted_zone
from capture_plan.anatomy.regions import face_regions
from capture_plan.anatomy.zones import MARGINS_MM, ZONES, find_zones, zone_mask
from capture_plan.errors import RigError
from capture_plan.face.anchors import face_anchors
from capture_plan.mesh.mirror import mirror_map
from capture_plan.rig import Rig
from tests.solids import sphere


@pytest.fixture(scope="module")
def regions(rig):
    return face_regions(rig)


@pytest.fixture(scope="module")
def zones(rig):
    return {zone.name: zone for zone in find_zones(rig)}


def test_every_zone_is_found_on_the_sample_and_lies_on_skin(rig, zones):
    assert tuple(zones) == ZONES
    for zone in zones.values():
        assert zone.mask.any()
        assert not (zone.mask & ~rig.skin).any()


@pytest.mark.parametrize(
    ("name", "inside"),
    [
        ("lash line", {"upper eyelid", "lower eyelid"}),
        ("inner eye corner", {"upper eyelid", "lower eyelid", "nose", "cheek", "brow"}),
        ("wet lip", {"upper lip", "lower lip", "mouth corner"}),
        ("nostril rim", {"nose", "upper lip"}),
        ("hairline", {"scalp", "forehead", "temple", "ear", "neck"}),
        ("helmet strap", {"temple", "cheek", "jaw", "chin", "neck", "scalp", "forehead"}),
    ],
)
def test_a_zone_lies_in_its_regions(regions, zones, name, inside):
    found = {regions.names[i] for i in regions.of_vertex[zones[name].mask]}
    assert found <= inside
    assert found & inside


def test_most_skin_of_the_face_stays_free(rig, regions, zones):
    small = zones["lash line"].mask | zones["wet lip"].mask | zones["nostril rim"].mask
    face = rig.skin & np.isin(regions.of_vertex, [regions.names.index(n) for n in ("cheek", "nose", "chin", "brow")])
    assert small[face].mean() < 0.15
    for region in ("upper eyelid", "lower eyelid", "upper lip", "lower lip"):
        assert not small[regions.of_vertex == regions.names.index(region)].all()


@pytest.mark.parametrize("name", ZONES)
def test_a_zone_grows_with_its_margin(rig, zones, name):
    none, usual, wide = (zone_mask(rig, name, margin) for margin in (0.0, MARGINS_MM[name], 2 * MARGINS_MM[name] + 4))
    assert (none <= usual).all()
    assert (usual <= wide).all()
    assert none.sum() < wide.sum()
    assert np.array_equal(usual, zones[name].mask)


@pytest.mark.parametrize("noise_mm", [0.0, 0.2])
def test_both_sides_have_the_same_zones(rig, noise_mm):
    """Also where the sides of a scan differ a little, so that a threshold falls differently on each."""
    noise = noise_mm * np.random.default_rng(0).normal(size=rig.neutral.shape)
    scan = replace(rig, neutral=rig.neutral + noise)
    mirror = mirror_map(scan.neutral)
    both = (mirror[mirror] == np.arange(len(mirror))) & rig.skin & rig.skin[mirror]
    assert both[rig.skin].mean() > 0.9
    for zone in find_zones(scan):
        assert np.array_equal(zone.mask[both], zone.mask[mirror][both])


def test_lashes_do_not_shade_skin_into_the_lash_line(rig, zones):
    """The sample's lash strips hang in front of the lids: without them the zone is the same."""
    lashes = [i for i, part in enumerate(rig.part_names) if "lash" in part]
    retained = ~np.isin(rig.parts[rig.triangles[:, 0]], lashes)
    bare = replace(rig, triangles=rig.triangles[retained])
    assert np.array_equal(zone_mask(bare, "lash line"), zones["lash line"].mask)


def test_eyes_and_mouth_without_a_border_are_found_where_skin_is_hidden(rig, zones):
    """All of the head's main piece called skin, its bags included: lids and lips have no border any more."""
    whole = replace(rig, skin=np.isin(np.arange(len(rig.skin)), rig.triangles) & (rig.parts == 0))
    for name in ("lash line", "wet lip"):
        (zone,) = find_zones(whole, {name: MARGINS_MM[name]})
        assert zone.mask.any()
        assert (zones[name].mask & zone.mask).sum() > 0.6 * zones[name].mask.sum()
        assert "no border" in zone.note


def ball():
    """A head without a single opening."""
    vertices, triangles = sphere()
    deltas = np.zeros((1, *vertices.shape), dtype=np.float32)
    deltas[0, :, 1] = np.where((vertices[:, 2] > 80) & (np.abs(vertices[:, 1]) < 60), -5, 0)
    every = np.ones(len(vertices), dtype=bool)
    parts = np.zeros(len(vertices), dtype=int)
    return Rig("ball", vertices, triangles, deltas, ("nod",), every, parts, ("ball",), np.arange(len(vertices)))


def test_what_a_face_does_not_have_is_said_and_left_empty():
    for zone in find_zones(ball(), {"lash line": 2.0, "inner eye corner": 5.0, "wet lip": 2.0, "nostril rim": 2.0}):
        assert not zone.mask.any()
        assert "was found: paint this zone by hand" in zone.note


@pytest.mark.parametrize(
    ("name", "margin", "message"),
    [("lashline", 2.0, "no keep-out zone is called 'lashline'"), ("wet lip", -1.0, "its margin is -1.0 mm")],
)
def test_an_unknown_zone_or_margin_is_refused(rig, name, margin, message):
    with pytest.raises(RigError, match=message):
        zone_mask(rig, name, margin)


def test_listed_vertices_are_those_of_the_artists_file(rig, tmp_path):
    own = rig.source_index
    path = tmp_path / "scar.txt"
    path.write_text(f"{own[5]} # the scar\n{own[100]}-{own[120]}")
    zone = painted_zone(path, rig)
    assert zone.name == "scar"
    expected = (own == own[5]) | ((own >= own[100]) & (own <= own[120]))
    assert np.array_equal(zone.mask, expected)


def write_ply(path, points, colours, kind="uchar"):
    """An ASCII PLY of points with a colour each."""
    rows = "\n".join(
        " ".join(f"{x:.5f}" for x in p) + " " + " ".join(map(str, c)) for p, c in zip(points, colours, strict=True)
    )
    names = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{axes}{names}end_header\n{rows}\n")
    return path


def in_file(rig, values, rest):
    """Values of the rig's vertices where its file has them."""
    whole = np.full((int(rig.source_index.max()) + 1, *values.shape[1:]), rest, dtype=values.dtype)
    whole[rig.source_index] = values
    return whole


@pytest.mark.parametrize(("kind", "full"), [("uchar", 255), ("float", 1.0)])
def test_a_hue_marks_and_white_grey_and_black_do_not(rig, tmp_path, kind, full):
    rng = np.random.default_rng(0)
    grey = rng.choice([0.0, 0.5, 1.0], size=len(rig.neutral))
    rgb = np.repeat(grey[:, None], 3, axis=1)
    red = rng.random(len(rgb)) < 0.1
    rgb[red] = [0.8, 0.1, 0.5]
    rgb[np.flatnonzero(~red)[:9]] = [0.9, 0.9, 0.75]  # a warm white is no paint
    rgb[np.flatnonzero(red)[:9]] = [0.7, 1.0, 0.7]  # a pale crayon is
    rgb = np.round(rgb * full).astype(int) if kind == "uchar" else rgb
    points = in_file(rig, rig.neutral / 25.4, 0.0)
    zone = painted_zone(write_ply(tmp_path / "paint.ply", points, in_file(rig, rgb, 0), kind), rig)
    assert np.array_equal(zone.mask, red)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p, c: (p[:-1], c[:-1]), "vertices, .* in its file"),
        (lambda p, c: (p[::-1], c), "does not have the shape"),
        (lambda p, c: (p, c * 0 + 90), "marks no vertex"),
    ],
)
def test_a_painted_mesh_that_does_not_fit_is_refused_in_one_line(rig, tmp_path, change, message):
    points = in_file(rig, rig.neutral, 0.0)
    colours = in_file(rig, np.tile([200, 0, 0], (len(rig.neutral), 1)), 0)
    with pytest.raises(RigError, match=message) as error:
        painted_zone(write_ply(tmp_path / "paint.ply", *change(points, colours)), rig)
    assert "\n" not in str(error.value)


def test_a_list_that_does_not_fit_is_refused_in_one_line(rig, tmp_path):
    path = tmp_path / "list.txt"
    for text, message in (("9999999", "names vertex 9999999"), ("all", "'all' is no vertex number"), ("", "marks no")):
        path.write_text(text)
        with pytest.raises(RigError, match=message):
            painted_zone(path, rig)
    with pytest.raises(RigError, match="cannot be read"):
        painted_zone(tmp_path / "none.ply", rig)


def test_a_mesh_without_colours_is_refused(rig, tmp_path):
    path = write_ply(tmp_path / "bare.ply", in_file(rig, rig.neutral, 0.0), in_file(rig, np.zeros((4939, 3), int), 0))
    path.write_text(path.read_text().replace("red", "pressure"))
    with pytest.raises(RigError, match="no vertex colours"):
        painted_zone(path, rig)


@pytest.mark.parametrize("side", ["left", "right"])
def test_no_dot_stands_at_the_corner_of_the_eye_beside_the_nose_and_the_other_corner_is_free(rig, zones, side):
    corners = eye_corners(rig, face_anchors(rig))
    x, sign = rig.neutral[:, 0], 1 if side == "left" else -1
    assert 0 < sign * x[corners["inner", side]] < sign * x[corners["outer", side]]
    mask = zones["inner eye corner"].mask
    assert mask[corners["inner", side]]
    assert not mask[corners["outer", side]]
