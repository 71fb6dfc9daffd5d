"""Damaged files of every format through the whole tool: a valid result, or one of our errors.

Rig        reading, `check_rig`, the audit, and a plan of cheap settings
Take       drives the small head, and a layout follows it
By hand    settings, rules and cameras make a plan; a plan is checked and edited
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from capture_plan.audit.audit import audit_rig
from capture_plan.camera import cameras_for
from capture_plan.check.check import check_plan
from capture_plan.errors import CapturePlanError
from capture_plan.expressions.settings import Edits, PackingSettings
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.files import inputs_of, plan_bytes, read_plan, read_settings, refer_to
from capture_plan.plan.inputs import read_inputs
from capture_plan.plan.make import make_plan
from capture_plan.plan.revise import edited_plan
from capture_plan.plan.settings import Settings
from capture_plan.reader.read import read_raw, rig_from_raw
from capture_plan.rig import Rig
from capture_plan.sequence import read_sequence
from tests import fuzz_seeds as seeds
from tests.camera import camera_files
from tests.fbx_files import ascii_text, binary
from tests.fuzz_seeds import NAMES, small_rig

CHEAP = PackingSettings(method="greedy")
METHODS = ("cover", "distance", "adaptive")


def cheap(method: str, **landmarks: Any) -> Settings:
    """Settings whose plan takes a fraction of a second."""
    layout = LayoutSettings(method=method, min_visibility=0.0, noise_mm=1.0, **landmarks)  # pyright: ignore
    return Settings(landmarks=layout, expressions=CHEAP)


def check_rig(rig: Rig) -> None:
    """AssertionError unless all of a rig is what `Rig` says."""
    v, k = len(rig.neutral), len(rig.names)
    assert rig.neutral.shape == (v, 3)
    assert rig.deltas.shape == (k, v, 3)
    assert rig.triangles.shape[1] == 3
    assert np.isfinite(rig.neutral).all()
    assert np.isfinite(rig.deltas).all()
    assert np.isfinite(rig.displacement).all()
    assert 0 <= rig.triangles.min() <= rig.triangles.max() < v
    assert rig.skin.dtype == bool
    assert rig.skin.any()
    assert len(rig.skin) == len(rig.source_index) == len(rig.parts) == v
    assert 0 <= rig.parts.min() <= rig.parts.max() < len(rig.part_names)
    assert rig.source_index.min() >= 0
    assert len(set(rig.names)) == k > 0
    assert all(name.isprintable() for name in (*rig.names, *rig.part_names, rig.note))
    assert np.isfinite(rig.unit_mm)
    assert rig.unit_mm > 0
    assert np.isfinite(rig.turn).all()


def through_rig(path: Path, n: int) -> None:
    """A rig becomes a plan that can be written and read."""
    rig = rig_from_raw(read_raw(path))
    check_rig(rig)
    assert audit_rig(rig).used is not None
    plan = make_plan(rig, cheap(METHODS[n % len(METHODS)]))
    msgspec.json.decode(plan_bytes(plan), type=type(plan))


def through_take(path: Path, n: int) -> None:
    """A take drives the head, and a layout may follow it."""
    rig = small_rig(path.parent)
    take = read_sequence(path, rig=rig)
    assert np.isfinite(take.frames.block(0, min(len(take.frames), 50))).all()
    assert take.fps > 0
    if n % 4 == 0:
        planned(rig, msgspec.structs.replace(cheap("motion", budget=3), sequences=(str(path),)))


def planned(rig: Rig, settings: Settings, folder: Path = Path()) -> None:
    """The settings and the files that they name give a plan."""
    make_plan(read_inputs(rig, settings, folder), settings)


def through_settings(path: Path, n: int) -> None:
    """Settings give a plan; how it is made stays cheap."""
    rig, found = small_rig(path.parent), read_settings(path)
    layout = msgspec.structs.replace(found.landmarks, method=METHODS[n % len(METHODS)], number=None)
    expressions = msgspec.structs.replace(found.expressions, method="greedy")
    planned(rig, msgspec.structs.replace(found, landmarks=layout, expressions=expressions), path.parent)


def through_rules(path: Path, n: int) -> None:
    """A rule file gives a plan."""
    expressions = msgspec.structs.replace(CHEAP, rules=str(path))
    planned(small_rig(path.parent), msgspec.structs.replace(cheap("cover"), expressions=expressions))


def through_cameras(path: Path, n: int) -> None:
    """Cameras give a plan."""
    planned(small_rig(path.parent), msgspec.structs.replace(cheap("cover"), cameras=str(path)))


def through_calibration(path: Path, n: int) -> None:
    """Cameras of another program stand before the head."""
    rig = small_rig(path.parent)
    assert cameras_for(str(path), rig.neutral, rig.skin)


def through_plan(path: Path, n: int) -> None:
    """A plan is checked, and edited."""
    plan = read_plan(path)
    given = inputs_of(plan, path)
    check_plan(plan, given)
    if n % 3 == 0:
        edited_plan(plan, given, Edits(dropped=NAMES[:1]))


def plan_json(path: Path) -> None:
    """A plan of the small head beside it."""
    rig = small_rig(path.parent)
    path.write_bytes(
        plan_bytes(make_plan(rig, cheap("cover"), reference=refer_to(rig, str(path.parent / "small.npz"), path)))
    )


CALIBRATIONS: dict[str, Callable[[Path, list[camera_files.Known]], Path]] = {
    "storage.yml": camera_files.opencv,
    "camchain.yaml": camera_files.kalibr,
    "colmap": camera_files.colmap,
    "colmap_binary": lambda folder, cameras: camera_files.colmap(folder, cameras, binary=True),
    "transforms.json": camera_files.nerfstudio,
    "metashape.xml": camera_files.metashape,
    "session.xcp": camera_files.vicon,
    "calibration.qca.txt": camera_files.qualisys,
    "cameras.csv": camera_files.reality_csv,
    "KRT": camera_files.multiface,
}


def calibration(write: Callable[[Path, list[camera_files.Known]], Path]) -> Callable[[Path], None]:
    """A writer of three cameras to a path: a folder's files lie in it."""

    def to(path: Path) -> None:
        (folder := path.parent / f"{path.name}.made").mkdir()
        made = write(folder, camera_files.stage())
        made.rename(path)
        if made != folder:
            for beside in folder.iterdir():
                beside.rename(path.parent / beside.name)
            folder.rmdir()

    return to


Seed = tuple[str, Callable[[Path], Any], Callable[[Path, int], None]]
SEEDS: dict[str, Seed] = {
    "obj": ("rig", seeds.obj_folder, through_rig),
    "ply": ("rig", seeds.ply_folder, through_rig),
    "ply_text": ("rig", lambda path: seeds.ply_folder(path, text=True), through_rig),
    "csv": ("rig", seeds.csv_folder, through_rig),
    "target": ("rig", seeds.target_folder, through_rig),
    "zip": ("rig.zip", seeds.zip_of, through_rig),
    "npz": ("rig.npz", lambda path: np.savez(path, **seeds.small()), through_rig),
    "glb": ("rig.glb", seeds.gltf, through_rig),
    "gltf": ("rig.gltf", seeds.gltf, through_rig),
    "vrm": ("rig.vrm", seeds.gltf, through_rig),
    "fbx": ("rig.fbx", lambda path: path.write_bytes(binary(seeds.fbx_tree())), through_rig),
    "fbx_text": ("rig.fbx", lambda path: path.write_bytes(ascii_text(seeds.fbx_tree())), through_rig),
    "usda": ("rig.usda", seeds.usd, through_rig),
    "usdc": ("rig.usdc", seeds.usd, through_rig),
    "usdz": ("rig.usdz", seeds.usd, through_rig),
    "take_csv": ("take.csv", seeds.csv_take, through_take),
    "take_json": ("take.json", seeds.json_take, through_take),
    "take_npz": ("take.npz", seeds.npz_take, through_take),
    "settings": ("settings.toml", seeds.settings_toml, through_settings),
    "rules": ("rules.toml", seeds.rules_toml, through_rules),
    "cameras": ("cameras.toml", seeds.cameras_toml, through_cameras),
    "calibration": ("calib.toml", seeds.calibration_toml, through_cameras),
    **{name: (name, calibration(write), through_calibration) for name, write in CALIBRATIONS.items()},
    "plan": ("plan.json", plan_json, through_plan),
}


def make_seed(kind: str, folder: Path) -> Path:
    """The whole input of a format, in an empty folder."""
    name, write, _ = SEEDS[kind]
    write(folder / name)
    return folder / name


def outcome(kind: str, path: Path, n: int) -> str:
    """'success', or the line of our error; any other error is the caller's."""
    try:
        SEEDS[kind][2](path, n)
    except CapturePlanError as error:
        said = str(error)
        assert said.isprintable(), said  # one line that a screen can show
        assert len(said) < 1600, said
        return said
    return "success"
