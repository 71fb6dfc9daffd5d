"""What the cameras of a plan make of its markers on a head: who is read in which expression, pictures, and figures for
who mounts them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt8
from msgspec.structs import replace

from capture_plan.camera import Camera, Mounting, between, mounting, upper_philtrum
from capture_plan.layout.dot_contact import NEUTRAL
from capture_plan.layout.labels import moment_words
from capture_plan.layout.record import Landmark
from capture_plan.layout.unread import pose_deltas, pose_views
from capture_plan.mesh import vertex_normals
from capture_plan.plan.record import Plan, cameras_of
from capture_plan.rig import Rig
from capture_plan.sheets.camera_picture import Crop, dot_outlines, through_lens
from capture_plan.sheets.head import Head, Posed, pose
from capture_plan.sheets.number_places import NumberPlaces, place_numbers
from capture_plan.visibility import SEEN, Sight, Views

AROUND = 0.12  # of the dots' extent: what a crop leaves around them
CROPPED = 0.45  # of the picture: where dots take less in both directions, it is cropped to them
NUMBER_MM = (5.2, 2.8)  # width and height of a marker's name of 7 pt
LEAST_RADIUS_MM = 0.6
ASIDE = ("to the actor's left", "to the actor's right")


class CameraView(NamedTuple):
    """A part of a camera's picture in an expression: the rims of the n markers in the camera's pixels, which of them it
    sees at all, and which it reads."""

    crop: Crop
    rgb: UInt8[np.ndarray, "p q 3"]
    rims: Float[np.ndarray, "n m 2"]
    seen: Bool[np.ndarray, " n"]
    read: Bool[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class CameraReads:
    """What cameras read of the markers of a plan on a head: the neutral first, then every expression as it is shot."""

    plan: Plan
    rig: Rig
    head: Head
    marks: tuple[Landmark, ...]

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """Those that the plan carries."""
        return cameras_of(self.plan)

    @cached_property
    def poses(self) -> dict[str, dict[str, float]]:
        """The expressions in the order of shooting."""
        return {one.name: dict(one.pose) for one in self.plan.in_session}

    @cached_property
    def views(self) -> Views:
        """How each camera sees each marker in each of them."""
        dot_mm = self.plan.settings.landmarks.dot_mm
        return pose_views(self.rig, self.marks, self.poses, self.cameras, dot_mm=dot_mm)

    @cached_property
    def philtrum(self) -> Float[np.ndarray, "3"]:
        """What head-mounted cameras are aimed at."""
        return upper_philtrum(self.rig.neutral[self.rig.skin])[0]

    @cached_property
    def neutral(self) -> Posed:
        """The head as it is at rest."""
        return pose(self.head, self.rig.neutral)

    def vertices(self, e: int) -> Float[np.ndarray, "v 3"]:
        """Of the neutral (0), or of an expression."""
        if e == 0:
            return self.rig.neutral
        name = list(self.poses)[e - 1]
        return self.rig.neutral + pose_deltas(self.rig, {name: self.poses[name]})[0]

    def shot(self, e: int) -> str:
        """What an expression is called on a page: 'Neutral', 'Shot 8 (E01)'."""
        name = (NEUTRAL, *self.poses)[e]
        words = self.plan.shots.get(name, name)
        return words[:1].upper() + words[1:]

    def worst(self, c: int) -> int:
        """The expression in which camera c reads fewest markers, the neutral where it reads as many in all."""
        return int((self.views.how[:, c] == Sight.READ).sum(axis=1).argmin())

    def view(self, c: int, e: int, width_px: int) -> CameraView:
        """The picture of camera c in an expression, `width_px` wide, around the markers that it sees."""
        camera, dot_mm, how = self.cameras[c], self.plan.settings.landmarks.dot_mm, self.views.how[e, c]
        vertices = self.vertices(e)
        posed = self.neutral if e == 0 else pose(self.head, vertices)
        at = np.array([mark.vertex for mark in self.marks], dtype=int)
        rims = dot_outlines(camera, vertices[at], vertex_normals(vertices, self.rig.triangles)[at], dot_mm)
        seen = np.isin(how, SEEN) & np.isfinite(rims).all(axis=(1, 2))
        crop = crop_of(camera, rims[seen])
        return CameraView(crop, through_lens(posed, camera, crop, width_px).rgb, rims, seen, how == Sight.READ)

    def always(self, c: int) -> int:
        """How many markers camera c reads in the neutral and all expressions."""
        return int((self.views.how[:, c] == Sight.READ).all(axis=0).sum())

    def mounting_rows(self, c: int) -> list[tuple[str, str]]:
        """Term and value of all that a technician measures."""
        camera = self.cameras[c]
        m = mounting(camera, self.philtrum)
        rows = [
            ("Lens to the upper philtrum (below the nose)", f"{m.away_mm:.0f} mm{away_words(m)}"),
            ("Looks", ", ".join(turn_words(m.down_degrees, m.leftward_degrees, m.roll_degrees))),
            (
                "Field of view, across and up",
                f"{m.field_degrees[0]:.0f}° \N{MULTIPLICATION SIGN} {m.field_degrees[1]:.0f}°",
            ),
            (
                "covers at the lips",
                f"{m.covers_mm[0]:.0f} \N{MULTIPLICATION SIGN} {m.covers_mm[1]:.0f} mm, {m.pixel_mm:.3f} mm a pixel",
            ),
            ("Sharp", sharp_words(m.sharp_mm)),
            ("A dot's middle is found to", f"{camera.noise_px:g} px (standard deviation, as stated or assumed)"),
        ]
        if slip := camera.slip:
            rows.append(
                ("The head may move or the helmet slip by", f"{slip.mm:g} mm and {slip.degrees:g}°, all allowed for")
            )
        for other in self.cameras:
            if other is not camera and len(self.cameras) <= 4:
                apart, angle = between(camera, other, self.philtrum)
                rows.append((f"To {other.name}", f"{apart:.0f} mm apart, {angle:.0f}° seen from the face"))
        return rows

    def label_rows(self, c: int) -> list[tuple[str, str]]:
        """How far dots may be found off in the pictures of camera c before a tracker takes one for another."""
        found = [
            labels for labels in (*self.plan.labels, *self.plan.take_labels) if labels.camera == self.cameras[c].name
        ]
        if not found:
            return []
        least = min(found, key=lambda labels: labels.margin_mm)
        whose = f"{' and '.join(least.dots)}, {moment_words(least.between, replace(least, camera=''), self.plan.shots)}"
        if least.margin_mm > 0:
            return [
                (
                    "Each dot may be found off, and is still told from the others, by",
                    f"{least.margin_mm:.1f} mm ({whose})",
                )
            ]
        pairs = len({one.dots for labels in found for one in labels.confusable})
        return [("May be taken for each other", f"{pairs} pair{'s' * (pairs > 1)} of dots, first of all {whose}")]

    def measured_rows(self) -> list[tuple[str, str]]:
        """How exactly all cameras together measure the markers."""
        known = [m.measured_mm for m in self.plan.layout.landmarks if len(m.measured_mm) == 3]
        if not known:
            return [("All cameras together", "no dot's depth is measured: one camera alone")]
        best, worst = np.median([one[0] for one in known]), np.median([one[2] for one in known])
        return [("Half of the dots are measured to", f"{best:.2f} mm at best, {worst:.2f} mm in depth")]


def numbers_beside(
    rims: Float[np.ndarray, "n m 2"], some: Bool[np.ndarray, " n"], bounds: tuple[float, float, float, float]
) -> tuple[list[int], NumberPlaces]:
    """Where the numbers of some markers stand beside their rims, millimetres, and whose they are: none where there is
    no room for all."""
    at = np.flatnonzero(some)
    middles = rims[at].mean(axis=1) if len(at) else np.zeros((0, 2))
    inside = np.all((middles > bounds[:2]) & (middles < bounds[2:]), axis=1)
    at, middles = at[inside], middles[inside]
    radii = np.linalg.norm(rims[at] - middles[:, None], axis=2).max(axis=1, initial=0.0)
    sizes = np.tile(NUMBER_MM, (len(at), 1))
    placed = place_numbers(middles, sizes, np.maximum(radii, LEAST_RADIUS_MM), np.zeros((0, 4)), bounds)
    return (at.tolist(), placed) if placed else ([], NumberPlaces(np.zeros((0, 2)), np.zeros((0, 2, 2))))


def crop_of(camera: Camera, rims: Float[np.ndarray, "n m 2"]) -> Crop:
    """All of the picture, or where dots take little of it the part around them, of the same shape."""
    whole = Crop.whole(camera)
    if not len(rims):
        return whole
    low, high = rims.min(axis=(0, 1)), rims.max(axis=(0, 1))
    share = float(((high - low) / camera.size_px).max()) * (1 + 2 * AROUND)
    if share > CROPPED:
        return whole
    size = np.array(camera.size_px) * share
    corner = np.clip((low + high) / 2 - size / 2, [-0.5, -0.5], np.array(camera.size_px) - 0.5 - size)
    return Crop(float(corner[0]), float(corner[1]), float(size[0]), float(size[1]))


def turn_words(down: float, leftward: float, roll: float) -> list[str]:
    """'12° down, 5° towards the actor's left, rolled by 90°'; 'straight at the face' where none is a degree."""
    words = [f"{abs(down):.0f}° {'down' if down > 0 else 'up'}"] if abs(down) >= 0.5 else []
    if abs(leftward) >= 0.5:
        words.append(f"{abs(leftward):.0f}° towards the actor's {'left' if leftward > 0 else 'right'}")
    if abs(roll) >= 0.5:
        words.append(f"rolled by {roll:.0f}°")
    return words or ["straight back, level"]


def sharp_words(sharp_mm: tuple[float, float] | None) -> str:
    """From where to where it is in focus."""
    if sharp_mm is None:
        return "not known: state focus_mm, f_number and pixel_um"
    near, far = sharp_mm
    return f"from {near:.0f} mm " + (f"to {far:.0f} mm" if np.isfinite(far) else "on")


def sided(mm: float, more: str, less: str) -> list[str]:
    """'12 mm above'; nothing below half a millimetre."""
    return [f"{abs(mm):.0f} mm {more if mm > 0 else less}"] if abs(mm) >= 0.5 else []


def away_words(m: Mounting) -> str:
    """': 230 mm ahead, 100 mm below', the parts of the way to a lens; ' straight ahead' where it is that alone."""
    beside = [*sided(m.above_mm, "above", "below"), *sided(m.left_mm, *ASIDE)]
    return f": {', '.join([f'{m.ahead_mm:.0f} mm ahead', *beside])}" if beside else " straight ahead"
