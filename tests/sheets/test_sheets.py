"""Sheets measure true, show each marker where it projects, and come out the same every time."""

import ctypes
import dataclasses
import io

import numpy as np
import pypdfium2
import pytest
import zxingcpp
from msgspec.structs import fields, replace
from PIL import Image

from capture_plan.anatomy.regions import face_regions
from capture_plan.audit.audit import Audit
from capture_plan.errors import PlanError
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.session import session
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.layout.record import Information, Landmark, Layout
from capture_plan.plan.consent import Consent
from capture_plan.plan.record import FORMAT_VERSION, Plan, RigReference, number_of
from capture_plan.plan.settings import Settings
from capture_plan.sheets import expression_pictures, marker_pictures, region_looks, write_sheets
from capture_plan.sheets.expression_page import (
    arrows_of,
    close_up,
    heat_colours,
    heat_scale,
    moved_side,
    movement,
    portrait,
)
from capture_plan.sheets.furniture import CHECK_BAR_MM
from capture_plan.sheets.head import curved_middles, make_head, pose, split_triangles
from capture_plan.sheets.markers import MarkedFace, draw_markers, place_all, seen_angle
from capture_plan.sheets.page import PAPERS, Booklet, paper
from capture_plan.sheets.style import LOOKS, outline, rgb
from capture_plan.sheets.tape import tape_points
from capture_plan.sheets.view import FRONT, LEFT, RIGHT, picture, pixels

ODD = "<b>&amp;日本 مرحبا\n\x07%"
DPI = 50


def landmark(rig, number: int, vertex: int, label: str | None = None) -> Landmark:
    regions = face_regions(rig)
    triangle = int(np.flatnonzero((rig.triangles == vertex).any(axis=1))[0])
    return Landmark(
        name=f"M{number + 1:02}",
        label=label or regions.label(vertex),
        region=regions.names[regions.of_vertex[vertex]],
        side=("middle", "left", "right")[int(regions.side[vertex])],
        role="primary",
        vertex=vertex,
        source_vertex=int(rig.source_index[vertex]),
        position=tuple(map(float, rig.neutral[vertex])),
        triangle=triangle,
        barycentric=tuple(map(float, rig.triangles[triangle] == vertex)),
        blendshapes=rig.names[:3],
        quality=0.5,
        visibility=0.9,
        round=0,
    )


def spread_vertices(rig, n: int) -> list[int]:
    """Skin vertices that move and face forward, each as far as can be from those before."""
    candidates = np.flatnonzero(rig.skin & (rig.displacement.max(axis=0) > 2) & (rig.neutral[:, 2] > 95))
    chosen = [int(candidates[rig.neutral[candidates, 2].argmax()])]
    while len(chosen) < n:
        apart = np.linalg.norm(rig.neutral[candidates, None] - rig.neutral[chosen], axis=2).min(axis=1)
        chosen.append(int(candidates[apart.argmax()]))
    return chosen


def expression(name: str, sentence: str, covered: float, *blendshapes: str) -> Expression:
    return Expression(name, blendshapes, (1.0,) * len(blendshapes), gain=0.5, covered=covered, sentence=sentence)


def make(rig, *, label: str | None = None) -> Plan:
    landmarks = tuple(landmark(rig, i, v, label) for i, v in enumerate(spread_vertices(rig, 24)))
    expressions = (
        expression("jaw", "Open your jaw wide.", 0.5, "jawOpen"),
        expression("smile", label or "Smile with one side.", 1.0, "mouthSmileLeft"),
    )
    information = Information(landmarks=24, rank=40, full_rank=51, condition=12.0, noise_mm=0.2, error_mm=0.3)
    packing = partly(Packing, expressions=expressions, objective=2, bound=2, proven_optimal=True)
    return Plan(
        format=FORMAT_VERSION,
        rig=RigReference(rig.name, "sample", rig.fingerprint, len(rig.neutral)),
        settings=Settings(),
        audit=partly(Audit, used=rig.names),
        layout=partly(Layout, method="studio", landmarks=landmarks, information=information),
        packing=packing,
        session=session(rig, rig.names, packing, SessionSettings()),
        versions={},
    )


def partly(kind, **known):
    """A record with nothing in the fields that no sheet reads."""
    return kind(**{field.name: known.get(field.name, ()) for field in fields(kind)})


@pytest.fixture(scope="module")
def plan(rig):
    return make(rig)


@pytest.fixture(scope="module")
def face(rig, plan):
    landmarks = plan.layout.landmarks
    posed = pose(make_head(rig), rig.neutral)
    return MarkedFace(posed, rig.skin, landmarks, region_looks(landmarks), face_regions(rig).anchors)


@pytest.fixture(scope="module")
def written(rig, plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sheets")
    return write_sheets(plan, rig, folder, paper="a4", dpi=DPI)


@pytest.fixture(scope="module")
def pages(face):
    return place_all(face, Booklet(PAPERS["a4"], "test"), dpi=100)[0]


def drawn(page, face):
    """A page of markers as pixels, 150 an inch."""
    book = Booklet(PAPERS["a4"], "test")
    book.add_page("test")
    draw_markers(book, page, face)
    return np.asarray(pypdfium2.PdfDocument(book.bytes())[0].render(scale=150 / 72).to_pil()).astype(int)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_landmark_is_drawn_in_its_regions_colour_with_a_light_point_in_its_middle(face, pages, mirrored):
    shown = 0
    for page in pages:
        page = page.mirrored(210) if mirrored else page
        pixels_of_page = drawn(page, face)
        for mark, (x, y) in zip(page.landmarks, page.points, strict=True):
            column, row = int(x / 25.4 * 150), int(y / 25.4 * 150)
            around = pixels_of_page[row - 6 : row + 7, column - 6 : column + 7].reshape(-1, 3)
            of_region = np.abs(around - rgb(face.looks[mark.region].colour)).max(axis=1) < 12
            assert of_region.sum() > 20
            assert pixels_of_page[row, column].min() > 150
            shown += 1
    assert shown == len(face.landmarks)


def test_a_life_size_page_shows_a_millimetre_as_a_millimetre(pages):
    assert {page.scale for page in pages} == {1.0}
    for page in pages:
        real = page.view.project(np.array([m.position for m in page.landmarks]))[:, :2]
        on_page = page.points * np.array([1, -1])
        np.testing.assert_allclose(on_page - on_page[0], real - real[0], atol=1e-6)


def test_the_surface_seen_at_a_landmarks_pixel_is_as_deep_as_the_landmark(face, pages):
    for page in pages:
        frame = page.picture.frame
        shown = picture(face.solid, page.view, frame, size_px=pixels(frame.width, frame.height, 200))
        places = page.view.project(np.array([m.position for m in page.landmarks]))
        column, row = np.floor(shown.pixel(places)).astype(int).T
        assert np.abs(shown.z[row, column] - places[:, 2]).max() < 1.5


def test_a_marker_behind_the_head_is_on_no_page_and_said(rig, face):
    behind = int(np.where(rig.skin, rig.neutral[:, 2], np.inf).argmin())
    marks = (*face.landmarks, landmark(rig, 99, behind))
    more = MarkedFace(face.posed, rig.skin, marks, region_looks(marks), face.anchors)
    shown, hidden = place_all(more, Booklet(PAPERS["a4"], "test"), dpi=60)
    assert [m.name for m in hidden] == ["M100"]
    assert "M100" not in {m.name for page in shown for m in page.landmarks}


@pytest.mark.parametrize("many", [10, 34, 120])
def test_every_marker_is_on_one_page_at_life_size_and_its_number_is_read_for_no_other(rig, face, many):
    marks = tuple(landmark(rig, i, v) for i, v in enumerate(spread_vertices(rig, many)))
    regions = face_regions(rig)
    rings = {m.name: 0.5 + 0.1 * (i % 20) for i, m in enumerate(marks)}
    crowd = MarkedFace(
        face.posed, rig.skin, marks, region_looks(marks), regions.anchors, tape_points(rig, regions), rings
    )
    book = Booklet(PAPERS["a4"], "test")
    shown, hidden = place_all(crowd, book, dpi=40)
    names = [m.name for page in shown for m in page.landmarks]
    assert sorted(names + [m.name for m in hidden]) == sorted(m.name for m in marks)
    assert {page.scale for page in shown} == {1.0}
    for page in shown:
        half = np.array([book.width("M001" if many > 99 else "M01", 12, bold=True), 2.6]) / 2
        away = np.maximum(np.abs(page.points[:, None] - page.numbers.middle[None]) - half, 0)
        assert (np.linalg.norm(away, axis=2).argmin(axis=0) == np.arange(len(page.points))).all()
        assert len({(row.x, row.y) for row in page.rows}) == len(page.rows)
        for on_left in (True, False):
            y = sorted(row.y for row in page.rows if row.on_left == on_left)
            assert (np.diff(y) > 7.1).all()


def test_the_mirror_page_mirrors_picture_and_places(pages):
    page = pages[0]
    mirror = page.mirrored(210)
    np.testing.assert_allclose(mirror.points[:, 0], 210 - page.points[:, 0])
    places = mirror.view.project(np.array([m.position for m in mirror.landmarks]))
    frame = mirror.picture.frame
    x = mirror.corner[0] + (places[:, 0] - frame.left) / mirror.scale
    np.testing.assert_allclose(x, mirror.points[:, 0], atol=1e-6)
    assert (page.picture.rgb[:, ::-1] == mirror.picture.rgb).all()


def test_the_subjects_left_is_on_the_right_of_the_front_page(face):
    front = place_all(face, Booklet(PAPERS["a4"], "test"), dpi=60)[0][0]
    assert front.view == FRONT
    for mark, point in zip(front.landmarks, front.points, strict=True):
        if mark.side != "middle":
            assert (point[0] > 105) == (mark.side == "left")


@pytest.mark.parametrize(("name", "size"), [("a4", (210.0, 297.0)), ("letter", (215.9, 279.4))])
def test_pages_have_the_size_of_the_paper(name, size):
    book = Booklet(PAPERS[name], "test")
    book.add_page("test")
    page = pypdfium2.PdfDocument(book.bytes())[0]
    assert np.array(page.get_size()) * 25.4 / 72 == pytest.approx(size, abs=0.01)


def test_the_check_bar_is_50_mm_long_in_the_pdf(written):
    """The end strokes are the only thin verticals 4.1 mm high; their distance is taken in the units of the page."""
    page = pypdfium2.PdfDocument(written[0])[0]
    boxes = [np.array(each.get_bounds()) * 25.4 / 72 for each in page.get_objects(filter=[2])]
    ends = [box for box in boxes if box[2] - box[0] < 0.5 and abs(box[3] - box[1] - 4.1) < 0.6]
    centres = sorted((box[0] + box[2]) / 2 for box in ends)
    assert centres[-1] - centres[0] == pytest.approx(CHECK_BAR_MM, abs=0.02)
    assert pytest.approx(50.0) == CHECK_BAR_MM


def test_what_is_written_is_one_pdf_and_a_png_of_each_page(written):
    pdf = pypdfium2.PdfDocument(written[0])
    assert written[0].name == "sheets.pdf"
    markers = [path for path in written[1:] if "markers-" in path.name]
    assert len(pdf) == len(written) - 1 == len(markers) + 7  # table, card, list, overview, two expressions, maps
    assert len([path for path in markers if "-mirror" in path.name]) == len(markers) / 2
    for path in written[1:]:
        with Image.open(path) as image:
            assert image.size == pytest.approx((210 / 25.4 * DPI, 297 / 25.4 * DPI), abs=1)


def test_pages_say_whose_left_and_name_every_marker(written, plan):
    pdf = pypdfium2.PdfDocument(written[0])
    front, table, page = (pdf[i].get_textpage().get_text_range() for i in (0, len(pdf) - 7, len(pdf) - 3))
    assert "ACTOR'S LEFT" in front
    assert "ACTOR'S RIGHT" in front
    assert all(mark.name in table for mark in plan.layout.landmarks)
    assert "Open your jaw wide." in page
    assert "Shot " in page


def test_what_was_agreed_stands_on_page_one_alone(rig, plan, written, tmp_path):
    agreed = replace(plan.settings, consent=Consent(purpose="a game", holder="Studio", keep_until="2027-01-31"))
    pdf = write_sheets(replace(plan, settings=agreed), rig, tmp_path, paper="a4", dpi=DPI)[0]
    of = [page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(pdf)]
    lines = ("Purpose: a game", "Held by: Studio", "Keep until: 2027-01-31")
    assert [[line in text for line in lines] for text in of] == [[n == 0] * 3 for n in range(len(of))]
    assert "Purpose" not in pypdfium2.PdfDocument(written[0])[0].get_textpage().get_text_range()


def test_the_same_plan_gives_the_same_bytes(rig, plan, written, tmp_path):
    again = write_sheets(plan, rig, tmp_path, paper="a4", dpi=DPI)
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in written]


def test_odd_names_are_printed_as_they_are(rig, tmp_path):
    pdf = pypdfium2.PdfDocument(write_sheets(make(rig, label=ODD), rig, tmp_path, paper="letter", dpi=30)[0])
    assert "<b>&amp;" in pdf[len(pdf) - 7].get_textpage().get_text_range()


def test_a_plan_of_another_rig_is_refused_and_nothing_written(rig, plan, tmp_path):
    other = replace(plan, rig=replace(plan.rig, fingerprint="0" * 16))
    with pytest.raises(PlanError, match="plan again or give that rig"):
        write_sheets(other, rig, tmp_path / "new", dpi=30)
    assert not (tmp_path / "new").exists()


def test_an_unknown_paper_and_an_unusable_folder_are_refused(rig, plan, tmp_path):
    with pytest.raises(PlanError, match="choose one of a4, letter"):
        paper("a5")
    (tmp_path / "file").write_text("")
    with pytest.raises(PlanError, match="choose another place"):
        write_sheets(plan, rig, tmp_path / "file", dpi=30)


def test_pictures_have_the_height_asked_for_and_the_markers_on_them(rig, plan, face):
    shots, marks = expression_pictures(plan, rig, height_px=160), marker_pictures(plan, rig, height_px=400)
    assert set(shots) == {"jaw", "smile"}
    assert all(image.height == 160 for shot in shots.values() for image in shot[:3])
    assert set(marks) == {"front", "left", "right"}
    image = np.asarray(marks["front"]).astype(int)
    frame = portrait(rig, face.anchors, FRONT, image.shape[1] / image.shape[0])
    x, y, _ = FRONT.project(face.positions[:1])[0]
    row = int((frame.top - y) / frame.height * image.shape[0])
    column = int((x - frame.left) / frame.width * image.shape[1])
    assert np.abs(image[row, column] - rgb(face.looks[face.landmarks[0].region].colour)).max() < 12


def test_an_expression_differs_from_the_neutral_only_where_it_moves(rig, plan):
    vertices, moved = movement(rig, plan.packing.expressions[0])
    np.testing.assert_allclose(np.linalg.norm(vertices - rig.neutral, axis=1), moved)
    np.testing.assert_allclose(moved, rig.displacement[rig.names.index("jawOpen")], atol=1e-5)
    assert heat_scale(rig, moved) >= moved[rig.skin].max()


def test_a_one_sided_expression_is_told_by_the_subjects_side(rig, face):
    moved = dict(zip(rig.names, rig.displacement, strict=True))
    assert moved_side(rig, face.anchors, moved["mouthSmileLeft"]) == "left"
    assert moved_side(rig, face.anchors, moved["mouthSmileRight"]) == "right"
    assert moved_side(rig, face.anchors, moved["jawOpen"]) is None


def test_more_movement_is_darker():
    brightness = heat_colours(np.linspace(0.1, 1, 30)) @ np.array([0.2126, 0.7152, 0.0722])
    assert (np.diff(brightness) < 0).all()


def test_splitting_keeps_vertices_and_doubles_every_edge():
    finer = split_triangles(np.array([[0, 1, 2], [0, 2, 3]]), 4)
    assert finer.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    assert len(finer.triangles) == 8
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    normals = np.tile([0.0, 0, 1], (4, 1))
    np.testing.assert_allclose(curved_middles(flat, normals, finer.edges), flat[finer.edges].mean(axis=1))


def test_a_split_edge_of_a_ball_bulges_towards_the_ball():
    ends = np.array([[1.0, 0, 0], [np.cos(0.6), np.sin(0.6), 0]])
    radius = np.linalg.norm(curved_middles(ends, ends, np.array([[0, 1]]))[0])
    assert np.cos(0.3) < radius < 1.03


def test_no_two_regions_look_alike_even_in_grey():
    shapes = [look.shape for look in LOOKS.values()]
    assert len(set(shapes)) == len(shapes)
    assert all(np.abs(outline(shape)).max() < 1.6 for shape in shapes)


def test_unknown_regions_take_free_looks(rig, plan):
    first, *others = plan.layout.landmarks
    looks = region_looks([replace(first, region="tail"), *others])
    assert len({look.shape for look in looks.values()}) == len(looks)
    assert "tail" in looks


def test_the_picture_of_a_page_is_a_jpeg_in_the_pdf_at_full_resolution(written):
    with Image.open(io.BytesIO(written[1].read_bytes())) as image:
        assert image.mode == "RGB"


def test_the_left_three_quarter_brings_the_subjects_left_nearer_to_the_viewer():
    cheeks = np.array([[60.0, 0, 80], [-60.0, 0, 80]])
    assert LEFT.project(cheeks)[0, 2] > LEFT.project(cheeks)[1, 2]
    assert RIGHT.project(cheeks)[0, 2] < RIGHT.project(cheeks)[1, 2]
    np.testing.assert_allclose(LEFT.rotation @ LEFT.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(LEFT.rotation) == pytest.approx(1)


@pytest.mark.parametrize(("page", "left_is_on_the_right"), [(0, True), (1, False), (2, True), (3, False)])
def test_actors_left_stands_on_the_side_where_the_actors_left_is_drawn(written, page, left_is_on_the_right):
    text = pypdfium2.PdfDocument(written[0])[page].get_textpage()
    width = 210 / 25.4 * 72
    top, bottom = (297 - 25) / 25.4 * 72, (297 - 31.5) / 25.4 * 72
    first = text.get_text_bounded(left=0, right=width / 2, bottom=bottom, top=top)
    second = text.get_text_bounded(left=width / 2, right=width, bottom=bottom, top=top)
    assert ("LEFT" in second, "RIGHT" in first) == (left_is_on_the_right, left_is_on_the_right)
    assert ("RIGHT" in second, "LEFT" in first) == (not left_is_on_the_right, not left_is_on_the_right)


def test_each_movement_has_an_arrow_from_where_the_skin_was_to_where_it_goes(rig, face):
    shown = expression("both", "Open and smile.", 1.0, "jawOpen", "mouthSmileLeft", "mouthSmileRight")
    vertices, _ = movement(rig, shown)
    arrows = arrows_of(rig, shown, vertices, face.posed.normals, face.anchors)
    assert len(arrows) == 3
    jaw, *smiles = sorted(arrows, key=lambda arrow: abs(arrow[0, 0]))
    assert abs(jaw[0, 0]) < 3  # in the middle
    assert jaw[1, 1] < jaw[0, 1] - 20  # downwards
    one, other = (arrow * [np.sign(arrow[0, 0]), 1] for arrow in smiles)
    assert one == pytest.approx(other, abs=1.0)  # mirror images
    still = expression("still", "Rest.", 1.0, "jawOpen")
    assert len(arrows_of(rig, still, rig.neutral, face.posed.normals, face.anchors)) == 0


@pytest.mark.parametrize("view", [FRONT, LEFT])
def test_a_close_up_shows_eyes_and_chin_and_an_open_jaw(face, view):
    frame, a = close_up(face.anchors, view, 0.7), face.anchors
    for place in (a.eye_left, a.eye_right, a.mouth, a.chin - [0, 0.6 * a.pupils, 0]):
        x, y, _ = view.project(place[None])[0]
        assert frame.left < x < frame.right
        assert frame.bottom < y < frame.top
    assert (a.pupils / frame.width) > 0.3  # the face, not the head


def test_every_letter_on_every_page_is_seven_points_or_more(written):
    for page in pypdfium2.PdfDocument(written[0]):
        for each in page.get_objects(filter=[1]):
            assert pdfium_size(each) >= 6.99


def pdfium_size(text):
    """Size of a text object on paper, points."""
    size = ctypes.c_float()
    assert pypdfium2.raw.FPDFTextObj_GetFontSize(text.raw, size)
    return size.value * abs(text.get_matrix().d)


def test_a_head_larger_than_the_paper_takes_more_pages_at_life_size_and_a_giant_another_scale(rig, face):
    def scaled(by):
        large = dataclasses.replace(rig, neutral=by * rig.neutral, deltas=np.float32(by) * rig.deltas)
        marks = tuple(landmark(large, i, m.vertex, m.label) for i, m in enumerate(face.landmarks))
        posed = pose(make_head(large), large.neutral)
        shown = MarkedFace(posed, large.skin, marks, region_looks(marks), face_regions(large).anchors)
        return place_all(shown, Booklet(PAPERS["a4"], "test"), dpi=20)[0]

    pages = scaled(1.6)
    assert {page.scale for page in pages} == {1.0}
    assert len(pages) > len({page.view for page in pages})
    assert sum(len(page.landmarks) for page in pages) == len(face.landmarks)
    assert len({page.scale for page in scaled(30.0)}) == 1
    assert scaled(30.0)[0].scale > 1


def test_a_telephone_reads_on_every_marker_page_which_plan_it_is_of(rig, plan, tmp_path):
    write_sheets(plan, rig, tmp_path, dpi=200)
    for page in sorted((tmp_path / "pages").glob("*-markers-*.png")):
        (code,) = zxingcpp.read_barcodes(Image.open(page).convert("L"))
        assert code.text == f"capture-plan: plan {number_of(plan)} of {rig.name}"


@pytest.mark.parametrize(("angle", "thick"), [(45, {"ne", "sw"}), (-45, {"nw", "se"})])
def test_a_ring_is_thick_in_the_direction_that_is_asked_for(angle, thick):
    book = Booklet(paper("a4"), "ring", ())
    book.add_page("ring")
    book.ring(100, 100, 10, colour="#000000")
    book.thick_ends(100, 100, 10, angle, colour="#000000")
    dark = np.asarray(pypdfium2.PdfDocument(book.bytes())[0].render(scale=10).to_pil().convert("L")) < 128
    px = 10 * 72 / 25.4
    corner = {"nw": (-1, -1), "ne": (1, -1), "sw": (-1, 1), "se": (1, 1)}

    def ink(x, y):
        row, column = round((100 + 7.07 * y) * px), round((100 + 7.07 * x) * px)
        return dark[row - 25 : row + 25, column - 25 : column + 25].sum()

    inks = {name: ink(*way) for name, way in corner.items()}
    assert min(inks[name] for name in thick) > 2 * max(inks[name] for name in set(corner) - thick)


def test_a_direction_leads_on_the_page_where_it_leads_on_the_face():
    up_and_left = (0.6, 0.8, 0.0)  # the subject's own left is on the page's right
    assert seen_angle(up_and_left, FRONT) == pytest.approx(np.degrees(np.arctan2(0.8, 0.6)))
    assert seen_angle(up_and_left, dataclasses.replace(FRONT, mirrored=True)) == pytest.approx(
        180 - np.degrees(np.arctan2(0.8, 0.6))
    )
    assert seen_angle((0.0, 0.1, 0.99), FRONT) is None
    assert seen_angle(None, FRONT) is None


def test_what_moves_both_sides_alike_has_an_arrow_on_each_and_what_comes_forward_is_shown_from_the_side(rig, face):
    shown = expression("puff", "Raise your brows and puff out your cheeks.", 1.0, "browInnerUp", "cheekPuff")
    vertices, _ = movement(rig, shown)
    front, side = (arrows_of(rig, shown, vertices, face.posed.normals, face.anchors, v) for v in (FRONT, LEFT))
    assert (front[:, 1, 1] > front[:, 0, 1]).all()  # brows, up; no cheeks
    assert len(front) == 1  # the two would lie too near to each other
    assert abs(front[0, 0, 0] - face.anchors.midline) < 8
    assert len(side) == 2  # a cheek on each side
