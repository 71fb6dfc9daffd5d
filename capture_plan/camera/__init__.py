"""Cameras as they are on set: lenses, calibrations of other programs, and where they stand to a head."""

from capture_plan.camera.blind import misplaced, why_blind
from capture_plan.camera.calibration import UNITS, Calibration
from capture_plan.camera.camera import Camera, Optics, Slip, look_at, rotation_about
from capture_plan.camera.candidates import KINDS, candidates
from capture_plan.camera.frame import Convention, Found, find_frame, looked_at
from capture_plan.camera.given import cameras_for, in_head_frame
from capture_plan.camera.mounting import Mounting, between, mounting
from capture_plan.camera.own import own_text
from capture_plan.camera.philtrum import upper_philtrum
from capture_plan.camera.precision import deviations, root, told
from capture_plan.camera.presets import PRESETS, is_preset
from capture_plan.camera.read import read_cameras
from capture_plan.camera.record import KnownCamera, camera_of, otherwise, recorded

__all__ = [
    "KINDS",
    "PRESETS",
    "UNITS",
    "Calibration",
    "Camera",
    "Convention",
    "Found",
    "KnownCamera",
    "Mounting",
    "Optics",
    "Slip",
    "between",
    "camera_of",
    "cameras_for",
    "candidates",
    "deviations",
    "find_frame",
    "in_head_frame",
    "is_preset",
    "look_at",
    "looked_at",
    "misplaced",
    "mounting",
    "otherwise",
    "own_text",
    "read_cameras",
    "recorded",
    "root",
    "rotation_about",
    "told",
    "upper_philtrum",
    "why_blind",
]
