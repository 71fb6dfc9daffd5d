"""All takes that a layout is judged by: sessions of one person or of several, on the rig's mesh.

Data     sessions with shares g; s_v how much an error counts at a vertex (Le et al. 2013, section 8), 1 unless given
Subject  the sessions of one person (`identify_subjects.py`): a shell of its own, on the part that any take moves
         (section 4.7)
Error    RMSE = sqrt(sum_d g_d E_d / (sum_d g_d sum_v s_v)), g_d the sum of the shares of its sessions
"""

from collections.abc import Sequence as Several
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from capture_plan.rig import Rig
from capture_plan.sequence import Sequence
from capture_plan.shell.elimination_order import Summary, summary_of
from capture_plan.shell.identify_subjects import by_person, on_own_neutral
from capture_plan.shell.motion import with_mirror_image
from capture_plan.shell.moving_region import part_of
from capture_plan.shell.take import Take, furthest_of, take_on
from capture_plan.shell.take_basis import EXACT_MM, Recording, in_fewer_frames, record

SEARCH_MM = 1e-2  # left out before frames are mirrored: a tenth of what the search leaves out


@dataclass(frozen=True, eq=False)
class Takes:
    """A `Take` of each person, whose motion counts by its share and by `s` of the rig's vertices; all have the same
    part. `notes` are sentences on what was assumed."""

    subjects: tuple[Take, ...]
    s: Float[np.ndarray, " n"]
    notes: tuple[str, ...] = ()

    @property
    def first(self) -> Take:
        """For what all subjects have in common: the part and where a marker is in it."""
        return self.subjects[0]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all sequences, subject by subject."""
        return tuple(one.sequence.name for person in self.subjects for one in person.recordings)

    @property
    def frames(self) -> int:
        """How many frames all subjects have."""
        return sum(one.frames for one in self.subjects)

    @cached_property
    def weight(self) -> float:
        """The whole weight, sum_d g_d sum_v s_v."""
        return float(sum(one.motion.weights.sum() for one in self.subjects))

    def errors(self, vertices: Int[np.ndarray, " m"], counts: Several[int]) -> tuple[float, ...]:
        """RMSE with the first of the rig's vertices as markers, for each of some counts, millimetres."""
        return tuple(self.error(vertices[:m]) for m in counts)

    def error(self, vertices: Int[np.ndarray, " m"]) -> float:
        """RMSE with markers at these vertices of the rig, millimetres."""
        H = self.first.places(vertices)
        return float(np.sqrt(sum(one.squared_error(H) for one in self.subjects) / self.weight))

    def summaries(self, markers: Int[np.ndarray, " m"]) -> list[Summary]:
        """What it takes to order markers at vertices of the shells."""
        return [summary_of(one.shell, one.motion, markers) for one in self.subjects]

    def missing(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Those of some blendshapes that no take shows."""
        lacks = [one.missing(names) for one in self.subjects]
        return tuple(name for name in names if all(name in some for some in lacks))

    def mirrored(self, mirror: Int[np.ndarray, " n"]) -> "Takes":
        """Every frame and its mirror image, on the skin that either moves; `mirror` is of the rig's vertices."""
        twin = _shared_part(self.first.rig, [one.recordings for one in self.subjects], self.s, mirror)
        both = [
            replace(one, motion=with_mirror_image(in_fewer_frames(one.motion, SEARCH_MM), one.mirror))
            for one in twin.subjects
        ]
        return replace(twin, subjects=tuple(both))


def takes_of(
    rig: Rig,
    sequences: Several[Sequence],
    *,
    shares: Several[float] = (),
    s: Float[np.ndarray, " n"] | float = 1.0,
) -> Takes:
    """The takes of the rig's mesh together; `shares` of the sequences are equal unless given.

    Raises:
        RigError: one is of another mesh, or they move nothing.

    Example:
        >>> rig = sample_rig()
        >>> takes = takes_of(rig, [read_sequence("take.csv", rig=rig)])
        >>> takes.names, takes.frames
        (('take',), 3)
    """
    persons, notes = by_person(rig, sequences)
    subjects, decided = [], [*notes]
    for numbers in persons:
        own, borrowed = on_own_neutral(rig, [sequences[d] for d in numbers])
        say = [shares[d] if shares else 1.0 for d in numbers]
        subjects.append(tuple(record(rig, one, g) for one, g in zip(own, say, strict=True)))
        decided += borrowed
    messages = [words for sessions in subjects for one in sessions for words in about(one)]
    if len(set(shares)) > 1:
        decided.append(f"the takes count {' : '.join(f'{g:g}' for g in shares)}")
    s = np.broadcast_to(np.asarray(s, dtype=float), len(rig.neutral))
    if np.ptp(s[rig.skin]):
        decided.append("errors count by the weights given for each vertex")
    return replace(_shared_part(rig, subjects, s, None), notes=(*messages, *decided))


def _shared_part(
    rig: Rig,
    subjects: Several[tuple[Recording, ...]],
    s: Float[np.ndarray, " n"],
    mirror: Int[np.ndarray, " n"] | None,
) -> Takes:
    """The recordings of each subject on the part that any of them moves, or with `mirror` its mirror image."""
    furthest = furthest_of(rig, sum(subjects, ()))
    if mirror is not None:
        furthest, s = np.maximum(furthest, furthest[mirror]), (s + s[mirror]) / 2
    names = ", ".join(one.sequence.name for sessions in subjects for one in sessions)
    part = part_of(rig, furthest, names)
    shares = [sum(one.share for one in sessions) for sessions in subjects]
    takes = [take_on(rig, part, sessions, g * s) for sessions, g in zip(subjects, shares, strict=True)]
    return Takes(tuple(takes), s)


def about(one: Recording) -> list[str]:
    """What was assumed when a take was read, and what it loses by being kept as shapes where that can be seen."""
    notes = [*one.sequence.notes]
    if one.lost_mm > 10 * EXACT_MM:
        notes.append(
            f"it is kept by its {len(one.shapes)} strongest shapes, which leave out {one.lost_mm:.3f} mm (root mean "
            "square) of motion or noise"
        )
    return [f"{one.sequence.name}: {note}" for note in notes]
