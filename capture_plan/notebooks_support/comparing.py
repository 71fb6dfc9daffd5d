"""A layout beside those of other methods: headline figures, the head, curves, a table, and the doubtful blendshapes."""

import marimo as mo
import numpy as np
from jaxtyping import Float, Int

from capture_plan.evaluation.baseline_cache import SIXTY_EIGHT, Layouts, blendshape_errors, upper_estimates
from capture_plan.figures import Figure, blendshape_bars, draw_error_against_budget, error_against_noise
from capture_plan.layout.face import Face
from capture_plan.layout.naming import name_landmarks
from capture_plan.layout.observation import error_against_budget as errors_by_number
from capture_plan.layout.predict import MIXES, performances, predict
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.weight_recovery import Score
from capture_plan.notebooks_support.figures import show_table, show_tiles
from capture_plan.notebooks_support.heads import show_head
from capture_plan.plan.predicted import ANY_WEIGHTS, SOLVE
from capture_plan.report.page import head_data
from capture_plan.report.words import millimetres

OURS = "Ours: least error, as worn"
NOISES_MM = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)


def comparison_tiles(face: Face, layout: Int[np.ndarray, " m"], others: Layouts, noise_mm: float) -> mo.Html:
    """What the layout is worth, and what the best of the others is; errors of weights solved between 0 and 1."""
    observation = face.observation(noise_mm)
    information, errors = observation.information(layout), upper_estimates(observation, others)
    peers = {name: error for name, error in errors.items() if name != SIXTY_EIGHT}
    best, doubt = min(peers, key=lambda name: peers[name]), blendshape_errors(observation, layout)
    mixes = performances(observation, None)[0]
    mine, other = (predict(observation, at, mixes, noise_mm=noise_mm) for at in (layout, others[best]))
    return show_tiles(
        ("Landmarks", str(len(layout)), "mirrored, at the spacing"),
        ("Distinguished", f"{information.rank} of {information.full_rank}", "mixes of blendshapes"),
        (
            "Predicted error",
            millimetres(mine.error_mm),
            f"of the skin, {SOLVE}, {MIXES}, under {noise_mm:g} mm of noise",
        ),
        ("Upper estimate", millimetres(information.error_mm), f"for {ANY_WEIGHTS}, as in the curves below"),
        ("Best other", millimetres(other.error_mm), f"{best}, with as many markers, predicted likewise"),
        ("Most doubtful", millimetres(float(doubt.max())), f"of the skin, for {face.used[int(doubt.argmax())]}"),
    )


def landmarks_head(
    face: Face, settings: LayoutSettings, layout: Int[np.ndarray, " m"], shade: Float[np.ndarray, " v"]
) -> mo.Html:
    """The head with landmarks at these vertices, from the top of the face down."""
    order = layout[np.argsort(-face.rig.neutral[layout, 1], kind="stable")]
    named = name_landmarks(face, settings, order, [None] * len(order))
    return show_head(face.rig, head_data(face.rig, (), landmarks=named, shade=shade))


def budget_curves(
    face: Face, layout: Int[np.ndarray, " m"], by_budget: dict[int, Layouts], others: Layouts, noise_mm: float
) -> Figure:
    """Upper estimate of every method by number of landmarks; ours in the order of its landmarks."""
    observation = face.observation(noise_mm)
    errors = {m: upper_estimates(observation, layouts) for m, layouts in sorted(by_budget.items())}
    names = next(iter(errors.values()), {})
    curves = {name: (list(errors), [of_m[name] for of_m in errors.values()]) for name in names}
    message = errors_by_number(observation, layout)
    first = min(min(errors, default=1), len(message))
    curves[OURS] = (list(range(first, len(message) + 1)), message[first - 1 :].tolist())
    levels = upper_estimates(observation, {name: at for name, at in others.items() if name == SIXTY_EIGHT})
    return draw_error_against_budget(curves, ours=OURS, meaning=upper_at(noise_mm), levels=levels, budget=len(layout))


def upper_at(noise_mm: float) -> str:
    """What the curves show, in words."""
    return f"upper estimate of the error at {noise_mm:g} mm noise, mm (rms)"


def noise_curves(face: Face, layout: Int[np.ndarray, " m"], others: Layouts) -> Figure:
    """Upper estimate of every layout over the noise of a landmark; ours stays the one of the knobs."""
    shown = {OURS: layout} | {name: at for name, at in others.items() if name != SIXTY_EIGHT}
    errors = [upper_estimates(face.observation(noise), shown) for noise in NOISES_MM]
    curves = {name: (NOISES_MM, [at_noise[name] for at_noise in errors]) for name in shown}
    return error_against_noise(curves, ours=OURS, meaning=f"upper estimate with M = {len(layout)}, mm (rms)")


def comparison_table(layouts: Layouts, scores: dict[str, Score]) -> mo.Html:
    """One row a layout, the most accurate first."""
    ranked = sorted(scores, key=lambda name: scores[name].rmse_mm)
    return show_table(
        [
            {
                "Layout": name,
                "Landmarks": len(layouts[name]),
                "Error of the skin": f"{scores[name].rmse_mm:.3f} mm",
                "Largest error": f"{scores[name].max_mm:.2f} mm",
                "Error of a weight": f"{scores[name].weight_mae:.3f}",
                "Most doubtful": scores[name].worst,
            }
            for name in ranked
        ],
        numbers=("Landmarks", "Error of the skin", "Largest error", "Error of a weight"),
        strong=ranked.index(OURS),
    )


def worst_blendshapes(face: Face, layout: Int[np.ndarray, " m"], others: Layouts, noise_mm: float) -> Figure:
    """The blendshapes that the layout knows worst, beside the best of the others with as many landmarks."""
    observation = face.observation(noise_mm)
    errors = upper_estimates(observation, {name: at for name, at in others.items() if name != SIXTY_EIGHT})
    best = min(errors, key=lambda name: errors[name])
    shown = {OURS: layout, best: others[best]}
    return blendshape_bars(
        face.used,
        {name: blendshape_errors(observation, vertices) for name, vertices in shown.items()},
        meaning=upper_at(noise_mm),
        shown=15,
    )
