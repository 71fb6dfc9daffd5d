"""Everything that a plan is made from beside its settings, in memory: read from the files that settings name, or built
by hand from arrays. Nothing that computes opens a file.

    make_plan(rig)                                                     a rig alone, where settings name no file
    make_plan(read_inputs(rig, settings, folder), settings)            with the files that the settings name
    make_plan(PlanInputs(rig, cameras=cameras, target=neutral))        with what is at hand in Python

A plan says of what was given in Python that it was, so that who checks it from its file alone is told what is missing.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from msgspec import structs

from capture_plan.anatomy.painted_zone import painted_zone
from capture_plan.anatomy.zones import ZONES
from capture_plan.camera import Camera, KnownCamera, camera_of, cameras_for, is_preset
from capture_plan.errors import PlanError
from capture_plan.expressions.rules import Rules, read_rules
from capture_plan.names.name_map import read_name_map
from capture_plan.plan.places import found_from, named_files
from capture_plan.plan.settings import Settings
from capture_plan.reader.head_scan import HeadScan
from capture_plan.reader.neutral import read_neutral
from capture_plan.reader.vertex_weights import read_vertex_weights
from capture_plan.registration.picked_points import named_vertices
from capture_plan.rig import Rig
from capture_plan.sequence import read_sequence
from capture_plan.shell.takes import Takes, takes_of
from capture_plan.transfer.deformation import deformation_transfer

IN_PYTHON = "given in Python"  # stands in a plan's settings where else a file does


@dataclass(frozen=True, eq=False)
class PlanInputs:
    """What a plan is made from: a rig of v vertices, and what else is known.

    Attributes:
        rig: in millimetres, +y up, facing +z.
        cameras: those of the session, in the rig's frame; none where they are unknown.
        takes: recorded motion of the rig's mesh (`takes_of`); None without.
        target: the actor's neutral on the rig's mesh, millimetres; None where the rig's own is the actor's.
        rules: what an actor can do at once; None where the package's own rules hold.
        zones: skin that a person painted, by the name that `LayoutSettings.keep_out` has for it.
        worn: the rig's neutral laid on the actor's own head, millimetres, +y up, facing +z; None without one.
        head: the scan that it was laid on; None where nobody asks for it.
        generic: `worn` is on a head that is nobody's (`plan/likeness.py`).
    """

    rig: Rig
    cameras: tuple[Camera, ...] = ()
    takes: Takes | None = None
    target: Float[np.ndarray, "v 3"] | None = None
    rules: Rules | None = None
    zones: Mapping[str, Bool[np.ndarray, " v"]] = field(default_factory=dict)
    worn: Float[np.ndarray, "v 3"] | None = None
    head: HeadScan | None = None
    generic: bool = False

    def __post_init__(self) -> None:
        v = len(self.rig.neutral)
        shapes = {f"the zone '{name}'": (mask.shape, (v,)) for name, mask in self.zones.items()}
        shapes |= {} if self.target is None else {"the actor's neutral": (self.target.shape, (v, 3))}
        shapes |= {} if self.worn is None else {"the neutral on the actor's head": (self.worn.shape, (v, 3))}
        for what, (found, expected) in shapes.items():
            if found != expected:
                raise PlanError(f"{what} has the shape {found}, expected {expected}: give it on the rig's own vertices")

    @cached_property
    def worn_rig(self) -> Rig:
        """The rig on the actor's own head, its blendshapes transferred (Sumner & Popovic 2004); without one the rig."""
        if self.worn is None:
            return self.rig
        rig = self.rig
        deltas = deformation_transfer(rig.neutral, rig.triangles, rig.deltas, self.worn)
        return replace(rig, neutral=self.worn, deltas=deltas.astype(np.float32), understood=None)


def read_inputs(
    rig: Rig,
    settings: Settings,
    folder: Path | str = Path(),
    *,
    names: str | None = None,
    takes: bool = True,
    carried: tuple[KnownCamera, ...] = (),
) -> PlanInputs:
    """The rig, and what the files that `settings` names hold, which are seen from `folder`: the plan's, for a plan.

    `names` is the name map that the rig was read with, for takes of other names. Without `takes` these are left out:
    expressions and sheets ask for none. Cameras that a plan has `carried` count where the file that it names is not
    there.

    Raises:
        RigError: a file is missing or unusable.
        PlanError: an input was given in Python, and no file has it.

    Example:
        >>> settings = Settings(cameras="frontal")
        >>> [camera.name for camera in read_inputs(sample_rig(), settings).cameras]
        ['frontal']
    """
    folder = Path(folder)
    known = {"cameras"} if carried else set()
    only_in_python = [what for what, said in named_files(settings) if said.startswith(IN_PYTHON) and what not in known]
    if only_in_python:
        raise PlanError(
            f"the plan was made with {only_in_python[0]} {IN_PYTHON}, which no file has: check and change it in Python "
            "too, with PlanInputs, or give a file and plan again"
        )
    cameras, rules, target = (
        found_from(folder, name) for name in (settings.cameras, settings.expressions.rules, settings.target)
    )
    painted = {name: found_from(folder, name) for name in settings.landmarks.keep_out if name not in ZONES}
    return PlanInputs(
        rig,
        cameras=read_cameras_of(rig, cameras, carried) if cameras else (),
        takes=read_takes(rig, settings, folder, names) if takes else None,
        target=read_neutral(Path(target), rig) if target else None,
        rules=read_rules(Path(rules)) if rules else None,
        zones={name: painted_zone(path, rig).mask for name, path in painted.items() if os.path.exists(path)},
    )


def read_cameras_of(rig: Rig, cameras: str, carried: tuple[KnownCamera, ...]) -> tuple[Camera, ...]:
    """The cameras of a preset or a file, or those that were carried where the file is not there."""
    if carried and not is_preset(cameras) and not os.path.exists(cameras):
        return tuple(map(camera_of, carried))
    return cameras_for(cameras, rig.neutral, rig.skin, lambda: _places(rig, {}))


def _places(rig: Rig, markers: Mapping[str, int]) -> dict[str, Float[np.ndarray, "3"]]:
    """Places of the head that calibrations are aligned by, and the dots of a plan (vertices), in millimetres."""
    return {name: rig.neutral[vertex] for name, vertex in (named_vertices(rig) | dict(markers)).items()}


def with_cameras(inputs: PlanInputs, cameras: str, markers: Mapping[str, int]) -> PlanInputs:
    """The inputs with the cameras of a preset or a file; `markers` are the vertices of the plan's dots by name, by
    which a file may be aligned.

    Raises:
        RigError: it is neither, or no camera has the head in its picture.
    """
    rig = inputs.rig
    return replace(inputs, cameras=cameras_for(cameras, rig.neutral, rig.skin, lambda: _places(rig, markers)))


def read_takes(rig: Rig, settings: Settings, folder: Path, names: str | None) -> Takes | None:
    """The takes that the settings name, together; None where they name none."""
    mine = read_name_map(found_from(folder, names)) if names else None
    paths = [found_from(folder, path) for path in settings.sequences]
    if not paths:
        return None
    sequences = [read_sequence(path, rig=rig, name_map=mine) for path in paths]
    weighed = found_from(folder, settings.vertex_weights)
    s = read_vertex_weights(Path(weighed), rig) if weighed else 1.0
    return takes_of(rig, sequences, shares=settings.sequence_weights, s=s)


def inputs_for(
    given: Rig | PlanInputs, settings: Settings, *, takes: bool = True, carried: tuple[KnownCamera, ...] = ()
) -> PlanInputs:
    """The inputs that the settings ask for: a rig alone is inputs of nothing else, and a preset of cameras is placed in
    front of the face, or those that a plan has `carried` are taken. Without `takes` these are not asked for.

    Raises:
        PlanError: the settings name what was not given.
    """
    inputs = given if isinstance(given, PlanInputs) else PlanInputs(given)
    if is_preset(settings.cameras) and not inputs.cameras:
        rig = inputs.rig
        inputs = replace(inputs, cameras=cameras_for(settings.cameras, rig.neutral, rig.skin))
    if carried and not inputs.cameras:
        inputs = replace(inputs, cameras=tuple(map(camera_of, carried)))
    there = {
        "a keep-out zone": True,  # the face says which zones it knows
        "cameras": bool(inputs.cameras),
        "rules": inputs.rules is not None,
        "the actor's neutral": inputs.target is not None,
        "takes": inputs.takes is not None or not takes,
        "vertex weights": inputs.takes is not None or not takes,
    }
    for what, said in named_files(settings):
        if not there[what]:
            raise PlanError(
                f"the settings name {what} ({said}), and no such input was given: read_inputs(rig, settings, folder) "
                "reads the files that settings name"
            )
    return inputs


def settings_recorded(settings: Settings, inputs: PlanInputs) -> Settings:
    """The settings as a plan of these inputs carries them: what no setting names was given in Python."""
    takes = inputs.takes.names if inputs.takes else ()
    said = {
        "cameras": settings.cameras or (IN_PYTHON if inputs.cameras else None),
        "target": settings.target or (IN_PYTHON if inputs.target is not None else None),
        "sequences": settings.sequences or tuple(f"{IN_PYTHON}: {name}" for name in takes),
    }
    rules = settings.expressions.rules or (IN_PYTHON if inputs.rules is not None else None)
    return structs.replace(settings, **said, expressions=structs.replace(settings.expressions, rules=rules))
