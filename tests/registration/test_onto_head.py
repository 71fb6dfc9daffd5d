"""Laws of laying a rig onto a scan: people with known places, in other triangles, turned and moved, are met; what is no
face is not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_plan.errors import PlanError, RigError
from capture_plan.input.points import read_points
from capture_plan.mesh import vertex_normals
from capture_plan.mesh.decimate import decimate
from capture_plan.reader.head_scan import HeadScan
from capture_plan.registration.empirical_layouts import empirical_layout
from capture_plan.registration.onto_head import lay_onto_head, refuse_strays
from capture_plan.registration.picked_points import named_vertices, picks_on
from capture_plan.sample import sample_rig
from capture_plan.sample.people import made_up_people

DOTS = empirical_layout("ibug68").vertices
UNITS = (1.0, 10.0, 1000.0, 25.4, 100.0)


@cache
def coarse():
    """The sample's skin in half as many triangles: which corners, numbered among the middles of its edges."""
    rig = sample_rig()
    part = rig.part_names.index("skin")
    skin = rig.triangles[(rig.parts == part)[rig.triangles].all(axis=1)]
    finer, triangles = trimesh.remesh.subdivide(rig.neutral, skin)
    at, kept = decimate(finer, triangles, len(skin) // 2)
    return skin, at, kept


def scan_of(rig, seed=0, unit=1.0, turned=True):
    """A rig as somebody's scan: other triangles, 0.1 mm of noise, anywhere; and where its vertices lie there."""
    rng = np.random.default_rng(seed)
    skin, at, triangles = coarse()
    x = trimesh.remesh.subdivide(rig.neutral, skin)[0][at]
    R = Rotation.random(random_state=seed).as_matrix() if turned else np.eye(3)
    shift = rng.normal(0, 300, 3) * turned
    x = (x + rng.normal(0, 0.1, x.shape)) @ R.T + shift
    return HeadScan("anna", x / unit, triangles, (unit,), ""), (rig.neutral @ R.T + shift) / unit


@pytest.fixture(scope="module")
def people():
    return made_up_people(sample_rig(), 2)


def test_other_people_in_other_triangles_are_met_without_a_point(people):
    """Known truth: median at most 1.5 mm, 95th percentile at most 4 mm; balls of eyes stay balls."""
    away = []
    for seed, person in enumerate(people):
        head, truth = scan_of(person, seed)
        laid = lay_onto_head(sample_rig(), head)
        away.append(np.linalg.norm(laid.in_file(laid.neutral) - truth, axis=1)[DOTS])
        eye = np.flatnonzero(sample_rig().parts == sample_rig().part_names.index("eye_L"))
        size = np.ptp(laid.neutral[eye], axis=0) / np.ptp(sample_rig().neutral[eye], axis=0)
        assert np.ptp(size) < 0.05
        assert not laid.left_out_mm
    assert np.median(away) <= 1.5
    assert np.percentile(away, 95) <= 4


def test_picked_points_measure_the_error_by_leaving_each_out(people):
    head, truth = scan_of(people[0], 3, unit=10.0)
    at = named_vertices(sample_rig())
    names = ["eye_outer_left", "eye_outer_right", "nose_tip", "chin", "mouth_left", "mouth_right"]
    picks = picks_on(sample_rig(), {name: tuple(truth[at[name]]) for name in names}, {})
    laid = lay_onto_head(sample_rig(), head, picks)
    assert list(laid.left_out_mm) == names
    median, tail = laid.error_mm
    assert 0 < median <= tail < 8
    own = [10 * np.linalg.norm(laid.in_file(laid.neutral)[at[name]] - truth[at[name]]) for name in names]
    assert np.median(own) < 1  # they are met where they were picked, and left out they are not
    assert median > np.median(own)


def test_the_same_head_in_any_unit_gets_the_same_dots(people):
    """Metres, centimetres and inches of one file, unit unknown."""
    places = []
    for unit in (1000.0, 25.4):
        head, _ = scan_of(people[1], 1, unit=unit)
        diagonal = np.linalg.norm(np.ptp(head.vertices, axis=0))
        found = tuple(one for one in UNITS if 200 <= one * diagonal <= 1100)
        laid = lay_onto_head(sample_rig(), replace(head, units_mm=found))
        assert laid.unit_mm == unit
        places.append(laid.neutral[DOTS])
    assert np.abs(places[0] - places[1]).max() < 0.5


def test_holes_an_open_back_and_triangles_inside_out_do_not_matter(people):
    head, truth = scan_of(people[0], 2)
    middle = head.vertices[head.triangles].mean(axis=1)
    hole = np.linalg.norm(middle - truth[DOTS[3]], axis=1) < 14
    laid_at = truth[DOTS[30]] - truth[DOTS].mean(axis=0)  # the tip of the nose is in front
    back = (middle - truth[DOTS].mean(axis=0)) @ laid_at / np.linalg.norm(laid_at) < -60
    cut = replace(head, triangles=head.triangles[~(hole | back)][:, ::-1])
    laid = lay_onto_head(sample_rig(), cut)
    away = np.linalg.norm(laid.in_file(laid.neutral) - truth, axis=1)[DOTS]
    assert np.median(away) < 2


def test_a_mask_without_ears_is_a_face(people):
    head, truth = scan_of(people[0], 5)
    from_nose = np.linalg.norm(head.vertices[head.triangles].mean(axis=1) - truth[DOTS[30]], axis=1)
    laid = lay_onto_head(sample_rig(), replace(head, triangles=head.triangles[from_nose < 90]))
    inside = np.linalg.norm(truth[DOTS] - truth[DOTS[30]], axis=1) < 80
    assert np.median(np.linalg.norm(laid.in_file(laid.neutral) - truth, axis=1)[DOTS][inside]) < 2


@pytest.mark.parametrize("shape", ["cube", "egg"])
def test_what_is_no_face_is_not_guessed_at(shape):
    if shape == "cube":
        mesh = trimesh.creation.box((240, 240, 240)).subdivide().subdivide().subdivide().subdivide()
    else:
        mesh = trimesh.creation.icosphere(3, 110)
        mesh.apply_scale([0.8, 1.2, 1.0])
    thing = HeadScan("thing", np.array(mesh.vertices), np.array(mesh.faces), (1.0,), "")
    with pytest.raises(RigError, match=r"thing: not sure where the face is .* give points with --points"):
        lay_onto_head(sample_rig(), thing)


def test_points_that_contradict_the_head_are_refused_in_one_line(people):
    rig = sample_rig()
    head, truth = scan_of(people[0])
    at = named_vertices(rig)
    right = {name: tuple(truth[at[name]]) for name in at}
    exchanged = {
        name: right[name.replace("left", "R").replace("right", "left").replace("R", "right")] for name in right
    }
    with pytest.raises(RigError, match="left and right of the points picked on anna are exchanged"):
        lay_onto_head(rig, head, picks_on(rig, exchanged, {}))
    with pytest.raises(RigError, match="2 points picked on anna, expected none, or 3"):
        lay_onto_head(rig, head, picks_on(rig, dict(list(right.items())[:2]), {}))
    with pytest.raises(RigError, match="lie on one line or together"):
        lay_onto_head(rig, head, picks_on(rig, {name: right["chin"] for name in list(right)[:3]}, {}))
    with pytest.raises(PlanError, match="no points are known as 'belly': name one of eye_inner_left"):
        picks_on(rig, {"belly": (0.0, 0.0, 0.0)}, {})


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("p.json", '{"chin": [1, 2.5, -3], "M01": [0, 0, 0]}'),
        ("p.toml", "chin = [1, 2.5, -3]\nM01 = [0, 0, 0]"),
        ("p.csv", "name,x,y,z\nchin, 1, 2.5, -3\nM01,0,0,0\n"),
    ],
)
def test_points_are_read_from_small_files(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert read_points(tmp_path / name, PlanError) == {"chin": (1.0, 2.5, -3.0), "M01": (0.0, 0.0, 0.0)}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("p.json", '{"chin": [1, 2]}'),
        ("p.csv", "chin,a,b,c\nnose_tip,1,2,x\n"),
        ("p.toml", "chin ="),
        ("p.txt", ""),
        ("empty.csv", ""),
        ("head.csv", "chin,a,b,c\n"),
        ("empty.json", "{}"),
    ],
)
def test_files_without_points_are_refused_in_one_line(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(PlanError, match="CSV with rows chin,x,y,z"):
        read_points(tmp_path / name, PlanError)


def test_named_points_lie_where_their_names_say():
    rig = sample_rig()
    at = {name: rig.neutral[vertex] for name, vertex in named_vertices(rig).items()}
    assert at["eye_outer_left"][0] > at["eye_inner_left"][0] > 0 > at["eye_inner_right"][0] > at["eye_outer_right"][0]
    assert at["nose_tip"][2] > at["chin"][2]
    assert at["eye_inner_left"][1] > at["nose_tip"][1] > at["mouth_left"][1] > at["chin"][1]
    assert vertex_normals(rig.neutral, rig.triangles)[named_vertices(rig)["nose_tip"]][2] > 0.5


def test_a_pick_far_from_where_the_others_put_it_is_refused_by_name():
    refuse_strays("anna", {"chin": 5.9, "nose_tip": 14.0})
    with pytest.raises(RigError, match=r"'mouth_left' \(48 mm\), 'mouth_right' \(31 mm\). Left and right"):
        refuse_strays("anna", {"mouth_right": 31.2, "chin": 2.0, "mouth_left": 47.8})
