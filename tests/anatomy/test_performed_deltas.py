"""What a face does when one blendshape is performed: a corrective never comes alone."""

import numpy as np

from capture_plan.anatomy.performed_deltas import performed_deltas
from capture_plan.anatomy.regions import face_regions
from capture_plan.camera import cameras_for
from capture_plan.visibility import camera_views


def test_a_corrective_moves_with_what_it_corrects_and_all_others_alone(rig):
    performed = performed_deltas(rig, rig.names)
    close, jaw = rig.names.index("mouthClose"), rig.names.index("jawOpen")
    assert np.allclose(performed[close], rig.deltas[close] + rig.deltas[jaw])
    others = np.arange(len(rig.names)) != close
    assert np.array_equal(performed[others], rig.deltas[others])


def test_without_what_it_corrects_a_corrective_stays_as_it_is(rig):
    used = tuple(name for name in rig.names if name != "jawOpen")
    rows = rig.rows(used)
    assert np.array_equal(performed_deltas(rig, used), rig.deltas[rows])


def test_rows_follow_the_order_that_was_asked_for(rig):
    used = rig.names[::-1]
    assert np.array_equal(performed_deltas(rig, used)[::-1], performed_deltas(rig, rig.names))


def test_cameras_see_the_upper_lip_of_a_performed_corrective(rig):
    """mouthClose alone pushes the lower lip through it."""
    regions = face_regions(rig)
    lip = np.flatnonzero(regions.of_vertex == regions.names.index("upper lip"))
    cameras = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    row = [rig.names.index("mouthClose")]
    alone, performed = (
        camera_views(rig.neutral, deltas[row], rig.triangles, lip, cameras, dot_mm=2.0).views > 0
        for deltas in (rig.deltas, performed_deltas(rig, rig.names))
    )
    assert alone.mean() < 0.2
    assert performed.mean() > 0.6
