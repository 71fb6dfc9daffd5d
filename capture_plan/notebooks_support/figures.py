"""What was found, in figures and tables: one function for each stage of a plan, every number with its unit."""

import html
from typing import Any

import marimo as mo

from capture_plan.audit.audit import Audit
from capture_plan.audit.report import verdict
from capture_plan.expressions import Packing
from capture_plan.layout.face import Face
from capture_plan.layout.record import Layout, Prediction
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.predicted import FRAMES_WITHIN, SOLVE
from capture_plan.plan.summary import number_words
from capture_plan.prose import count
from capture_plan.report.contents import KINDS, compare_row, error_tile, headline, marker_rows, predicted_row, take_tile
from capture_plan.report.words import millimetres, percent


def audit_view(report: Audit) -> mo.Html:
    """The verdict, what is in the rig, and every finding."""
    said = verdict(report)
    kind = "success" if said.startswith("Yes") else "warn" if report.used else "danger"
    pupils = "not found" if report.interpupillary_mm is None else f"{report.interpupillary_mm:.1f} mm"
    skin = f"{report.skin_vertices:,} of them face skin"
    return mo.vstack(
        [
            mo.callout(mo.Html(f"<p><b>Can it be shot with?</b> {html.escape(said)}</p>"), kind=kind),
            show_tiles(
                ("Blendshapes planned", f"{len(report.used)} of {report.blendshapes}", "the others are listed below"),
                ("Can be distinguished", f"{report.rank} of {len(report.used)}", "movements that differ on the skin"),
                ("Vertices", f"{report.vertices:,}", skin),
                ("Between the pupils", pupils, f"1 unit of the file is {report.unit_mm:g} mm, up {report.up}"),
            ),
            show_table(
                [
                    {
                        "Finding": KINDS[finding.kind],
                        "Plan": "left out" if finding.left_out else "planned",
                        "What was found": finding.message,
                        "What to do": finding.advice,
                    }
                    for finding in report.findings
                ],
            )
            if report.findings
            else mo.md("Nothing is wrong with this rig."),
        ],
        gap=1,
    )


def visibility_view(face: Face) -> mo.Html:
    """How well the moving skin is seen, in figures."""
    share = face.visibility[face.moving_skin]
    enough = LayoutSettings().min_visibility
    return show_tiles(
        ("Skin that moves", f"{len(share):,}", "vertices that some blendshape moves"),
        (
            "Seen well enough",
            percent(float((share >= enough).mean())),
            f"from {percent(enough)} or more, in every expression",
        ),
        ("Seen by half", percent(float((share >= 0.5).mean())), "from half of all directions or cameras"),
        ("Never seen", percent(float((share == 0).mean())), "hidden in some expression"),
    )


def layout_view(layout: Layout) -> mo.Html:
    """What the landmarks are worth, beside layouts that people know."""
    information = layout.information
    expected = {"This layout": layout.predictions} | {name: one.predictions for name, one in layout.references.items()}
    rows = [
        (name, other, headline(other, expected[name]))
        for name, other in [("This layout", information), *layout.references.items()]
    ]
    most = max(error for _, _, error in rows) or 1.0
    compared = [compare_row(name, other, other is information, error, error / most) for name, other, error in rows]
    error = error_tile(information, layout.predictions)
    fit = layout.motion
    lost = {"This layout": fit.rmse_mm} | fit.references_mm if fit else {}
    return mo.vstack(
        [
            show_tiles(
                (
                    "Landmarks",
                    str(len(layout.landmarks)),
                    f"at least {layout.certificate.landmarks} are needed to see everything once",
                ),
                ("Distinguished", f"{information.rank} of {information.full_rank}", "mixes of blendshapes"),
                (error.name, f"{error.figure} {error.unit}", error.note),
                (
                    "Uncovered",
                    str(len(layout.uncovered)),
                    ", ".join(layout.uncovered) or "every blendshape has a landmark",
                ),
                *((one.name, f"{one.figure} {one.unit}", one.note) for one in (take_tile(fit) if fit else ())),
            ),
            show_table(
                [
                    {
                        "Layout": row["name"],
                        "Landmarks": row["markers"],
                        "Distinguished": row["rank"],
                        "Condition number": row["condition"],
                        "Predicted error": row["error"],
                        "Upper estimate": row["upper"],
                        **({"Lost of the take": millimetres(lost[row["name"]])} if lost else {}),
                    }
                    for row in compared
                ],
                numbers=(
                    "Landmarks",
                    "Distinguished",
                    "Condition number",
                    "Predicted error",
                    "Upper estimate",
                    "Lost of the take",
                ),
                strong=0,
            ),
            *([predicted_table(layout.predictions)] if layout.predictions else []),
        ],
        gap=1,
    )


def predicted_table(predictions: tuple[Prediction, ...]) -> mo.Html:
    """The error to expect of every performance, weights solved between 0 and 1."""
    titles = {
        "performance": f"Performance, {SOLVE}",
        "noise": "Noise",
        "error": "Predicted error of the skin",
        "within": FRAMES_WITHIN,
        "beyond": "The rig cannot show",
    }
    rows = [{title: row[name] for name, title in titles.items()} for row in map(predicted_row, predictions)]
    return show_table(rows, numbers=tuple(titles.values())[1:])


def landmark_table(layout: Layout) -> mo.Html:
    """One row a landmark, as on the printed table."""
    return show_table(
        [
            {
                "Landmark": row["name"],
                "Where": row["label"],
                "Side": row["side"],
                "Seen from": row["seen"],
                "Vertex": row["vertex"],
                "Stands for": row["stands_for"],
            }
            for row in marker_rows(layout.markers)
        ],
        numbers=("Seen from", "Vertex"),
        names=("Stands for",),
    )


def packing_view(packing: Packing) -> mo.Html:
    """How many expressions, what was proved, and one row for each, the most telling first."""
    shots = packing.expressions
    return mo.vstack(
        [
            show_tiles(
                ("Expressions", str(len(shots)), number_words(packing)),
                (
                    "First five show",
                    percent(shots[min(5, len(shots)) - 1].covered),
                    "of what all expressions would",
                ),
                ("All show", percent(shots[-1].covered), "when every expression is scanned"),
                ("Left out", count(len(packing.left_out), "blendshape"), "by the limit on expressions"),
            ),
            show_table(
                [
                    {
                        "Name": shot.name,
                        "What the actor does": shot.sentence,
                        "Adds": percent(shot.gain),
                        "Shown so far": percent(shot.covered),
                        "Blendshapes": ", ".join(shot.blendshapes),
                    }
                    for shot in shots
                ],
                numbers=("Adds", "Shown so far"),
                names=("Blendshapes",),
            ),
        ],
        gap=1,
    )


def show_tiles(*tiles: tuple[str, str, str]) -> mo.Html:
    """Headline figures: what, how much with its unit, and a note."""
    cells = "".join(
        f'<div><p class="what">{html.escape(what)}</p><p class="figure">{html.escape(figure)}</p>'
        f"<p>{html.escape(note)}</p></div>"
        for what, figure, note in tiles
    )
    return mo.Html(f'<div class="tiles">{cells}</div>')


def show_table(
    rows: list[dict[str, Any]], *, numbers: tuple[str, ...] = (), names: tuple[str, ...] = (), strong: int = -1
) -> mo.Html:
    """Rows of the same columns: `numbers` stand to the right, `names` are small; the row number `strong` stands out."""
    sorts = {column: "number" if column in numbers else "names" if column in names else "" for column in rows[0]}
    head = "".join(f'<th class="{sort}">{html.escape(column)}</th>' for column, sort in sorts.items())
    body = "".join(
        f'<tr class="{"strong" if i == strong else ""}">'
        + "".join(f'<td class="{sorts[column]}">{html.escape(str(cell))}</td>' for column, cell in row.items())
        + "</tr>"
        for i, row in enumerate(rows)
    )
    return mo.Html(f'<div class="rows"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>')
