"""How markers of a region look: a colour, and a shape that tells regions apart in black and white too."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.layout.record import Landmark

Number = float | int  # what a person writes as 8 or 7.5
INK, SOFT, FAINT, WASH = "#1d1f22", "#5b5f66", "#c9ccd1", "#f1f2f4"
ACCENT = "#0b57d0"


class Look(NamedTuple):
    """Colour and shape that mark a region on paper."""

    colour: str
    shape: str


# Colours are dark enough to be read on clay and on white (contrast above 4.5); neighbours on the face differ in both.
LOOKS = {
    "forehead": Look("#0b57d0", "circle"),
    "brow": Look("#b3261e", "square"),
    "upper eyelid": Look("#7b3fb5", "dome"),
    "lower eyelid": Look("#7b3fb5", "bowl"),
    "temple": Look("#4d6300", "plus"),
    "nose": Look("#9a5b00", "diamond"),
    "cheek": Look("#0f7b4f", "hexagon"),
    "upper lip": Look("#a8326e", "triangle"),
    "lower lip": Look("#a8326e", "point-down"),
    "mouth corner": Look("#00708a", "saltire"),
    "chin": Look("#0b57d0", "pentagon"),
    "jaw": Look("#b3261e", "star"),
    "neck": Look("#4d6300", "bar"),
    "ear": Look("#9a5b00", "pillar"),
    "scalp": Look("#5b5f66", "octagon"),
}


def region_looks(landmarks: Iterable[Landmark]) -> dict[str, Look]:
    """The look of each region that has landmarks."""
    return looks_of(landmark.region for landmark in landmarks)


def looks_of(names: Iterable[str]) -> dict[str, Look]:
    """The look of each region, in the order of `LOOKS`; regions not listed there take free looks."""
    regions = list(dict.fromkeys(names))
    free = [look for name, look in LOOKS.items() if name not in regions] or list(LOOKS.values())
    unknown = [region for region in regions if region not in LOOKS]
    looks = {region: free[i % len(free)] for i, region in enumerate(unknown)}
    return {name: look for name, look in LOOKS.items() if name in regions} | looks


def outline(shape: str) -> Float[np.ndarray, "n 2"]:
    """Corners of a shape about as large as a circle of radius 1, y down; a circle has 40."""
    if shape in ("plus", "saltire"):
        a, b = 0.40, 1.2
        arm = np.array([(-a, -a), (-a, -b), (a, -b)])
        turns = np.radians([0, 90, 180, 270]) + (np.pi / 4 if shape == "saltire" else 0)
        return np.concatenate([arm @ np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]]) for t in turns])
    if shape == "star":
        return np.tile([1.35, 0.62], 5)[:, None] * _around(10, -90)
    if shape in ("bar", "pillar"):
        corners = np.array([(-1.3, -0.6), (1.3, -0.6), (1.3, 0.6), (-1.3, 0.6)])
        return corners if shape == "bar" else corners[:, ::-1]
    if shape in ("dome", "bowl"):
        half = np.radians(np.linspace(180, 360, 24))
        dome = 1.25 * np.stack([np.cos(half), np.sin(half)], axis=1) + np.array([0, 0.55])
        return dome if shape == "dome" else -dome
    corners, start, radius = {
        "circle": (40, 0, 1.0),
        "square": (4, 45, 1.25),
        "triangle": (3, -90, 1.42),
        "diamond": (4, 0, 1.35),
        "pentagon": (5, -90, 1.15),
        "point-down": (3, 90, 1.42),
        "hexagon": (6, 0, 1.12),
        "octagon": (8, 22.5, 1.05),
    }[shape]
    return radius * _around(corners, start)


def rgb(colour: str) -> tuple[int, int, int]:
    """'#rrggbb' as three numbers from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _around(corners: int, start_degrees: Number) -> Float[np.ndarray, "n 2"]:
    angle = np.radians(start_degrees + 360 * np.arange(corners) / corners)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)
