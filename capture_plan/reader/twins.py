"""Copies of the face that move as well: levels of detail and spare heads that keep blendshapes of their own.

Data       bodies (meshes, or large loose pieces of one); which of them every blendshape moves
Main       of two bodies that repeat each other the one that more blendshapes move; of as many, the finer one; of two
           as fine, the first in the file
Copy       repeats a main face (`belongs.py`), and it is plain which is the lesser: it lies on the face, it is coarser,
           it has fewer blendshapes, or the same blendshapes move both, or its own move it as the main face is moved.
           Two heads that move each its own way are for a person to choose from (`face/shape.py`); plates drawn over a
           still head are no faces
With it    what stands to a copy beside the face as eyes and teeth do to the face, also in one mesh with it; meshes that
           are called of the same level as a copy on the face, and lie on another mesh
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.face.flying import flying
from capture_plan.face.skin import is_ball
from capture_plan.formats.naming import listed, sentences
from capture_plan.formats.raw import RawRig
from capture_plan.reader.belongs import (
    ASIDE,
    MOVES,
    Body,
    Copy,
    find_faces,
    goes_with,
    leave_out,
    lies_on,
    loose_bodies,
    loose_pieces,
    repeats,
)

AS_MANY = 0.8  # of the blendshapes that move another body
AS_FINE = 0.7  # of the vertices for an area: a level of detail has half of them; eyes in the same mesh make it denser
FLAT = 0.15  # of its longest spread; masks of a face have 0.3 or more
SHARED = 0.5  # of the blendshapes that move a copy move the face too
SAME_MOVES = 0.02  # of the root mean square displacement
MOST_PIECES = 200  # of a mesh: hair has thousands
LEVEL = re.compile(r"lod[ _-]?(\d+)", re.IGNORECASE)


def one_of_each(raw: RawRig) -> RawRig:
    """The rig without copies of its face that move too, and without their own blendshapes; its note names both."""
    moves = moving_vertices(raw)
    extra = moving_copies(raw, moves)
    if not extra:
        return raw
    names = tuple(dict.fromkeys(body.title for body in extra))
    message = f"what repeats the face was left out, although it moves (levels of detail, spare heads): {listed(names)}"
    at = with_strays(raw, np.concatenate([body.at for body in extra]))
    theirs = np.logical_and(moves.any(axis=1), ~np.delete(moves, at, axis=1).any(axis=1))
    if theirs.all():
        return raw
    without = leave_out(raw, at)
    own = [name for name, of_copy in zip(raw.names, theirs, strict=True) if of_copy]
    retained = tuple(name for name, of_copy in zip(raw.names, theirs, strict=True) if not of_copy)
    with_them = f"blendshapes that move these alone were left out with them: {listed(own)}" if own else ""
    return replace(
        without,
        deltas=without.deltas[~theirs],
        names=retained,
        left_out=(*raw.left_out, *names),
        note=sentences(raw.note, message, with_them),
    )


def with_strays(raw: RawRig, at: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
    """These vertices, and those without a triangle of meshes that have no other vertex left."""
    number = raw.parts if raw.meshes is None else raw.meshes
    surface = np.setdiff1d(np.unique(raw.triangles), at)
    emptied = np.setdiff1d(number[at], number[surface])
    return np.union1d(at, np.flatnonzero(np.isin(number, emptied)))


def moving_vertices(raw: RawRig) -> Bool[np.ndarray, "k v"]:
    """Which vertices every blendshape moves by more than rounding."""
    length = np.linalg.norm(raw.deltas, axis=2)
    flies = flying(raw.neutral, raw.triangles, raw.deltas)
    most = length.max() if flies.all() else length[~flies].max()
    return length > MOVES * most


def moving_copies(raw: RawRig, moves: Bool[np.ndarray, "k v"]) -> list[Body]:
    """Copies of a face that move, and what goes with them."""
    every = list(loose_bodies(raw))
    moving = [body for body in every if moves[:, body.at].any()]
    faces = find_faces(moving, moves)
    if not faces:
        return []
    area = max(face.area for face in faces)
    loose = [piece for body in moving for piece in loose_pieces(body, area) if moves[:, piece.at].any()]
    heads = _ranked([body for body in (*moving, *loose) if not is_ball(body.points)], faces, moves)
    copies: list[Copy] = []
    for i, body in enumerate(heads):
        gone = [copy.body for copy in copies]
        mains = [one for one in heads[:i] if is_face(one, faces) and not _overlaps(one, (*gone, body))]
        mains = [one for one in mains if not is_plate(one)]
        if not _overlaps(body, gone):
            mesh = any(body is one for one in moving)
            copies += list(copy_of(body, mains, moves, raw.deltas, mesh=mesh))[:1]
    every += _inner_pieces(every, copies)
    rest = [body for body in every if not _overlaps(body, [one for copy in copies for one in (copy.body, copy.face)])]
    found = {id(copy.body): copy.body for copy in copies}
    for copy in copies:
        found |= {id(body): body for body in (*goes_with(copy, rest, every), *of_its_level(copy, rest, every))}
    return list(found.values())


def _inner_pieces(every: list[Body], copies: list[Copy]) -> list[Body]:
    """The largest pieces of meshes of which a copy is a piece too: eyes and teeth of two heads in one mesh."""
    of_mesh = [
        body for body in every if any(len(one.body.at) < len(body.at) and _overlaps(body, [one.body]) for one in copies)
    ]
    found = [piece for body in of_mesh for piece in loose_pieces(body, 0.0)]
    return sorted(found, key=lambda piece: -piece.area)[:MOST_PIECES]


def _overlaps(body: Body, others: Iterable[Body]) -> bool:
    """Whether a body shares vertices with one of the others, as a piece does with its mesh."""
    return any(np.isin(body.at, other.at).any() for other in others)


def is_face(body: Body, faces: list[Body]) -> bool:
    """Whether a body is one of the faces, or a large piece of one."""
    return any(body is face or np.isin(body.at, face.at).all() for face in faces)


def is_plate(body: Body) -> bool:
    """Whether a body is nearly flat, as lids, brows and lips are that are drawn over a still head."""
    spread = np.sqrt(np.clip(np.linalg.eigvalsh(np.cov(body.points.T)), 0, None))
    return bool(spread[0] < FLAT * spread[-1])


def _ranked(found: list[Body], faces: list[Body], moves: Bool[np.ndarray, "k v"]) -> list[Body]:
    """The bodies in the order in which they may be the main face."""
    counts = [int(moves[:, body.at].any(axis=1).sum()) for body in found]
    most, finest = max(counts, default=0), max(map(density, faces))
    order = sorted(
        range(len(found)), key=lambda i: (counts[i] < AS_MANY * most, density(found[i]) < AS_FINE * finest, i)
    )
    return [found[i] for i in order]


def density(body: Body) -> float:
    """How many vertices a body has for its area."""
    return len(body.points) / max(body.area, 1e-12)


def copy_of(
    body: Body, mains: list[Body], moves: Bool[np.ndarray, "k v"], deltas: Float[np.ndarray, "k v 3"], *, mesh: bool
) -> Iterator[Copy]:
    """How the body repeats one of the faces before it, where it is plain which is the lesser.

    A second head is only left out where it is a `mesh` of its own: of a piece of one, the eyes would stay behind.
    """
    if not body.area > 0:
        return
    own = moves[:, body.at].any(axis=1)
    for face in mains:
        copy = repeats(body, face, moves_too=True)
        if copy is None:
            continue
        theirs = moves[:, face.at].any(axis=1)
        on_it = np.linalg.norm(body.box.mean(axis=0) - face.box.mean(axis=0)) < ASIDE * face.size
        lesser = density(body) < AS_FINE * density(face) or own.sum() < AS_MANY * theirs.sum()
        if (
            on_it
            or lesser
            or (own & theirs).sum() >= SHARED * own.sum()
            or (mesh and moved_alike(copy, deltas[own], deltas[theirs]))
        ):
            yield copy


def moved_alike(copy: Copy, own: Float[np.ndarray, "a v 3"], theirs: Float[np.ndarray, "b v 3"]) -> bool:
    """Whether the blendshapes of a copy move it as those of the face do, one by one, vertex by vertex."""
    if len(own) != len(theirs) or len(copy.body.at) != len(copy.face.at):
        return False
    moved = theirs[:, copy.face.at]
    off = own[:, copy.body.at] @ copy.R.T - moved
    return bool(np.sqrt((off**2).mean()) < SAME_MOVES * np.sqrt((moved**2).mean()))


def of_its_level(copy: Copy, rest: list[Body], every: list[Body]) -> Iterator[Body]:
    """Bodies called of the same level of detail as a copy, which lie on a body of another level."""
    level = level_of(copy.body)
    if level is None:
        return
    others = [body for body in every if level_of(body) != level]
    for body in rest:
        if level_of(body) == level and any(lies_on(body.points, other, copy.face.size) for other in others):
            yield body


def level_of(body: Body) -> str | None:
    """The level of detail that a body's name says."""
    found = LEVEL.search(body.title)
    return found and found[1]
