"""Dots by their names in a plan that was made before: where a person points at M12 to pin or to forbid it."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from capture_plan.errors import PlanError
from capture_plan.layout.dot_numbers import dots_of, is_vertex, vertices_of
from capture_plan.plan.files import read_plan
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig


@dataclass(frozen=True)
class NamedDots:
    """The dots of the plan in a file, which is read when a name is asked for; `given` where a person named the file."""

    path: Path
    given: bool

    @cached_property
    def plan(self) -> Plan | None:
        """The plan; None where there is none and nobody said that there is one."""
        return read_plan(self.path) if self.given or self.path.is_file() else None

    def vertices(self, words: Iterable[str | int], what: str) -> tuple[int, ...]:
        """Vertices in the artist's file that names or numbers mean; a plan is needed for names alone.

        Raises:
            PlanError: a word is neither, or the plan cannot be read.
        """
        asked = [str(word) for word in words]
        plan = None if all(is_vertex(word.strip()) for word in asked) else self.plan
        dots = dots_of(plan.layout) if plan else {}
        return vertices_of(asked, dots, what=what, whose=str(self.path))

    def must_be_of(self, rig: Rig) -> None:
        """PlanError where names were asked of a plan for another rig: they mean other places there."""
        plan = self.__dict__.get("plan")
        if plan is not None and plan.rig.fingerprint != rig.fingerprint:
            raise PlanError(
                f"dots are named as in {self.path}, which was made for another rig ({plan.rig.name}): "
                "name a plan of this rig with --dots-of, or give vertex numbers"
            )
