"""Who sees which vertex: the whole hemisphere, or known cameras; functions of meshes."""

from capture_plan.visibility.blind import why_blind
from capture_plan.visibility.camera import Camera, look_at
from capture_plan.visibility.camera_file import read_cameras
from capture_plan.visibility.hemisphere import global_visibility, hemisphere_visibility
from capture_plan.visibility.presets import PRESETS, cameras_for
from capture_plan.visibility.seen import camera_visibility
from capture_plan.visibility.views import FEWEST_PIXELS, Views, camera_views

__all__ = [
    "FEWEST_PIXELS",
    "PRESETS",
    "Camera",
    "Views",
    "camera_views",
    "camera_visibility",
    "cameras_for",
    "global_visibility",
    "hemisphere_visibility",
    "look_at",
    "read_cameras",
    "why_blind",
]
