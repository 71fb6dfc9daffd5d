"""Knobs: what a person turns in a notebook, and the settings that follow.

The knobs of one stage are one element whose `value` maps the fields of its settings, so that turning one of them
recomputes that stage and what comes after it, and nothing else. Every knob starts at the setting's own default.
"""

from typing import Any

import marimo as mo
import msgspec

from capture_plan.expressions import PackingSettings
from capture_plan.layout.design import design_layout
from capture_plan.layout.dot_contact import NO_POSES, Poses
from capture_plan.layout.dot_numbers import dots_of, is_vertex, vertices_of, words_in
from capture_plan.layout.face import Face
from capture_plan.layout.settings import BUDGETED, LayoutSettings
from capture_plan.plan.settings import Settings
from capture_plan.shell.takes import Takes

Number = float | int
NO_LIMIT, ALL_SIDES = "No limit", "Not known: seen from all sides"


def landmark_knobs(*, take: bool = False) -> Any:
    """What a person can decide about landmarks, with a `take` by its motion too; `value` holds fields of
    `LayoutSettings`."""
    start = LayoutSettings()
    return knob_group(
        method=(
            _choice(
                {
                    "studio": "Studio: as accurate as 68 points",
                    "adaptive": "Adaptive: several per blendshape",
                    "cover": "Cover: one per blendshape",
                    "budget": "Budget: least error for so many",
                    **({"motion": "Motion: the take's best for so many"} if take else {}),
                },
                start.method,
                "Method",
            ),
            "How many landmarks there are, and what they have to achieve.",
        ),
        weights=(
            _choice(
                {
                    "lexicographic": "Fewest, then the best places",
                    "paper": "The paper's sum",
                    "count": "Fewest only",
                },
                start.weights,
                "Weights",
            ),
            "What makes one place better than another.",
        ),
        epsilon=(
            slider(0.1, 0.9, 0.05, start.epsilon, "Epsilon"),
            "A landmark stands for a blendshape that moves it by this share of the largest movement.",
        ),
        spacing_mm=(
            slider(0.0, 20.0, 1.0, start.spacing_mm, "Spacing, mm"),
            "Least distance between two landmarks, straight and along the skin.",
        ),
        noise_mm=(
            slider(0.05, 1.0, 0.05, start.noise_mm, "Noise, mm"),
            "How far a measured landmark is off, as a standard deviation.",
        ),
        symmetric=(
            mo.ui.switch(value=start.symmetric, label="Symmetric"),
            "Every landmark has its mirror image on the other side.",
        ),
        budget=(
            slider(6, 100, 2, 34, "Budget"),
            "Landmarks that there may be, where the method is a budget or a motion.",
        ),
        pins=(
            mo.ui.text("", placeholder="M12, 1225", label="Pinned", debounce=True, full_width=True),
            "Dots that stay, as they are called while nothing is pinned, or vertices of the rig's file.",
        ),
        head_markers=(
            mo.ui.dropdown({"None": 0, "3": 3, "4": 4, "5": 5}, "None", label="Head markers", full_width=True),
            "Further markers where the face hardly moves, for the head's own motion.",
        ),
    )


def cover_knobs() -> Any:
    """What a person can decide about the paper's single cover; `value` holds fields of `LayoutSettings`."""
    start = LayoutSettings()
    return knob_group(
        epsilon=(
            slider(0.1, 0.9, 0.05, start.epsilon, "Epsilon"),
            "A landmark stands for a blendshape that moves it by this share of the largest movement.",
        ),
        alpha=(
            slider(0.0, 1.0, 0.05, start.alpha, "Alpha"),
            "How much being seen counts against being moved.",
        ),
        spacing_mm=(
            slider(0.0, 20.0, 1.0, start.spacing_mm, "Spacing, mm"),
            "Least distance, straight and along the skin, where landmarks are kept apart.",
        ),
    )


def cover_settings(knobs: Any) -> LayoutSettings:
    """What the knobs of the single cover say, in the paper's own weights."""
    return msgspec.convert(knobs.value | {"weights": "paper", "symmetric": False}, LayoutSettings)


def comparing_knobs() -> tuple[Any, Any, Any, Any]:
    """Epsilon, budget, noise and spacing, each an element of its own: what does not depend on one stays as it is."""
    start = LayoutSettings()
    return (
        slider(0.1, 0.9, 0.05, start.epsilon, "Epsilon"),
        slider(6, 68, 1, 24, "Landmarks"),
        slider(0.05, 1.0, 0.05, start.noise_mm, "Noise, mm"),
        slider(0.0, 20.0, 1.0, start.spacing_mm, "Spacing, mm"),
    )


def knob_panel(epsilon: Any, budget: Any, noise: Any, spacing: Any) -> mo.Html:
    """The four side by side, each with a sentence that says what it does."""
    return _panel(
        (epsilon, "A landmark stands for a blendshape that moves it by this share of the largest movement."),
        (budget, "How many markers the crew applies: the budget of every method."),
        (noise, "How far a measured landmark is off, as a standard deviation."),
        (spacing, "Least distance between two landmarks of ours, straight and along the skin."),
    )


def comparing_settings(epsilon: Any, noise: Any, spacing: Any) -> LayoutSettings:
    """What the knobs say, but for the budget."""
    return LayoutSettings(epsilon=epsilon.value, noise_mm=noise.value, spacing_mm=spacing.value)


def expression_knobs() -> Any:
    """What a person can decide about expressions; `value` holds fields of `PackingSettings`."""
    start = PackingSettings()
    return knob_group(
        method=(
            _choice(
                {
                    "early": "Early: shortest, least error first",
                    "minimum": "Minimum: shortest, most important first",
                    "sequential": "Sequential: the paper's",
                },
                start.method,
                "Method",
            ),
            "Which list is looked for.",
        ),
        mu=(
            slider(0.1, 0.6, 0.05, start.mu, "Mu"),
            "Two blendshapes clash where both move the skin by this share of their largest movement.",
        ),
        paired=(
            mo.ui.switch(value=start.paired, label="Left and right together"),
            "Partners are performed in one expression.",
        ),
        limit=(
            mo.ui.dropdown(
                {"No limit": None, **{str(n): n for n in (5, 8, 10, 12, 15, 20, 30)}},
                "No limit",
                label="Most expressions",
            ),
            "As many as there is time for; the plan names what is left out.",
        ),
    )


def camera_knob() -> Any:
    """Who looks at the face; the value is a preset of `camera.PRESETS`, or nothing where cameras are not known."""
    names = {
        "Not known: seen from all sides": None,
        "A phone in front": "phone",
        "One portrait camera in front": "frontal",
        "Head-mounted, one lens": "head-mounted",
        "Head-mounted pair": "head-mounted-pair",
        "Head-mounted, four lenses": "head-mounted-four",
        "Ring of 8": "ring-8",
        "Dome of 24": "dome-24",
    }
    return mo.ui.dropdown(names, "Not known: seen from all sides", label="Cameras")


def paper_knob() -> Any:
    """The paper in the printer."""
    return mo.ui.dropdown({"A4": "a4", "US Letter": "letter"}, "A4", label="Paper")


def landmark_settings(
    knobs: Any, face: Face | None = None, takes: Takes | None = None, poses: Poses = NO_POSES
) -> LayoutSettings:
    """What the landmark knobs say; a pinned dot is the one that the layout of the other knobs calls so, which is made
    on the face (for takes and poses) where one is named.

    Raises:
        PlanError: what is pinned is neither a dot nor the whole number of a vertex.
    """
    words = words_in(knobs.value["pins"])
    budget = knobs.value["budget"] if knobs.value["method"] in BUDGETED else None
    free = msgspec.convert(knobs.value | {"pins": (), "budget": budget}, LayoutSettings)
    by_name = face is not None and not all(map(is_vertex, words))
    dots = dots_of(design_layout(face, free, takes=takes, poses=poses)) if face and by_name else {}
    pins = vertices_of(words, dots, what="Pinned", whose="the layout without pins")
    return msgspec.structs.replace(free, pins=pins)


def packing_settings(knobs: Any) -> PackingSettings:
    """What the expression knobs say."""
    return msgspec.convert(knobs.value, PackingSettings)


def session_settings(
    landmarks: LayoutSettings, expressions: Any, cameras: Any, *, sequences: tuple[str, ...] = ()
) -> Settings:
    """What all knobs of a session say, those of landmarks read already, and its takes."""
    return Settings(
        landmarks=landmarks,
        expressions=packing_settings(expressions),
        cameras=cameras.value,
        sequences=sequences,
    )


def _panel(*knobs: tuple[Any, str]) -> mo.Html:
    cells = "".join(f"<div>{knob}<p>{says}</p></div>" for knob, says in knobs)
    return mo.Html(f'<div class="knobs narrow">{cells}</div>')


def knob_group(**knobs: tuple[Any, str]) -> Any:
    """One element of several, each with a sentence that says what it does."""
    cells = "".join(f"<div>{{{name}}}<p>{says}</p></div>" for name, (_, says) in knobs.items())
    return mo.Html(f'<div class="knobs">{cells}</div>').batch(**{name: knob for name, (knob, _) in knobs.items()})


def slider(start: Number, stop: Number, step: Number, value: Number, label: str) -> Any:
    """A slider that shows its number and answers when it is let go."""
    return mo.ui.slider(start, stop, step, value=value, debounce=True, show_value=True, label=label, full_width=True)


def _choice(names: dict[str, str], value: str, label: str) -> Any:
    return mo.ui.dropdown({name: key for key, name in names.items()}, names[value], label=label, full_width=True)
