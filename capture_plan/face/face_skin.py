"""What of a head's skin a face says more about than the mesh alone: no clothes and no body, and every part that moves.

Data       e  middle of the eyes, m mouth, u pupil distance, h = e_y - m_y, c the chin; all in millimetres
Front      what lies between brow and chin, no further to the side than CHEEK u and no further back than DEEP u
Body       a part (a mesh or material) or a loose piece with most of its area below the upper neck, that has nothing in
           front and is not called skin, is a garment or a body: a shirt's collar goes with its shirt
Neck       where skin goes on past LONG_NECK times the way from the eyes down to the chin, or WIDE u to the side below
           it, it is a bust: only what lies above the upper neck, UPPER_NECK times that way, is kept
Called     a part called eye or brow that is one sheet from side to side and moves is the face around the eyes
Own        seen pieces on the front are skin where most of what they do, the skin so far hardly takes part in: lids,
           brows and lips of a drawn face are loose plates. What a sideways look moves is an eye, no lid
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.face.profile import find_chin
from capture_plan.mesh import piece_areas, vertex_areas

AROUND_EYES = re.compile(r"eye|brow", re.IGNORECASE)
USUAL_CHIN = 1.6  # h below the eyes, where no chin is found: people 1.5 to 1.75
CHEEK, DEEP, BROW = 1.0, 1.0, 0.7  # u from the midline, behind the eyes, above them
UPPER_NECK = 1.4  # times the eyes' height over the chin: 45 mm below a human chin
LONG_NECK, WIDE = 2.2, 2.05  # twelve heads that end with the neck have up to 2.05 and 1.93, seven busts from 2.37
MOSTLY = 0.5  # of an area
SHEET = 1.2  # u: from side to side; an eye has at most 0.9
MIDDLE = 0.15  # u from the midline
CARRIES = 0.1  # of a movement's energy: what a piece takes part with
LITTLE = 0.5  # of what the loose pieces move: a lash line goes with a lid that moves twice as much
LEFT = 0.1  # of the largest front: hair and collars reach into it
LOOKS = 0.1  # of a sideways look's energy: more is an eye
SEEN = 0.4  # of the hemisphere, as every piece of skin
FLAT = 1e-4  # u^2: a piece that is folded away at rest


@dataclass(frozen=True, eq=False)
class FacePlace:
    """Eyes (left, right) and mouth of a head in millimetres, the midline x0, and which deltas look to a side."""

    eyes: Float[np.ndarray, "2 3"]
    mouth: Float[np.ndarray, " 3"]
    x0: float
    looks: Bool[np.ndarray, " k"]

    @property
    def e(self) -> Float[np.ndarray, " 3"]:
        """e, the middle of the eyes."""
        return self.eyes.mean(axis=0)

    @property
    def u(self) -> float:
        """u, the distance between the pupils."""
        return float(np.linalg.norm(self.eyes[0] - self.eyes[1]))

    @property
    def h(self) -> float:
        """Height of the eyes over the mouth."""
        return float(self.e[1] - self.mouth[1])

    def chin_y(self, points: Float[np.ndarray, "n 3"]) -> float:
        """Height of the chin of a skin."""
        chin = find_chin(points[np.abs(points[:, 0] - self.x0) < MIDDLE * self.u], self.e, self.mouth, self.u)
        return float(self.e[1] - USUAL_CHIN * self.h if chin is None else chin[1])

    def front(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Which points lie where a face has its front."""
        x, y, z = ((points - [self.x0, *self.e[1:]]) / self.u).T
        return (np.abs(x) < CHEEK) & (y < BROW) & (y > -USUAL_CHIN * self.h / self.u) & (z > -DEEP)


def around_eyes(
    neutral: Float[np.ndarray, "v 3"],
    piece: Int[np.ndarray, " v"],
    moving: Bool[np.ndarray, " v"],
    parts: Int[np.ndarray, " v"],
    part_names: tuple[str, ...],
    face: FacePlace,
) -> Bool[np.ndarray, " v"]:
    """Vertices of parts called eye or brow that are one moving sheet from side to side: the face around the eyes."""
    found = np.zeros(len(neutral), dtype=bool)
    x = neutral[:, 0] - face.x0
    for i in [i for i, name in enumerate(part_names) if AROUND_EYES.search(name)]:
        for number in np.unique(piece[parts == i]):
            of = (parts == i) & (piece == number)
            wide = min(x[of].max(), -x[of].min()) > SHEET / 2 * face.u
            if wide and (of & moving).any() and (of & (np.abs(x) < MIDDLE * face.u) & face.front(neutral)).any():
                found |= of
    return found


def bodies(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    group: Int[np.ndarray, " v"],
    face: FacePlace,
    neck_y: float,
    bare: Bool[np.ndarray, " v"],
) -> Bool[np.ndarray, " v"]:
    """Vertices of the groups (parts or pieces) that lie mostly below the upper neck and hold nothing of the front."""
    a = vertex_areas(neutral, triangles)
    low, front, whole = (
        np.bincount(group, a * which, group.max() + 1)
        for which in (neutral[:, 1] < neck_y, face.front(neutral), np.ones(len(a)))
    )
    out = (low > MOSTLY * whole) & (front < LEFT * front.max(initial=0))
    return out[group] & ~bare


def above_neck(
    neutral: Float[np.ndarray, "v 3"], skin: Bool[np.ndarray, " v"], face: FacePlace, chin_y: float
) -> Bool[np.ndarray, " v"]:
    """The skin without the body that it goes on into; a head that ends with its neck is left whole."""
    low = skin & (neutral[:, 1] < chin_y)
    if not low.any():
        return skin
    deep = face.e[1] - neutral[low, 1].min() > LONG_NECK * (face.e[1] - chin_y)
    wide = np.abs(neutral[low, 0] - face.x0).max() > WIDE * face.u
    return skin & (neutral[:, 1] >= upper_neck(face, chin_y)) if deep or wide else skin


def upper_neck(face: FacePlace, chin_y: float) -> float:
    """Height down to which the neck belongs to the head."""
    return float(face.e[1] - UPPER_NECK * (face.e[1] - chin_y))


def own_movers(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    piece: Int[np.ndarray, " v"],
    seen: Float[np.ndarray, " v"],
    skin: Bool[np.ndarray, " v"],
    face: FacePlace,
) -> Bool[np.ndarray, " v"]:
    """Vertices of the loose pieces that movements of the face move for themselves, without eyes."""
    energy = vertex_areas(neutral, triangles) * np.einsum("kvx,kvx->kv", deltas, deltas)
    total = energy.sum(axis=1, keepdims=True, dtype=float)
    energy = energy / np.where(total > 0, total, 1)
    area = piece_areas(neutral, triangles, piece)
    front = face.front(neutral)
    found, can = np.zeros_like(skin), []
    for number in np.unique(piece[front & ~skin & (energy.max(axis=0) > 0)]):
        of = piece == number
        eye = (energy[np.ix_(face.looks, of)].sum(axis=1) > LOOKS).any()
        if area[number] > FLAT * face.u**2 and np.median(seen[of]) >= SEEN and front[of].all() and not eye:
            can.append(of)
    if can:
        share = np.stack([energy[:, of].sum(axis=1) for of in can])
        alone = energy[:, skin].sum(axis=1) < LITTLE * share.sum(axis=0)
        for of, does in zip(can, share > CARRIES, strict=True):
            found |= of & (does.any() and alone[does].mean() >= MOSTLY)
    return found
