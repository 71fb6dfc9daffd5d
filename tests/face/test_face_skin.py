"""What a face says of its skin: heads of many kinds keep their face and lose clothes and bodies."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.audit.audit import audit_rig
from capture_plan.face.anchors import face_anchors, unlike_eyes
from capture_plan.face.profile import chin_agrees, find_chin
from capture_plan.mesh import vertex_normals
from capture_plan.reader.read import rig_from_raw
from tests.face_family import Truth, raw_rig
from tests.face_heads import (
    Head,
    add,
    bespectacled,
    body,
    bust,
    clothed,
    cut,
    cut_ears,
    haired,
    jewelled,
    one_armed,
    ring,
    sample_head,
    tube,
    visible_skin,
    whole,
)

CHIN = 632.0  # of the sample, whose eyes lie at 734
UPPER_NECK = 734 - 1.45 * (734 - CHIN)  # no marker below


def as_rig(head: Head):
    truth = Truth("+y", "+z", 1.0, head.eye_left, head.eye_right, head.mouth)
    return rig_from_raw(raw_rig(head, truth, (1.0, "+y", "+z")))


def hooded(head: Head) -> Head:
    """A shirt of its own whose collar stands up around the neck, before the chin's height."""
    shape = [ring(64, 60, 640, 22), ring(70, 62, 610, 20), ring(130, 85, 560, 20), ring(170, 95, 380, 20)]
    return add(bust(head), tube(shape), "Outfit")


def of_one_name(head: Head) -> Head:
    """All parts in one mesh without a name that says anything."""
    return replace(head, parts=np.zeros_like(head.parts), part_names=("mesh",))


@pytest.mark.parametrize("kind", [bust, body, clothed, one_armed, hooded, lambda head: of_one_name(hooded(head))])
def test_no_marker_goes_on_clothes_or_a_body(kind):
    rig = as_rig(kind(sample_head()))
    assert rig.neutral[rig.skin, 1].min() > UPPER_NECK
    garment = np.arange(len(rig.neutral)) >= len(sample_head().neutral)
    assert (rig.skin & garment & (rig.neutral[:, 1] < 600)).sum() == 0


@pytest.mark.parametrize("kind", [whole, bust, body, clothed, hooded, haired, bespectacled, jewelled, cut_ears])
def test_the_face_is_skin_whatever_is_worn(kind):
    head = sample_head()
    rig, plain = as_rig(kind(head)), as_rig(head)
    face = plain.neutral[plain.skin & (plain.neutral[:, 1] > CHIN) & (plain.neutral[:, 2] > 90)]
    retained = {tuple(point) for point in rig.neutral[rig.skin].round(2)}
    assert np.mean([tuple(point) in retained for point in face.round(2)]) > 0.97


def test_a_head_that_ends_with_its_neck_is_left_whole():
    rig = as_rig(sample_head())
    assert rig.neutral[rig.skin, 1].min() < sample_head().neutral[sample_head().of("skin"), 1].min() + 1


def test_a_collar_goes_with_its_shirt():
    """A collar as high as the chin is no skin, although it lies above the upper neck."""
    rig = as_rig(hooded(sample_head()))
    collar = rig.parts == rig.part_names.index("Outfit")
    assert (rig.neutral[collar, 1] > CHIN).any()
    assert not rig.skin[collar].any()


# ---------------------------------------------------------------- faces of separate pieces
NAMES = ("blink_L", "blink_R", "brow_up", "aa", "smile", "look_left", "look_right", "brow_down")


def drawn() -> Head:
    """A still head with lids, brows and lips drawn over it as thin plates, and irises that look about."""
    still = replace(sample_head(), names=NAMES, deltas=np.zeros((8, len(sample_head().neutral), 3), dtype=np.float32))
    still = cut(still, still.of("skin"))
    for side, blink in ((1, 0), (-1, 1)):
        x, y, z = side * 30.1, 734.4, 136.0
        still = add_plate(still, "lids", (x, y + 6, z), (13, 4), {blink: (0, -9, 0)})
        still = add_plate(still, "irises", (x, y - 4, z - 1), (6, 7), {blink: (0, -4, 0), 5: (3, 0, 0), 6: (-3, 0, 0)})
        still = add_plate(still, "brows", (x, y + 22, z + 6), (14, 2), {2: (0, 6, 0), 7: (0, -6, 0)})
    return add_plate(still, "lips", (0.0, 669.1, 150.0), (20, 2), {3: (0, -9, 0), 4: (0, 3, 0)})


def add_plate(head: Head, part: str, middle, half, moves: dict[int, tuple[float, float, float]]) -> Head:
    """A flat plate of 7 by 5 vertices; what moves it moves its upper half furthest, a look the whole of it."""
    x, y = (np.linspace(-h, h, n) for h, n in zip(half, (7, 5), strict=True))
    grid = np.stack([*np.meshgrid(x, y), np.zeros((5, 7))], axis=-1).reshape(-1, 3)
    corner = (7 * np.arange(4)[:, None] + np.arange(6)).ravel()
    triangles = np.concatenate(
        [np.stack([corner, corner + 1, corner + 8], 1), np.stack([corner, corner + 8, corner + 7], 1)]
    )
    deltas = np.zeros((len(head.names), 35, 3), dtype=np.float32)
    for k, d in moves.items():
        share = np.ones(35) if d[0] else 0.2 + 0.4 * (1 + grid[:, 1] / half[1])
        deltas[k] = share[:, None] * d
    return add(head, (grid + middle, triangles), part, deltas)


def skin_share(rig, part: str) -> float:
    return rig.skin[rig.parts == rig.part_names.index(part)].mean()


def test_a_drawn_face_is_skin_without_its_irises():
    """Plates that a movement moves alone are skin; what a sideways look moves is an eye."""
    rig = as_rig(drawn())
    assert [skin_share(rig, part) for part in ("lids", "brows", "lips")] == [1, 1, 1]
    assert skin_share(rig, "irises") == 0
    planned = set(audit_rig(rig).used)
    assert {"blink_L", "blink_R", "brow_up", "aa", "smile"} <= planned
    assert not planned & {"look_left", "look_right"}


def test_the_skin_behind_drawn_brows_is_skin_and_they_are_no_part_of_the_lids():
    """VRoid heads have brows of their own just before the skin: a hole behind them would run into the eye's."""
    head = sample_head()
    x, y, z = head.neutral.T
    behind = visible_skin(head) & (y > 738) & (y < 768) & (np.abs(x) > 14) & (np.abs(x) < 46) & (z > 95)
    brows = cut(head, behind)
    before = brows.neutral + 0.7 * vertex_normals(brows.neutral, brows.triangles)
    rig, plain = as_rig(add(head, (before, brows.triangles), "brows", 3 * brows.deltas)), as_rig(head)
    assert rig.skin[: len(head.neutral)][behind].all()
    assert np.linalg.norm(face_anchors(rig).eye_left - face_anchors(plain).eye_left) < 2


def test_a_lash_line_that_goes_with_a_lid_is_no_skin():
    """A strip that the blink moves less than the lid behind it."""
    head = sample_head()
    blink = head.names.index("eyeBlinkLeft")
    rig = as_rig(add_plate(head, "strip", (30.1, 740.0, 138.0), (12, 1), {blink: (0, -6, 0)}))
    assert skin_share(rig, "strip") == 0


def test_a_face_around_the_eyes_is_skin_although_it_is_called_eye():
    """The band of the face from brow to cheek in a mesh called eye, as avatars of several meshes have it."""
    head = sample_head()
    _, y, z = head.neutral.T
    band = head.of("skin") & (y > 715) & (y < 770) & (z > 60)
    named = replace(
        head,
        parts=np.where(band, len(head.part_names), head.parts).astype(np.int32),
        part_names=(*head.part_names, "EYE"),
    )
    rig, plain = as_rig(named), as_rig(head)
    assert (rig.skin != plain.skin).mean() < 0.01


# ---------------------------------------------------------------- the chin
@pytest.mark.parametrize("kind", [whole, bust, body, clothed, hooded])
def test_the_chin_is_the_jaws_whatever_stands_out_below(kind):
    anchors = face_anchors(as_rig(kind(sample_head())))
    assert np.linalg.norm(anchors.chin - [0.0, 632.1, 136.8]) < 2
    assert anchors.chin_sure


def test_a_profile_ends_at_the_throat():
    """What comes further forward below the throat, a chest, is no chin."""
    y = np.arange(0.0, -130.0, -2.0)
    face, throat = 100.0 * (y > -62), 55.0 * (y <= -62)
    points = np.stack([np.zeros_like(y), y, face + throat + np.where(y < -85, 70.0, 0.0)], axis=1)
    e, m = np.array([0.0, 70.0, 90.0]), np.array([0.0, 0.0, 100.0])
    chin = find_chin(points, e, m, 62.0)
    assert chin is not None
    assert chin[1] == -60.0


def test_a_chin_that_stays_when_the_jaw_opens_is_not_sure():
    e, m, chin = np.array([0.0, 70.0, 90.0]), np.array([0.0, 0.0, 100.0]), np.array([0.0, -40.0, 98.0])
    assert chin_agrees(chin, e, m, None)
    assert chin_agrees(chin, e, m, np.array([0.0, -0.8, -0.3]))
    assert not chin_agrees(chin, e, m, np.array([0.0, -0.2, 0.0]))
    assert not chin_agrees(chin, e, m, np.array([0.0, 0.8, 0.0]))
    assert not chin_agrees(chin - [0, 40, 0], e, m, None)  # a collar


# ---------------------------------------------------------------- what is said
@pytest.mark.parametrize(("kind", "said"), [(bust, True), (clothed, False), (whole, False)])
def test_skin_that_is_left_to_the_body_is_told(kind, said):
    assert ("below the upper neck" in as_rig(kind(sample_head())).note) == said


def test_eyes_that_are_no_mirror_images_of_each_other_speak_against_themselves():
    eyes = np.array([[32.0, 10, 40], [-32.0, 10, 40]])
    assert unlike_eyes(eyes, 0.0) == ()
    (sign,) = unlike_eyes(eyes + np.array([[0, 5, 0], [0, 0, 0]]), 0.0)
    assert sign.weight < 0
    assert "5 mm" in sign.says
