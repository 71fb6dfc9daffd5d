"""Whose face each of several takes shows, told by their neutrals on one mesh (Le et al. 2013, section 4.7).

Data      n_d  neutral of take d, millimetres;  a_v  how still the rig's vertex v is, 1 on the scalp, 0 on the lips
Apart     sum_v a_v |R n_e + u - n_d|_v / sum_v a_v: laid on and measured where the face does not move, so that an open
          mouth is no other person
Same      below `SAME_PERSON_MM` of the person's first take; otherwise another person
A take whose first frame stands for its neutral gets that of its person, where another take of the same person has one.
"""

from collections.abc import Sequence as Several
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from capture_plan.curves.frames import PosedFrames
from capture_plan.rig import Rig
from capture_plan.sequence import Sequence
from capture_plan.sequence.head_stabilisation import hold, stillness

SAME_PERSON_MM = 1.0  # two scans of one head lie some tenths apart, two heads on one mesh several
IDENTICAL_MM = 1e-4  # files of single precision


def by_person(rig: Rig, sequences: Several[Sequence]) -> tuple[tuple[tuple[int, ...], ...], tuple[str, ...]]:
    """The numbers of the takes of each person, and sentences on what was decided."""
    still = stillness(rig.displacement.max(axis=0)) * rig.skin
    persons, notes = [[0]], []
    for d, take in enumerate(sequences[1:], start=1):
        distances = [apart(sequences[one[0]].neutral, take.neutral, still) for one in persons]
        near = int(np.argmin(distances))
        same, mm, other = distances[near] < SAME_PERSON_MM, distances[near], sequences[persons[near][0]].name
        persons = [[*one, d] if same and n == near else one for n, one in enumerate(persons)]
        if not same:
            persons.append([d])
        if mm > IDENTICAL_MM:
            notes.append(
                f"{take.name} is taken as {'the same person as' if same else 'another person than'} {other}: "
                f"their neutrals are {mm:.2f} mm apart where the face is still"
            )
    return tuple(map(tuple, persons)), tuple(notes)


def apart(first: Float[np.ndarray, "v 3"], other: Float[np.ndarray, "v 3"], still: Float[np.ndarray, " v"]) -> float:
    """How far another neutral lies from the first, millimetres."""
    return float(still @ np.linalg.norm(hold(other, first, still) - first, axis=1) / still.sum())


def on_own_neutral(rig: Rig, session: Several[Sequence]) -> tuple[tuple[Sequence, ...], tuple[str, ...]]:
    """The takes of one person, measured from a neutral where one has it, and sentences on those that borrow it."""
    lent = [take for take in session if opens_on_neutral(rig, take)]
    known = [take for take in session if take not in lent]
    if not known:
        return tuple(session), ()
    settled = tuple(replace(take, neutral=known[0].neutral) if take in lent else take for take in session)
    return settled, tuple(f"{take.name} is measured from the neutral of {known[0].name}" for take in lent)


def opens_on_neutral(rig: Rig, take: Sequence) -> bool:
    """Whether the first frame is what stands for the neutral, which is not the rig's."""
    if isinstance(take.frames, PosedFrames) or np.abs(take.neutral - rig.neutral).max() < IDENTICAL_MM:
        return False
    return bool(np.abs(take.frame(0) - take.neutral).max() < IDENTICAL_MM)
