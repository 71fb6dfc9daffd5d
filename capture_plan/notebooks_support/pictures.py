"""Figures in a notebook: the picture, what it shows, and the file to take along; and the rigs that stand beside."""

import base64
import html
from typing import Any

import marimo as mo
import numpy as np
from jaxtyping import Int

from capture_plan.figures import Figure, incidence, png, svg
from capture_plan.layout.face import Face
from capture_plan.layout.naming import name_landmarks
from capture_plan.layout.settings import LayoutSettings
from capture_plan.notebooks_support.frame import working
from capture_plan.reader.read import read_rig
from capture_plan.rig import Rig

ON_PAGE = 1.2  # a page of a screen is wider than one of paper


def figure_view(figure: Figure, words: str, *, name: str) -> mo.Html:
    """A figure with the sentence below it, to be taken along as PNG and as SVG."""
    picture = png(figure)
    wide = ON_PAGE * figure.get_size_inches()[0] * figure.dpi
    shown = mo.Html(
        f'<figure class="paper"><img alt="{html.escape(words)}" width="{wide:.0f}" '
        f'src="data:image/png;base64,{base64.b64encode(picture).decode()}">'
        f"<figcaption>{html.escape(words)}</figcaption></figure>"
    )
    files = [
        mo.download(lambda: picture, filename=f"{name}.png", mimetype="image/png", label="PNG"),
        mo.download(lambda: svg(figure), filename=f"{name}.svg", mimetype="image/svg+xml", label="SVG"),
    ]
    return mo.vstack([shown, mo.hstack(files, justify="start")], gap=0.5)


def incidence_figure(face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"]) -> Figure:
    """Which landmarks stand for which blendshape, landmarks named as on the sheets, from the top of the face down."""
    order = vertices[np.argsort(-face.rig.neutral[vertices, 1], kind="stable")]
    names = tuple(one.label for one in name_landmarks(face, settings, order, [0] * len(order)))
    return incidence(face.used, names, face.relative_displacement(settings)[:, order], epsilon=settings.epsilon)


def blendshape_knob(used: tuple[str, ...]) -> Any:
    """One of the planned blendshapes."""
    return mo.ui.dropdown(list(used), used[0], label="Blendshape", searchable=True)


def neighbouring_rigs(rig: Rig) -> tuple[Rig, ...]:
    """The rig of the session, and those given as `-- --beside PATH`, several allowed."""
    with working():
        return (rig, *(read_rig(str(path)) for path in mo.cli_args().get_all("beside")))
