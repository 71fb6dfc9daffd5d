"""What of a file belongs to the rig that is shown: not the heads that were left beside or on the face.

Sculptors leave the heads behind that blendshapes were made from, and games keep the face a second time with fewer
vertices. Both repeat the face and do not move; they would hide its skin, or get markers themselves.

Data       meshes of a scene (or parts of a file, or large loose pieces of one mesh); which of them the blendshapes move
Face       the meshes that many blendshapes move, and large among these
Copy       of a face: as many vertices in the same triangles, in any pose and a little reshaped; or nearly as many over
           nearly the same surface; or any number on the same surface, seen from both sides: a cap lies on the face, but
           the face does not lie on the cap
With it    what stands to a copy as eyes and teeth do to the face

What moves is never left out, nor what is not as large as a face; an eye, being round, is no face.
Letters: v vertices, f triangles, n points.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.face.flying import flying
from capture_plan.face.skin import is_ball
from capture_plan.formats.naming import listed, one_line, sentences
from capture_plan.formats.raw import RawRig
from capture_plan.formats.weld import weld_seams
from capture_plan.mesh import piece_areas, pieces, rigid_fit, triangle_areas

MOVES = 1e-3  # of the largest displacement: less is rounding
MANY = 0.5  # of the blendshapes that move the mesh that most of them move
LARGE = 0.3  # of the area of the largest such mesh, and of a loose piece of the face
SAME_SIZE = 1.4  # between two faces: an open mouth makes a head a fifth longer
NEARLY = 0.03  # of the vertices: seams are welded otherwise where nothing moves
RESHAPED = 0.1  # rms of a copy in the same triangles against the face, of its diagonal: an open jaw makes 0.03
FEW_POINTS, POINTS, MORE_POINTS = 500, 2_000, 20_000  # on either surface; the last lie 3 mm apart on a head
MIDDLE, MOST = 0.012, 0.03  # of the diagonal: how near half and most points of one surface lie to the other
COVERING, COVERED = 0.9, 0.8  # most of a copy's points, and of the face's: copies often lack the inside of the mouth
ON = 0.006  # of the diagonal, 2 mm: half the vertices of a level of detail lie so near the face, those of cloth do not
ASIDE = 0.2  # of the diagonal: what lies so far off its original stands beside it
ALIKE, SWUNG = (
    0.01,
    0.15,
)  # of the diagonal: how near a piece beside a copy lies to what it repeats; teeth of an open jaw


@dataclass(frozen=True, eq=False)
class Body:
    """A mesh of the scene, or a loose piece of one: `at` are its vertices in the rig, `triangles` count within them."""

    title: str
    at: Int[np.ndarray, " v"]
    points: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]

    @cached_property
    def box(self) -> Float[np.ndarray, "2 3"]:
        """The lowest and the highest corner, (2 3)."""
        return np.stack([self.points.min(axis=0), self.points.max(axis=0)])

    @cached_property
    def size(self) -> float:
        """The diagonal of the box around it."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    @cached_property
    def area(self) -> float:
        """The area of its whole surface."""
        return float(triangle_areas(self.points, self.triangles).sum())

    @cached_property
    def sample(self) -> Float[np.ndarray, "n 3"]:
        """Points spread evenly over the surface, the same every time."""
        areas, random = triangle_areas(self.points, self.triangles), np.random.default_rng(0)
        chosen = random.choice(len(areas), MORE_POINTS, p=areas / areas.sum())
        a, b = np.sort(random.random((2, MORE_POINTS)), axis=0)
        shares = np.stack([a, b - a, 1 - b], axis=1)
        return np.einsum("nc,ncx->nx", shares, self.points[self.triangles[chosen]])

    @cached_property
    def tree(self) -> KDTree:
        """Its points, to search in."""
        return KDTree(self.sample)


@dataclass(frozen=True, eq=False)
class Copy:
    """A body that repeats the face, which the rotation R and the translation t lay on it: R p + t."""

    body: Body
    face: Body
    R: Float[np.ndarray, "3 3"]
    t: Float[np.ndarray, " 3"]


def what_belongs(raw: RawRig) -> RawRig:
    """The rig with its seams closed and without copies of the face that do not move; its note names them."""
    meshes = raw.parts if raw.meshes is None else raw.meshes.astype(np.int64) * len(raw.part_names) + raw.parts
    raw = weld_seams(raw, meshes)
    spare = spare_bodies(raw)
    if not spare:
        return raw
    names = tuple(dict.fromkeys(body.title for body in spare))
    message = f"what repeats the face without moving (target heads, levels of detail) was left out: {listed(names)}"
    without = leave_out(raw, np.concatenate([body.at for body in spare]))
    return replace(without, left_out=(*raw.left_out, *names), note=sentences(raw.note, message))


def spare_bodies(raw: RawRig) -> list[Body]:
    """Copies of the face that do not move, and what goes with them."""
    flies = flying(raw.neutral, raw.triangles, raw.deltas)
    moves = np.linalg.norm(raw.deltas if flies.all() else raw.deltas[~flies], axis=2)
    moves = moves > MOVES * moves.max()
    moving = moves.any(axis=0)
    every = list(loose_bodies(raw))
    faces = find_faces([body for body in every if moving[body.at].any()], moves)
    faces += [piece for face in faces for piece in loose_pieces(face, face.area) if moving[piece.at].any()]
    copies = [copy for body in every for copy in copies_in(body, faces, moving)]
    still = [body for body in every if not moving[body.at].any() and all(body is not copy.body for copy in copies)]
    spare = {id(copy.body): copy.body for copy in copies}
    spare |= {id(body): body for copy in copies for body in goes_with(copy, still, every)}
    return list(spare.values())


def loose_bodies(raw: RawRig) -> Iterator[Body]:
    """The meshes of a rig, or its parts where the file does not tell meshes apart."""
    number = raw.parts if raw.meshes is None else raw.meshes
    for one in np.unique(number):
        triangles = raw.triangles[(number == one)[raw.triangles].all(axis=1)]
        if len(triangles):
            at, inner = np.unique(triangles, return_inverse=True)
            titles = list(dict.fromkeys(raw.part_names[part] for part in np.unique(raw.parts[at])))
            title = titles[0] if len(titles) == 1 else titles[0].rpartition("/")[0] or titles[0]
            yield Body(one_line(title), at, raw.neutral[at], inner.reshape(-1, 3))


def find_faces(moving: list[Body], moves: Bool[np.ndarray, "k v"]) -> list[Body]:
    """Of the bodies that move, those that many blendshapes move and that are large."""
    counts = [int(moves[:, body.at].any(axis=1).sum()) for body in moving]
    many = [body for body, count in zip(moving, counts, strict=True) if count >= MANY * max(counts, default=0)]
    largest = max((body.area for body in many), default=0.0)
    return [body for body in many if body.area >= LARGE * largest > 0 and not is_ball(body.points)]


def loose_pieces(body: Body, area: float) -> list[Body]:
    """Connected pieces of a body that are large beside this area, where it has several pieces."""
    piece = pieces(body.triangles, len(body.points))
    areas = piece_areas(body.points, body.triangles, piece)
    if len(areas) == 1:
        return []
    found = []
    for one in np.flatnonzero(areas >= LARGE * area):
        triangles = body.triangles[piece[body.triangles[:, 0]] == one]
        at, inner = np.unique(triangles, return_inverse=True)
        title = f"a piece of {body.title} ({len(at):,} vertices)"
        found.append(Body(title, body.at[at], body.points[at], inner.reshape(-1, 3)))
    return found


def copies_in(body: Body, faces: list[Body], moving: Bool[np.ndarray, " v"]) -> Iterator[Copy]:
    """The body itself, if it repeats a face, or else those of its pieces that do."""
    if any(body is face for face in faces) or not faces:
        whole = None
    else:
        whole = None if moving[body.at].any() else first_copy(body, faces)
    if whole is not None:
        yield whole
        return
    for piece in loose_pieces(body, max(face.area for face in faces) if faces else np.inf):
        if not moving[piece.at].any() and (copy := first_copy(piece, faces)) is not None:
            yield copy


def first_copy(body: Body, faces: list[Body]) -> Copy | None:
    """How the body repeats one of the faces, if it does."""
    if not body.area > 0 or is_ball(body.points):
        return None
    found = (repeats(body, face) for face in faces)
    return next((copy for copy in found if copy is not None), None)


def repeats(body: Body, face: Body, *, moves_too: bool = False) -> Copy | None:
    """How the body repeats the face: in the same triangles, or over the same surface.

    A body that `moves_too` is no cloth, so a coarser level of detail counts; nor is it a copy if it is the face's
    mirror image, as a right hand is a left one's.
    """
    if len(body.points) == len(face.points) and body.triangles.shape == face.triangles.shape:
        same = (body.triangles == face.triangles).all(axis=1).mean()
        R, t = rigid_fit(body.points, face.points)
        off = float(np.sqrt(((body.points @ R.T + t - face.points) ** 2).sum(axis=1).mean()))
        if same > 1 - NEARLY and off <= RESHAPED * face.size:
            return None if moves_too and mirrored(body.points, face.points, off) else Copy(body, face, R, t)
    sides = np.ptp(body.box, axis=0) / np.maximum(np.ptp(face.box, axis=0), 1e-12)
    if not ((sides >= 1 / SAME_SIZE) & (sides <= SAME_SIZE)).all():
        return None
    t = over(body, face, moves_too=moves_too)
    return None if t is None else Copy(body, face, np.eye(3), t)


def mirrored(a: Float[np.ndarray, "n 3"], b: Float[np.ndarray, "n 3"], off: float) -> bool:
    """Whether the mirror image of a lies nearer to b, turned and moved, than a itself, which lies `off` (rms)."""
    image = a * [-1, 1, 1]
    R, t = rigid_fit(image, b)
    return float(np.sqrt(((image @ R.T + t - b) ** 2).sum(axis=1).mean())) < off


def over(body: Body, face: Body, *, moves_too: bool = False) -> Float[np.ndarray, " 3"] | None:
    """The translation that lays the body's surface over the face's, if it then covers it and is covered."""
    theirs, ours = body.sample, face.sample
    t = face.box.mean(axis=0) - body.box.mean(axis=0)
    for _ in range(8):
        gap, near = face.tree.query(theirs[:FEW_POINTS] + t)
        if np.median(gap) > 3 * MIDDLE * face.size:
            return None
        t = t + np.median(ours[near] - theirs[:FEW_POINTS] - t, axis=0)
    nearly = abs(len(body.points) - len(face.points)) <= NEARLY * len(face.points)  # then it may be sculpted
    to_face, to_body = face.tree.query(theirs[:POINTS] + t)[0], body.tree.query(ours[:POINTS] - t)[0]
    gaps = ((to_face, COVERED if nearly else COVERING), (to_body, COVERED))
    fits = all(np.median(gap) <= MIDDLE * face.size and np.quantile(gap, q) <= MOST * face.size for gap, q in gaps)
    on = moves_too or nearly or np.median(face.tree.query(body.points + t)[0]) <= ON * face.size
    return t if fits and on else None


def goes_with(copy: Copy, still: list[Body], every: list[Body]) -> Iterator[Body]:
    """Still bodies beside a copy that lie, laid on the face with it, where the rig has the same already."""
    shift = np.linalg.norm(copy.body.points.mean(axis=0) - copy.face.points.mean(axis=0))
    if shift < ASIDE * copy.face.size:
        return
    home, away = copy.face.box.mean(axis=0), copy.body.box.mean(axis=0)
    at_home = [
        b for b in every if np.linalg.norm(b.box.mean(axis=0) - home) < np.linalg.norm(b.box.mean(axis=0) - away)
    ]
    for body in still:
        middle = body.box.mean(axis=0)
        if np.linalg.norm(middle - away) >= np.linalg.norm(middle - home):
            continue
        laid = body.points @ copy.R.T + copy.t
        if any(lies_on(laid, other, copy.face.size) for other in at_home if other is not body):
            yield body


def lies_on(points: Float[np.ndarray, "n 3"], other: Body, size: float) -> bool:
    """Whether the points lie on the vertices of a body about as large as they reach, or near as many vertices."""
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    if not 1 / SAME_SIZE <= extent / max(other.size, 1e-12) <= SAME_SIZE:
        return False
    limit = size * (SWUNG if len(points) == len(other.points) else ALIKE)
    return bool(np.quantile(KDTree(other.points).query(points)[0], 0.9) <= limit)


def leave_out(raw: RawRig, at: Int[np.ndarray, " n"]) -> RawRig:
    """The rig without these vertices, and without parts that were theirs alone."""
    retained = np.setdiff1d(np.arange(len(raw.neutral)), at)
    number = np.full(len(raw.neutral), -1)
    number[retained] = np.arange(len(retained))
    triangles = number[raw.triangles]
    used, parts = np.unique(raw.parts[retained], return_inverse=True)
    return replace(
        raw,
        neutral=raw.neutral[retained],
        triangles=triangles[(triangles >= 0).all(axis=1)].astype(np.int32),
        deltas=np.ascontiguousarray(raw.deltas[:, retained]),
        parts=parts.reshape(-1).astype(np.int32),
        part_names=tuple(raw.part_names[part] for part in used),
        source_index=raw.source_index[retained],
        meshes=None if raw.meshes is None else raw.meshes[retained],
    )
