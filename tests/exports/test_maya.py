"""Maya scenes, taken apart as MEL."""

import re

import numpy as np

from capture_plan.exports.maya import quoted, write
from tests.exports.deliveries import badly_named, dots, sample

LOCATOR = re.compile(
    r'createNode transform -n "(\w+)" -p "\|capture_plan_markers";\n'
    r'\taddAttr [^\n]+;\n\tsetAttr ".t" -type "double3" (\S+) (\S+) (\S+) ;\n\tsetAttr ".nts" -type "string" "(.*)";\n'
    r'createNode locator -n "(\w+)" -p "\|capture_plan_markers\|(\w+)";\n'
)


def test_a_locator_stands_where_each_dot_is_in_centimetres_y_up(tmp_path):
    (path,) = write(sample(), tmp_path)
    text = path.read_text()
    found = LOCATOR.findall(text)
    assert tuple(name for name, *_ in found) == sample().names
    assert np.abs(10 * np.array([xyz for _, *xyz, _, _, _ in found], float) - dots(sample())).max() < 0.01
    assert all(parent == name and shape == f"{name}Shape" for name, *_, shape, parent in found)
    assert "currentUnit -l centimeter" in text.split("createNode")[0]
    assert text.isascii()


def test_names_are_such_as_maya_takes_and_all_different(tmp_path):
    (path,) = write(badly_named(30), tmp_path)
    found = LOCATOR.findall(path.read_text())
    assert len({name for name, *_ in found}) == len(found) == 30
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) for name, *_ in found)
    assert any("lèvre supérieure" in note for *_, note, _, _ in found)


def test_no_text_ends_its_string():
    assert quoted('a"; quit; "\\\n') == 'a\\"; quit; \\"\\\\ '
