"""The channels, shape, eyes and mouth of a rig that was read: in millimetres and the rig's own axes."""

from capture_plan.face.channels import Channels, find_channels
from capture_plan.face.points import Points, find_points
from capture_plan.face.shape import Shape
from capture_plan.face.votes import names_agree
from capture_plan.once import once
from capture_plan.rig import Rig


@once
def rig_channels(rig: Rig) -> Channels:
    """What every blendshape of a rig moves, and which speak of the face."""
    return find_channels(rig.neutral, rig.triangles, rig.deltas, rig.names)


@once
def rig_shape(rig: Rig) -> Shape:
    """What the shape of a rig tells near its face."""
    return Shape(rig.neutral, rig.triangles, rig.deltas, rig_channels(rig), rig.parts, rig.part_names)


@once
def rig_points(rig: Rig) -> Points:
    """Eyes and mouth of a rig, with their doubt."""
    return find_points(rig_shape(rig), named=names_agree(rig_channels(rig)))
