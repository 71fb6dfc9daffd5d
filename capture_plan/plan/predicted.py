"""What error a plan predicts, in words, each time with the solve that it is of.

Predicted error   of weights solved between 0 and 1, as takes are solved: simulated for performances (`layout.predict`)
Upper estimate    of weights of any size and sign, by formula (`Observation.error`): search, budgets and bounds use it.
                  Both are means (root mean square) over all frames
"""

from math import ceil

from capture_plan.layout.predict import LEAST, MOST
from capture_plan.layout.record import Information, Prediction

SOLVE = "weights solved between 0 and 1"
ANY_WEIGHTS = "weights of any size"
UPPER = (
    f"The upper estimate is of the mean error (root mean square) over all frames, for {ANY_WEIGHTS}: search, budgets "
    "and bounds speak of it; single frames can lie above it."
)
ABOVE = " Here the predicted error is larger: the estimate takes weights to be small, as where few of many act at once."
FRAMES_WITHIN = f"{10 * (MOST - LEAST):.0f} of 10 frames"
FINEST = 0.001  # millimetres; what is nearer to the truth is not said


def under_noise(one: Information | Prediction) -> str:
    """'under 0.2 mm of noise', or 'as the cameras measure'."""
    return "as these cameras measure each marker" if one.by_cameras else f"under {one.noise_mm:g} mm of noise"


def at_noise(predictions: tuple[Prediction, ...], noise_mm: float) -> tuple[Prediction, ...]:
    """Those of one noise; the first is the headline, where there are any."""
    return tuple(one for one in predictions if one.noise_mm == noise_mm)


def error_words(information: Information, predictions: tuple[Prediction, ...]) -> str:
    """'predicted error 0.140 mm, upper estimate 0.182 mm under 0.2 mm of noise': beside others, whose differences in
    per cent are told from these figures."""
    messages = [f"predicted error {one.error_mm:.3f} mm" for one in at_noise(predictions, information.noise_mm)[:1]]
    return f"{', '.join([*messages, f'upper estimate {information.error_mm:.3f} mm'])} {under_noise(information)}"


def headline_words(information: Information, predictions: tuple[Prediction, ...]) -> str:
    """'predicted error 0.14 mm under 0.2 mm of noise', where there is room for one figure only."""
    found = at_noise(predictions, information.noise_mm)
    figure = f"predicted error {found[0].error_mm:.2f} mm" if found else f"upper estimate {information.error_mm:.2f} mm"
    return f"{figure} {under_noise(information)}"


def upper_words(information: Information, predictions: tuple[Prediction, ...]) -> str:
    """What the upper estimate is of, and why it lies below a predicted error where it does."""
    of_rig = [one for one in at_noise(predictions, information.noise_mm) if one.beyond_mm is None]
    return UPPER + (ABOVE if any(one.error_mm > information.error_mm for one in of_rig) else "")


def prediction_words(information: Information, predictions: tuple[Prediction, ...]) -> list[str]:
    """Every prediction with its spread and standard error, a sentence for each noise; what the rig cannot show."""
    noises = dict.fromkeys(one.noise_mm for one in predictions)
    messages = [
        f"Predicted error of the skin (root mean square) {under_noise(of[0])}, {SOLVE}: {'; '.join(map(_one, of))}."
        for of in (at_noise(predictions, noise) for noise in noises)
    ]
    if predictions:
        messages.append(upper_words(information, predictions))
    return [*messages, *beyond_words(predictions)]


def beyond_words(predictions: tuple[Prediction, ...]) -> list[str]:
    """What the rig cannot show of each take, where it is anything."""
    takes = {one.performance: one.beyond_mm for one in predictions if one.beyond_mm is not None}
    return [
        f"What the rig cannot show of {name}: {beyond_mm:.2f} mm (root mean square) is left of it even where all of "
        "the skin is measured without noise, and is part of its predicted error."
        for name, beyond_mm in takes.items()
        if beyond_mm >= 0.005
    ]


def known_to(prediction: Prediction) -> float:
    """The standard error as it is printed: thousandths, never better than it is."""
    return max(ceil(prediction.standard_error_mm / FINEST), 1) * FINEST


def within(prediction: Prediction) -> str:
    """The range of a prediction in words: '0.10 to 0.17 mm'."""
    return f"{prediction.low_mm:.2f} to {prediction.high_mm:.2f} mm"


def _one(prediction: Prediction) -> str:
    return (
        f"{prediction.performance} {prediction.error_mm:.3f} ± {known_to(prediction):.3f} mm, "
        f"{FRAMES_WITHIN} {within(prediction)}"
    )
