"""Cameras as they are on set: lenses, calibrations of other programs, and where they stand to a head."""

from capture_plan.camera.blind import misplaced, why_blind
from capture_plan.camera.calibration import UNITS, Calibration
from capture_plan.camera.camera import Camera, look_at
from capture_plan.camera.frame import Convention, Found, find_frame, looked_at
from capture_plan.camera.presets import PRESETS, cameras_for, in_head_frame
from capture_plan.camera.read import read_cameras

__all__ = [
    "PRESETS",
    "UNITS",
    "Calibration",
    "Camera",
    "Convention",
    "Found",
    "cameras_for",
    "find_frame",
    "in_head_frame",
    "look_at",
    "looked_at",
    "misplaced",
    "read_cameras",
    "why_blind",
]
