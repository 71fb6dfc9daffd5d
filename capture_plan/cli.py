"""The command line: `capture-plan …`. Every subcommand is one call into the package and prints what it wrote.

Exit codes: 0 done; 1 a check did not hold; 2 wrong usage or unusable input, said in one line with what to change.
What was asked for goes to standard output, what is said about the work to standard error. Heavy packages load when
needed.
"""

import shlex
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import date
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TextIO

import typer

from capture_plan.exports import KINDS, WRITES

if TYPE_CHECKING:
    from capture_plan.audit.audit import Audit
    from capture_plan.plan.inputs import PlanInputs
    from capture_plan.plan.record import Plan
    from capture_plan.plan.settings import Settings
    from capture_plan.rig import Rig
    from capture_plan.rig.read_options import ReadOptions
    from capture_plan.sequence import Sequence

app = typer.Typer(
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode="rich",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

LANDMARKS, EXPRESSIONS, SESSION = "Landmarks", "Expressions", "Session, cameras and takes"  # groups of help
AUDITS = (".png", ".pdf", ".html", ".htm", ".txt", ".json")  # endings of what `audit` writes
READING = "How the rig is read, where that went wrong"
STOPPED = 130  # exit code after Ctrl-C, as shells know it
SPELLED = {
    "expressions.method": "--expressions", "landmarks.caps": "--cap", "landmarks.pins": "--pin",
    "landmarks.forbidden": "--forbid", "sequences": "--sequence", "sequence_weights": "--sequence-weight",
}  # options that do not bear the name of their setting  # fmt: skip
LandmarkOption = partial(typer.Option, rich_help_panel=LANDMARKS)
ExpressionOption = partial(typer.Option, rich_help_panel=EXPRESSIONS)
SessionOption = partial(typer.Option, rich_help_panel=SESSION)
ReadingOption = partial(typer.Option, rich_help_panel=READING)

RIG_FORMATS = (
    "Folder of OBJ, PLY, CSV, TXT or .target files; .glb, .gltf, .vrm, .fbx, .npz, .usd, .usda, .usdc or .usdz file; "
    "a .zip of one that is not USD; or 'sample'."
)
RigPath = Annotated[str, typer.Argument(metavar="RIG", help=RIG_FORMATS)]
PlanPath = Annotated[Path, typer.Argument(metavar="PLAN", help="A plan.json that `plan` wrote.")]
OtherRig = Annotated[str | None, typer.Option("--rig", help="Where the rig is now, if it moved.")]
Force = Annotated[bool, typer.Option("--force", help="Go on where PLAN does not hold: everything says DRAFT.")]
Replace = Annotated[bool, typer.Option("--replace", help="Replace FILE even where it holds work of another kind.")]
Likeness = Annotated[
    bool, typer.Option("--without-likeness", help="Draw a generic head instead of the actor's or the rig's.")
]
Folder = Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to write into.")]
UnitMm = Annotated[
    float | None,
    typer.Option(help="Millimetres in one unit of the rig's file, if detection errs.", rich_help_panel=READING),
]
Up = Annotated[
    str | None, typer.Option(help="Axis of the file that points up, e.g. +y or +z.", rich_help_panel=READING)
]
Facing = Annotated[
    str | None, typer.Option(help="Axis of the file that the face looks along, e.g. +z or -y.", rich_help_panel=READING)
]
Names = Annotated[
    str | None, typer.Option(help="TOML file that says what blendshapes with house names are.", rich_help_panel=READING)
]
Skin = Annotated[
    str | None,
    typer.Option(help="Skin: part names with commas, or a text file of vertex numbers.", rich_help_panel=READING),
]


Paper = Annotated[Literal["a4", "letter", "a3"], typer.Option(case_sensitive=False, help="Size of the sheets.")]
Dpi = Annotated[int, typer.Option(min=72, max=600, help="Resolution of the page pictures.")]
Method = Literal["studio", "adaptive", "trivial", "distance", "cover", "budget", "motion"]
Known = Literal["ibug68", "ibug51", "mpeg4", "iemocap53", "motionbuilder17", "faceware30"]
Weights = Literal["lexicographic", "paper", "count"]
Packer = Literal["early", "minimum", "sequential", "greedy"]


KINDS_TOLD = ("html", *KINDS)


def say_version(wanted: bool | None) -> None:
    """The version, where it is asked for."""
    if wanted:
        from importlib.metadata import version

        print(f"capture-plan {version('capture-plan')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool | None, typer.Option("--version", callback=say_version, is_eager=True, help="Say the version and end.")
    ] = None,
) -> None:
    """Plan a facial capture session from a blendshape rig: where to put how few markers, which expressions to scan, and
    every page the set needs. RIG is a folder of OBJ, PLY, CSV, TXT or .target files, a .glb, .gltf, .vrm, .fbx, .npz
    or .usd file, a .zip, or the word 'sample'."""


@app.command()
def demo(output: Folder = Path("capture-plan-demo"), paper: Paper = "a4") -> None:
    """Plan the bundled sample head and write its plan, sheets and HTML page into DIR."""
    from capture_plan.output import refuse_folder, refuse_plan
    from capture_plan.plan.files import write_plan
    from capture_plan.plan.make import make_plan
    from capture_plan.plan.summary import summary
    from capture_plan.report import write_html
    from capture_plan.sample import sample_rig
    from capture_plan.sheets import write_sheets

    refuse_folder(output, ("plan.json", "sheets", "plan.html"))
    refuse_plan(output / "plan.json")
    rig = sample_rig()
    plan = make_plan(rig)
    answer(summary(plan))
    written: list[Path] = []
    with together(output, written) as new:
        written.append(write_plan(plan, new / "plan.json"))
        written += write_sheets(plan, rig, new / "sheets", paper=paper)
        written.append(write_html(plan, rig, new / "plan.html"))
    say([f"Next: open {output / 'plan.html'}; print {output / 'sheets' / 'sheets.pdf'} at 100 %."])


@app.command()
def audit(
    rig: RigPath,
    json: Annotated[bool, typer.Option("--json", help="Print the audit as JSON to standard output.")] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="FILE to write: .png, .pdf or .html with pictures, .txt, .json."
        ),
    ] = None,
    unit_mm: UnitMm = None,
    up: Up = None,
    facing: Facing = None,
    skin: Skin = None,
    names: Names = None,
) -> None:
    """Say and show how a rig was understood, what is wrong with it, and what a plan will leave out and why."""
    from capture_plan.audit.audit_cache import audit_once
    from capture_plan.audit.report import audit_text, can_be_planned
    from capture_plan.output import refuse_place
    from capture_plan.rig.read_options import ReadOptions

    if output is not None:
        refuse_place(output, inputs=[rig, skin, names], endings=AUDITS)
    given = ReadOptions(unit_mm, up, facing, skin, names)
    found = open_rig(rig, given)
    report = audit_once(found)
    text = json_text(report) if json or is_json(output) else audit_text(report)
    if output is not None:
        write_audit(report, found, output, text)
    elif json:
        print(text, end="")
    else:
        answer([text.removesuffix("\n")])
    message = f"{rig}{options_again(given)}"
    look = [f"capture-plan audit {message} -o audit.png shows how it was understood"] if output is None else []
    plan = [f"capture-plan plan {message}"] if can_be_planned(report) else []
    if not json and (look or plan):
        say([f"Next: {'; then '.join(look + plan)}."])


@app.command()
def plan(
    rig: RigPath,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Plan file to write; by default <rig>.plan.json."),
    ] = None,
    replace: Replace = False,
    settings: Annotated[
        Path | None, typer.Option(metavar="FILE", help="TOML file of settings; options below win over it.")
    ] = None,
    method: Annotated[
        Method | None,
        LandmarkOption(
            metavar="METHOD",
            help="How landmarks are chosen: studio (the default), adaptive, trivial, distance, cover, budget, motion.",
        ),
    ] = None,
    budget: Annotated[
        int | None, LandmarkOption(metavar="N", help="Number of landmarks; chooses method budget.")
    ] = None,
    weights: Annotated[
        Weights | None,
        LandmarkOption(metavar="WEIGHTS", help="What a good landmark is: lexicographic (the default), paper, count."),
    ] = None,
    epsilon: Annotated[
        float | None,
        LandmarkOption(metavar="SHARE", help="Share of a blendshape's largest movement; by default 0.5."),
    ] = None,
    symmetric: Annotated[bool | None, LandmarkOption(help="Mirror every landmark; by default yes.")] = None,
    spacing_mm: Annotated[
        float | None,
        LandmarkOption(metavar="MM", help="Least distance of two landmarks, millimetres; by default 8."),
    ] = None,
    noise_mm: Annotated[
        float | None,
        LandmarkOption(metavar="MM", help="Noise of a measured landmark, millimetres; by default 0.2."),
    ] = None,
    number: Annotated[
        int | None, LandmarkOption(metavar="N", help="Exactly so many landmarks (cover, budget, motion).")
    ] = None,
    pin: Annotated[
        list[str] | None,
        LandmarkOption(metavar="DOT", help="Dot (M12) or vertex (1225) that carries a landmark; several allowed."),
    ] = None,
    forbid: Annotated[
        list[str] | None,
        LandmarkOption(metavar="DOT", help="Dot or vertex that carries none; several allowed."),
    ] = None,
    dots_of: Annotated[
        Path | None,
        LandmarkOption(metavar="PLAN", help="Plan that names the dots; by default the one that FILE holds now."),
    ] = None,
    keep_out: Annotated[
        list[str] | None,
        LandmarkOption(
            metavar="ZONE", help="Zone without landmarks and its margin in millimetres: 'wet lip=3', a file, or 'none'."
        ),
    ] = None,
    relaxed_for: Annotated[
        Known | None,
        LandmarkOption(metavar="LAYOUT", help="Open the zones where points of this known layout stand, e.g. ibug68."),
    ] = None,
    cap: Annotated[
        list[str] | None, LandmarkOption(metavar="REGION=N", help="Most landmarks of a region: 'nose=4'.")
    ] = None,
    min_views: Annotated[
        int | None,
        LandmarkOption(metavar="N", help="Cameras that must see a landmark at once; by default 1."),
    ] = None,
    dot_mm: Annotated[
        float | None,
        LandmarkOption(metavar="MM", help="Diameter of a marker, millimetres; by default 3."),
    ] = None,
    label_margin_mm: Annotated[
        float | None,
        LandmarkOption(
            metavar="MM", help="How far each of two dots may be found off and still be told from the other."
        ),
    ] = None,
    head_markers: Annotated[
        int | None,
        LandmarkOption(metavar="N", help="Markers for the head's own motion, 3 to 5; by default none."),
    ] = None,
    cameras: Annotated[
        str | None,
        SessionOption(
            metavar="CAMERAS",
            help="Camera file (TOML, or a calibration of another program), or phone, frontal, head-mounted, "
            "head-mounted-pair, head-mounted-four, ring-N, dome-N.",
        ),
    ] = None,
    expressions: Annotated[
        Packer | None,
        ExpressionOption(
            metavar="METHOD", help="How expressions are packed: early (the default), minimum, sequential, greedy."
        ),
    ] = None,
    mu: Annotated[
        float | None,
        ExpressionOption(metavar="SHARE", help="Share of movement that makes a vertex active; by default 0.3."),
    ] = None,
    paired: Annotated[
        bool | None,
        ExpressionOption(help="Perform left and right together; by default yes."),
    ] = None,
    limit: Annotated[int | None, ExpressionOption(metavar="N", help="Most expressions there is time for.")] = None,
    rules: Annotated[
        str | None,
        ExpressionOption(metavar="FILE", help="TOML file of what an actor can do at once; by default ours."),
    ] = None,
    most_things: Annotated[
        int | None,
        ExpressionOption(metavar="N", help="Movements that an expression asks for at most; by default 4."),
    ] = None,
    minutes: Annotated[
        float | None, SessionOption(metavar="MINUTES", help="Time that there is for the session, minutes.")
    ] = None,
    target: Annotated[
        str | None, SessionOption(metavar="FILE", help="Mesh of the actor's neutral with the rig's vertices.")
    ] = None,
    sequence: Annotated[
        list[str] | None,
        SessionOption(metavar="TAKE", help="Recorded take: weights, or meshes of the rig; several allowed."),
    ] = None,
    sequence_weight: Annotated[
        list[float] | None,
        SessionOption(metavar="WEIGHT", help="Say of a take, one for each --sequence; by default the same for all."),
    ] = None,
    vertex_weights: Annotated[
        str | None,
        SessionOption(metavar="FILE", help="How much an error of a take counts, a number per vertex; by default 1."),
    ] = None,
    unit_mm: UnitMm = None,
    up: Up = None,
    facing: Facing = None,
    skin: Skin = None,
    names: Names = None,
) -> None:
    """Plan a session for RIG: landmarks and expressions, with what was proved and what error to expect."""
    from capture_plan.check.gate import lies, not_ready
    from capture_plan.output import refuse_place, replace_whole
    from capture_plan.plan.consent import passed_words
    from capture_plan.plan.files import plan_bytes, read_settings, refer_to, settings_seen_from
    from capture_plan.plan.inputs import read_inputs
    from capture_plan.plan.make import make_plan
    from capture_plan.plan.named import NamedDots
    from capture_plan.plan.replacing import files_of, refuse_to_replace
    from capture_plan.plan.settings import Settings
    from capture_plan.plan.summary import summary
    from capture_plan.progress import listen
    from capture_plan.rig.read_options import ReadOptions

    output = output or Path(f"{Path(rig).resolve().stem}.plan.json")
    dots = NamedDots(dots_of or output, given=dots_of is not None)
    chosen = override(
        read_settings(settings, dots.vertices) if settings else Settings(),
        {"method": method or ("budget" if budget is not None else None), "budget": budget, "weights": weights}
        | {"epsilon": epsilon, "symmetric": symmetric, "spacing_mm": spacing_mm, "noise_mm": noise_mm}
        | {"number": number, "keep_out": zones(keep_out), "relaxed_for": relaxed_for, "caps": counts(cap)}
        | {"pins": pin and dots.vertices(pin, "--pin"), "forbidden": forbid and dots.vertices(forbid, "--forbid")}
        | {"min_views": min_views, "dot_mm": dot_mm, "head_markers": head_markers}
        | {"label_margin_mm": label_margin_mm},
        {"method": expressions, "mu": mu, "paired": paired, "limit": limit, "rules": rules, "most_things": most_things},
        {"cameras": cameras, "target": target, "sequences": sequence}
        | {"sequence_weights": sequence_weight, "vertex_weights": vertex_weights},
        {"minutes": minutes},
    )
    refuse_place(output, inputs=[rig, settings, skin, names, *files_of(chosen)], over_plan=True)
    say(passed_words(chosen.consent, date.today()))
    given = ReadOptions(unit_mm, up, facing, skin, names)
    found = open_rig(rig, given)
    dots.must_be_of(found)
    settled = settings_seen_from(output.parent, chosen)
    if not replace:
        refuse_to_replace(output, found, rig, settled)
    reference = refer_to(found, rig, output, given)
    heard: list[str] = []
    with listen(lambda lines: say(noted(lines, heard))):
        inputs = read_inputs(found, settled, output.parent, names=names)
        made = make_plan(inputs, settled, reference=reference)
    said = replace_whole(output, plan_bytes(made))
    answer(unheard(summary(made), heard))
    say(said)
    say_written([output])
    ready = [f"Next: capture-plan check {output}, then capture-plan render {output} for the pages."]
    broken = lies(made, inputs)
    say(not_ready(output, broken) if broken else ready)


@app.command()
def settings(
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="File to write; by default it is printed.")
    ] = None,
) -> None:
    """Give a settings file with every key, what it means, its unit and what is decided without it."""
    from importlib.resources import files

    from capture_plan.output import refuse_place, replace_whole

    text = files("capture_plan.plan").joinpath("data", "settings.toml").read_text(encoding="utf-8")
    if output is None:
        print(text, end="")
        return
    refuse_place(output, endings=(".toml",))
    say(replace_whole(output, text.encode()))
    say_written([output])
    say([f"Next: change what you like and plan with --settings {output}."])


@app.command()
def markers(
    take: Annotated[
        Path,
        typer.Argument(metavar="TAKE", help="Folder of numbered OBJ or PLY files, .npz, .usd or .abc, without a rig."),
    ],
    number: Annotated[int, typer.Option(help="How many markers.")],
    output: Folder = Path("markers"),
    faces: Annotated[int, typer.Option(help="Triangles that a denser scan is made coarser to.")] = 50_000,
    symmetric: Annotated[bool, typer.Option(help="Mirror every marker.")] = True,
    spacing_mm: Annotated[float, typer.Option(help="Least distance, straight and along the skin, millimetres.")] = 8.0,
    paper: Paper = "a4",
    dpi: Dpi = 300,
    unit_mm: UnitMm = None,
    up: Up = None,
    facing: Facing = None,
    skin: Annotated[str | None, typer.Option(help="Skin: a text file of vertex numbers of the take.")] = None,
) -> None:
    """Place markers for a take of meshes that no rig describes: sheets for print, a table and the layout, with vertices
    numbered as in the take's own files."""
    from capture_plan.exports.tables import write_landmarks
    from capture_plan.layout.take_without_rig import layout_from_take, on_scan
    from capture_plan.output import refuse_folder
    from capture_plan.plan.files import change_settings, write_layout
    from capture_plan.plan.settings import Settings
    from capture_plan.plan.summary import take_summary
    from capture_plan.sequence import read_sequence
    from capture_plan.sequence.rig_from_take import skin_of_scan
    from capture_plan.sheets import write_marker_sheets

    asked = {"method": "motion", "number": number, "symmetric": symmetric, "spacing_mm": spacing_mm}
    settings = change_settings(Settings(), {"landmarks": asked}).landmarks
    refuse_folder(output, ("layout.json", "landmarks.csv", "sheets"), inputs=[take, skin])
    sequence = read_sequence(take, unit_mm=unit_mm, up=up, facing=facing)
    marked = skin_of_scan(skin, sequence) if skin else None
    layout, rig = layout_from_take(sequence, settings, triangles=faces, skin=marked)
    answer(take_summary(layout, rig))
    mine = on_scan(layout, sequence)
    written: list[Path] = []
    with together(output, written) as new:
        written.append(write_layout(mine, new / "layout.json"))
        written.append(write_landmarks(mine, new / "landmarks.csv", file=take.name, moved_by="frames"))
        written += write_marker_sheets(layout, rig, new / "sheets", paper=paper, dpi=dpi)
    say([f"Next: print {output / 'sheets' / 'sheets.pdf'} at 100 % and hold a ruler to its 50 mm bar."])


@app.command()
def check(
    plan: PlanPath,
    rig: OtherRig = None,
    cameras: Annotated[
        str | None,
        typer.Option(metavar="CAMERAS", help="Hold PLAN against these cameras: what would no longer hold is told."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the claims as JSON to standard output.")] = False,
    every: Annotated[bool, typer.Option("--all", help="A line for each claim, those that hold too.")] = False,
) -> None:
    """Recompute every claim of PLAN without a solver and say what to correct; exit 1 if one does not hold."""
    from capture_plan.check.check import check_plan
    from capture_plan.check.report import as_rows, check_lines
    from capture_plan.check.unchecked import unchecked
    from capture_plan.plan.files import inputs_of, read_plan
    from capture_plan.plan.inputs import with_cameras
    from capture_plan.plan.summary import near_words

    made = read_plan(plan)
    given = inputs_of(made, plan, rig_path=rig)
    if cameras:
        given = with_cameras(given, cameras, {m.name: m.vertex for m in made.layout.landmarks})
    claims = check_plan(made, given)
    lines = [*check_lines(claims, unchecked(made, claims), every=every), *near_words(made)]
    if json:
        print(json_text(as_rows(claims)), end="")
    say(lines) if json else answer(lines)
    if not all(claim.holds for claim in claims):
        raise typer.Exit(1)
    say([f"Next: capture-plan render {plan} for the pages, capture-plan export {plan} for everybody else."])


@app.command()
def cameras(
    plan: PlanPath,
    count: Annotated[int, typer.Option(min=1, max=60, metavar="N", help="Cameras at most.")] = 4,
    candidates: Annotated[
        str, typer.Option(metavar="KIND", help="Places to choose from: ring, dome, boom, or a camera file.")
    ] = "dome",
    places: Annotated[int, typer.Option(min=2, max=1000, metavar="N", help="Places of a ring, dome or boom.")] = 120,
    views: Annotated[int, typer.Option(min=1, max=10, metavar="N", help="Cameras that read each landmark.")] = 2,
    move_landmarks: Annotated[
        bool, typer.Option("--move-landmarks", help="Choose landmarks and cameras in turn until neither improves.")
    ] = False,
    rig: OtherRig = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write the best cameras as TOML for --cameras."),
    ] = None,
) -> None:
    """Say where to put cameras so that they measure PLAN's landmarks best, and what one more would bring."""
    import numpy as np

    from capture_plan.camera import KINDS, own_text
    from capture_plan.camera import candidates as places_of
    from capture_plan.layout.camera_places import alternate, place_cameras, placement_lines
    from capture_plan.output import refuse_place, replace_whole
    from capture_plan.plan.files import inputs_of, read_plan
    from capture_plan.plan.inputs import with_cameras

    made = read_plan(plan)
    if output:
        refuse_place(output, inputs=[plan], over_plan=False)
    given = inputs_of(made, plan, rig_path=rig, takes=False)
    found, marks, settings = given.rig, made.layout.landmarks, made.settings.landmarks
    if candidates in KINDS:
        known = places_of(candidates, places, found.neutral[found.skin])
    else:
        known = with_cameras(given, candidates, {m.name: m.vertex for m in marks}).cameras
    poses = made.poses
    if move_landmarks:
        layout, best = alternate(found, made.audit.used, settings, known, count, made.layout, views=views, poses=poses)
        moved = len({m.vertex for m in layout.landmarks} - {m.vertex for m in marks})
        answer(
            [
                f"{best.count} cameras and {len(layout.landmarks)} landmarks, {moved} of them elsewhere: "
                f"{best.error_mm:.3f} mm (upper estimate): {', '.join(one.name for one in best.cameras)}.",
            ]
        )
    else:
        at = np.array([m.vertex for m in marks])
        placement = place_cameras(
            found, made.audit.used, at, known, range(1, count + 1), dot_mm=settings.dot_mm, views=views, poses=poses
        )
        answer(placement_lines(placement, {m.vertex: m.name for m in marks}))
        best = placement.best[-1]
    if output:
        said = replace_whole(output, own_text(best.cameras, f"{best.count} cameras for {made.rig.name}").encode())
        next_ = f"Next: capture-plan plan RIG --cameras {output}, for landmarks that suit these cameras."
        say([*said, f"wrote {output}", next_])


@app.command()
def carry(
    plan: PlanPath,
    head: Annotated[
        Path, typer.Argument(metavar="HEAD", help="Scan of the actor's head: .obj, .ply, .stl, .3mf, .glb or .off.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Plan file to write, and beside it what was laid.")
    ],
    points: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Points picked on HEAD, in its own coordinates: .json, .toml or .csv."),
    ] = None,
    unit_mm: Annotated[float | None, typer.Option(help="Millimetres in one unit of HEAD, if detection errs.")] = None,
    rig: OtherRig = None,
    replace: Replace = False,
    force: Force = False,
) -> None:
    """Put PLAN onto the actor's own head: where its dots go on HEAD, how exact that is, and a picture to judge by. What
    `render` and `export` make of it shows that head."""
    from capture_plan.check.gate import as_far_as_it_goes
    from capture_plan.errors import PlanError
    from capture_plan.exports.expression_meshes import obj_bytes
    from capture_plan.input.points import read_points
    from capture_plan.output import refuse_place, replace_whole
    from capture_plan.plan.carry import actor_lines, carried, with_places
    from capture_plan.plan.files import plan_bytes
    from capture_plan.plan.places import found_from
    from capture_plan.plan.replacing import refuse_to_replace
    from capture_plan.reader.head_scan import read_head
    from capture_plan.sheets.carried_sheet import carried_picture

    laid, picture = (output.with_suffix(ending) for ending in (".laid.obj", ".png"))

    def refuse(read: list[str | Path]) -> None:
        for place in (output, laid, picture):
            refuse_place(place, inputs=[*read, head, points], over_plan=place == output)

    made, given = open_plan(plan, rig, force=force, refuse=refuse)
    if not replace:
        refuse_to_replace(output, given.rig, found_from(plan.parent, made.rig.path), made.settings)
    scan, picked = read_head(head, unit_mm), read_points(points, PlanError) if points else {}
    with as_far_as_it_goes(made):
        found, neutral = carried(made, given.rig, scan, picked)
        found = with_places(found, plan, output, head, laid)
        contents = {
            laid: obj_bytes(neutral, given.rig.triangles),
            picture: carried_picture(found, given.rig, neutral, scan, picked),
            output: plan_bytes(found),
        }
    said = [line for path, content in contents.items() for line in replace_whole(path, content)]
    answer(actor_lines(found))
    say(said)
    say_written(contents)
    say([f"Next: look at {picture}; if the dots lie right, capture-plan render {output} for the pages."])


@app.command()
def edit(
    plan: PlanPath,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Plan file to write; by default PLAN itself.")
    ] = None,
    replace: Replace = False,
    lock: Annotated[list[str] | None, typer.Option(help="'jawOpen=3': in expression E03; several allowed.")] = None,
    together: Annotated[list[str] | None, typer.Option(help="'jawOpen,browInnerUp': in one expression.")] = None,
    apart: Annotated[list[str] | None, typer.Option(help="'jawOpen,browInnerUp': never in one.")] = None,
    drop: Annotated[list[str] | None, typer.Option(help="Blendshape that is not scanned at all.")] = None,
    another: Annotated[bool, typer.Option("--another", help="Another list that is as good.")] = False,
    why: Annotated[str | None, typer.Option(help="'jawOpen,mouthPucker': say why they are not in one.")] = None,
    rig: OtherRig = None,
    force: Force = False,
) -> None:
    """Change the expressions of PLAN as an artist asks, with the least change to what was agreed."""
    from msgspec.structs import replace as replaced

    from capture_plan.check.gate import as_far_as_it_goes
    from capture_plan.errors import PlanError
    from capture_plan.expressions.settings import Edits
    from capture_plan.output import refuse_place, replace_whole
    from capture_plan.plan.files import plan_bytes
    from capture_plan.plan.places import found_from
    from capture_plan.plan.replacing import refuse_to_replace
    from capture_plan.plan.revise import edited_plan, other_plan, renumbered_words, why_not_together
    from capture_plan.plan.summary import expression_lines

    if why is None and not (lock or together or apart or drop or another):
        raise PlanError("nothing to edit: give --lock, --together, --apart, --drop, --another or --why")
    if sum(map(bool, (lock or together or apart or drop, another, why))) > 1:
        raise PlanError("--another and --why stand alone: give --lock, --together, --apart and --drop without them")
    output = output or plan
    here = output.resolve() == plan.resolve()
    made, given = open_plan(
        plan, rig, force=force, refuse=lambda read: refuse_place(output, inputs=read[here:], over_plan=True)
    )
    if why is not None:
        a, b = pair_of(why)
        answer([why_not_together(made, given, a, b)])
        return
    before = made.settings.expressions.edits
    edits = Edits(
        locked=before.locked | (counts(lock) or {}),
        together=tuple(dict.fromkeys((*before.together, *(tuple(names_of(group)) for group in together or [])))),
        apart=tuple(dict.fromkeys((*before.apart, *(pair_of(pair) for pair in apart or [])))),
        dropped=tuple(dict.fromkeys((*before.dropped, *(drop or [])))),
    )
    if edits == before and not another:
        raise PlanError(f"{plan} follows these edits already: nothing was written")
    if not (here or replace):
        source, asked = found_from(plan.parent, made.rig.path), replaced(made.settings.expressions, edits=edits)
        refuse_to_replace(output, given.rig, source, replaced(made.settings, expressions=asked))
    with as_far_as_it_goes(made):
        changed = other_plan(made, given) if another else edited_plan(made, given, edits)
    said = replace_whole(output, plan_bytes(changed))
    answer([*expression_lines(changed, made), *renumbered_words(made.packing, changed.packing)])
    say(said)
    say_written([output])
    say([f"Next: capture-plan render {output} for the pages."])


@app.command()
def inspect(
    plan: PlanPath,
    rig: OtherRig = None,
    json: Annotated[bool, typer.Option("--json", help="Print the inspection as JSON to standard output.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="File for all of it, by marker: .txt or .json."),
    ] = None,
    force: Force = False,
) -> None:
    """Say what the markers of PLAN see and confuse, which dots need care and what may fall off; with -o why each is
    there, how far it may sit from its place and what stands in for it."""
    from capture_plan.check.gate import as_far_as_it_goes
    from capture_plan.inspection.inspect import inspect_plan
    from capture_plan.inspection.inspect_report import inspection_text, short_text
    from capture_plan.output import refuse_place, replace_whole

    def refuse(read: list[str | Path]) -> None:
        if output is not None:
            refuse_place(output, inputs=read, endings=(".txt", ".json"))

    made, given = open_plan(plan, rig, force=force, refuse=refuse, takes=True)
    with as_far_as_it_goes(made):
        found = inspect_plan(made, given)
    if output is not None:
        text = json_text(found) if json or is_json(output) else f"{inspection_text(found)}\n"
        say(replace_whole(output, text.encode()))
        answer([short_text(found)])
        say_written([output])
    elif json:
        print(json_text(found), end="")
    else:
        answer([short_text(found)])
    if output is None and not json:
        say([f"Next: capture-plan inspect {plan} -o inspection.txt says all of it, marker by marker."])


@app.command()
def render(
    plan: PlanPath,
    output: Folder = Path("sheets"),
    rig: OtherRig = None,
    paper: Paper = "a4",
    dpi: Dpi = 300,
    cards: Annotated[bool, typer.Option("--cards", help="Draw cue cards instead: cards.pdf.")] = False,
    deck: Annotated[bool, typer.Option("--deck", help="Draw pages for a monitor on set instead: deck.pdf.")] = False,
    sculptor: Annotated[
        bool, typer.Option("--sculptor", help="Draw turntables with what moves how far instead: sculptor.pdf.")
    ] = False,
    as_mirror: Annotated[bool, typer.Option("--as-mirror", help="Cards and deck as in a mirror.")] = False,
    without_likeness: Likeness = False,
    force: Force = False,
) -> None:
    """Draw the marker sheets and reference expressions of PLAN for print: one PDF at true scale, and PNG pages."""
    from capture_plan.check.gate import as_far_as_it_goes
    from capture_plan.errors import PlanError
    from capture_plan.output import refuse_folder
    from capture_plan.plan.likeness import on_generic_head
    from capture_plan.progress import listen
    from capture_plan.sheets import write_on_set, write_sheets
    from capture_plan.sheets.on_set import NEXT, file_of
    from capture_plan.sheets.write import WRITES

    kinds = tuple(kind for kind, wanted in {"cards": cards, "deck": deck, "sculptor": sculptor}.items() if wanted)
    if as_mirror and not (cards or deck):
        raise PlanError("--as-mirror is for cue cards and the deck: give --cards or --deck too")
    writes = tuple(file_of(kind, as_mirror=as_mirror) for kind in kinds) or WRITES
    made, given = open_plan(
        plan, rig, force=force, refuse=lambda read: refuse_folder(output, writes, inputs=read), into=output
    )
    with as_far_as_it_goes(made), listen(say):
        given = on_generic_head(given) if without_likeness else given
        if kinds:
            paths = write_on_set(made, given, output, kinds=kinds, paper=paper, dpi=dpi, as_mirror=as_mirror)
            say_written(paths)
            say(f"Next: {NEXT[kind].format(path=path)}" for kind, path in zip(kinds, paths, strict=True))
            return
        say_written(write_sheets(made, given, output, paper=paper, dpi=dpi))
    say([f"Next: print {output / 'sheets.pdf'} at 100 % and hold a ruler to its 50 mm bar."])


@app.command()
def mask(
    plan: PlanPath,
    output: Folder = Path("mask"),
    print_volume: Annotated[
        str, typer.Option(metavar="WxDxH", help="What the printer holds, millimetres; a larger mask comes in pieces.")
    ] = "220x220x250",
    halves: Annotated[
        bool, typer.Option("--halves", help="Cut it along the midline, for a face that is too tight for one piece.")
    ] = False,
    gap_mm: Annotated[
        float, typer.Option(metavar="MM", help="Space between skin and mask, 0.4 to 0.8 millimetres.")
    ] = 0.6,
    wall_mm: Annotated[float, typer.Option(metavar="MM", help="Thickness of the mask, millimetres.")] = 2.2,
    rig: OtherRig = None,
    force: Force = False,
) -> None:
    """Make a mask of PLAN for a 3D printer: a shell over the face with a conical hole for every dot, its number beside
    it, as STL and 3MF in millimetres, and a picture of it."""
    from capture_plan.check.gate import as_far_as_it_goes
    from capture_plan.mask import MaskSettings, mask_lines, write_mask
    from capture_plan.mask.write import WRITES
    from capture_plan.output import refuse_folder
    from capture_plan.plan.carry import actor_lines
    from capture_plan.progress import listen

    wanted = MaskSettings(gap_mm=gap_mm, wall_mm=wall_mm, volume_mm=volume_of(print_volume), halves=halves)
    made, given = open_plan(
        plan, rig, force=force, refuse=lambda read: refuse_folder(output, WRITES, inputs=read), into=output
    )
    with as_far_as_it_goes(made), listen(say):
        printed, paths = write_mask(made, given, output, settings=wanted)
    answer(mask_lines(printed))
    answer(actor_lines(made))
    say_written(paths)
    say([f"Next: look at {paths[-1]}; print at 100 % and hold the mask to the face before you mark through it."])


@app.command()
def export(
    plan: PlanPath,
    output: Folder = Path("export"),
    only: Annotated[
        list[str] | None,
        typer.Option(metavar=f"[{'|'.join(KINDS_TOLD)}]", help="Write only this, or these: c3d,trc."),
    ] = None,
    without_likeness: Likeness = False,
    rig: OtherRig = None,
    force: Force = False,
) -> None:
    """Write PLAN for people and programs: an HTML page that needs no network, tables and slate, the plan with its
    schema, and a mesh for every expression with keyframes and examples for rigging. Only where asked for with --only:
    files for other programs, each of which says its unit and axes; verify: plan, rig and a checker of one file that
    imports nothing of ours."""
    from capture_plan.check.gate import as_far_as_it_goes
    from capture_plan.errors import CapturePlanError, PlanError
    from capture_plan.exports.delivery import Delivery
    from capture_plan.output import refuse_folder, refuse_plan, same
    from capture_plan.plan.files import rig_file_of
    from capture_plan.plan.likeness import on_generic_head
    from capture_plan.plan.record import number_of, whose_words
    from capture_plan.prose import in_series
    from capture_plan.report import write_html

    usual = ["html", *(name for name, kind in KINDS.items() if kind.usual)]
    wanted = kinds_of(only) if only else ["html"] if without_likeness else usual
    if without_likeness and wanted != ["html"]:
        raise PlanError("--without-likeness is for the HTML page and for render: give --only html, or nothing")
    if {"json", "verify"} & set(wanted) and not same(plan, output / "plan.json"):
        refuse_plan(output / "plan.json")
    made, given = open_plan(
        plan,
        rig,
        force=force,
        refuse=lambda read: refuse_folder(output, WRITES, inputs=read),
        into=output,
        takes="verify" in wanted,
    )
    of = Delivery(made, given, rig_file_of(made, plan, rig_path=rig), output)
    written: list[Path] = []
    refused: dict[str, str] = {}
    with as_far_as_it_goes(made), together(output, written, whose_words(made), number_of(made)) as new:
        if "html" in wanted:
            shown = on_generic_head(given) if without_likeness else given
            written.append(write_html(made, shown, new / "plan.html"))
        for name in wanted:
            if name in KINDS:
                try:
                    written += KINDS[name].write(of, new)
                except CapturePlanError as error:
                    refused[name] = str(error)
        if not written:
            raise PlanError("; ".join(refused.values()))
    if refused:
        say(f"Next: {line}" for line in next_steps([name for name in wanted if name not in refused], output, of.suffix))
        raise PlanError(f"all but {in_series(list(refused))} is written: {'; '.join(refused.values())}")
    if not only:
        say([f"Next: open {output / 'plan.html'}; it needs no network. For other programs: export --only KIND."])
    else:
        say(f"Next: {line}" for line in next_steps(wanted, output, of.suffix))


def kinds_of(given: Iterable[str]) -> list[str]:
    """Kinds of export that a person names, one or several at a time between commas, each once."""
    kinds = [word.strip().lower() for words in given for word in words.split(",")]
    for kind in kinds:
        if kind not in KINDS_TOLD:
            raise typer.BadParameter(
                f"'{kind[:40]}' is no kind of export: give some of {', '.join(KINDS_TOLD)}, as --only c3d,trc",
                param_hint="'--only'",
            )
    return list(dict.fromkeys(kinds))


def next_steps(kinds: Iterable[str], folder: Path, draft: str) -> list[str]:
    """What a person does with each kind of file that was written into a folder, `draft` in the names of drafts."""
    page = {"html": f"open {folder / 'plan.html'}; it needs no network."}
    steps = page | {name: kind.next.format(folder=folder, draft=draft) for name, kind in KINDS.items()}
    return [steps[kind] for kind in dict.fromkeys(kinds) if steps[kind]]


@app.command()
def compare(
    rig: RigPath,
    layouts: Annotated[Path | None, typer.Option(help="JSON file of more layouts: {name: [vertex, ...]}.")] = None,
    take: Annotated[Path | None, typer.Option(help="Recorded take to judge by too: weights, or meshes of it.")] = None,
    budget: Annotated[list[int] | None, typer.Option(min=1, help="Landmarks; may be given several times.")] = None,
    noise_mm: Annotated[
        float, typer.Option(min=0.001, max=1000, help="Noise that ours are designed for, millimetres.")
    ] = 0.2,
    epsilon: Annotated[
        float, typer.Option(min=0.01, max=1, help="Share of its largest movement by which a blendshape is seen.")
    ] = 0.5,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the performance and the noise.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print the comparison as JSON to standard output.")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Write table, plots and JSON into DIR too.")
    ] = None,
    unit_mm: UnitMm = None,
    up: Up = None,
    facing: Facing = None,
    skin: Skin = None,
    names: Names = None,
) -> None:
    """Hold our layouts of RIG against those of others: what comes back of a performance under noise."""
    from capture_plan.audit.audit_cache import audit_once
    from capture_plan.evaluation.compare import BUDGETS, compare_layouts
    from capture_plan.evaluation.compare_report import comparison_text
    from capture_plan.evaluation.user_layouts import read_layouts, take_weights
    from capture_plan.layout.face import see_face
    from capture_plan.layout.settings import LayoutSettings
    from capture_plan.output import refuse_folder, write_whole
    from capture_plan.rig.read_options import ReadOptions
    from capture_plan.shell.takes import takes_of

    if output is not None:
        refuse_folder(output, ("comparison.txt", "comparison.json"), inputs=[rig, layouts, take, skin, names])
    given = ReadOptions(unit_mm, up, facing, skin, names)
    found = open_rig(rig, given)
    used = audit_once(found).used
    sequence = open_take(take, found, names) if take else None
    made = compare_layouts(
        see_face(found, used),
        LayoutSettings(noise_mm=noise_mm, epsilon=epsilon),
        budgets=budget or BUDGETS,
        given=read_layouts(layouts, found) if layouts else {},
        take=take_weights(sequence, found, used) if sequence else None,
        takes=takes_of(found, [sequence]) if sequence else None,
        seed=seed,
    )
    text = comparison_text(made)
    if json:
        print(json_text(made), end="")
    else:
        answer([text])
    if output is not None:
        from capture_plan.figures import write_comparison_figures

        written: list[Path] = []
        with together(output, written) as new:
            written += [new / "comparison.txt", new / "comparison.json"]
            write_whole(written[0], f"{text}\n".encode())
            write_whole(written[1], json_text(made).encode())
            written += write_comparison_figures(made, found, new)


@app.command()
def motion(
    rig: RigPath,
    take: Annotated[Path | None, typer.Option(help="Recorded take; of the sample a made-up one by default.")] = None,
    markers: Annotated[list[int] | None, typer.Option(min=1, help="Markers; may be given several times.")] = None,
    subject: Annotated[
        list[str] | None, typer.Option(help="Rig of another person who performs the take; several allowed.")
    ] = None,
    unit_mm: UnitMm = None,
    up: Up = None,
    facing: Facing = None,
    skin: Skin = None,
    names: Names = None,
) -> None:
    """Evaluate marker layouts on a take of RIG as Le et al. 2013 do: methods, folds, recovery, compression."""
    from capture_plan.errors import RigError
    from capture_plan.evaluation.le2013.evaluation_cache import evaluate_all
    from capture_plan.evaluation.le2013.other_subjects import made_up, people_of
    from capture_plan.evaluation.le2013.report import motion_text
    from capture_plan.rig.read_options import ReadOptions
    from capture_plan.sample.motion import sample_motion

    given = ReadOptions(unit_mm, up, facing, skin, names)
    found = open_rig(rig, given)
    if take is None and rig != "sample":
        raise RigError(f"{rig}: name a recorded take of it with --take; only the sample has a made-up one")
    sequence = open_take(take, found, names) if take else sample_motion()
    people = people_of(subject, take) if subject else made_up(found) if rig == "sample" else None
    text = motion_text(evaluate_all(found, sequence, counts=markers or (), people=people))
    answer(unheard(text.split("\n"), sequence.messages() if take else ()))


@app.command()
def notebook(
    rig: RigPath = "sample",
    take: Annotated[list[str] | None, typer.Option(help="Recorded take of the rig; several allowed.")] = None,
    edit: Annotated[bool, typer.Option("--edit", help="Open it for editing instead of as an app.")] = False,
    headless: Annotated[bool, typer.Option("--headless", help="Start the server without a browser.")] = False,
    host: Annotated[
        str,
        typer.Option(help="Address to listen at; only this machine reaches the usual one."),
    ] = "127.0.0.1",
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port of the server.")] = None,
) -> None:
    """Open the session notebook on RIG: turn a knob, see the plan change."""
    from capture_plan.notebook import open_notebook
    from capture_plan.notebook_guard import LOOPBACK

    if host and host not in LOOPBACK:
        say([f"warning: whoever reaches {host} and has the address with its token sees the rig and plans on it"])
    raise typer.Exit(open_notebook(rig, take or (), edit=edit, headless=headless, host=host, port=port))


@app.command()
def learn(
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Folder to write them into, as pages."),
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="Start the server without a browser.")] = False,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="Port of the server.")] = None,
) -> None:
    """Open the lessons: from a rig to a printed page, which method when, and what the numbers mean; or write them and a
    reference of the package as pages."""
    from capture_plan.notebook import notebooks_folder, open_lessons

    if output is None:
        raise typer.Exit(open_lessons(headless=headless, port=port))
    from capture_plan.notebooks_support.site import WRITES, write_site
    from capture_plan.output import refuse_folder

    refuse_folder(output, WRITES, inputs=[])
    written: list[Path] = []
    with together(output, written) as new:
        written += write_site(notebooks_folder(), new)
    say([f"Next: open {output / 'index.html'}; it needs no network."])


def open_plan(
    path: Path,
    rig: str | None,
    *,
    force: bool,
    refuse: Callable[[list[str | Path]], None],
    into: Path | None = None,
    takes: bool = False,
) -> tuple["Plan", "PlanInputs"]:
    """The plan in a file and what it was made from, its takes where they are needed; where it does not hold, a draft by
    force, else exit 1 with its lies named. `refuse` is asked before any work whether the output may stand where it
    shall, beside what is read; a folder that it is put `into` may show no other head."""
    from capture_plan.check.gate import as_draft, insisted, lies, refusal
    from capture_plan.output import refuse_another
    from capture_plan.plan.consent import passed_words
    from capture_plan.plan.files import inputs_of, read_plan
    from capture_plan.plan.record import seal_of, whose_words
    from capture_plan.plan.replacing import files_of_plan

    plan = read_plan(path)
    refuse(files_of_plan(plan, path, rig))
    say(passed_words(plan.settings.consent, date.today()))
    if into is not None:
        refuse_another(into, whose_words(plan))
    given = inputs_of(plan, path, rig_path=rig, takes=takes or plan.seal != seal_of(plan))
    broken = lies(plan, given)
    if broken:
        say(insisted(path, broken) if force else refusal(path, broken))
        if not force:
            raise typer.Exit(1)
    return as_draft(plan, broken), given


def open_rig(path: str, given: "ReadOptions") -> "Rig":
    """The rig that a person named, read with what they state of it."""
    from capture_plan.errors import RigError
    from capture_plan.reader.read import rig_at
    from capture_plan.sample import sample_rig

    if path != "sample":
        return rig_at(Path(path), given)
    if again := options_again(given).split():
        raise RigError(f"the sample is read as it is: leave out {again[0]}")
    return sample_rig()


def is_json(output: Path | None) -> bool:
    """Whether a file is called one of JSON."""
    return output is not None and output.suffix.lower() == ".json"


def json_text(record: object) -> str:
    """A record as indented JSON."""
    import msgspec

    return f"{msgspec.json.format(msgspec.json.encode(record)).decode()}\n"


def options_again(given: "ReadOptions") -> str:
    """What a person stated of how to read a rig, as the next command has to say it again."""
    found = {name: value if isinstance(value, str) else f"{value:g}" for name, value in vars(given).items() if value}
    return "".join(f" --{name.replace('_', '-')} {shlex.quote(value)}" for name, value in found.items())


def write_audit(report: "Audit", rig: "Rig", path: Path, text: str) -> None:
    """The audit as a page with pictures where the suffix asks for one, else as this text; says the verdict."""
    from capture_plan.audit.report import verdict
    from capture_plan.output import replace_whole
    from capture_plan.sheets.audit_sheet import KINDS, audit_bytes

    kind = path.suffix.lower()
    content = audit_bytes(report, rig, kind) if kind in KINDS else text.encode()
    say(replace_whole(path, content))
    answer([f"Shoot with it? {verdict(report)}"])
    say_written([path])


def open_take(path: Path, rig: "Rig", names: str | None) -> "Sequence":
    """A take of the rig, its weights matched by the person's own names where there are any; says what drives what."""
    from capture_plan.names.name_map import read_name_map
    from capture_plan.progress import listen
    from capture_plan.sequence import read_sequence

    with listen(say):
        return read_sequence(path, rig=rig, name_map=read_name_map(names) if names else None)


def override(settings: "Settings", landmarks: dict, expressions: dict, places: dict, session: dict) -> "Settings":
    """`settings` with every option that was given."""
    from capture_plan.plan.files import change_settings

    def given(options: dict) -> dict:
        return {name: value for name, value in options.items() if value is not None}

    return change_settings(
        settings,
        given(places) | {"landmarks": given(landmarks), "expressions": given(expressions), "session": given(session)},
        option_of,
    )


def option_of(name: str) -> str:
    """The option that sets 'landmarks.epsilon'."""
    return SPELLED.get(name) or f"--{name.rpartition('.')[2].replace('_', '-')}"


def zones(given: list[str] | None) -> dict[str, float] | None:
    """'wet lip=3' and 'scar.ply' as zones with their margins; 'none' for no zone at all."""
    from capture_plan.anatomy.zones import MARGINS_MM

    if given is None or given == ["none"]:
        return None if given is None else {}
    pairs = [(one.rpartition("=")[0] or one, one.rpartition("=")[2] if "=" in one else "") for one in given]
    return {name: number_of(value, name) if value else MARGINS_MM.get(name, 0.0) for name, value in pairs}


def counts(given: list[str] | None) -> dict[str, int] | None:
    """'nose=4' as a region with its cap.

    Raises:
        PlanError: the number is not whole.
    """
    from capture_plan.errors import PlanError

    found = {one.rpartition("=")[0]: number_of(one.rpartition("=")[2], one) for one in given or ()}
    for name, number in found.items():
        if not number.is_integer():
            raise PlanError(f"'{name}={number:g}' needs a whole number behind the equals sign, as in 'nose=4'")
    return None if given is None else {name: int(number) for name, number in found.items()}


def names_of(text: str) -> list[str]:
    """The names in a text like 'jawOpen,browInnerUp'."""
    return [name.strip() for name in text.split(",") if name.strip()]


def pair_of(text: str) -> tuple[str, str]:
    """'jawOpen,browInnerUp' as two names.

    Raises:
        PlanError: these are not two.
    """
    from capture_plan.errors import PlanError

    names = names_of(text)
    if len(names) != 2:
        raise PlanError(f"'{text}' names {len(names)} blendshapes, expected two: 'jawOpen,browInnerUp'")
    return names[0], names[1]


def number_of(text: str, what: str) -> float:
    """The number in an option.

    Raises:
        PlanError: it is none.
    """
    from capture_plan.errors import PlanError

    try:
        return float(text)
    except ValueError:
        raise PlanError(f"'{what}' needs a number behind an equals sign, as in 'nose=4'; found '{text}'") from None


def volume_of(text: str) -> tuple[float, float, float]:
    """'220x220x250' as three lengths, millimetres.

    Raises:
        PlanError: these are not three.
    """
    from capture_plan.errors import PlanError

    sides = text.lower().split("x")
    if len(sides) != 3:
        raise PlanError(f"'{text}' names {len(sides)} lengths, expected width, depth and height: '220x220x250'")
    width, depth, height = (number_of(side, f"--print-volume={text}") for side in sides)
    return width, depth, height


def answer(lines: Iterable[str]) -> None:
    """What was asked for, to standard output, from where it can be kept or passed on; see `say`."""
    from capture_plan.terminal import close_quietly

    try:
        _print(lines, sys.stdout)
    except BrokenPipeError:  # nobody reads on
        close_quietly(sys.stdout)


def say(lines: Iterable[str]) -> None:
    """Messages about the work, to standard error; what files smuggle in stays harmless to a screen, and work goes on
    where nobody reads them any more."""
    with suppress(OSError):
        _print(lines, sys.stderr)


def _print(lines: Iterable[str], stream: TextIO) -> None:
    from capture_plan.errors import printable

    for line in lines:
        print("\n".join(map(printable, line.split("\n"))), file=stream)
    stream.flush()


def noted(lines: Iterable[str], heard: list[str]) -> list[str]:
    """Lines as they are, remembered in `heard`."""
    said = list(lines)
    heard += said
    return said


def unheard(lines: Iterable[str], heard: Iterable[str]) -> list[str]:
    """Lines without the notes that were said while the take was read."""
    message = " ".join(" ".join(heard).split())
    notes = [note.strip() for note in message.split("note: ")[1:]]
    return [
        line for line in lines if not (line.lower().startswith("note: ") and any(said(line, note) for note in notes))
    ]


def said(line: str, note: str) -> bool:
    """Whether a note of a summary, which may name its take first, stood in what was told."""
    words = line[6:].removesuffix(".")
    return note.startswith(words) or note.startswith(words.partition(": ")[2] or words)


@contextmanager
def together(folder: Path, written: list[Path], of: str = "", number: str = "") -> Iterator[Path]:
    """Where to write what shall stand in `folder` as a whole, `of` a head and the plan with a `number`, and be said:
    the paths in `written`."""
    from capture_plan.output import written_together
    from capture_plan.progress import listen

    with listen(say), written_together(folder, of, number) as new:
        yield new
    say_written(folder / path.relative_to(new) for path in written)


def say_written(paths: Iterable[Path]) -> None:
    """The paths that were written."""
    say(f"wrote {path}" for path in paths)


def main() -> None:
    """Run the command line; every expected error is one line and exit code 2."""
    from typer.exceptions import TyperException

    from capture_plan.errors import CapturePlanError, printable
    from capture_plan.progress import show_progress
    from capture_plan.terminal import Terminal, close_quietly, open_streams

    open_streams()
    terminal = Terminal(sys.stderr)
    try:
        with show_progress(terminal):
            code = app(standalone_mode=False, prog_name="capture-plan") or 0
        if code == STOPPED:
            raise KeyboardInterrupt
        sys.stdout.flush()
        sys.exit(code)
    except TyperException as error:
        reason = getattr(error, "format_message", lambda: str(error))()
        say([reason if reason.startswith("Usage") else f"capture-plan: {' '.join(reason.split())} (see --help)"])
    except CapturePlanError as error:
        say([f"capture-plan: {error}"])
    except MemoryError:
        say(["capture-plan: not enough memory for this; nothing half-written was left"])
    except OSError as error:
        close_quietly(sys.stdout)
        say([f"capture-plan: {printable(str(error))}; nothing half-written was left"])
    except KeyboardInterrupt:
        say([f"capture-plan: {terminal.stopped()}; nothing half-written was left"])
        sys.exit(STOPPED)
    sys.exit(2)
