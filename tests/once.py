"""Plans and layouts of the bundled head that many tests ask for, made once for all workers of a run."""

import os
from collections.abc import Callable
from fcntl import LOCK_EX, flock
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TypeVar

import msgspec

from capture_plan.audit.audit import audit_rig
from capture_plan.expressions.settings import PackingSettings
from capture_plan.layout.design import design_layout
from capture_plan.layout.face import see_face
from capture_plan.layout.record import Layout
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.make import make_plan
from capture_plan.plan.record import Plan, sealed
from capture_plan.plan.settings import Settings
from capture_plan.sample import sample_rig

Made = TypeVar("Made", bound=msgspec.Struct)

# A plan with all that a plan has, for tests that ask neither where its landmarks lie nor how good its list is.
QUICK = Settings(landmarks=LayoutSettings(method="cover"), expressions=PackingSettings(method="greedy"))


def plan_of(settings: Settings | None = None) -> Plan:
    """The plan of the bundled head with these settings, the default ones if none are given."""
    asked = settings or Settings()
    return once(asked, Plan, lambda: make_plan(sample_rig(), asked))


def shortened(plan: Plan) -> Plan:
    """A plan with two of its expressions, for pages that are asked neither for the others nor for the whole."""
    packing = msgspec.structs.replace(plan.packing, expressions=plan.packing.expressions[:2])
    return sealed(msgspec.structs.replace(plan, packing=packing))


def layout_of(settings: LayoutSettings | None = None) -> Layout:
    """The layout of the bundled head with these settings, where no dots meet in other expressions."""
    asked, rig = settings or LayoutSettings(), sample_rig()
    return once(asked, Layout, lambda: design_layout(see_face(rig, audit_rig(rig).used), asked))


def once(asked: msgspec.Struct, kind: type[Made], make: Callable[[], Made]) -> Made:
    """What is made of `asked`, by whichever worker is the first to want it; the others wait for it."""
    folder = Path(os.environ["XDG_CACHE_HOME"]) / "once"  # which the workers of a run share, and no other run has
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{kind.__name__}-{sha256(msgspec.json.encode(asked)).hexdigest()}.json"
    with path.with_suffix(".lock").open("w") as lock:
        flock(lock, LOCK_EX)
        if not path.exists():
            path.write_bytes(msgspec.json.encode(make()))
    return read(path, kind)


@cache
def read(path: Path, kind: type[Made]) -> Made:
    """The record in a file."""
    return msgspec.json.decode(path.read_bytes(), type=kind)
