"""Whether all that a plan names is there, before anything is computed with it."""

import re
import unicodedata
from collections import Counter
from collections.abc import Iterator
from typing import Any

import msgspec

from capture_plan.errors import PlanError
from capture_plan.layout.assembly import SINGLE_COVER
from capture_plan.layout.record import ErrorBound, Layout
from capture_plan.layout.settings import ORDERED
from capture_plan.plan.record import DECIDING, Plan, RigReference
from capture_plan.rig import Rig

TURNING = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")  # bidirectional
VERSION = re.compile(r"[0-9][0-9A-Za-z.+!_-]{0,39}")  # as packages have them (PEP 440)
PROGRAMS = {"motion": (0, 0), "budget": (0, 1)}  # least and most that a method asks a solver for, where not one


def check_structure(plan: Plan, rig: Rig) -> None:
    """PlanError in one line where the plan names a vertex, a triangle, a blendshape or a landmark that is not there, or
    lists of one length have two."""
    check_texts(plan)
    for fault in (*_numbers(plan.layout, rig), *_names(plan, rig), *_lengths(plan)):
        raise PlanError(f"the plan of {plan.rig.name} {fault}: make it again with `capture-plan plan`")


def check_texts(plan: Plan | RigReference, mend: str = "make it again") -> None:
    """PlanError where a text, at any depth, has a sign in it that a screen would obey or that begins a new line: it
    could make a page say what nobody found."""
    for place, text in _texts(msgspec.to_builtins(plan), ""):
        if any(obeyed(sign) for sign in text):
            where = place if isinstance(plan, Plan) else f"rig.{place}"
            raise PlanError(f"the plan has a control character in {where}: {text[:40]!a}: {mend}")


def obeyed(sign: str) -> bool:
    """Whether a sign is a control character, a break of lines, or turns the direction of text."""
    return unicodedata.category(sign) in ("Cc", "Cs", "Zl", "Zp") or sign in TURNING


def _texts(value: Any, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield place, value
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    for name, one in inner:
        if isinstance(name, str):
            yield f"a name in {place}", name
        yield from _texts(one, f"{place}.{name}".lstrip("."))


def _numbers(layout: Layout, rig: Rig) -> Iterator[str]:
    v, f = len(rig.neutral), len(rig.triangles)
    others = [*layout.programs, *layout.references.values(), *bounds_of(layout).values()]
    vertices = [*(m.vertex for m in layout.markers), *(vertex for one in others for vertex in one.vertices)]
    yield from (f"has vertex {n:,} of {v:,}" for n in vertices if not 0 <= n < v)
    yield from (f"has triangle {m.triangle:,} of {f:,} ({m.name})" for m in layout.markers if not 0 <= m.triangle < f)


def bounds_of(layout: Layout) -> dict[str, ErrorBound]:
    """The certificates by shares that a layout has, by what they prove."""
    both = {"error bound": layout.error_bound, "bound of the target": layout.target_bound}
    return {name: bound for name, bound in both.items() if bound}


def _names(plan: Plan, rig: Rig) -> Iterator[str]:
    layout, packing = plan.layout, plan.packing
    named = [*layout.certificate.blendshapes, *packing.clique, *packing.left_out]
    named += [name for several in packing.unscanned for name in several]
    named += [name for expression in packing.expressions for name in (*expression.blendshapes, *expression.drivers)]
    pairs = (packing.pairs, packing.relaxed, packing.exclusive, packing.drivers, packing.local, packing.colliding)
    named += [name for several in pairs for pair in several for name in pair]
    named += [name for a, b, _ in packing.hard for name in (a, b)]
    yield from (f"plans for '{name}', which the rig does not have" for name in plan.audit.used if name not in rig.names)
    yield from (f"names '{name}', which is planned for nowhere" for name in named if name not in plan.audit.used)
    marks = [m.name for m in layout.markers]
    yield from (f"has {count} markers called {name}" for name, count in Counter(marks).items() if count > 1)
    yield from (f"has an order with '{name}', which is no landmark" for name in layout.order if name not in marks)
    ordered = {m.name for m in layout.landmarks} if layout.method in ORDERED else set()
    if set(layout.order) != ordered:
        yield f"has an order of {len(set(layout.order))} landmarks where {len(ordered)} have one"


def _lengths(plan: Plan) -> Iterator[str]:
    layout = plan.layout
    lists = [("certificate", len(layout.certificate.blendshapes), len(layout.certificate.weights))]
    lists += [(name, len(bound.vertices), len(bound.shares)) for name, bound in bounds_of(layout).items()]
    lists += [(f"expression {e.name}", len(e.blendshapes), len(e.weights)) for e in plan.packing.expressions]
    yield from (f"has {a} entries and {b} numbers in the {what}" for what, a, b in lists if a != b)
    yield from (
        f"has an expression {e.name} without blendshapes" for e in plan.packing.expressions if not e.blendshapes
    )
    if not layout.landmarks:
        yield "has no landmark"
    if SINGLE_COVER not in layout.references or not layout.references[SINGLE_COVER].vertices:
        yield f"is not set beside the {SINGLE_COVER}"
    least, most = PROGRAMS.get(layout.method, (1, 1))
    most = plan.settings.landmarks.rounds if layout.method == "adaptive" else most
    if not least <= len(layout.programs) <= most:
        yield f"has {len(layout.programs)} programs"
    if plan.packing.unmoved is not None and not 0 <= plan.packing.unmoved <= len(plan.audit.used):
        yield f"left {plan.packing.unmoved} of {len(plan.audit.used)} blendshapes where they were"
    if tuple(plan.versions) != DECIDING:
        yield f"tells the versions of {', '.join(plan.versions) or 'nothing'}, not of {', '.join(DECIDING)}"
    for name, number in plan.versions.items():
        if not VERSION.fullmatch(number):
            yield f"was made by {name} {number!r}, which is no version"
