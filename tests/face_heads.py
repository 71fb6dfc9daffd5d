"""Heads of many kinds made from the bundled sample, each with the places of its eyes and mouth by construction.

A `Head` is in the rig's frame: millimetres, +y up, facing +z, the subject's left +x. Every kind is a function from a
head to a head; what a kind does to space (`bend`), it does to the places as well, so they stay true.
Letters: v vertices, f triangles, k blendshapes, n points of a ring.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from capture_plan.mesh import border_edges, half_edges, pieces, vertex_normals
from capture_plan.sample import sample_rig

# on the midline, between the lowest vertex of the upper and the highest of the lower lip
MOUTH = np.array([0.0, 668.2, 146.6])
NECK = 610.0  # height below which the sample is neck alone
SOLES = -860.0  # of a person of 1.7 m whose crown is the sample's
AROUND = 44  # points of a ring, as many as the sample's neck ends in


@dataclass(frozen=True, eq=False)
class Head:
    """Arrays as in `Rig`; places of the eyes (between the eyeball's middle and its front) and of the mouth.

    Where eyes are so deep that neither their middle nor their front is near that place, `eye_depth` says how much
    further forward or back an answer may lie.
    """

    neutral: np.ndarray
    triangles: np.ndarray
    deltas: np.ndarray
    names: tuple[str, ...]
    parts: np.ndarray
    part_names: tuple[str, ...]
    eye_left: np.ndarray
    eye_right: np.ndarray
    mouth: np.ndarray
    eye_depth: float = 0.0

    def of(self, *names: str) -> np.ndarray:
        """Vertices of the parts whose names begin so."""
        return np.isin(self.parts, [i for i, name in enumerate(self.part_names) if name.startswith(names)])


@cache
def sample_head() -> Head:
    """The bundled sample."""
    rig = sample_rig()
    balls = [rig.neutral[rig.parts == rig.part_names.index(name)] for name in ("eye_L", "eye_R")]
    eyes = [
        np.append(b.min(axis=0)[:2] + b.max(axis=0)[:2], 0.5 * b[:, 2].min() + 1.5 * b[:, 2].max()) / 2 for b in balls
    ]
    arrays = (rig.neutral, rig.triangles, rig.deltas, rig.names, rig.parts, rig.part_names)
    return Head(*arrays, eye_left=eyes[0], eye_right=eyes[1], mouth=MOUTH)


def visible_skin(head: Head) -> np.ndarray:
    """Skin of the sample without the bags of mouth and eye sockets, for heads with the sample's vertices first."""
    skin = np.zeros(len(head.neutral), dtype=bool)
    skin[: len(sample_rig().skin)] = sample_rig().skin
    return skin


# ---------------------------------------------------------------- operations
def cut(head: Head, retained: np.ndarray) -> Head:
    """The triangles all of whose vertices are kept."""
    triangles = head.triangles[retained[head.triangles].all(axis=1)]
    used = np.unique(triangles)
    return replace(
        head,
        neutral=head.neutral[used],
        triangles=np.searchsorted(used, triangles).astype(np.int32),
        deltas=head.deltas[:, used],
        parts=head.parts[used],
    )


def add(head: Head, mesh: tuple[np.ndarray, np.ndarray], part: str, deltas: np.ndarray | None = None) -> Head:
    """One more piece; it stands still unless its own deltas are given."""
    vertices, triangles = mesh
    names = head.part_names if part in head.part_names else (*head.part_names, part)
    if deltas is None:
        deltas = np.zeros((len(head.names), len(vertices), 3), dtype=np.float32)
    return replace(
        head,
        neutral=np.concatenate([head.neutral, vertices]),
        triangles=np.concatenate([head.triangles, triangles + len(head.neutral)]).astype(np.int32),
        deltas=np.concatenate([head.deltas, deltas.astype(np.float32)], axis=1),
        parts=np.append(head.parts, np.full(len(vertices), names.index(part))).astype(np.int32),
        part_names=names,
    )


def bend(head: Head, f: Callable[[np.ndarray], np.ndarray]) -> Head:
    """Space bent by f: neutral, every pose and the places."""
    neutral = f(head.neutral)
    moved = np.any(head.deltas != 0, axis=2)
    deltas = np.zeros_like(head.deltas)
    vertex = np.nonzero(moved)[1]
    deltas[moved] = f(head.neutral[vertex] + head.deltas[moved]) - neutral[vertex]
    eyes = f(np.stack([head.eye_left, head.eye_right, head.mouth]))
    return replace(head, neutral=neutral, deltas=deltas, eye_left=eyes[0], eye_right=eyes[1], mouth=eyes[2])


def stitch(head: Head, rings: list[np.ndarray], *, closed: bool) -> Head:
    """The skin of the neck's end carried on through rings of as many points, each beginning in front."""
    loop = neck_loop(head)
    rows = [loop, *(len(head.neutral) + len(loop) * i + np.arange(len(loop)) for i in range(len(rings)))]
    strips = [_strip(a, b) for a, b in pairwise(rows)]
    vertices = np.concatenate([*rings, np.empty((0, 3))])
    if closed:
        last = rings[-1] if rings else head.neutral[loop]
        strips.append(
            np.stack([np.full(len(loop), len(head.neutral) + len(vertices)), np.roll(rows[-1], -1), rows[-1]], 1)
        )
        vertices = np.concatenate([vertices, last.mean(axis=0, keepdims=True)])
    still = np.zeros((len(head.names), len(vertices), 3), dtype=np.float32)
    return replace(
        head,
        neutral=np.concatenate([head.neutral, vertices]),
        triangles=np.concatenate([head.triangles, *strips]).astype(np.int32),
        deltas=np.concatenate([head.deltas, still], axis=1),
        parts=np.append(head.parts, np.full(len(vertices), head.part_names.index("skin"))).astype(np.int32),
    )


def neck_loop(head: Head) -> np.ndarray:
    """Vertices of the neck's end, from the front over the subject's left to the back."""
    edges = border_edges(head.triangles[head.of("skin")[head.triangles].all(axis=1)])
    ends = np.unique(edges[(head.neutral[edges][:, :, 1] < NECK + 40).all(axis=1)])
    x, z = head.neutral[ends][:, 0], head.neutral[ends][:, 2]
    return ends[np.argsort(np.arctan2(x, z - (z.min() + z.max()) / 2) % (2 * np.pi))]


def _strip(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Two triangles between each pair of neighbours of an upper ring a and a lower ring b."""
    c, d = np.roll(a, -1), np.roll(b, -1)
    return np.concatenate([np.stack([a, b, c], 1), np.stack([c, b, d], 1)])


def ring(rx: float, rz: float, y: float, z: float = 33.0, x: float = 0.0, n: int = AROUND) -> np.ndarray:
    """An ellipse across +y, from the front over the subject's left."""
    a = 2 * np.pi * np.arange(n) / n
    return np.stack([x + rx * np.sin(a), np.full(n, y), z + rz * np.cos(a)], axis=1)


def tube(rings: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """A surface through rings from above, open at both ends."""
    n = len(rings[0])
    rows = [n * i + np.arange(n) for i in range(len(rings))]
    return np.concatenate(rings), np.concatenate([_strip(a, b) for a, b in pairwise(rows)])


def ellipsoid(centre: np.ndarray, radii: tuple[float, float, float], n: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """A closed shell."""
    steps = np.linspace(0.02, np.pi - 0.02, n)
    x, y, z = centre
    return tube([ring(radii[0] * np.sin(t), radii[2] * np.sin(t), y + radii[1] * np.cos(t), z, x, n) for t in steps])


def between(rings: list[np.ndarray], step: float = 30.0) -> list[np.ndarray]:
    """More rings, so that neighbours are about `step` apart in height."""
    out = []
    for a, b in pairwise(rings):
        count = max(1, int(np.ceil(np.abs((a - b)[:, 1]).max() / step)))
        out += [a + (b - a) * i / count for i in range(count)]
    return [*out, rings[-1]]


# ---------------------------------------------------------------- kinds of heads
def whole(head: Head) -> Head:
    return head


def mask(head: Head) -> Head:
    """An open face mask, cut like those that are sculpted: lids, lips and rim are open."""
    x, y, z = head.neutral.T
    return cut(head, visible_skin(head) & (abs(x) < 65) & (y > 624) & (y < 780) & (z > 90))


def mask_with_eyes(head: Head) -> Head:
    """A mask with eyeballs, teeth and lashes behind it."""
    x, y, z = head.neutral.T
    return cut(head, visible_skin(head) & (abs(x) < 65) & (y > 624) & (y < 780) & (z > 90) | ~head.of("skin"))


def bust(head: Head) -> Head:
    """Shoulders and a chest in one surface with the neck, open below."""
    shape = [ring(62, 58, 590), ring(120, 75, 555), ring(185, 95, 520), ring(180, 105, 400)]
    return stitch(head, between(shape), closed=False)


def body(head: Head) -> Head:
    """A person of 1.7 m: torso, arms in T pose that end in open sleeves, and closed legs."""
    shape = [ring(62, 58, 590), ring(120, 75, 555), ring(175, 95, 520), ring(150, 95, 250), ring(170, 110, -20)]
    figure = stitch(head, between(shape), closed=True)
    for side in (-1, 1):
        arm, triangles = tube(between([ring(52, 52, 0, 0, n=24), ring(38, 38, -480, 0, n=24)]))
        arm = np.stack([side * (175 - arm[:, 1]), 480 - side * arm[:, 0], 33 + arm[:, 2]], axis=1)
        figure = add(figure, (arm, triangles), "body")
        leg = [
            ring(75, 80, -20, x=85 * side, n=24),
            ring(45, 50, SOLES, x=85 * side, n=24),
            ring(1, 1, SOLES, x=85 * side, n=24),
        ]
        figure = add(figure, tube(between(leg)), "body")
    return figure


def clothed(head: Head) -> Head:
    """A shirt of its own over no body, whose two sleeves end in holes wider than the lids."""
    shape = [ring(70, 62, 625, 20), ring(120, 80, 570, 20), ring(170, 95, 540, 20), ring(170, 95, 380, 20)]
    shirt, triangles = tube(between(shape))
    hole = (abs(shirt[triangles].mean(axis=1)[:, 0]) > 130) & (shirt[triangles].mean(axis=1)[:, 1] < 545)
    return add(head, (shirt, triangles[~hole]), "shirt")


def cut_ears(head: Head) -> Head:
    """The ears are meshes of their own: they leave holes wider than the lids."""
    ears = np.array([[83.5, 729.8, 32.9], [-83.5, 729.8, 32.9]])
    near = np.linalg.norm(head.neutral[:, None] - ears, axis=2).min(axis=1) < 32
    parted = cut(head, ~near)
    away = cut(head, near & head.of("skin"))
    return add(parted, (away.neutral, away.triangles), "ears", away.deltas)


def earless(head: Head) -> Head:
    """The ears are gone: their holes are wider than the lids."""
    ears = np.array([[83.5, 729.8, 32.9], [-83.5, 729.8, 32.9]])
    return cut(head, np.linalg.norm(head.neutral[:, None] - ears, axis=2).min(axis=1) >= 32)


def horned(head: Head) -> Head:
    """Two horns on the forehead that stand far up and out."""
    for side in (-1, 1):
        steps = np.linspace(0, 1, 12)
        rings = [
            ring(16 * (1 - t) + 0.5, 16 * (1 - t) + 0.5, 815 + 150 * t, 95 - 40 * t, side * (45 + 60 * t**2), 16)
            for t in steps[::-1]
        ]
        head = add(head, tube(rings), "horns")
    return head


def hatted(head: Head) -> Head:
    """A hat with a brim."""
    shape = [ring(1, 1, 910, 45), ring(95, 105, 900, 45), ring(100, 110, 800, 45), ring(190, 200, 790, 45)]
    return add(head, tube(between(shape, 15)), "hat")


def haired(head: Head) -> Head:
    """Hair over the skull that hangs down behind to the shoulders."""
    shape = [
        ring(1, 1, 862, 20),
        ring(70, 80, 850, 20),
        ring(97, 112, 790, 15),
        ring(98, 100, 700, -5),
        ring(90, 60, 560, -45),
    ]
    vertices, triangles = tube(between(shape, 15))
    c = vertices[triangles].mean(axis=1)
    return add(head, (vertices, triangles[(c[:, 2] < 60) | (c[:, 1] > 800)]), "hair")


def bearded(head: Head) -> Head:
    """A beard that follows the jaw and hangs 60 mm below it."""
    _, y, z = head.neutral.T
    chin = cut(head, visible_skin(head) & (y < 660) & (y > 612) & (z > 70))
    grown = chin.neutral + 9 * vertex_normals(chin.neutral, chin.triangles)
    grown[:, 1] -= 60 * np.clip((655 - grown[:, 1]) / 45, 0, 1)
    return add(head, (grown, chin.triangles), "beard", chin.deltas)


def bespectacled(head: Head) -> Head:
    """Glasses: two round rims before the eyes that are wider than the lids."""
    flat, triangles = tube([ring(26, 26, 4, 0, n=32), ring(24, 24, 2, 0, n=32), ring(26, 26, 0, 0, n=32)])
    rim = flat[:, [0, 2, 1]] + [0.0, 0.0, 152.0]
    for eye in (head.eye_left, head.eye_right):
        head = add(head, (rim + eye * [1, 1, 0], triangles[:, ::-1]), "glasses")
    return head


def jewelled(head: Head) -> Head:
    """A round pearl below each ear, as large as an eyeball."""
    for side in (-1, 1):
        head = add(head, ellipsoid(np.array([side * 84.0, 680.0, 40.0]), (15, 15, 15), 16), "earrings")
    return head


def spare_close(head: Head) -> Head:
    """A sculpted head that was left beside, 190 mm away."""
    return _spare(head, np.array([190.0, 0, 0]), "mouthSmileLeft")


def spare_rows(head: Head) -> Head:
    """Three sculpted heads in a row beside, 350 mm apart."""
    for i, name in enumerate(head.names[:3]):
        head = _spare(head, np.array([350.0 * (i + 1), 0, 0]), name)
    return head


def spare_behind(head: Head) -> Head:
    """A copy of the whole head 300 mm behind."""
    return _spare(head, np.array([0.0, 0, -300]), "")


def _spare(head: Head, away: np.ndarray, shape: str) -> Head:
    first = cut(head, ~head.of("spare"))
    posed = first.neutral + first.deltas[first.names.index(shape)] if shape in first.names else first.neutral
    return add(head, (posed + away, first.triangles), f"spare_{shape or 'head'}")


def helmeted(head: Head) -> Head:
    """A closed shell around the head that never moves, by the name of a helmet."""
    return add(head, ellipsoid(np.array([0.0, 725, 55]), (150, 175, 165)), "helmet")


def caged(head: Head) -> Head:
    """The same shell without a telling name."""
    return add(head, ellipsoid(np.array([0.0, 725, 55]), (150, 175, 165)), "object_7")


def narrow_mouthed(head: Head) -> Head:
    """A mouth half as wide, its bag left out, above a neck that ends close below the chin."""
    short = cut(head, (head.neutral[:, 1] > 612) & visible_skin(head) | ~head.of("skin"))

    def squeeze(v: np.ndarray) -> np.ndarray:
        away = np.linalg.norm((v - MOUTH) * [0.5, 1, 1], axis=1)
        return v * np.stack([1 - 0.55 * np.exp(-((away / 30) ** 2)), np.ones(len(v)), np.ones(len(v))], axis=1)

    return bend(short, squeeze)


def closed_neck(head: Head) -> Head:
    """The neck's end is closed: the skin has no outer rim."""
    return stitch(head, [], closed=True)


def long_necked(head: Head) -> Head:
    """A neck 180 mm longer, open below."""
    loop = head.neutral[neck_loop(head)]
    return stitch(head, [loop - [0, 20.0 * i, 2.0 * i] for i in range(1, 10)], closed=False)


def skin_alone(head: Head) -> Head:
    """Skin alone, its bags left out: lids and lips are open, nothing lies behind them."""
    return cut(head, visible_skin(head))


def eyeless(head: Head) -> Head:
    """No eyeballs and no lashes."""
    return cut(head, ~head.of("eye_", "lashes"))


def one_eyed(head: Head) -> Head:
    """The right eyeball is missing, its lids stand open."""
    return cut(head, ~head.of("eye_R"))


def winking(head: Head) -> Head:
    """The right eyeball is missing, its lids are closed for good and no blink moves them."""
    if "eyeBlinkRight" not in head.names:
        return one_eyed(head)
    k = head.names.index("eyeBlinkRight")
    right = [k for k, name in enumerate(head.names) if name.startswith("eye") and name.endswith("Right")]
    deltas = head.deltas.copy()
    deltas[right] = 0
    others = [i for i in range(len(head.names)) if i not in right]
    shut = replace(
        head, neutral=head.neutral + head.deltas[k], deltas=deltas[others], names=tuple(head.names[i] for i in others)
    )
    return cut(shut, ~shut.of("eye_R", "lashes_R"))


def cartoon(head: Head) -> Head:
    """Eyes twice as large, head 0.6 as high."""

    def grow(v: np.ndarray) -> np.ndarray:
        out = v.astype(float)
        for eye in (head.eye_left, head.eye_right):
            off = v - eye
            w = np.exp(-((np.linalg.norm(off, axis=1) / 25) ** 2))[:, None] * ((v[:, :1] > 0) == (eye[0] > 0))
            out = out + w * off * np.stack([1 - np.exp(-((v[:, 0] / 15) ** 2)), *np.ones((2, len(v)))], axis=1)
        return out * [1, 0.6, 1]

    return replace(bend(head, grow), eye_depth=8.0)


def half_balls(head: Head) -> Head:
    """Eyes that are only the front halves of balls, as in most avatars."""
    front = head.neutral[:, 2] > head.neutral[head.of("eye_")][:, 2].mean() - 2
    return cut(head, front | ~head.of("eye_"))


def sealed(head: Head) -> Head:
    """A mask whose lids and lips have grown together: it has one border, its rim."""
    open_mask = mask(head)
    edges = border_edges(open_mask.triangles)
    for loop in _loops(edges):
        middle = open_mask.neutral[loop].mean(axis=0)
        if np.abs(open_mask.neutral[loop] - middle).max() < 40:
            open_mask = _capped(open_mask, edges[np.isin(edges, loop).all(axis=1)])
    return open_mask


def hands_apart(head: Head) -> Head:
    """Two hands that float 800 mm to the sides, and no body."""
    for side in (-1, 1):
        head = add(head, ellipsoid(np.array([side * 760.0, 420.0, 40.0]), (90, 25, 50), 20), "hands")
    return head


def one_armed(head: Head) -> Head:
    """A bust with a machine's arm on one side alone, which reaches high and far."""
    arm, triangles = tube(between([ring(45, 45, 900, n=20), ring(40, 40, 300, n=20)]))
    lean = np.stack([250 + 0.9 * (arm[:, 1] - 300), arm[:, 1], arm[:, 2] - 120], axis=1)
    lean[:, 0] += arm[:, 0]
    return add(bust(head), (lean, triangles), "machine_arm")


def _loops(edges: np.ndarray) -> list[np.ndarray]:
    """Vertices of every connected border."""
    used, ends = np.unique(edges, return_inverse=True)
    label = pieces(np.column_stack([ends.reshape(-1, 2), ends.reshape(-1, 2)[:, 1]]), len(used))
    return [used[label == number] for number in np.unique(label)]


def _capped(head: Head, edges: np.ndarray) -> Head:
    """A fan over these border edges around one new vertex, which moves as they do on average."""
    loop, v = np.unique(edges), len(head.neutral)
    directed = {tuple(edge) for edge in half_edges(head.triangles).tolist()}
    fan = [(v, b, a) if (a, b) in directed else (v, a, b) for a, b in edges.tolist()]
    return replace(
        head,
        neutral=np.concatenate([head.neutral, head.neutral[loop].mean(axis=0, keepdims=True)]),
        triangles=np.concatenate([head.triangles, fan]).astype(np.int32),
        deltas=np.concatenate([head.deltas, head.deltas[:, loop].mean(axis=1, keepdims=True)], axis=1),
        parts=np.append(head.parts, head.parts[loop[0]]).astype(np.int32),
    )


KINDS: dict[str, Callable[[Head], Head]] = {
    kind.__name__: kind
    for kind in (
        *(whole, mask, mask_with_eyes, bust, body, clothed, cut_ears, earless, horned, hatted, haired, bearded),
        *(bespectacled, jewelled, spare_close, spare_rows, spare_behind, helmeted, caged, narrow_mouthed, closed_neck),
        *(long_necked, skin_alone, eyeless, one_eyed, winking, cartoon),
        *(half_balls, sealed, hands_apart, one_armed),
    )
}
