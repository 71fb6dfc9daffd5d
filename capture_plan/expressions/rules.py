"""What an actor can do at once, as data: one file that a person reads, copies and edits.

same_side, any_side   names that no face performs at once, on one side of the face or on any
requires              (what, its base): not performed for itself, the base is held meanwhile
hard                  (a, b, cost): can be performed at once, but badly; cost from 1 to 3
most_things           separate movements that an expression asks for at most, a left/right pair counted once
Names   ARKit's, with or without side, or a rig's own. One that is neither is refused, lest a slip of the pen be a rule
        that never bites; ARKit's that a rig lacks are passed over, so that one file does for every rig
"""

from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from capture_plan.errors import RigError
from capture_plan.input.documents import MOST_COUNTED, read_toml
from capture_plan.names.arkit import arkit_name
from capture_plan.rig import Rig

Cost = Annotated[int, Meta(ge=1, le=3)]


class Hard(Struct, frozen=True, forbid_unknown_fields=True):
    """Two movements that are hard to perform at once."""

    names: tuple[str, str]
    cost: Cost


class Rules(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A rule file; without entries everything can be performed at once."""

    same_side: dict[str, tuple[str, ...]] = {}
    any_side: dict[str, tuple[str, ...]] = {}
    requires: dict[str, tuple[str, ...]] = {}
    hard: tuple[Hard, ...] = ()
    most_things: Annotated[int, Meta(ge=1, le=MOST_COUNTED)] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Every name that a rule is about, once."""
        lists = (self.same_side, self.any_side, self.requires)
        listed = [name for table in lists for a, others in table.items() for name in (a, *others)]
        return tuple(dict.fromkeys([*listed, *(name for hard in self.hard for name in hard.names)]))


def read_rules(path: Path) -> Rules:
    """A person's own rules, in the form of `data/rules.toml`; they replace ours."""
    try:
        return msgspec.convert(read_toml(path, RigError, "start from a copy of ours"), Rules)
    except msgspec.ValidationError as problem:
        raise RigError(f"{path}: not a rule file: {problem}; start from a copy of ours") from None


@cache
def default_rules() -> Rules:
    """What we know of faces, by ARKit's names."""
    ours = files("capture_plan.expressions").joinpath("data", "rules.toml")
    return msgspec.toml.decode(ours.read_bytes(), type=Rules)


def check_rule_names(rig: Rig, rules: Rules) -> None:
    """RigError where a rule is about something that is neither ARKit's nor the rig's."""
    for name in rules.names:
        if not arkit_name(name) and not arkit_name(f"{name}Left") and name not in rig.names:
            raise RigError(
                f"a rule names '{name}', which is neither a blendshape of {rig.name} nor one of ARKit's: correct it"
            )
