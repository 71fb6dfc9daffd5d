"""Documents that other programs write: JSON, YAML and XML, read in bounded time and memory.

YAML   no tags but OpenCV's `!!opencv-matrix`, which is a mapping; no anchors; scalars of names stay what they look like
XML    no document type, so no entities; names without their namespaces
"""

import json
import xml.etree.ElementTree as ElementTree
from typing import Any
from xml.etree.ElementTree import Element

import yaml

from capture_plan.errors import CapturePlanError
from capture_plan.input.bounds import check_values

MOST_YAML_BYTES = 1_000_000  # PyYAML reads about 100 kB a second; calibrations have 1 to 100 kB


class _Plain(yaml.SafeLoader):
    """YAML of plain mappings, lists, numbers and words."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        """The next node. A ConstructorError where it is an alias: a few of them unfold to billions of values."""
        if self.check_event(yaml.AliasEvent):
            raise yaml.constructor.ConstructorError(None, None, "it holds an alias (*name)")
        return super().compose_node(parent, index)


def _mapping(loader: yaml.SafeLoader, node: yaml.Node) -> dict[Any, Any]:
    """A matrix of OpenCV: rows, cols and data, or sizes and data."""
    if not isinstance(node, yaml.MappingNode):
        raise yaml.constructor.ConstructorError(None, None, "a matrix is no mapping")
    return loader.construct_mapping(node, deep=True)


for _tag in ("opencv-matrix", "opencv-nd-matrix"):
    _Plain.add_constructor(f"tag:yaml.org,2002:{_tag}", _mapping)


def decoded(content: bytes, what: str, error: type[CapturePlanError]) -> str:
    """The text of a file in UTF-8, or in UTF-16 where it begins with a mark that says so."""
    wide = content[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        return content.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        raise error(f"{what} is no text in UTF-8: save it as UTF-8, or export it again") from None


def json_document(text: str, what: str, error: type[CapturePlanError]) -> Any:
    """The values of a JSON document. `error` that begins with `what` where it is none, or too large or deep."""
    check_values(text)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as reason:
        raise error(f"{what} is not JSON ({_line(reason)}): export it again") from None


def yaml_document(text: str, what: str, error: type[CapturePlanError]) -> Any:
    """The values of a YAML document, also of OpenCV's. `error` that begins with `what` where it is none, or unsafe."""
    if len(text) > MOST_YAML_BYTES:
        raise error(f"{what} has {len(text):,} signs, expected at most {MOST_YAML_BYTES:,}: leave the image points out")
    lines = text.splitlines()
    if lines and lines[0].startswith("%YAML:"):  # OpenCV's own way to write %YAML 1.0
        lines = lines[1:]
    try:
        return yaml.load("\n".join(lines), Loader=_Plain)  # a SafeLoader
    except (yaml.YAMLError, ValueError, RecursionError) as reason:
        raise error(f"{what} is not plain YAML ({_line(reason)}): export it again without tags and aliases") from None


def xml_document(text: str, what: str, error: type[CapturePlanError]) -> Element:
    """The root of an XML document, names without namespaces. `error` that begins with `what` where it is none."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise error(f"{what} declares a document type or entities, which are not read: export it again without")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as reason:
        raise error(f"{what} is not XML ({_line(reason)}): export it again") from None
    for element in root.iter():
        element.tag = _bare(element.tag)
        element.attrib = {_bare(key): value for key, value in element.attrib.items()}
    return root


def _bare(name: str) -> str:
    return name.rpartition("}")[2]


def _line(reason: BaseException) -> str:
    """What went wrong, in one line of at most 120 signs."""
    return " ".join(str(reason).split())[:120]
