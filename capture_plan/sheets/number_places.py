"""Where the number of each marker stands beside it, so that nobody takes it for another marker's.

Data       p[i]     middle of marker i, millimetres on the page;  r[i] its radius;  w[i], h  size of its number
Candidate  the number's box in one of DIRECTIONS, with a gap of GAPS_MM to the rim, or from AWAY_MM on the middle of
           its nearest side that far from p, with a tick from the rim
Refused    a box within FREE_MM of another marker's rim or of an obstacle, or not nearer to its own marker than OWN
           times to another; a tick within TICK_MM of another marker's middle
Clash      two boxes within APART_MM; a tick that crosses a tick or a box
Model      one candidate for each marker, of least total cost, no two that clash: an integer program (CP-SAT, one
           worker, seeded), so that an answer is the best there is or known to be near it
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from ortools.sat.python import cp_model

from capture_plan.solver import UndecidedError, solve

DIRECTIONS = 16
GAPS_MM, AWAY_MM = (0.7, 1.6), (5.0, 7.5, 10.5)
FREE_MM, APART_MM, TICK_MM, OWN = 0.5, 0.4, 2.5, 1.15
COSTS = (0, 6, 30, 40, 55)  # of each distance: a tick reads worse than a number at its marker
SIDEWAYS = (0, 1, 2, 3, 4)  # by how far a direction is from the horizontal, 22.5 degrees each
WORK = 4.0  # of the solver, about seconds


class NumberPlaces(NamedTuple):
    """Middles of the boxes, and where a tick begins and ends: the same place twice where there is none."""

    middle: Float[np.ndarray, "n 2"]
    ticks: Float[np.ndarray, "n 2 2"]


class _Candidates(NamedTuple):
    """Of one marker: middles of boxes, ends of ticks, costs."""

    middle: Float[np.ndarray, "c 2"]
    end: Float[np.ndarray, "c 2"]
    start: Float[np.ndarray, "c 2"]
    cost: Float[np.ndarray, " c"]


def place_numbers(
    points: Float[np.ndarray, "n 2"],
    sizes: Float[np.ndarray, "n 2"],
    radii: Float[np.ndarray, " n"],
    obstacles: Float[np.ndarray, "o 4"],
    bounds: tuple[float, float, float, float],
) -> NumberPlaces | None:
    """A place for each number, or None where they do not fit.

    `sizes` are width and height of each number, `obstacles` boxes (x, y, half width, half height) that stay free, and
    `bounds` the left, top, right and bottom that no number passes; millimetres on the page.
    """
    if not len(points):
        return NumberPlaces(points, np.zeros((0, 2, 2)))
    found = [_candidates(i, points, sizes[i], radii, obstacles, bounds) for i in range(len(points))]
    if any(not len(one.cost) for one in found):
        return None
    model = cp_model.CpModel()
    chosen = [[model.new_bool_var("") for _ in one.cost] for one in found]
    for variables in chosen:
        model.add_exactly_one(variables)
    reach = 2 * (AWAY_MM[-1] + sizes.max())
    for i in range(len(points)):
        for j in range(i + 1, len(points)):
            if np.abs(points[i] - points[j]).max() > reach:
                continue
            clash = _clash(found[i], sizes[i], found[j], sizes[j])
            for c in np.flatnonzero(clash.any(axis=1)):
                model.add_at_most_one([chosen[i][c], *(chosen[j][d] for d in np.flatnonzero(clash[c]))])
    model.minimize(
        sum(
            int(cost) * variable
            for one, variables in zip(found, chosen, strict=True)
            for cost, variable in zip(one.cost, variables, strict=True)
        )
    )
    try:
        solver, status = solve(model, work_limit=WORK)
    except UndecidedError:
        return None
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return None
    picked = [next(c for c, one in enumerate(variables) if solver.value(one)) for variables in chosen]
    middle = np.stack([one.middle[c] for one, c in zip(found, picked, strict=True)])
    ticks = np.stack([[one.start[c], one.end[c]] for one, c in zip(found, picked, strict=True)])
    return NumberPlaces(middle, ticks)


def _candidates(
    i: int,
    points: Float[np.ndarray, "n 2"],
    size: Float[np.ndarray, " 2"],
    radii: Float[np.ndarray, " n"],
    obstacles: Float[np.ndarray, "o 4"],
    bounds: tuple[float, float, float, float],
) -> _Candidates:
    """What may be chosen for one marker by itself."""
    half, p, radius = size / 2, points[i], radii[i]
    others, rims = np.delete(points, i, axis=0), np.delete(radii, i)
    angle = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    from_level = np.round(np.degrees(np.arcsin(np.abs(u[:, 1]))) / 22.5).astype(int)
    middles, ends, starts, costs = [], [], [], []
    for step, distance in enumerate(
        (*(radius + gap for gap in GAPS_MM), *np.maximum(AWAY_MM, radius + 2 * GAPS_MM[-1]))
    ):
        middle = p + _reach(u, half, distance)[:, None] * u
        near = np.clip(p, middle - half, middle + half)
        tick = step >= len(GAPS_MM)
        middles.append(middle)
        ends.append(near if tick else middle)
        starts.append(p + radius * u if tick else middle)
        costs.append(COSTS[step] + np.array(SIDEWAYS)[from_level])
    middle, end, start, cost = map(np.concatenate, (middles, ends, starts, costs))
    left, top, right, bottom = bounds
    fits = (middle - half >= [left, top]).all(axis=1) & (middle + half <= [right, bottom]).all(axis=1)
    own = _to_box(p[None], middle, half)[:, 0]
    if len(others):
        away = _to_box(others, middle, half)
        fits &= (away >= rims + FREE_MM).all(axis=1) & (away >= OWN * own[:, None]).all(axis=1)
        fits &= (_to_segment(others, start, end) >= TICK_MM).all(axis=1) | (start == end).all(axis=1)
    for x, y, wide, high in obstacles:
        fits &= ~(np.abs(middle - [x, y]) < half + np.array([wide, high]) + FREE_MM).all(axis=1)
    return _Candidates(middle[fits], end[fits], start[fits], cost[fits].astype(float))


def _reach(u: Float[np.ndarray, "d 2"], half: Float[np.ndarray, " 2"], distance: float) -> Float[np.ndarray, " d"]:
    """How far along each direction the middle of a box lies whose nearest point is so far away."""
    low, high = np.zeros(len(u)), np.full(len(u), distance + float(np.hypot(*half)))
    for _ in range(30):
        t = (low + high) / 2
        away = np.hypot(*np.maximum(np.abs(t[:, None] * u) - half, 0).T)
        low, high = np.where(away < distance, t, low), np.where(away < distance, high, t)
    return high


def _to_box(
    points: Float[np.ndarray, "m 2"], middle: Float[np.ndarray, "c 2"], half: Float[np.ndarray, " 2"]
) -> Float[np.ndarray, "c m"]:
    return np.linalg.norm(np.maximum(np.abs(points[None] - middle[:, None]) - half, 0), axis=2)


def _to_segment(
    points: Float[np.ndarray, "m 2"], start: Float[np.ndarray, "c 2"], end: Float[np.ndarray, "c 2"]
) -> Float[np.ndarray, "c m"]:
    along = end - start
    t = (
        np.einsum("cmx,cx->cm", points[None] - start[:, None], along)
        / np.maximum((along**2).sum(axis=1), 1e-12)[:, None]
    )
    nearest = start[:, None] + np.clip(t, 0, 1)[..., None] * along[:, None]
    return np.linalg.norm(points[None] - nearest, axis=2)


def _clash(
    a: _Candidates, size_a: Float[np.ndarray, " 2"], b: _Candidates, size_b: Float[np.ndarray, " 2"]
) -> Bool[np.ndarray, "c d"]:
    """Which candidates of two markers may not be chosen together."""
    half = (size_a + size_b) / 2 + APART_MM
    boxes = (np.abs(a.middle[:, None] - b.middle[None]) < half).all(axis=2)
    steps = np.linspace(0, 1, 9)[:, None, None]
    for ticked, boxed, room in ((a, b, size_b), (b, a, size_a)):
        along = ticked.start + steps * (ticked.end - ticked.start)  # t c 2
        over = (np.abs(along[:, :, None] - boxed.middle) < room / 2 + FREE_MM).all(axis=3).any(axis=0)
        over &= (ticked.start != ticked.end).any(axis=1)[:, None]
        boxes |= over if ticked is a else over.T
    return boxes | _cross(a, b)


def _cross(a: _Candidates, b: _Candidates) -> Bool[np.ndarray, "c d"]:
    """Which ticks cross."""

    def turn(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    p, q, r, s = a.start[:, None], a.end[:, None], b.start[None], b.end[None]
    return (turn(p, q, r) * turn(p, q, s) < 0) & (turn(r, s, p) * turn(r, s, q) < 0)
