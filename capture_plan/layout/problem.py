"""What one design is about: where landmarks may stand, its constraints, what has to be seen, what is measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace as dataclass_replace
from functools import cached_property

import numpy as np
from jaxtyping import Int
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit, open_under
from capture_plan.layout.constraints import constraints, difference_limits, touching, views
from capture_plan.layout.contact_pairs import met_in, pose_movements, without_pairs_of
from capture_plan.layout.dot_contact import Poses
from capture_plan.layout.exchange import Search
from capture_plan.layout.face import Face
from capture_plan.layout.observation import Observation
from capture_plan.layout.settings import NEUTRAL_ONLY, LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing

NOTHING = np.empty(0, dtype=int)


@dataclass(frozen=True, eq=False)
class Task:
    """What one design is about: sites, constraints, the blendshapes that open sites reach, and what is measured."""

    face: Face
    settings: LayoutSettings
    sites: Sites
    limits: tuple[Limit, ...]
    met: csr_array | None = None

    @cached_property
    def open_(self) -> Int[np.ndarray, " o"]:
        """Sites that no constraint shuts out."""
        return np.flatnonzero(open_under(self.limits, NOTHING, len(self.sites.visibility)))

    @cached_property
    def reachable(self) -> Int[np.ndarray, " r"]:
        """Blendshapes that an open site can stand for."""
        return np.flatnonzero(self.sites.covers(self.settings.epsilon)[:, self.open_].any(axis=1))

    @cached_property
    def demand(self) -> Int[np.ndarray, " r"]:
        """How many sites each blendshape that can be reached has at least: one, or by methods that ask for several
        `rounds`, or as many as it has room for, next to each other (`trivial`) or at the spacing (`distance`)."""
        settings = self.settings
        rows = self.sites.covers(settings.epsilon)[np.ix_(self.reachable, self.open_)]
        if settings.method == "distance":
            return np.array([room_for(self.spacing, self.open_[row], settings.rounds) for row in rows])
        return np.minimum(rows.sum(axis=1), settings.rounds if settings.method == "trivial" else 1)

    @cached_property
    def spacing(self) -> Spacing | None:
        """Which sites stand too close to each other, or meet when the face moves."""
        plain = self.face.spacing(self.sites, self.settings.spacing_mm)
        return plain and dataclass_replace(plain, met=self.met)

    @cached_property
    def observation(self) -> Observation:
        """The face as a measuring problem."""
        return self.face.observation(self.settings.noise_mm, self.settings.dot_mm)

    def read_in(self, poses: Poses) -> "Task":
        """This task where cameras read every landmark in every pose too; as it is where no place is read so."""
        try:
            more = views(self.face, self.settings, self.sites, poses) if poses else []
        except InfeasibleError:
            more = []
        return dataclass_replace(self, limits=(*self.limits, *more))

    def apart_in(self, poses: Poses) -> "Task":
        """This task where no two dots meet in any blendshape or pose and, where a margin is asked for, none are taken
        for each other from pose to pose. What a person decides twice (two pins, or one and its mirror image) and
        partners without which nothing stands for a blendshape may: it is told, not refused.

        The paper's methods know the neutral alone, and without a spacing dots may stand as they like.
        """
        settings, sites = self.settings, self.sites
        if settings.method in NEUTRAL_ONLY or not settings.spacing_mm:
            return self
        rig, at = self.face.rig, self.face.dotted(settings)
        moved = pose_movements(rig, poses, at)
        planned = met_in(rig.neutral, at, moved, dot_mm=settings.dot_mm, spacing_mm=settings.spacing_mm)
        if settings.label_margin_mm is not None and poses:
            planned = csr_array(planned + self.face.untold(settings, poses))
        pins = self.face.pinned(settings)
        decided = np.union1d(pins, self.face.mirror[pins]) if settings.symmetric else pins
        met = without_pairs_of(csr_array(self.face.met(settings) + planned), decided)
        partners = met[sites.vertices[:, 0], sites.vertices[:, 1]] > 0
        covers, others = sites.covers(settings.epsilon)[self.reachable], self.open_[~partners[self.open_]]
        alone = ~covers[:, others].any(axis=1)
        shut = partners & ~covers[alone].any(axis=0)
        apart = Limit("partners whose dots meet when the face moves", shut.astype(int), most=0)
        return dataclass_replace(self, met=met, limits=(*self.limits, apart))

    def with_head_markers(self, head: Int[np.ndarray, " h"]) -> "Task":
        """This task with all sites shut out that stand too close to the head markers."""
        near = self.face.around(head, self.settings.spacing_mm)
        clear = Limit("nothing beside the head markers", touching(self.sites, near).astype(int), most=0)
        return dataclass_replace(self, limits=(*self.limits, clear))


def room_for(spacing: Spacing | None, candidates: Int[np.ndarray, " n"], most: int) -> int:
    """How many of the candidates fit beside each other, first come first served, `most` at most."""
    count, left = 0, candidates
    while len(left) and count < most:
        count += 1
        left = left[~spacing.close(left[:1])[0, left]] if spacing else left[1:]
    return count


def task_of(face: Face, settings: LayoutSettings, unlike: Sequence[Sequence[int]] = ()) -> Task:
    """The task of these settings.

    Raises:
        InfeasibleError: nothing that is seen moves enough, or a constraint names what this face does not have.
    """
    sites = face.sites(settings)
    task = Task(
        face, settings, sites, (*constraints(face, settings, sites), *difference_limits(face, settings, sites, unlike))
    )
    if not len(task.reachable):
        raise InfeasibleError(f"no vertex that is seen moves by {settings.epsilon} of any blendshape: lower epsilon")
    return task


def search_of(task: Task, budget: int, *, covered: bool = True) -> Search:
    """The search for a budget; with `covered`, every blendshape that can be reached keeps a landmark."""
    covers = task.sites.covers(task.settings.epsilon)[task.reachable]
    return Search(task.observation, task.sites, covers if covered else covers[:0], task.spacing, budget, task.limits)
