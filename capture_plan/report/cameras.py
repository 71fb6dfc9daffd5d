"""What the plan page shows of each camera: its picture with dots as vectors over it, its figures, and what it reads."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from capture_plan.plan.record import Plan
from capture_plan.rig import Rig
from capture_plan.sheets.camera_pages import LEGEND, LETTERS
from capture_plan.sheets.camera_reads import CameraReads, numbers_beside
from capture_plan.sheets.head import make_head
from capture_plan.visibility import WORDS, Sight

WIDE_PX, WIDE_MM = 620, 82.0  # of a picture on the page; numbers are placed as on paper so wide

Embed = Callable[[UInt8[np.ndarray, "p q 3"], str], dict[str, Any]]


def camera_cards(plan: Plan, rig: Rig, embed: Embed) -> list[dict[str, Any]]:
    """A card for each camera of the plan on a rig (or the actor's head); `embed` makes a picture's source of pixels."""
    if not plan.cameras:
        return []
    reads = CameraReads(plan, rig, make_head(rig), plan.layout.markers)
    return [_card(reads, c, embed) for c in range(len(reads.cameras))]


def _card(reads: CameraReads, c: int, embed: Embed) -> dict[str, Any]:
    camera, how = reads.cameras[c], reads.views.how[:, c]
    return {
        "name": camera.name,
        "reads": f"reads {reads.always(c)} of {len(reads.marks)} markers in the neutral and all expressions",
        "pictures": [_picture(reads, c, e, embed) for e in dict.fromkeys([0, reads.worst(c)])],
        "facts": [*reads.mounting_rows(c), *reads.label_rows(c), *reads.measured_rows()],
        "expressions": ["rest", *reads.poses],
        "rows": [
            {
                "name": mark.name,
                "label": mark.label,
                "cells": [(LETTERS[Sight(int(s))] or "●", WORDS[Sight(int(s))]) for s in how[:, n]],
                "px": f"{reads.views.pixels[c, n]:.1f} px" if reads.views.pixels[c, n] else "never seen",
            }
            for n, mark in enumerate(reads.marks)
        ],
        "legend": LEGEND.replace("Filled", "●"),
    }


def _picture(reads: CameraReads, c: int, e: int, embed: Embed) -> dict[str, Any]:
    """A picture with the outlines of its dots and where their numbers stand, in its own pixels."""
    view, name = reads.view(c, e, WIDE_PX), reads.shot(e)
    scale = WIDE_PX / view.crop.width
    rims = (view.rims - [view.crop.left, view.crop.top]) * scale
    high = view.rgb.shape[0]
    named = view.seen if e == 0 else view.seen & ~view.read
    mm = WIDE_MM / WIDE_PX
    whose, placed = numbers_beside(rims * mm, named, (0.0, 0.0, WIDE_MM, high * mm))
    count = int(view.read.sum())
    caption = f"{name}: {count} of {len(reads.marks)} read"
    return {
        **embed(view.rgb, f"What {reads.cameras[c].name} sees, {caption}"),
        "caption": caption if e == 0 else f"{caption}, fewest of all",
        "dots": [
            {"points": _points(rims[n]), "read": bool(view.read[n]), "name": reads.marks[n].name}
            for n in np.flatnonzero(view.seen).tolist()
        ],
        "numbers": [
            (reads.marks[n].name, round(x / mm, 1), round(y / mm, 1))
            for n, (x, y) in zip(whose, placed.middle.tolist(), strict=True)
        ],
    }


def _points(rim: Float[np.ndarray, "m 2"]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in rim.tolist())
