"""Empirical layouts: the points that studios and data sets use, placed on any rig.

Data     data/empirical.json   every layout's points as vertices of the bundled sample head, each with its name and what
                               defines it; picked by us from the definitions, which the notes say how far to trust
Place    the sample's face is laid onto the rig, once for all layouts (`correspondence.py`); every point takes a skin
         vertex of its own
"""

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import msgspec
import numpy as np
from jaxtyping import Int

from capture_plan.errors import PlanError, RigError
from capture_plan.registration.correspondence import transfer
from capture_plan.registration.known import EMPIRICAL
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig


class _Point(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A named place on a face: a vertex of the sample head, and the words that define it. Sides are the subject's."""

    name: str
    vertex: int
    definition: str


class EmpiricalLayout(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Points that people use: where they come from, and what our placement rests on."""

    title: str
    source: str
    note: str
    points: tuple[_Point, ...]

    @property
    def vertices(self) -> Int[np.ndarray, " m"]:
        """The points on the sample head."""
        return np.array([point.vertex for point in self.points])


@dataclass(frozen=True, eq=False)
class Placement:
    """A layout on a rig: names and skin vertices of its points, no vertex twice.

    `residual_mm` is how far the skin lies from where the points came to lie: root mean square, millimetres. `left_out`
    are points that have no skin near, as the ears on a mask.
    """

    names: tuple[str, ...]
    vertices: Int[np.ndarray, " m"]
    residual_mm: float
    left_out: tuple[str, ...]


def place_layout(rig: Rig, key: str) -> Placement:
    """The layout called `key` on a rig.

    Raises:
        RigError: the skin has fewer vertices than the layout has points, or lies nowhere near them.
        PlanError: no layout is called so.
    """
    layout = empirical_layout(key)
    carried = transfer(sample_rig(), layout.vertices, rig)
    there = ~carried.absent
    if not there.any():
        raise RigError(f"{rig.name}: no skin near any of the {layout.title}: allow landmarks on the face")
    return Placement(
        names=tuple(point.name for point, is_there in zip(layout.points, there, strict=True) if is_there),
        vertices=carried.vertices[there],
        residual_mm=float(np.sqrt(np.mean(carried.gaps_mm[there] ** 2))),
        left_out=tuple(point.name for point, is_there in zip(layout.points, there, strict=True) if not is_there),
    )


def place_ibug68(rig: Rig) -> Int[np.ndarray, "68"]:
    """The skin vertices of a rig nearest to the 68 points of iBUG, in their order, no vertex twice.

    Raises:
        RigError: the skin is too coarse for 68 points, or ends before some of them.

    Example:
        >>> len(set(place_ibug68(sample_rig()).tolist()))
        68
    """
    placement = place_layout(rig, "ibug68")
    if missing := placement.left_out:
        raise RigError(f"{rig.name}: no skin near points {', '.join(missing)} of the 68: allow landmarks there")
    return placement.vertices


def empirical_layout(key: str) -> EmpiricalLayout:
    """The layout called `key`. PlanError where there is none."""
    if key not in EMPIRICAL:
        raise PlanError(f"layout '{key}' is not known: choose one of {', '.join(EMPIRICAL)}")
    return _layouts()[key]


@cache
def _layouts() -> dict[str, EmpiricalLayout]:
    """All layouts by key."""
    data = files("capture_plan.registration").joinpath("data/empirical.json").read_bytes()
    return msgspec.json.decode(data, type=dict[str, EmpiricalLayout])
