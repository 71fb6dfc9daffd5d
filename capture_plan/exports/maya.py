"""Markers as a Maya scene: `markers.ma`, one locator each under a group. Centimetres, +y up, facing +z.

Names    letters a to z, digits and '_', as Maya takes them; what stood in the plan is in each locator's notes
"""

from pathlib import Path

from capture_plan.exports.delivery import Delivery, dots_mm
from capture_plan.exports.marker_names import plain_names
from capture_plan.output import write_whole
from capture_plan.plan.record import words_of

MM = 10  # in a centimetre
LONGEST = 60  # letters of a name
GROUP = "capture_plan_markers"
HEAD = """//Maya ASCII 2020 scene
//Markers of a capture plan: one unit is a centimetre, +y up, the face looks along +z.
//{origin}
//Codeset: UTF-8
requires maya "2020";
currentUnit -l centimeter -a degree -t film;
fileInfo "capture_plan" "{origin}";
createNode transform -n "{group}";
"""
LOCATOR = """createNode transform -n "{name}" -p "|{group}";
\taddAttr -ci true -sn "nts" -ln "notes" -dt "string";
\tsetAttr ".t" -type "double3" {x:.6f} {y:.6f} {z:.6f} ;
\tsetAttr ".nts" -type "string" "{note}";
createNode locator -n "{name}Shape" -p "|{group}|{name}";
\tsetAttr -k off ".v";
\tsetAttr ".los" -type "double3" {size:g} {size:g} {size:g} ;
"""


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the scene; locators are as wide as the dots."""
    names = plain_names(of.names, longest=LONGEST)
    size = of.plan.settings.landmarks.dot_mm / MM / 2  # a locator reaches as far on either side
    text = HEAD.format(group=GROUP, origin=quoted(words_of(of.plan)))
    for name, marker, xyz in zip(names, of.plan.layout.markers, dots_mm(of.plan, of.inputs) / MM, strict=True):
        x, y, z = xyz.tolist()
        note = quoted(f"{marker.name}: {marker.label}")
        text += LOCATOR.format(name=name, group=GROUP, x=x, y=y, z=z, note=note, size=size)
    path = of.place(folder, "markers", ".ma")
    write_whole(path, f"{text}// End of {path.name}\n".encode())
    return [path]


def quoted(text: str) -> str:
    """Text between the quotes of a MEL string."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return plain.replace("\\", "\\\\").replace('"', '\\"')
