"""Pages for who sets cameras up: every dot in every expression of every camera, and figures as a tape has them."""

import re
from dataclasses import replace as dataclass_replace

import numpy as np
import pypdfium2
import pytest
from msgspec.structs import replace

from capture_plan.camera import cameras_for
from capture_plan.layout.labels import Confusable
from capture_plan.plan.settings import Settings
from capture_plan.sample import sample_rig
from capture_plan.sheets.camera_pages import CameraPages
from capture_plan.sheets.camera_reads import CameraReads, Crop, crop_of, turn_words
from capture_plan.sheets.head import make_head
from capture_plan.sheets.page import Booklet, paper
from capture_plan.visibility import Sight
from tests.once import QUICK, plan_of


@pytest.fixture(scope="module")
def pages():
    plan = plan_of(Settings(cameras="head-mounted-pair", expressions=QUICK.expressions))
    return CameraReads(plan, sample_rig(), make_head(sample_rig()), plan.layout.markers)


@pytest.fixture(scope="module", params=["a4", "letter"])
def drawn(pages, request):
    book = Booklet(paper(request.param), "cameras")
    made = CameraPages(pages, book)
    made.draw(60, book.add_page)
    assert len(book.titles) == made.count()
    return [page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(book.bytes())]


def test_each_camera_has_a_picture_page_and_a_table(pages, drawn):
    for c, camera in enumerate(pages.cameras):
        first, table = drawn[2 * c : 2 * c + 2]
        assert f"Camera: {camera.name}" in first
        assert "Camera" in table
        read = (pages.views.how[:, c] == Sight.READ).all(axis=0).sum()
        assert f"reads {read} of {len(pages.marks)} dots" in first
        for mark in pages.marks:
            assert mark.name in table
        for name in pages.poses:
            assert name in table


def test_the_table_counts_what_is_read(pages, drawn):
    for c in range(len(pages.cameras)):
        counts = (pages.views.how[:, c] == Sight.READ).sum(axis=1).tolist()
        said = re.findall(r"^read\s*([\d\s]+)", drawn[2 * c + 1], re.MULTILINE)
        numbers = [int(number) for number in said[-1].split()] if said else []
        assert numbers[: len(counts)] == counts


def test_what_the_pages_say_is_unread_is_what_the_plan_says(pages):
    how = pages.views.how
    names = ("neutral", *pages.poses)
    here = {(names[e], pages.cameras[c].name, pages.marks[m].name) for e, c, m in np.argwhere(how != Sight.READ)}
    assert here == {(one.pose, one.camera, one.dot) for one in pages.plan.unread}


def test_the_figures_are_those_of_the_preset(pages):
    rows = dict(pages.mounting_rows(1))
    rig = sample_rig()
    boom = np.linalg.norm(cameras_for("head-mounted-pair", rig.neutral, rig.skin)[1].position - pages.philtrum)
    assert rows["Lens to the upper philtrum (below the nose)"].startswith(f"{boom:.0f} mm: ")
    assert "below" in rows["Lens to the upper philtrum (below the nose)"]
    assert re.fullmatch(r"\d+° up", rows["Looks"])
    assert rows["Field of view, across and up"].endswith("50°")
    assert rows["To boom top"].startswith("100 mm apart")
    assert rows["Sharp"] == "not known: state focus_mm, f_number and pixel_um"


def test_how_surely_dots_are_told_apart_is_said_of_each_camera(pages):
    for c, camera in enumerate(pages.cameras):
        (labels,) = (one for one in pages.plan.labels if one.camera == camera.name)
        ((term, words),) = pages.label_rows(c)
        assert labels.dots[0] in words
        assert labels.dots[1] in words
        assert ("told from the others" in term) == (labels.margin_mm > 0)
        close = replace(labels, margin_mm=-0.5, confusable=(Confusable(labels.dots, labels.between, -0.5),))
        worse = dataclass_replace(pages, plan=replace(pages.plan, labels=(close,)))
        assert worse.label_rows(c)[0][1].startswith("1 pair of dots, first of all ")


def test_directions_are_the_actors():
    assert turn_words(12.0, -5.0, 0.0) == ["12° down", "5° towards the actor's right"]
    assert turn_words(0.0, 0.0, 0.0) == ["straight back, level"]


def test_a_small_face_is_cropped_to_with_the_shape_of_the_picture(pages):
    camera = pages.cameras[0]
    small = np.array([[[700.0, 900], [800, 1000]]])
    crop = crop_of(camera, small)
    assert crop.width / crop.height == pytest.approx(camera.size_px[0] / camera.size_px[1])
    assert crop.left < 700 < 800 < crop.left + crop.width
    assert crop.top < 900 < 1000 < crop.top + crop.height
    assert crop_of(camera, np.array([[[0.0, 0], [1400, 1900]]])) == Crop.whole(camera)
    assert crop_of(camera, np.zeros((0, 2, 2))) == Crop.whole(camera)


def test_a_plan_without_cameras_has_no_such_pages(pages):
    bare = replace(pages.plan, cameras=(), unread=())
    reads = CameraReads(bare, pages.rig, pages.head, pages.marks)
    assert CameraPages(reads, Booklet(paper("a4"), "none")).count() == 0
