"""The audit: what is in a rig, what is wrong with it, and which blendshapes are left out of the plan and why."""

from typing import Literal

from msgspec import Struct


class Finding(Struct, frozen=True, forbid_unknown_fields=True):
    """One thing found: what it is, what it does to the plan, and what to change.

    `left_out` says whether its `blendshapes` take no part in the plan.
    """

    kind: Literal["static", "noise", "duplicate", "dependent", "non-face", "partner", "corrective", "geometry"]
    blendshapes: tuple[str, ...]
    message: str
    advice: str
    left_out: bool


class Audit(Struct, frozen=True, forbid_unknown_fields=True):
    """`used` are the blendshapes that are planned for, in the rig's order; `rank` of them can be told apart at all."""

    vertices: int
    triangles: int
    skin_vertices: int
    blendshapes: int
    used: tuple[str, ...]
    rank: int
    unit_mm: float
    up: str
    facing: str
    interpupillary_mm: float | None
    findings: tuple[Finding, ...]
