"""The rooms of the house: who may import whom, and who may know which library."""

import ast
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from capture_plan.audit.audit_cache import AUDITING
from capture_plan.plan.collide import COLLIDING
from capture_plan.reader.read_cache import ROOMS

PACKAGE = Path(__file__).parents[1] / "capture_plan"
FLOORS = (  # a room imports only from rooms below it; a room is a folder, or a module that stands alone
    {"errors", "glossary", "once", "progress", "prose", "terminal"},
    {"input", "output", "mesh", "solver", "notebook_guard"},
    {"cache", "names", "camera"},
    {"rig", "visibility"},
    {"formats"},
    {"face", "curves"},
    {"reader", "transfer"},
    {"anatomy", "sequence"},
    {"sample", "audit", "shell", "expressions"},
    {"registration", "evaluation/carrigan2020"},
    {"layout"},
    {"plan", "evaluation", "evaluation/zell2022"},
    {"check", "evaluation/le2013"},
    {"inspection", "sheets", "exports"},
    {"report", "figures", "mask", "notebook"},
    {"notebooks_support"},
    {"cli"},
)
ONLY_IN = {
    "embreex": {"visibility"},
    "yaml": {"input"},
    "cv2": set(),
    "bpy": {"exports"},
    "ezc3d": {"exports"},
    "pxr": {"formats", "exports"},
    "DracoPy": {"formats"},
    "alembic3d": {"sequence"},
    "ortools": {"solver", "layout", "expressions", "sheets"},
    "pyrender": {"sheets"},
    "OpenGL": {"sheets"},
    "PIL": {"sheets"},
    "fpdf": {"sheets"},
    "segno": {"sheets"},
    "matplotlib": {"figures"},
    "manifold3d": {"mask"},
    "skimage": {"mask"},
    "marimo": {"notebooks_support"},
    "uvicorn": {"notebook"},
    "typer": {"cli"},
}
LARGEST = 0.10  # of the lines of the package: a room that holds more is two


def room(path):
    """The folder that a module lies in, or the module that stands alone."""
    *folders, name = path.relative_to(PACKAGE).parts
    return "/".join(folders) if folders else name.removesuffix(".py")


def room_of(module):
    """The room of a module by its dotted name, as it is imported."""
    path = PACKAGE.joinpath(*module.split(".")[1:])
    return room(path / "__init__.py" if path.is_dir() else path.with_suffix(".py"))


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


def test_every_room_has_its_floor():
    assert {room(path) for path in MODULES} == set().union(*FLOORS)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_room_imports_only_from_rooms_below_it(path):
    floor = {name: number for number, rooms in enumerate(FLOORS) for name in rooms}
    own = room(path)
    for module in imports(path):
        if module.startswith("capture_plan."):
            other = room_of(module)
            assert other == own or floor[other] < floor[own], f"{own} imports {module}"


def test_no_room_holds_more_than_a_tenth_of_the_lines():
    lines = Counter()
    for path in MODULES:
        lines[room(path)] += len(path.read_text().splitlines())
    assert [name for name, count in lines.items() if count > LARGEST * lines.total()] == []


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
    assert not loaded_after("import capture_plan.check.check") & {"ortools", "highspy"}


def asked_by(*modules):
    """Folders of the package that these modules import, and what those import in turn."""
    left, found = [PACKAGE / module for module in modules], set()
    while left:
        path = left.pop()
        rooms = {room_of(name) for name in imports(path) if name.startswith("capture_plan.")}
        for new in {name for name in rooms if (PACKAGE / name).is_dir()} - found:
            found.add(new)
            left += sorted((PACKAGE / new).glob("*.py"))
    return found


@pytest.mark.parametrize(
    ("rooms", "modules"),
    [
        (ROOMS, ["reader/read.py", "reader/read_cache.py"]),
        (AUDITING, ["audit/audit.py", "audit/audit_cache.py"]),
        (COLLIDING, ["expressions/collision.py", "expressions/compatibility.py"]),
    ],
)
def test_a_cached_answer_is_forgotten_when_any_room_that_it_asks_changes(rooms, modules):
    """A reader that was mended must not give the rig that it read before."""
    assert asked_by(*modules) - set(rooms) <= {"output"}  # writes the answer, and decides nothing in it
    assert all((PACKAGE / name).is_dir() for name in rooms)
