"""Where the nodes of an FBX scene put their meshes, and what its axes and unit are.

World    W = W_parent T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1, in which T, S, the offsets and pivots are those
         of the node's properties and R turns by its angles in its rotation order (FBX SDK, "Computing transformation
         matrices"); Rpre, Rpost and the order count only where RotationActive is set
Mesh     W G, where G is the node's geometric translation, rotation and scaling, which its children do not inherit
Axes     UpAxis, FrontAxis and CoordAxis (to the viewer's right), each with a sign; a left-handed file is mirrored
Unit     UnitScaleFactor is in centimetres

A scale that the parent's segment does not hand on (InheritType 2) is handed on here.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.formats.fbx_file import Node

ORDERS = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx", "xyz")  # RotationOrder 0 to 5, first letter turned first; 6 spheric
MM_PER_CM = 10.0


def properties(node: Node) -> dict[str, tuple]:
    """Values of the node's Properties70, each called by its name."""
    rows = (p.values for p in node.child("Properties70").all("P"))
    return {str(values[0]): values[4:] for values in rows if values}


def number_property(props: dict[str, tuple], name: str, default: float) -> float:
    """A property that is one number."""
    values = props.get(name, ())
    return float(values[0]) if values and isinstance(values[0], int | float) else default


def triple(props: dict[str, tuple], name: str, default: float = 0.0) -> Float[np.ndarray, " 3"]:
    """A property that is three numbers."""
    values = props.get(name, ())[:3]
    if len(values) < 3 or not all(isinstance(value, int | float) for value in values):
        return np.full(3, default)
    return np.array(values, dtype=np.float64)


def _moved(t: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "4 4"]:
    """The matrix of a translation by t."""
    M = np.eye(4)
    M[:3, 3] = t
    return M


def _turned(degrees: Float[np.ndarray, " 3"], order: str = "xyz") -> Float[np.ndarray, "4 4"]:
    """Rotation by the angles about x, y and z, in this order about fixed axes."""
    M = np.eye(4)
    if np.isfinite(degrees).all():
        M[:3, :3] = Rotation.from_euler(order, degrees[["xyz".index(axis) for axis in order]], degrees=True).as_matrix()
    return M


def scaled(s: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "4 4"]:
    """Scaling by s along the axes."""
    return np.diag([*s, 1.0])


def local_matrix(props: dict[str, tuple]) -> Float[np.ndarray, "4 4"]:
    """T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1 of the module's docstring."""
    active = number_property(props, "RotationActive", 0.0) != 0
    order = ORDERS[int(np.clip(number_property(props, "RotationOrder", 0.0), 0, 6))] if active else "xyz"
    pre, post = (_turned(triple(props, name)) if active else np.eye(4) for name in ("PreRotation", "PostRotation"))
    Rp, Sp = triple(props, "RotationPivot"), triple(props, "ScalingPivot")
    return (
        _moved(triple(props, "Lcl Translation") + triple(props, "RotationOffset") + Rp)
        @ pre
        @ _turned(triple(props, "Lcl Rotation"), order)
        @ post.T
        @ _moved(triple(props, "ScalingOffset") + Sp - Rp)
        @ scaled(triple(props, "Lcl Scaling", 1.0))
        @ _moved(-Sp)
    )


def geometric_matrix(props: dict[str, tuple]) -> Float[np.ndarray, "4 4"]:
    """G of the module's docstring."""
    return (
        _moved(triple(props, "GeometricTranslation"))
        @ _turned(triple(props, "GeometricRotation"))
        @ scaled(triple(props, "GeometricScaling", 1.0))
    )


def ancestry(model: int, parent_of: dict[int, int]) -> list[int]:
    """The node `model`, the one above it, and so on. RigError when it is its own ancestor."""
    chain = [model]
    while (parent := parent_of.get(chain[-1])) is not None:
        if parent == model or len(chain) > len(parent_of):
            raise RigError("has a node that lies inside itself: export it again")
        chain.append(parent)
    return chain


def world_matrix(model: int, models: dict[int, Node], parent_of: dict[int, int]) -> Float[np.ndarray, "4 4"]:
    """W of the node `model`. RigError when it is its own ancestor."""
    W = np.eye(4)
    for node in reversed(ancestry(model, parent_of)):
        W = W @ local_matrix(properties(models[node]))
    return W


def axes(settings: dict[str, tuple]) -> tuple[Float[np.ndarray, "4 4"], str | None, str | None]:
    """The mirror that makes the file right-handed (usually none), and its up and front: None where it does not say."""
    ways = []
    for name in ("CoordAxis", "UpAxis", "FrontAxis"):
        axis, sign = number_property(settings, name, -1.0), number_property(settings, f"{name}Sign", 1.0)
        if axis not in (0, 1, 2) or sign not in (-1, 1):
            return np.eye(4), None, None
        ways.append((int(axis), int(sign)))
    (coord, _), up, front = ways
    if {coord, up[0], front[0]} != {0, 1, 2}:
        return np.eye(4), None, None
    rows = np.zeros((3, 3))
    for row, (axis, sign) in enumerate(ways):
        rows[row, axis] = sign
    mirror = np.ones(3)
    mirror[coord] = np.linalg.det(rows)  # right x up = front in a right-handed file
    return scaled(mirror), *("+-"[sign < 0] + "xyz"[axis] for axis, sign in (up, front))  # pyright: ignore[reportReturnType]


def unit_mm(settings: dict[str, tuple]) -> float | None:
    """Millimetres in one unit of the file, None when what it says cannot be."""
    factor = number_property(settings, "UnitScaleFactor", 1.0)
    return MM_PER_CM * factor if np.isfinite(factor) and factor > 0 else None
