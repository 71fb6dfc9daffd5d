"""Lenses in OpenCV's models: where a direction lands on the image plane, and back.

Direction  (x, y, z) in the camera's axes: x right, y down, z forward;  a = x/z, b = y/z, s = a² + b²
Pinhole    radial = (1 + k1 s + k2 s² + k3 s³) / (1 + k4 s + k5 s² + k6 s³)
           a' = a radial + 2 p1 a b + p2 (s + 2 a²) + s1 s + s2 s²      (Brown 1966; rational; thin prism)
           b' = b radial + p1 (s + 2 b²) + 2 p2 a b + s3 s + s4 s²
           then the tilt of the sensor, tx and ty
           coefficients in OpenCV's order: k1 k2 p1 p2 k3 | k4 k5 k6 | s1 s2 s3 s4 | tx ty
Fisheye    theta = angle between direction and z;  theta' = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)
           (a', b') = theta' (x, y) / |(x, y)|                           (Kannala & Brandt 2006; k1 k2 k3 k4)
Fold       the least s, or theta, from which points move inwards: beyond it there is no image
Back       Newton's iteration on (a, b), or on theta
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

SIZES = (5, 8, 12, 14)  # numbers of a pinhole lens
FISHEYE = 4  # numbers of a fisheye lens
STEPS, CLOSE = 60, 1e-10  # of Newton's iteration; of a focal length: 1e-6 px
STEP = 1e-6  # of the derivatives
SAMPLES = 400  # radii at which the model of another program is compared


def bend(
    directions: Float[np.ndarray, "p 3"], lens: Float[np.ndarray, " n"], fisheye: bool
) -> Float[np.ndarray, "p 2"]:
    """Image-plane coordinates a', b' (focal length 1) of directions; NaN behind the camera and beyond the fold."""
    if fisheye:
        across = np.hypot(directions[:, 0], directions[:, 1])
        theta = np.arctan2(across, directions[:, 2])
        theta = np.where(theta < fold(lens, True), theta, np.nan)
        scale = _fisheye(theta, lens) / np.where(across > 0, across, 1)
        return directions[:, :2] * scale[:, None]
    depth = np.where(directions[:, 2] > 0, directions[:, 2], np.nan)
    plane = directions[:, :2] / depth[:, None]
    s = (plane**2).sum(axis=1)
    return _pinhole(np.where(s < fold(lens, False), plane.T, np.nan).T, lens)


def straighten(
    bent: Float[np.ndarray, "p 2"], lens: Float[np.ndarray, " n"], fisheye: bool
) -> Float[np.ndarray, "p 3"]:
    """Unit directions that land on image-plane coordinates; NaN where the lens brings none there."""
    if fisheye:
        across = np.hypot(bent[:, 0], bent[:, 1])
        theta = _fisheye_back(across, lens)
        out = np.sin(theta) / np.where(across > 0, across, 1)
        return np.column_stack([bent * out[:, None], np.cos(theta)])
    plane = _pinhole_back(bent, lens)
    directions = np.column_stack([plane, np.ones(len(plane))])
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def fold(lens: Float[np.ndarray, " n"], fisheye: bool) -> float:
    """Where the image of a point that moves outwards turns back: a theta for a fisheye lens, else an s.

    d(r N/D)/dr = 0 with s = r² is N D + 2 s (N' D - N D') = 0; a pole D = 0 ends the image too.
    """
    if fisheye:
        k1, k2, k3, k4 = lens
        return min(np.pi, np.sqrt(_least_root([9 * k4, 7 * k3, 5 * k2, 3 * k1, 1.0])))
    k1, k2, _, _, k3, k4, k5, k6 = _padded(lens)[:8]
    n, d = np.poly1d([k3, k2, k1, 1.0]), np.poly1d([k6, k5, k4, 1.0])
    slope = n * d + np.poly1d([2.0, 0.0]) * (n.deriv() * d - n * d.deriv())
    return min(_least_root(slope.coeffs), _least_root(d.coeffs))


def _least_root(coefficients: list[float] | np.ndarray) -> float:
    """Least positive real root of a polynomial, highest power first; infinity where there is none."""
    roots = np.roots(np.trim_zeros(np.asarray(coefficients, dtype=float), "f"))
    positive = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)]
    return float(positive.min()) if len(positive) else np.inf


def _padded(lens: Float[np.ndarray, " n"]) -> Float[np.ndarray, "14"]:
    return np.concatenate([lens, np.zeros(14 - len(lens))])


def _pinhole(plane: Float[np.ndarray, "p 2"], lens: Float[np.ndarray, " n"]) -> Float[np.ndarray, "p 2"]:
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tx, ty = _padded(lens)
    a, b = plane.T
    s = a * a + b * b
    radial = 1 + k1 * s + k2 * s**2 + k3 * s**3
    if len(lens) > 5:
        radial = radial / (1 + k4 * s + k5 * s**2 + k6 * s**3)
    bent_a = a * radial + 2 * p1 * a * b + p2 * (s + 2 * a * a)
    bent_b = b * radial + p1 * (s + 2 * b * b) + 2 * p2 * a * b
    if len(lens) > 8:
        bent_a, bent_b = bent_a + s1 * s + s2 * s**2, bent_b + s3 * s + s4 * s**2
    bent = np.stack([bent_a, bent_b], axis=1)
    return _tilted(bent, tx, ty) if tx or ty else bent


def _tilted(bent: Float[np.ndarray, "p 2"], tx: float, ty: float) -> Float[np.ndarray, "p 2"]:
    """On a sensor that is turned by tx and ty (Louhichi et al. 2007, as OpenCV writes it)."""
    about_x = np.array([[1, 0, 0], [0, np.cos(tx), np.sin(tx)], [0, -np.sin(tx), np.cos(tx)]])
    about_y = np.array([[np.cos(ty), 0, -np.sin(ty)], [0, 1, 0], [np.sin(ty), 0, np.cos(ty)]])
    turn = about_y @ about_x
    ahead = np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]])
    x, y, w = ahead @ turn @ np.vstack([bent.T, np.ones(len(bent))])
    return np.stack([x / w, y / w], axis=1)


def _pinhole_back(bent: Float[np.ndarray, "p 2"], lens: Float[np.ndarray, " n"]) -> Float[np.ndarray, "p 2"]:
    """Newton: solve J d = bent - P(plane), with the derivatives by differences."""
    plane, limit = bent.copy(), fold(lens, False)
    off = _pinhole(plane, lens) - bent
    for _ in range(STEPS):
        if np.nanmax(np.abs(off), initial=0.0) < CLOSE:
            break
        columns = [(_pinhole(plane + h, lens) - _pinhole(plane - h, lens)) / (2 * STEP) for h in STEP * np.eye(2)]
        (aa, ba), (ab, bb) = columns[0].T, columns[1].T
        det = aa * bb - ab * ba
        step = np.stack([bb * off[:, 0] - ab * off[:, 1], aa * off[:, 1] - ba * off[:, 0]], axis=1)
        with np.errstate(all="ignore"):
            plane = plane - step / det[:, None]
            off = _pinhole(plane, lens) - bent
    s = (plane**2).sum(axis=1)
    good = (np.abs(off).max(axis=1) < 1e-7) & (s < limit)
    return np.where(good[:, None], plane, np.nan)


def _fisheye(theta: Float[np.ndarray, " p"], lens: Float[np.ndarray, "4"]) -> Float[np.ndarray, " p"]:
    k1, k2, k3, k4 = lens
    return theta * (1 + k1 * theta**2 + k2 * theta**4 + k3 * theta**6 + k4 * theta**8)


def _fisheye_back(bent: Float[np.ndarray, " p"], lens: Float[np.ndarray, "4"]) -> Float[np.ndarray, " p"]:
    """Bisection between 0 and the fold, where theta' grows with theta."""
    top = fold(lens, True)
    low, high = np.zeros(len(bent)), np.full(len(bent), top)
    for _ in range(STEPS):
        middle = (low + high) / 2
        below = _fisheye(middle, lens) < bent
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.where(bent < _fisheye(np.array([top]), lens), (low + high) / 2, np.nan)


class RadialFit(NamedTuple):
    """A lens of ours in place of another program's: its numbers, and the most that they differ, focal length 1."""

    lens: Float[np.ndarray, " n"]
    off: float


def fitted(straight: Float[np.ndarray, " n"], bent: Float[np.ndarray, " n"], enough: float) -> RadialFit:
    """The lens whose radial part brings each radius r of `straight` to r' of `bent`, both of focal length 1.

    r' (1 + k4 s + k5 s² + k6 s³) = r (1 + k1 s + k2 s² + k3 s³) is linear in k; without the denominator where that
    comes within `enough`.
    """
    most = (straight**2).max()
    powers = (straight**2 / most)[:, None] ** np.arange(1, 4)
    fits = []
    for parts in ([straight[:, None] * powers], [straight[:, None] * powers, -bent[:, None] * powers]):
        k = np.linalg.lstsq(np.hstack(parts), bent - straight, rcond=1e-13)[0]
        k = np.concatenate([k, np.zeros(6 - len(k))]) / np.tile(most ** np.arange(1, 4), 2)
        lens = np.array([k[0], k[1], 0, 0, k[2], *k[3:]])[: 5 if len(parts) == 1 else 8]
        ends = fold(lens, False) <= most
        again = _pinhole(np.stack([straight, 0 * straight], axis=1), lens)[:, 0]
        fits.append(RadialFit(lens, np.inf if ends else float(np.abs(again - bent).max())))
        if fits[-1].off <= enough:
            break
    return min(fits, key=lambda fit: fit.off)
