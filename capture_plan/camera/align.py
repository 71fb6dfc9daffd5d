"""Where a head is in the world of a calibration: by places of it that were measured there, or by what cameras look at.

Places    p_i of the head (mm) lie at q_i of the calibration, in its own unit u: A a rotation, t a shift with
          A u q_i + t = p_i by least squares (Kabsch); the scale of q against p tells u where the file does not, or
          says it wrongly
Philtrum  all cameras are aimed at the upper philtrum: it lies where their axes come nearest to each other, the face
          looks against their mean direction and stands upright in their pictures
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from capture_plan.camera.calibration import UNITS, Calibration
from capture_plan.camera.frame import MIRROR_WORLD, meeting
from capture_plan.camera.philtrum import upper_philtrum
from capture_plan.errors import RigError
from capture_plan.mesh import rigid_fit, similarity_fit
from capture_plan.prose import in_series

FEWEST = 3
NARROW_MM = 8.0  # root mean square of places about a line: fewer tell no turn about it
ALIKE = (0.75, 1.33)  # sizes of heads against each other
STRAY_MM = 25.0  # between a place and where the others put it: heads differ by 3 to 6
WORTH_SAYING = 0.03  # of the size of a head
MIRRORED = 2.0  # times as far the places lie from the head as from its mirror image: sides are exchanged

Poses = tuple[Float[np.ndarray, "c 3 3"], Float[np.ndarray, "c 3"]]


@dataclass(frozen=True, eq=False)
class Places:
    """Named places in the calibration's world and unit, and where the head has them (mm)."""

    names: tuple[str, ...]
    there: Float[np.ndarray, "n 3"]
    here: Float[np.ndarray, "n 3"]

    def turned(self, R: Float[np.ndarray, "c 3 3"], C: Float[np.ndarray, "c 3"], mm: float, mirrored: bool) -> Poses:
        """World-to-camera rotations and places (mm) of cameras in the head's frame; the unit of the places is `mm`."""
        A, t = rigid_fit(self._there(mm, mirrored), self.here)
        return R @ A.T, C @ A.T + t

    def off_mm(self, mm: float, mirrored: bool = False) -> Float[np.ndarray, " n"]:
        """How far each place comes to lie from where the head has it."""
        q = self._there(mm, mirrored)
        A, t = rigid_fit(q, self.here)
        return np.linalg.norm(q @ A.T + t - self.here, axis=1)

    def left_out_mm(self, mm: float, mirrored: bool = False) -> Float[np.ndarray, " n"]:
        """How far each place lies from where the others put it; of three, from where all do."""
        if len(self.names) == FEWEST:
            return self.off_mm(mm, mirrored)
        q, away = self._there(mm, mirrored), np.zeros(len(self.names))
        for i in range(len(away)):
            A, t = rigid_fit(np.delete(q, i, axis=0), np.delete(self.here, i, axis=0))
            away[i] = np.linalg.norm(A @ q[i] + t - self.here[i])
        return away

    def unit_mm(self) -> float:
        """Millimetres in one unit, if the actor's head were as large as this."""
        A, _ = similarity_fit(self.there, self.here)
        return float(np.cbrt(np.linalg.det(A)))

    def _there(self, mm: float, mirrored: bool) -> Float[np.ndarray, "n 3"]:
        return mm * self.there @ (MIRROR_WORLD if mirrored else np.eye(3))


@dataclass(frozen=True, eq=False)
class AtPhiltrum:
    """All cameras are aimed at the upper philtrum of the `head` (mm)."""

    head: Float[np.ndarray, "v 3"]

    def turned(self, R: Float[np.ndarray, "c 3 3"], C: Float[np.ndarray, "c 3"], mm: float, mirrored: bool) -> Poses:
        """World-to-camera rotations and places (mm) of cameras in the head's frame."""
        del mm, mirrored
        ahead = -R[:, 2].mean(axis=0)
        up = -R[:, 1].mean(axis=0)
        across = np.cross(up, ahead)
        W = np.stack([across / np.linalg.norm(across), up, ahead / np.linalg.norm(ahead)])
        W[1] = np.cross(W[2], W[0])
        middle = middle_of_view(R, C)
        return R @ W.T, (C - middle) @ W.T + upper_philtrum(self.head)[0]


def middle_of_view(R: Float[np.ndarray, "c 3 3"], C: Float[np.ndarray, "c 3"]) -> Float[np.ndarray, "3"]:
    """Where the optical axes come nearest to each other.

    Raises:
        RigError: they are all but parallel, or run apart.
    """
    middle = meeting(R[:, 2], C)
    if middle is None or np.any(np.einsum("cx,cx->c", middle - C, R[:, 2]) <= 0):
        raise RigError(
            "its cameras do not look at one point before them, so philtrum = true tells no place: give places of the "
            "head instead (nose_tip = [x, y, z], ...)"
        )
    return middle


def places_of(found: Mapping[str, object], known: Mapping[str, Float[np.ndarray, "3"]], where: str) -> Places:
    """The places that a person found by name, `known` on the head.

    Raises:
        RigError: a name is not known, or the places tell no turn.
    """
    if others := [name for name in found if name not in known]:
        raise RigError(f"{where}: no place of the head is known as '{others[0]}': known are {in_series(list(known))}")
    there = np.array([found[name] for name in found], dtype=float)
    here = np.array([known[name] for name in found])
    if len(here) < FEWEST:
        raise RigError(f"{where}: {len(here)} places of the head, expected {FEWEST} or more that lie apart")
    spread = np.linalg.svd(here - here.mean(axis=0), compute_uv=False) / np.sqrt(len(here))
    own = np.linalg.svd(there - there.mean(axis=0), compute_uv=False)
    if spread[1] < NARROW_MM or own[1] < NARROW_MM / spread[0] * own[0] / 2:
        raise RigError(
            f"{where}: the places {in_series(list(found))} lie on a line or together: give the tip of the nose and "
            "corners of both eyes, too"
        )
    return Places(tuple(found), there, here)


def in_unit(read: Calibration, places: Places, unit: str | None) -> tuple[Calibration, Places, str]:
    """A calibration in the unit that the places tell, and these in the same; how that was decided in words.

    A unit that a person states stands. Where neither they nor the file do, lengths are scaled until the places are as
    far apart as on the head.

    Raises:
        RigError: a unit that is stated makes a head of no head's size, or no unit does.
    """
    mm, stated = places.unit_mm(), unit or read.unit
    if stated is None:
        now = UNITS["millimetres"]  # what the reader took the numbers for
        cameras = tuple(replace(camera, position=camera.position / now * mm) for camera in read.cameras)
        scaled = replace(read, cameras=cameras, unit="millimetres")
        size = f"1 unit of the file is {mm:.4g} mm, if the actor's head is as large as the rig's"
        return scaled, replace(places, there=mm * places.there), size
    times = UNITS[stated] / mm  # the actor's head against the rig's
    if ALIKE[0] <= times <= ALIKE[1]:
        larger = f"the actor's head is {abs(times - 1):.0%} {'larger' if times > 1 else 'smaller'} than the rig's"
        return read, places, larger if abs(times - 1) > WORTH_SAYING else ""
    fitting = [name for name, one in UNITS.items() if ALIKE[0] <= one / mm <= ALIKE[1]]
    if unit or not fitting:
        would = f": they would fit in {in_series(fitting)}" if fitting else ""
        raise RigError(
            f"the places of the head are {times:.3g} times as far apart in {stated} as on the rig{would}: correct the "
            "unit or the places, which are measured in the calibration's own frame and unit"
        )
    nearest = min(fitting, key=lambda name: abs(np.log(UNITS[name] / mm)))
    cameras = tuple(
        replace(camera, position=camera.position / UNITS[stated] * UNITS[nearest]) for camera in read.cameras
    )
    said = f"its lengths are {nearest}, as the places of the head tell, not {stated}"
    return replace(read, cameras=cameras, unit=nearest), places, said


def check_places(places: Places, mm: float, mirrored: bool, where: str) -> str:
    """How well the places lie on the head, in words.

    Raises:
        RigError: one lies far from where the others put it, or left and right are exchanged.
    """
    off = places.off_mm(mm, mirrored)
    other = places.off_mm(mm, not mirrored)
    if len(off) > FEWEST and np.sum(off**2) > MIRRORED**2 * np.sum(other**2) + 1:
        raise RigError(
            f"{where}: left and right of the places are exchanged, or the file is left-handed: sides are the actor's "
            "own; where they are right, write mirrored = true below [calibration]"
        )
    worst, left = int(off.argmax()), places.left_out_mm(mm, mirrored)
    if left.max() > STRAY_MM:
        stray = int(left.argmax()) if len(off) > FEWEST + 1 else worst  # of four each may be the one that is wrong
        raise RigError(
            f"{where}: '{places.names[stray]}' lies {left[stray]:.0f} mm from where the others put it: measure it "
            "again in the calibration's own frame, or leave it out"
        )
    return (
        f"aligned by {len(off)} places of the head, which lie {np.sqrt(np.mean(off**2)):.1f} mm from where the rig has "
        f"them (root mean square; '{places.names[worst]}' {off[worst]:.1f} mm)"
    )
