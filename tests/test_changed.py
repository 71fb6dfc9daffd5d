"""Which tests a change asks for."""

from pathlib import Path

from tests.changed import files_that_test


def test_the_test_of_a_changed_module_comes_first_and_then_its_room():
    asked = files_that_test([Path("capture_plan/layout/cover.py")])
    assert asked[0] == Path("tests/layout/test_cover.py")
    assert Path("tests/layout/test_budget.py") in asked
    assert {path.parent for path in asked} == {Path("tests/layout")}


def test_each_test_is_asked_for_once_and_what_is_no_code_asks_for_none():
    changed = [Path("README.md"), Path("tests/mesh/test_mesh.py"), *map(Path, ("capture_plan/mesh/mirror.py",) * 2)]
    asked = files_that_test(changed)
    assert asked[0] == Path("tests/mesh/test_mesh.py")
    assert len(asked) == len(set(asked))
    assert files_that_test([Path("README.md"), Path("tests/mesh/test_gone.py"), Path("tests/once.py")]) == []
