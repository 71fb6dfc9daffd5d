"""Who sees which vertex: the whole hemisphere, or known cameras; functions of meshes."""

from capture_plan.visibility.hemisphere import global_visibility, hemisphere_visibility

__all__ = ["global_visibility", "hemisphere_visibility"]
