"""Which files can be written of a plan, each kind by one module of this room: a new kind is a module and a line here.

Writer    NAME.write(of: Delivery, folder: Path) -> paths written. It loads when it is asked for, so that the command
          line can name all kinds without the libraries behind them
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from pathlib import Path

    from capture_plan.exports.delivery import Delivery

    Writer = Callable[[Delivery, Path], list[Path]]

DRAFT = "-DRAFT"  # stands in the names of what is made of a plan that does not hold


@dataclass(frozen=True)
class Kind:
    """One kind of file: the module of this room that writes it, files and folders it may write, and what a person does
    next, with `{folder}` and `{draft}` in it. `usual` kinds are written where none is named."""

    module: str
    writes: tuple[str, ...]
    next: str = ""
    usual: bool = False

    @property
    def write(self) -> "Writer":
        """The function that writes it."""
        return cast("Writer", import_module(f"capture_plan.exports.{self.module}").write)


def either(*names: str) -> tuple[str, ...]:
    """Names of files and folders, each also as a draft's: 'a.csv', 'a-DRAFT.csv'."""
    cut = [(stem, dot + ending) for stem, dot, ending in (name.partition(".") for name in names)]
    return tuple(f"{stem}{draft}{ending}" for stem, ending in cut for draft in ("", DRAFT))


KINDS = {
    "csv": Kind("tables", either("landmarks.csv", "expressions.csv", "slate.csv"), usual=True),
    "json": Kind("plan_json", ("plan.json", "plan.schema.json"), usual=True),
    "meshes": Kind(
        "expression_meshes",
        either("expressions"),
        "{folder}/expressions{draft}/examples.json says unit, axes and weights of every mesh.",
        usual=True,
    ),
    "verify": Kind(
        "verify",
        ("plan.json", "rig.npz", "verify_plan.py"),
        "read {folder}/verify_plan.py, then run it there: python verify_plan.py",
    ),
    "wrap": Kind(
        "wrap",
        either("wrap_points.json"),
        "in Wrap, LoadPoints {folder}/wrap_points{draft}.json on the neutral of your own file, loaded as it is.",
    ),
    "c3d": Kind(
        "c3d",
        either("markers.c3d"),
        "open {folder}/markers{draft}.c3d in Vicon, MotionBuilder or Qualisys: millimetres, z up, the neutral on "
        "frame 1 and a frame for each expression.",
    ),
    "trc": Kind(
        "trc",
        either("markers.trc"),
        "open {folder}/markers{draft}.trc: millimetres, y up, the neutral on frame 1 and a frame for each expression.",
    ),
    "maya": Kind("maya", either("markers.ma"), "import {folder}/markers{draft}.ma in Maya: centimetres, y up."),
    "blender": Kind(
        "blender",
        either("markers_blender.py"),
        "blender --python {folder}/markers_blender{draft}.py: metres, z up; with --only meshes beside it the head too.",
    ),
    "usd": Kind(
        "usd",
        either("markers.usda", "markers_on_rig.usda"),
        "{folder}/markers{draft}.usda holds points in millimetres, y up, the neutral at time code 0.",
    ),
    "glb": Kind(
        "glb",
        either("head.glb"),
        "open {folder}/head{draft}.glb: metres, y up, each expression a morph target, each marker a node.",
    ),
    "livelink": Kind(
        "livelink",
        either("expressions_livelink.csv"),
        "import {folder}/expressions_livelink{draft}.csv as a Live Link Face take: 60 frames a second.",
    ),
}
"""By the name that `--only` takes."""

HTML = ("plan.html",)  # written by the room above
WRITES = tuple(dict.fromkeys((*HTML, *(name for kind in KINDS.values() for name in kind.writes))))
"""Files and folders, all there can be."""
