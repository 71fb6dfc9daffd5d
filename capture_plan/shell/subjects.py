"""Several subjects on one topology share a layout (Le et al. 2013, section 4.7): what each misses, added up.

E(H) = sum_d E_d(H): each subject bends its own shell; a marker is the same vertex on all. E_d is a mean over the frames
of d, so that a long sequence has no more say than a short one.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import RigError
from capture_plan.shell import scores, updates
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion
from capture_plan.shell.state import State

Subject = tuple[Shell, Motion]


class Subjects:
    """A `State` for each, moved together."""

    def __init__(self, subjects: Sequence[Subject], partner: Int[np.ndarray, " v"] | None) -> None:
        sizes = {len(part) for shell, motion in subjects for part in (shell.vertices, motion.rows)}
        if len(sizes) != 1:
            raise RigError(f"shells and motions of {sorted(sizes)} vertices: give all on one topology")
        self.states = [State(shell, motion, partner=partner) for shell, motion in subjects]

    @property
    def markers(self) -> list[int]:
        """Vertices that carry markers, the same on every subject."""
        return self.states[0].markers

    @property
    def error(self) -> float:
        """Sum of the squared errors of all subjects, mm^2."""
        return sum(state.error for state in self.states)

    @property
    def fixed(self) -> Bool[np.ndarray, " v"]:
        """Vertices that hold still on any subject."""
        return np.any([state.shell.fixed for state in self.states], axis=0)

    @property
    def floating(self) -> Bool[np.ndarray, " v"]:
        """Vertices of the pieces that nothing holds yet, of any subject."""
        return np.any([state.floating for state in self.states], axis=0)

    @property
    def rmse_mm(self) -> float:
        """Of the motion as it was given, which may be a compressed one."""
        return float(np.sqrt(max(self.error, 0) / sum(state.s.sum() for state in self.states)))

    def copy(self) -> "Subjects":
        """Subjects that start from these and change on their own."""
        twin = object.__new__(Subjects)
        twin.states = [state.copy() for state in self.states]
        return twin

    def refresh(self, markers: Sequence[int]) -> None:
        """Compute all subjects from scratch for these markers."""
        for state in self.states:
            state.refresh(markers)

    def add(self, v: int) -> None:
        """Add a marker at vertex v on every subject."""
        for state in self.states:
            updates.add(state, v)

    def drop(self, j: int) -> None:
        """Take the marker number j off every subject."""
        for state in self.states:
            updates.drop(state, j)

    def swap(self, j: int, v: int) -> None:
        """Move the marker number j to vertex v on every subject."""
        for state in self.states:
            updates.swap(state, j, v)

    def add_scores(self) -> Float[np.ndarray, " v"]:
        """The error with one more marker, at every vertex, mm^2."""
        return np.sum([scores.add_scores(state) for state in self.states], axis=0)

    def add_pair_scores(self) -> Float[np.ndarray, " v"]:
        """The error with one more marker and its mirror image, at every vertex, mm^2."""
        return np.sum([scores.add_pair_scores(state) for state in self.states], axis=0)

    def swap_scores(self, j: int, at: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The error where the marker number j moves to each vertex of `at`, mm^2."""
        return np.sum([scores.swap_scores(state, j, at) for state in self.states], axis=0)

    def two_scores(self, a: Int[np.ndarray, " p"], b: Int[np.ndarray, " q"]) -> Float[np.ndarray, "p q"]:
        """The error with two more markers, one of `a` and one of `b`, mm^2."""
        return np.sum([scores.two_scores(state, a, b) for state in self.states], axis=0)
