"""The examples in docstrings of the chief functions run, and say what comes out."""

import doctest
from importlib import import_module

import numpy as np
import pytest
from msgspec.structs import replace

import capture_plan
from capture_plan.expressions.settings import Edits
from capture_plan.layout.face import see_face
from capture_plan.plan.files import write_plan
from capture_plan.shell.take import face_take
from tests.once import QUICK, plan_of

CHIEF = {
    "anatomy.regions": ("face_regions",),
    "audit.audit": ("audit_rig",),
    "camera.camera": ("look_at",),
    "camera.read": ("read_cameras",),
    "check.check": ("check_plan",),
    "evaluation.carrigan2020.mu_sweep": ("mu_sweep",),
    "evaluation.compare": ("compare_layouts",),
    "evaluation.le2013.methods": ("by_method",),
    "evaluation.zell2022.epsilon_sweep": ("epsilon_sweep",),
    "evaluation.zell2022.variants": ("single_cover",),
    "expressions.pack": ("pack",),
    "inspection.inspect": ("inspect_plan",),
    "layout.design": ("design_layout",),
    "layout.face": ("see_face",),
    "mesh.decimate": ("decimate",),
    "mesh.geodesic": ("geodesic_distance",),
    "mesh.geometry": ("vertex_normals",),
    "mesh.mirror": ("mirror_map",),
    "plan.files": ("read_plan", "write_plan"),
    "plan.inputs": ("read_inputs",),
    "plan.make": ("make_plan",),
    "plan.revise": ("edited_plan",),
    "reader.read": ("read_rig",),
    "registration.empirical_layouts": ("place_ibug68",),
    "report.page": ("write_html",),
    "sample": ("sample_rig",),
    "sequence.read": ("read_sequence",),
    "sheets.write": ("write_sheets",),
    "shell.optimise": ("optimise",),
    "shell.takes": ("takes_of",),
}
EXAMPLES = [(module, name) for module, names in CHIEF.items() for name in names]


@pytest.fixture(scope="module")
def folder(rig, tmp_path_factory):
    """A folder with the files that examples read: a rig, a take and a plan."""
    folder = tmp_path_factory.mktemp("examples")
    arrays = {"vertices": rig.neutral, "faces": rig.triangles, "deltas": rig.deltas, "names": np.array(rig.names)}
    np.savez(folder / "hero.npz", **arrays)
    frames = ["1,0,0.2", "0.5,0.6,0", "0,1,0.9"]
    (folder / "take.csv").write_text("\n".join(["jawOpen,mouthSmileLeft,browInnerUp", *frames]) + "\n")
    few = replace(QUICK, expressions=replace(QUICK.expressions, limit=2))
    write_plan(plan_of(few), folder / "hero.plan.json")
    return folder


@pytest.mark.parametrize(("module", "name"), EXAMPLES, ids=[name for _, name in EXAMPLES])
def test_an_example_says_what_comes_out(folder, monkeypatch, module, name):
    monkeypatch.chdir(folder)
    home = import_module(f"capture_plan.{module}")
    exported = {one: getattr(capture_plan, one) for one in capture_plan.__all__}
    named = {"np": np, "Edits": Edits, "see_face": see_face, "face_take": face_take}
    known = exported | named | vars(home)
    (found,) = doctest.DocTestFinder(recurse=False).find(getattr(home, name), name, globs=known)
    assert found.examples
    said: list[str] = []
    assert doctest.DocTestRunner().run(found, out=said.append).failed == 0, "".join(said)


def test_every_exported_function_has_one():
    functions = {name for name in capture_plan.__all__ if name.islower()}
    assert functions <= {name for _, name in EXAMPLES}
