"""What is asked of a plan before anything is made of it: all that can be recomputed in seconds, and once only.

A plan whose seal is unbroken is as a planner wrote it, and its word is taken for what costs most of the time. A broken
seal says already that something was changed: where no quick claim tells what, everything is asked. A plan that does not
hold becomes a draft only where a person insists, and carries what is wrong with it from then on.

What was found is kept under all that it depends on: every word of the plan, all of the rig, all of this package's code.
Where a plan also depends on what a person measured, painted or wrote rules for, it is found again each time.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np
from msgspec.structs import replace

from capture_plan.cache import Arrays, cached, code_digest, digest
from capture_plan.check.again_claims import NO_DRAFT, SEALED
from capture_plan.check.check import claims_of
from capture_plan.errors import PlanError, printable
from capture_plan.plan.claims import Claim
from capture_plan.plan.inputs import PlanInputs, inputs_for
from capture_plan.plan.record import Plan, seal_of
from capture_plan.reader.read_cache import everything_of
from capture_plan.rig import Rig

NAMED = 3  # lies that are named: the first mostly explains the rest
ENTRIES = 200  # plans, a few kB each
LINE = 160  # letters of a lie; `check` tells all of it


def lies(plan: Plan, inputs: Rig | PlanInputs) -> tuple[Claim, ...]:
    """The claims of the plan that fail, its seal first. Where the seal is broken, takes are asked for too.

    Raises:
        PlanError: the plan names what is not there, or a file that is not among the inputs.
        InfeasibleError: its settings cannot be followed on this rig.
    """
    if plan.seal != seal_of(plan):
        broken = _failing(plan, inputs, quick=True)
        return broken if len(broken) > 1 else _failing(plan, inputs, quick=False)
    given = inputs_for(inputs, plan.settings, takes=False)
    if any(one is not None for one in (given.target, given.rules, given.worn)) or given.zones:
        return _failing(plan, given, quick=True)
    cameras = repr(given.cameras).encode()
    name = digest([code_digest(), msgspec.json.encode(plan), cameras, *everything_of(given.rig)])

    def found() -> Arrays:
        failing = msgspec.json.encode(_failing(plan, given, quick=True))
        return {"lies": np.frombuffer(failing, dtype=np.uint8)}

    return msgspec.json.decode(cached(found, "gate", name, entries=ENTRIES)["lies"].tobytes(), type=tuple[Claim, ...])


def _failing(plan: Plan, inputs: Rig | PlanInputs, *, quick: bool) -> tuple[Claim, ...]:
    return tuple(one for one in claims_of(plan, inputs, quick=quick) if not one.holds)


def as_draft(plan: Plan, broken: tuple[Claim, ...]) -> Plan:
    """The plan with what is wrong with it, so that everything made of it says so."""
    fresh = [_line(one) for one in named_first(broken) if one.what != NO_DRAFT]
    return replace(plan, draft=tuple(dict.fromkeys((*plan.draft, *fresh)))) if fresh else plan


@contextmanager
def as_far_as_it_goes(plan: Plan) -> Iterator[None]:
    """Within it a draft that is broken too far to be made anything of ends in one line.

    Raises:
        PlanError: what stood in the way.
    """
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        if not plan.draft:
            raise
        kind = type(error).__name__
        raise PlanError(f"nothing can be made of this draft ({kind}: {error}): plan again") from error


def named_first(broken: tuple[Claim, ...]) -> tuple[Claim, ...]:
    """The lies that are named: what the plan says otherwise than its rig, before that its seal is broken."""
    return tuple(sorted(broken, key=lambda one: one.what == SEALED))[:NAMED]


def refusal(plan: Path, broken: tuple[Claim, ...]) -> list[str]:
    """Why nothing is made of the plan, a line for each lie that is named, and what to do."""
    return [
        f"{plan} does not hold:",
        *failing_lines(broken),
        f"Nothing was made of it. `capture-plan check {plan}` tells all that is wrong. Plan again, or go on with "
        "--force: everything will say DRAFT.",
    ]


def not_ready(plan: Path, broken: tuple[Claim, ...]) -> list[str]:
    """What is said of a plan that was just made and that no pages will be made of as it is: why, and what to do."""
    return [
        "Before `render` makes pages of this plan, correct:",
        *failing_lines(broken),
        f"Next: correct that and plan again, or capture-plan render {plan} --force: every page will say DRAFT.",
    ]


def failing_lines(broken: tuple[Claim, ...]) -> list[str]:
    """A line for each lie that is named, and below it what to correct."""
    lines: list[str] = []
    for one in named_first(broken):
        lines += [f"  FAILS  {_line(one)}"]
        lines += [f"  To correct: {printable(one.mend)}."] if one.mend else []
    return lines


def insisted(plan: Path, broken: tuple[Claim, ...]) -> list[str]:
    """What is said where a person goes on with such a plan."""
    return [f"{plan} does not hold; this is a DRAFT:", *(f"  FAILS  {_line(one)}" for one in named_first(broken))]


def _line(one: Claim) -> str:
    line = printable(f"{one.what}: {one.found}")
    return line if len(line) <= LINE else f"{line[: LINE - 2]} …"
