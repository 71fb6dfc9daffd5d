"""Tables that a spreadsheet, a slate operator or a script reads: `landmarks.csv`, `expressions.csv`, `slate.csv`.

`landmarks.csv`   millimetres, +y up, facing +z; `vertex_in_file` is the vertex in the file or folder that `file` names,
                  `vertex_in_plan` the one in plan.json and rig.npz, both counted from 0; for every camera of the
                  session whether it sees the dot in every expression, and its least width in pixels; `ring_mm`, how far
                  the dot may stand from its place while all others do so within theirs (`evaluation/rings.py`)
All three end in which plan and whose head they are of: programs read a table's rows, none its comments.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from capture_plan.evaluation.rings import rings_of
from capture_plan.exports.delivery import Delivery
from capture_plan.exports.rows import Columns, write_rows
from capture_plan.exports.slate import write_slate
from capture_plan.expressions.session import shot_number
from capture_plan.layout.record import Landmark, Layout, View
from capture_plan.plan.record import SAMPLE, ActorHead, Plan, cameras_of, head_words, number_of


def write(of: Delivery, folder: Path) -> list[Path]:
    """One row a marker, one an expression in the order of shooting, one a line of the shot list.

    Programs take a first line for the heads of columns: that a plan is a draft stands in the files' names.
    """
    plan = of.plan
    return [
        write_landmarks(
            plan.layout,
            of.place(folder, "landmarks", ".csv"),
            file=file_name(plan),
            actor=plan.actor,
            rings=rings_of(
                of.inputs.rig, plan.audit.used, plan.settings.landmarks, plan.layout.landmarks, cameras_of(plan)
            ).mm,
            of=origin(plan),
        ),
        write_expressions(plan, of.place(folder, "expressions", ".csv")),
        write_slate(plan.session, of.place(folder, "slate", ".csv"), of=origin(plan)),
    ]


def file_name(plan: Plan) -> str:
    """The artist's file or folder that `vertex_in_file` counts in."""
    return "MakeHuman's base.obj" if plan.rig.path == SAMPLE else Path(plan.rig.path).name


def origin(plan: Plan) -> Columns:
    """The last columns of every table: the plan's number, and whose head it shows."""
    return {"plan": number_of(plan), "head": head_words(plan)}


def write_landmarks(
    layout: Layout,
    path: Path,
    *,
    file: str,
    moved_by: str = "blendshapes",
    actor: ActorHead | None = None,
    rings: Mapping[str, float] = MappingProxyType({}),
    of: Columns = MappingProxyType({}),
) -> Path:
    """One row a marker; `file` is the artist's, and one column is headed by what moves the marker. On an actor's head
    places are those there, and stand in the head file's own coordinates besides. `of` are columns of one value each."""
    cameras = [view.camera for view in layout.markers[0].views] if layout.markers else []
    header = ["name", "place", "side", "role", "x_mm", "y_mm", "z_mm", "vertex_in_file", "file", "vertex_in_plan"]
    views = [f"{camera} {what}" for camera in cameras for what in ("reads it", "why not", "least px")]
    measured = ["measured_to_mm", "measured_worst_mm"] if cameras else []
    rows = [
        [
            *(m.name, m.label, m.side, m.role, *m.position, m.source_vertex, file, m.vertex, " ".join(m.blendshapes)),
            *(cell for view in m.views for cell in view_cells(view)),
            *(measured_cells(m) if measured else ()),
        ]
        for m in layout.markers
    ]
    header = [*header, moved_by, *views, *measured]
    if actor:
        header += ["x_in_head_file", "y_in_head_file", "z_in_head_file", "gap_mm"]
        pairs = zip(rows, actor.dots, strict=True)
        rows = [[*row[:4], *dot.position, *row[7:], *dot.in_file, dot.gap_mm] for row, dot in pairs]
    if rings:
        header += ["ring_mm"]
        rows = [[*row, rings.get(marker.name, "")] for row, marker in zip(rows, layout.markers, strict=True)]
    return write_rows(path, [[*header, *of], *([*row, *of.values()] for row in rows)])


def view_cells(view: View) -> tuple[str, str, float]:
    """Whether a camera reads a marker, why not the first time that it does not, and how wide at least, pixels."""
    reads = "always" if view.always else "sometimes" if view.share > 0 else "never"
    return reads, f"{view.why}: {view.when}" if view.why else "", round(view.pixels, 1)


def measured_cells(marker: Landmark) -> tuple[float | str, float | str]:
    """Standard deviations of a marker's place along the axis that the cameras measure best and worst, millimetres; the
    worst is empty where no second camera tells the depth."""
    known = marker.measured_mm
    return (known[0] if known else "", known[2] if len(known) == 3 else "")


def write_expressions(plan: Plan, path: Path) -> Path:
    """One row an expression, in the order of shooting; `shot` is the number that pages and slate.csv count by."""
    header, of = ["shot", "name", "sentence", "blendshapes", "gain_percent", "covered_percent"], origin(plan)
    shots = {item.name: shot_number(item) for item in plan.session.items}
    rows = [
        [shots[e.name], e.name, e.sentence, " ".join(e.blendshapes), round(100 * e.gain, 2), round(100 * e.covered, 2)]
        for e in plan.in_session
    ]
    return write_rows(path, [[*header, *of], *([*row, *of.values()] for row in rows)])
