"""Docstrings stand alone: whoever hovers over a name sees nothing of what stands above it."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "capture_plan"
FEWEST = 5  # words: fewer say no more than the name does
ABOVE = ("The same", "See above", "As above", "Ditto")


def documented(path):
    """Every public function, method and class of a module with its docstring, nested ones of classes too."""
    found = []

    def look(node, inside):
        for one in ast.iter_child_nodes(node):
            if isinstance(one, ast.FunctionDef | ast.ClassDef) and not one.name.startswith("_"):
                found.append((f"{inside}{one.name}", ast.get_docstring(one)))
                if isinstance(one, ast.ClassDef):
                    look(one, f"{inside}{one.name}.")

    look(ast.parse(path.read_text()), "")
    return found


MODULES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.name != "rebuild.py"]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_docstring_stands_alone(path):
    for name, text in documented(path):
        if text is not None:
            assert len(text.split()) >= FEWEST, f"{name}: {text}"
            assert not text.startswith(ABOVE), f"{name}: {text}"
