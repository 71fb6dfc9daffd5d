"""Surfaces that pass through each other when blendshapes are performed at once: a rig can show that, no face can.

Data       x[n]       points of one surface in a pose       p[m], n[m]   vertices and unit normals of another, same pose
Depth      D[n] = -(x - p) . n at the nearest p, 0 where that is negative: how deep x lies behind that surface
           Nothing is said where p is further off than EXTENT_MM, on the border of its mesh, or aside rather than before
           x: there the surface ends or bends away, and x may well pass beside it
Tests      lower lip in upper lip and back, upper lid in lower lid and back, lids in eyeballs, teeth before the lips
Excess     D[combined] - max(D[neutral], D[each movement alone]), per point: a lid that touches its ball at rest, or a
           blendshape that is built through the teeth, is a matter of the rig and no reason to keep two apart
Left and right partners are one movement; a corrective is taken together with what it corrects, as it is performed.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec import Struct
from scipy.spatial import KDTree

from capture_plan.anatomy.delta_relations import correctives
from capture_plan.expressions.groups import grouped, said_as_one
from capture_plan.expressions.surfaces import ContactSurface, touching_surfaces
from capture_plan.mesh import vertex_normals
from capture_plan.once import once
from capture_plan.progress import track
from capture_plan.rig import Rig

TOUCH_MM = 1.0  # lips and lids are soft and give way by about a millimetre; deeper is a pose that flesh cannot take
EXTENT_MM = 6.0  # half as thick as a lip; deeper than that a point may as well have come out on the other side
ASIDE = 0.7  # least cosine between x - p and the normal: 45 degrees
FEWEST = 3  # vertices: one or two are where the triangles are too large to tell
STILL_MM = 0.05  # a movement below it changes no depth that counts

_Pose = dict[str, float]


class Collision(Struct, frozen=True, forbid_unknown_fields=True):
    """`what` passes through what, in plain words; how many vertices do by more than TOUCH_MM, and the deepest."""

    what: str
    vertices: int
    depth_mm: float


def collisions(rig: Rig, pose: _Pose) -> tuple[Collision, ...]:
    """What passes through what in a pose, beyond what each of its movements does alone; the deepest first."""
    scene = _scene(rig)
    movements = [{name: pose[name] for name in group} for group in grouped(rig, tuple(pose))]
    return scene.found(pose, [scene.performed(movement) for movement in movements])


@once
def colliding_pairs(
    rig: Rig, used: tuple[str, ...], together: tuple[tuple[str, str], ...]
) -> tuple[tuple[str, str], ...]:
    """Pairs of `used` blendshapes that are fine alone and collide when performed at once, in the order of `used`.

    Partners in `together` are judged together, as they are performed; the first of each stands for both. Blendshapes
    with one phrase in common, as both lips rolled in, are one movement that people make: there only the sum is wrong.
    A movement of TOUCH_MM / 2 brings a point and a surface at most TOUCH_MM closer to each other: it is not tried.
    """
    scene = _scene(rig)
    second = {b for _, b in together}
    partner = dict(together)
    items = [(name, partner[name]) if name in partner else (name,) for name in used if name not in second]
    poses = [scene.performed(dict.fromkeys(item, 1.0)) for item in items]
    far = np.array([scene.farthest_mm(pose) for pose in poses]).reshape(len(poses), -1) > TOUCH_MM / 2
    return tuple(
        (items[i][0], items[j][0])
        for i in track(range(len(items)), "Trying pairs of movements")
        for j in (i + 1 + np.flatnonzero((far[i] & far[i + 1 :]).any(axis=1))).tolist()
        if not said_as_one(rig, items[i] + items[j]) and scene.found(poses[i] | poses[j], [poses[i], poses[j]])
    )


def depth_behind(
    points: Float[np.ndarray, "n 3"],
    surface: Float[np.ndarray, "m 3"],
    normals: Float[np.ndarray, "m 3"],
    border: Bool[np.ndarray, " m"],
) -> Float[np.ndarray, " n"]:
    """D, millimetres: 0 for points in front of the surface and for those of which nothing can be said."""
    away, nearest = KDTree(surface).query(points, distance_upper_bound=EXTENT_MM)
    near = np.isfinite(away)
    p, depth = np.asarray(nearest)[near], np.zeros(len(points))
    behind = -np.einsum("nx,nx->n", points[near] - surface[p], normals[p])
    depth[near] = np.where(border[p] | (behind < ASIDE * away[near]), 0, np.maximum(behind, 0))
    return depth


@dataclass(frozen=True, eq=False)
class Test:
    """Points of a face that may come to lie behind a surface of it."""

    what: str
    points: Int[np.ndarray, " n"]
    surface: ContactSurface

    def depth(self, vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, " n"]:
        """D in a pose of the whole rig, millimetres."""
        surface = vertices[self.surface.vertices]
        normals = vertex_normals(surface, self.surface.triangles)
        return depth_behind(vertices[self.points], surface, normals, self.surface.border)


@dataclass(frozen=True, eq=False)
class _Scene:
    """The tests of one rig, which blendshapes matter to each, and what was found of poses asked before."""

    rig: Rig
    tests: tuple[Test, ...]
    matters: tuple[frozenset[str], ...]
    number: dict[str, int]
    drivers: dict[str, tuple[str, ...]]
    known: dict[tuple[int, tuple[tuple[str, float], ...]], Float[np.ndarray, " n"]]

    def farthest_mm(self, pose: _Pose) -> list[float]:
        """How far the points and the surface of each test move at most."""
        return [
            float(
                np.linalg.norm(sum(w * self.rig.deltas[self.number[name], at] for name, w in pose.items()), axis=1).max(
                    initial=0
                )
            )
            for at in (np.concatenate([test.points, test.surface.vertices]) for test in self.tests)
        ]

    def performed(self, pose: _Pose) -> _Pose:
        """A pose with what its correctives correct."""
        return pose | {name: 1.0 for corrective in pose for name in self.drivers.get(corrective, ())}

    def found(self, pose: _Pose, alone: list[_Pose]) -> tuple[Collision, ...]:
        """Collisions of a pose beyond those of the poses that it is made of."""
        found = []
        for t, test in enumerate(self.tests):
            moving = [each for each in alone if not self.matters[t].isdisjoint(each)]
            if len(moving) < min(len(alone), 2):
                continue  # all is as it is alone
            depth = self.depth(t, pose)
            if np.count_nonzero(depth > TOUCH_MM) < FEWEST:
                continue  # nor is the excess deeper
            excess = depth - np.max([self.depth(t, each) for each in [{}, *moving]], axis=0)
            deep = int(np.count_nonzero(excess > TOUCH_MM))
            if deep >= FEWEST:
                found.append(Collision(test.what, deep, round(float(excess.max()), 2)))
        return tuple(sorted(found, key=lambda collision: (-collision.depth_mm, collision.what)))

    def depth(self, t: int, pose: _Pose) -> Float[np.ndarray, " n"]:
        """D of test t with those blendshapes of a pose that matter to it."""
        weights = tuple(sorted((name, w) for name, w in pose.items() if name in self.matters[t]))
        if (t, weights) not in self.known:
            test = self.tests[t]
            at = np.concatenate([test.points, test.surface.vertices])
            vertices = np.zeros_like(self.rig.neutral)
            vertices[at] = self.rig.neutral[at]
            for name, weight in weights:
                vertices[at] += weight * self.rig.deltas[self.number[name], at]
            self.known[t, weights] = test.depth(vertices)
        return self.known[t, weights]


@once
def _scene(rig: Rig) -> _Scene:
    tests = tuple(Test(what, points, surface) for what, points, surface in touching_surfaces(rig))
    matters = tuple(_moving(rig, np.concatenate([test.points, test.surface.vertices])) for test in tests)
    drivers = {f.blendshapes[0]: f.blendshapes[1:] for f in correctives(rig, rig.names)}
    return _Scene(rig, tests, matters, {name: k for k, name in enumerate(rig.names)}, drivers, {})


def _moving(rig: Rig, at: Int[np.ndarray, " n"]) -> frozenset[str]:
    """Blendshapes that move one of some vertices."""
    moves = rig.displacement[:, at].max(axis=1) > STILL_MM
    return frozenset(name for name, does in zip(rig.names, moves.tolist(), strict=True) if does)
