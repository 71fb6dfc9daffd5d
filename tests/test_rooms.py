"""The rooms of the house: who may import whom, and who may know which library."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "capture_plan"
FLOORS = (
    {"errors", "progress"},
    {"solver"},
    {"output", "documents"},
    {"cache"},
    {"mesh"},
    {"visibility"},
    {"rig"},
    {"transfer"},
    {"layout", "expressions"},
    {"plan"},
    {"sheets", "exports"},
    {"report", "figures", "terminal", "notebook_guard"},
    {"notebook", "notebooks_support"},
    {"cli"},
)
ONLY_IN = {
    "embreex": {"visibility"},
    "pxr": {"rig"},
    "ortools": {"solver", "layout", "expressions"},
    "pyrender": {"sheets"},
    "OpenGL": {"sheets"},
    "PIL": {"sheets"},
    "fpdf": {"sheets"},
    "matplotlib": {"figures"},
    "marimo": {"notebooks_support"},
}


def room(path):
    inside = path.relative_to(PACKAGE)
    return inside.parts[0].removesuffix(".py")


@cache
def imports(path):
    """Every module that a file names, whether at its top or inside a function."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.append(node.module)
    return tuple(found)


MODULES = [
    path
    for path in sorted(PACKAGE.rglob("*.py"))
    if room(path) not in ("__init__", "_notebooks") and path.name != "rebuild.py"
]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_room_imports_only_from_rooms_below_it(path):
    floor = {name: number for number, rooms in enumerate(FLOORS) for name in rooms}
    own = room(path)
    for module in imports(path):
        if module.startswith("capture_plan."):
            other = module.split(".")[1]
            assert other == own or floor[other] < floor[own], f"{own} imports {module}"


@pytest.mark.parametrize("library", ONLY_IN)
def test_a_library_is_known_to_its_rooms_alone(library):
    knowing = {room(path) for path in MODULES for module in imports(path) if module.split(".")[0] == library}
    assert knowing <= ONLY_IN[library]


def loaded_after(statement):
    code = f"import sys; {statement}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return {name.split(".")[0] for name in run.stdout.split()}


@pytest.mark.parametrize("statement", ["import capture_plan", "import capture_plan.cli"])
def test_importing_the_package_loads_nothing_heavy(statement):
    assert not loaded_after(statement) & {"marimo", "pyrender", "ortools", "scipy", "embreex", "PIL", "matplotlib"}


def test_the_checker_knows_no_solver():
    assert not loaded_after("import capture_plan.plan.check") & {"ortools", "highspy"}
