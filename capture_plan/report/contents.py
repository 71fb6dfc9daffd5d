"""What the plan page says: every figure with its unit, every sentence plain, proofs only where something was proved.

All texts come from a `Plan` alone; nothing here is HTML.
"""

from typing import Any, NamedTuple

from capture_plan.anatomy.delta_relations import KINDS
from capture_plan.anatomy.kinds import apart_lines
from capture_plan.expressions.session import ENOUGH, Session
from capture_plan.expressions.settings import MEASURED_BY
from capture_plan.glossary import explained
from capture_plan.layout.record import Information, Landmark, MotionFit, Prediction, View
from capture_plan.plan.consent import consent_lines
from capture_plan.plan.predicted import (
    ANY_WEIGHTS,
    FRAMES_WITHIN,
    SOLVE,
    at_noise,
    beyond_words,
    known_to,
    under_noise,
    upper_words,
    within,
)
from capture_plan.plan.record import Plan, number_of
from capture_plan.plan.summary import fit_words, unidentified_words
from capture_plan.prose import count
from capture_plan.report.proofs import minimum_proof, packing_proof, proofs
from capture_plan.report.shots import session_intro
from capture_plan.report.words import millimetres, percent
from capture_plan.sheets import Look, region_looks
from capture_plan.sheets.style import outline

ROLE_TEXT = {
    "primary": "",
    "backup": "second view of its blendshapes",
    "head": "Holds the head's own motion: the face hardly moves here",
}
WORDS = (  # of the glossary that stand on the page
    *("blendshape", "landmark", "marker", "head marker", "expression", "importance", "relative displacement"),
    *("epsilon", "mu", "noise"),
    *("rank", "condition", "predicted error", "upper estimate", "bound", "certificate", "fallback"),
)
SIDES = {"left": "on the left", "right": "on the right", "middle": "on the midline"}


class Tile(NamedTuple):
    """A headline figure; `proof` is empty where nothing was proved."""

    name: str
    figure: str
    unit: str
    note: str
    proof: str = ""


def contents(plan: Plan, shot_list: Session) -> dict[str, Any]:
    """Everything that `page.html.jinja` shows, pictures, shots and 3D head apart."""
    layout, packing, audit = plan.layout, plan.packing, plan.audit
    return {
        "title": plan.rig.name,
        "draft": plan.draft,
        "agreed": consent_lines(plan.settings.consent),
        "lead": f"{count(len(layout.landmarks), 'marker')} and {count(len(packing.expressions), 'expression')} "
        f"for {count(len(audit.used), 'blendshape')}.",
        "tiles": tiles(plan),
        "regions": {region: glyph(look) for region, look in region_looks(layout.markers).items()},
        "marker_intro": marker_intro(layout.markers),
        "uncovered": layout.uncovered,
        "stop": shot_list.stop,
        "edited": bool(packing.edits.names),
        "easy_first": plan.settings.session.easy_first,
        "session_intro": session_intro(shot_list),
        "chart": chart(plan),
        "measured": MEASURED_BY[plan.settings.expressions.importance],
        "unscanned": packing.left_out,
        "relaxed": [" and ".join(pair) for pair in packing.relaxed],
        "information_intro": f"What the markers tell about the face {under_noise(layout.information)}: how many mixes "
        "of blendshapes can be distinguished, and how far the solved skin would be off (root mean square). The "
        f"predicted error is of {SOLVE}{performance_words(layout.predictions)}. "
        f"{upper_words(layout.information, layout.predictions)} Shorter bars are better.",
        "predicted": [predicted_row(one) for one in layout.predictions],
        "frames_within": FRAMES_WITHIN,
        "predicted_intro": f"Error of the skin (root mean square) of {SOLVE}, by a seeded simulation of each "
        f"performance that says how well it knows the error. {' '.join(beyond_words(layout.predictions))}".strip(),
        "compare": compared_layouts(plan),
        "take": " ".join(fit_words(layout.motion)) if layout.motion else "",
        "proofs": proofs(plan),
        "rig_facts": rig_facts(plan),
        "words": explained(WORDS),
        "apart": apart_lines(plan.audit.apart),
        "left_out": [finding for finding in findings(plan) if finding["left_out"]],
        "findings": [finding for finding in findings(plan) if not finding["left_out"]],
        "settings": _settings(plan),
        "versions": ", ".join(f"{name} {number}" for name, number in plan.versions.items()),
        "fingerprint": plan.rig.fingerprint,
    }


def tiles(plan: Plan) -> list[Tile]:
    """The figures a supervisor asks for first."""
    layout, packing, information = plan.layout, plan.packing, plan.layout.information
    sides = [landmark.side for landmark in layout.landmarks]
    covered = packing.expressions[-1].covered if packing.expressions else 0.0
    solved = (
        "blendshape mixes: all that can be distinguished on this rig"
        if information.rank == information.full_rank
        else "blendshape mixes."
    )
    apart = "Distinguished" if information.rank == information.full_rank else "Rank"
    return [
        Tile(
            "Markers",
            str(len(layout.landmarks)),
            "",
            ", ".join(f"{sides.count(side)} {where}" for side, where in SIDES.items()),
            minimum_proof(plan),
        ),
        Tile(
            "Expressions",
            str(len(packing.expressions)),
            "",
            f"show {percent(covered)} of {MEASURED_BY[plan.settings.expressions.importance]}",
            packing_proof(plan),
        ),
        Tile(
            apart, str(information.rank), f"of {information.full_rank}", " ".join([solved, *unidentified_words(plan)])
        ),
        error_tile(information, layout.predictions),
        *(take_tile(layout.motion) if layout.motion else ()),
    ]


def error_tile(information: Information, predictions: tuple[Prediction, ...]) -> Tile:
    """The error to expect at the noise of the settings, with the solve that it is of."""
    noise = under_noise(information)
    for one in at_noise(predictions, information.noise_mm):
        note = f"of the skin, root mean square, {noise}: {SOLVE}, {one.performance}; {FRAMES_WITHIN} {within(one)}"
        return Tile("Predicted error", f"{one.error_mm:.2f}", "mm", note)
    return Tile(
        "Upper estimate", f"{information.error_mm:.2f}", "mm", f"of the mean error of the skin, {ANY_WEIGHTS}, {noise}"
    )


def performance_words(predictions: tuple[Prediction, ...]) -> str:
    """' with 3 to 8 blendshapes at once', what the headline is of."""
    return f" with {predictions[0].performance}" if predictions else ""


def predicted_row(one: Prediction) -> dict[str, str]:
    """A prediction as a row of a table."""
    return {
        "performance": one.performance,
        "noise": "as the cameras measure" if one.by_cameras else f"{one.noise_mm:g} mm",
        "error": f"{one.error_mm:.3f} ± {known_to(one):.3f} mm",
        "within": within(one),
        "beyond": "" if one.beyond_mm is None else millimetres(one.beyond_mm),
    }


def take_tile(fit: MotionFit) -> list[Tile]:
    """What is lost of a recorded take."""
    missing = f"; {count(len(fit.missing), 'blendshape')} not in it" if fit.missing else ""
    note = f"of its motion, root mean square over {count(fit.frames, 'frame')}{missing}"
    return [Tile("Lost of the take", f"{fit.rmse_mm:.2f}", "mm", note)]


def marker_intro(landmarks: tuple[Landmark, ...]) -> str:
    """What a reader can do with the table of markers."""
    text = "Choose a row to turn the head to its marker."
    if any(landmark.role == "head" for landmark in landmarks):
        text += " Those named H stand where the face hardly moves: the head's own motion is taken from them."
    return text


def marker_facts(landmark: Landmark, seers: str) -> list[tuple[str, str]]:
    """Term and value of everything the card of a marker shows; `seers` are what its visibility is a share of."""
    why = ROLE_TEXT.get(landmark.role, "")
    facts = [
        ("Side", landmark.side),
        ("Seen", f"from {percent(landmark.visibility)} of {seers}"),
        ("Vertex", f"{landmark.source_vertex:,}"),
    ]
    if landmark.views:
        facts.append(("Cameras", ", ".join(_view_words(view) for view in landmark.views)))
        facts.append(("Measured to", measured_words(landmark.measured_mm)))
    return [*facts, ("Why", why)] if why else facts


def _view_words(view: View) -> str:
    """'upper 7.2 px', and where a camera does not read the marker, why."""
    if view.always:
        return f"{view.camera} {view.pixels:.1f} px"
    with_ = "in the neutral" if view.when == "neutral" else f"with {view.when}"
    return f"{view.camera} {'never' if view.share == 0 else 'not always'} ({view.why} {with_})"


def measured_words(deviations: tuple[float, ...]) -> str:
    """'0.05, 0.06 and 0.21 mm along three axes': standard deviations of a marker's place."""
    if not deviations:
        return "no camera reads it"
    figures = ", ".join(f"{one:.2f}" for one in deviations[:-1])
    words = f"{figures} and {deviations[-1]:.2f} mm"
    return f"{words} along three axes" if len(deviations) == 3 else f"{words} across the view; its depth is not told"


def glyph(look: Look) -> dict[str, str]:
    """The sign of a region as on the printed sheets: a colour, and an outline for a box from -1.5 to 1.5."""
    return {"colour": look.colour, "points": " ".join(f"{x:.2f},{y:.2f}" for x, y in outline(look.shape))}


def marker_rows(landmarks: tuple[Landmark, ...]) -> list[dict[str, Any]]:
    """Markers as the page lists them, one row each."""
    looks = region_looks(landmarks)
    return [
        {
            "name": landmark.name,
            "label": landmark.label,
            "side": landmark.side,
            "why": ROLE_TEXT.get(landmark.role, ""),
            "glyph": glyph(looks[landmark.region]),
            "stands_for": landmark.stands_for,
            "seen": percent(landmark.visibility),
            "vertex": f"{landmark.source_vertex:,}",
        }
        for landmark in landmarks
    ]


def chart(plan: Plan) -> dict[str, Any]:
    """Heights of the bars of the importance covered after each expression, in per cent of the chart's own."""
    covered = [min(1.0, expression.covered) for expression in plan.in_session]
    before = [0.0, *covered]
    bars = [{"height": round(100 * share, 1), "needed": before[i] < ENOUGH} for i, share in enumerate(covered)]
    said = ", ".join(f"{expression.name} {percent(expression.covered)}" for expression in plan.in_session)
    return {"bars": bars, "line": 100 * ENOUGH, "enough": percent(ENOUGH), "alt": f"Covered after each: {said}"}


def compared_layouts(plan: Plan) -> list[dict[str, Any]]:
    """This plan's layout above the others of the same face; bars share one scale that ends at the largest error."""
    fit, own = plan.layout.motion, f"This plan ({plan.layout.method})"
    informations = {own: plan.layout.information} | plan.layout.references
    expected = {own: plan.layout.predictions} | {name: one.predictions for name, one in plan.layout.references.items()}
    shown = {name: headline(information, expected[name]) for name, information in informations.items()}
    lost = {own: fit.rmse_mm} | fit.references_mm if fit else {}
    most, most_lost = max(shown.values()) or 1.0, max(lost.values(), default=0.0) or 1.0
    return [
        compare_row(name, information, name == own, shown[name], shown[name] / most)
        | ({"lost": millimetres(lost[name]), "lost_share": lost[name] / most_lost} if name in lost else {})
        for name, information in informations.items()
    ]


def headline(information: Information, predictions: tuple[Prediction, ...]) -> float:
    """The predicted error at the noise of the settings, millimetres; the upper estimate where none was predicted."""
    return next((one.error_mm for one in at_noise(predictions, information.noise_mm)), information.error_mm)


def compare_row(name: str, information: Information, own: bool, error_mm: float, share: float) -> dict[str, Any]:
    """A layout as a row of a table; `error_mm` is its predicted error."""
    return {
        "name": name,
        "markers": information.landmarks,
        "rank": f"{information.rank} of {information.full_rank}",
        "condition": f"{information.condition:,.0f}",
        "error": millimetres(error_mm),
        "upper": millimetres(information.error_mm),
        "share": share,
        "own": own,
    }


def rig_facts(plan: Plan) -> list[tuple[str, str]]:
    """Term and value of all that the audit tells of the rig."""
    audit = plan.audit
    facts = [
        ("Vertices", f"{audit.vertices:,}, of which {audit.skin_vertices:,} face skin"),
        ("Triangles", f"{audit.triangles:,}"),
        ("Blendshapes", f"{audit.blendshapes}, of which {len(audit.used)} planned for"),
        ("Can be distinguished at all", f"{audit.rank} mixes"),
        ("Unit read as", f"{audit.unit_mm:g} mm"),
        ("Up and facing", f"{audit.up} and {audit.facing}"),
        ("Plan", number_of(plan)),
        ("Fingerprint of the rig", plan.rig.fingerprint),
    ]
    if audit.interpupillary_mm is not None:
        facts.insert(4, ("Between the pupils", f"{audit.interpupillary_mm:.1f} mm"))
    return facts


def findings(plan: Plan) -> list[dict[str, Any]]:
    """What the audit found, as the page lists it."""
    return [
        {
            "kind": KINDS[finding.kind],
            "message": finding.message,
            "advice": finding.advice,
            "blendshapes": finding.blendshapes,
            "left_out": finding.left_out,
        }
        for finding in plan.audit.findings
    ]


def _settings(plan: Plan) -> list[tuple[str, str]]:
    """What was decided for this plan, in words."""
    landmarks, expressions = plan.settings.landmarks, plan.settings.expressions
    switch = {True: "yes", False: "no"}
    return [
        ("Marker method", landmarks.method),
        ("Marker weights", landmarks.weights),
        ("Movement that counts (epsilon)", f"{percent(landmarks.epsilon)} of a blendshape's largest"),
        ("Symmetric markers", switch[landmarks.symmetric]),
        ("Least spacing on the skin", f"{landmarks.spacing_mm:g} mm"),
        ("Markers per blendshape, at most", f"{landmarks.rounds} rounds"),
        ("Noise of a marker", f"{landmarks.noise_mm:g} mm"),
        ("Least visibility", percent(landmarks.min_visibility)),
        ("Cameras", plan.settings.cameras or "not known: seen from all sides"),
        ("Recorded takes", ", ".join(plan.settings.sequences) or "none"),
        ("Expression method", expressions.method),
        ("Movement that clashes (mu)", f"{percent(expressions.mu)} of a blendshape's largest"),
        ("Left and right together", switch[expressions.paired]),
        ("Expressions, at most", str(expressions.limit or "no limit")),
        ("Actor's neutral", plan.settings.target or "not given"),
    ]
