"""Who sees which vertex: the whole hemisphere, or known cameras; functions of meshes."""

from capture_plan.visibility.all_sides import global_visibility
from capture_plan.visibility.hemisphere import hemisphere_visibility
from capture_plan.visibility.seen import FEWEST_PIXELS, MOST_DEGREES, SEEN, WORDS, Sight, camera_visibility
from capture_plan.visibility.views import Views, camera_views

__all__ = [
    "FEWEST_PIXELS",
    "MOST_DEGREES",
    "SEEN",
    "WORDS",
    "Sight",
    "Views",
    "camera_views",
    "camera_visibility",
    "global_visibility",
    "hemisphere_visibility",
]
