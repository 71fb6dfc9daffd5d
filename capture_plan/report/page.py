"""The plan as one HTML file that needs no network, and the 3D head alone for notebooks.

Everything travels inside: style, scripts, pictures, the head and the plan's data. Names from a rig pass through Jinja's
escaping on their way into the page, through `script_json` on their way into a script, and as text nodes from there.
"""

import base64
import hashlib
import io
import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

import jinja2
import numpy as np
from jaxtyping import Float, UInt8
from markupsafe import Markup
from msgspec import structs

from capture_plan.expressions.record import Expression
from capture_plan.expressions.session import Item, Session, shot_note, shot_title
from capture_plan.face.blocking import opaque_triangles
from capture_plan.layout.record import Landmark
from capture_plan.output import write_whole
from capture_plan.plan.carry import as_worn, worn_words
from capture_plan.plan.files import plan_bytes
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan
from capture_plan.report.cameras import camera_cards
from capture_plan.report.contents import contents, marker_facts, marker_rows
from capture_plan.report.evidence import evidence
from capture_plan.report.head import packed_head, packed_landmarks
from capture_plan.report.shots import shot_facts, shot_rows
from capture_plan.report.words import percent
from capture_plan.rig import Rig
from capture_plan.sheets import ExpressionPictures, expression_pictures, image_of, marker_pictures
from capture_plan.visibility import hemisphere_visibility

ASSETS = files("capture_plan.report").joinpath("assets")
SHADE_RAYS = 64  # smooth enough for the eye; the plan's own visibility uses more
MARKER_PICTURE_PX, EXPRESSION_PICTURE_PX = 900, 420
WEBP_QUALITY = 84
VIEWS = {"front": "From the front", "left": "From the actor's left", "right": "From the actor's right"}
NOBODYS = "this page shows a generic head and holds nothing of the rig's: check the plan itself"
# Inside a script element these could end it, open a comment, or break a line of JavaScript.
UNSAFE = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


@runtime_checkable
class _Picture(Protocol):
    """What the page needs of a Pillow image."""

    @property
    def size(self) -> tuple[int, int]: ...
    def save(self, fp: io.BytesIO, format: str, **params: Any) -> None: ...


def write_html(plan: Plan, inputs: Rig | PlanInputs, path: Path | str) -> Path:
    """Write the plan as one HTML file, whole or not at all.

    Raises:
        PlanError: the place cannot be written.

    Example:
        >>> write_html(read_plan("hero.plan.json"), sample_rig(), "hero.html").stat().st_size > 1_000_000
        True
    """
    write_whole(Path(path), page_html(plan, inputs).encode())
    return Path(path)


def page_html(plan: Plan, inputs: Rig | PlanInputs) -> str:
    """The plan page: pictures, tables, the 3D head, the plan's data and what checks it in one document. It checks
    nothing where the inputs of the plan's settings are missing, and says so."""
    given = inputs if isinstance(inputs, PlanInputs) else PlanInputs(inputs)
    shown, worn = as_worn(plan, given)
    pictures = expression_pictures(shown, worn, height_px=EXPRESSION_PICTURE_PX)
    plates = marker_pictures(shown, worn, height_px=MARKER_PICTURE_PX)
    line_of = {item.name: item for item in plan.session.items}
    script = scripts("three.min.js", "head.js", "viewer.js", "panel.js", "check.js", "page.js")
    return (
        templates()
        .get_template("page.html.jinja")
        .render(
            **contents(plan, plan.session),
            cameras=camera_cards(shown, worn, embedded_pixels),
            expressions=[card(e, pictures[e.name], line_of[e.name], plan.session) for e in plan.in_session],
            shot_list=shot_rows(plan.session),
            markers=marker_rows((shown if given.generic else plan).layout.markers),
            placed=worn_words(plan, given),
            marker_pictures=[plate(view, picture) for view, picture in plates.items()],
            head_json=script_json(json.dumps(plan_head(worn, shown))),
            plan_json=script_json(plan_bytes(structs.replace(shown, actor=None) if given.generic else plan).decode()),
            evidence_json=script_json(json.dumps({"missing": NOBODYS} if given.generic else evidence(plan, inputs))),
            css=asset("style.css"),
            scripts=script,
            policy=policy(script),
        )
    )


def card(expression: Expression, pictures: ExpressionPictures, item: Item, of: Session) -> dict[str, Any]:
    """What the page shows of one expression; `item` is its line of the shot list `of` the session."""
    name = expression.name
    return {
        "title": f"{shot_title(item)} {shot_note(item, of)}",
        "sentence": expression.sentence,
        "blendshapes": expression.blendshapes,
        "session": shot_facts(item),
        "covered": expression.covered,
        "gain_text": percent(expression.gain),
        "covered_text": percent(expression.covered),
        "scale": f"{pictures.scale_mm:g} mm",
        "pictures": [
            embedded(pictures.front, f"{name} from the front"),
            embedded(pictures.three_quarter, f"{name} from three quarters"),
            embedded(pictures.heat, f"{name}: where the skin moves, dark red for {pictures.scale_mm:g} mm"),
        ],
    }


def plate(view: str, picture: _Picture) -> dict[str, Any]:
    """What the page shows of one picture of the markers."""
    caption = VIEWS.get(view, view)
    return {**embedded(picture, f"Markers: {caption}"), "caption": caption}


def viewer_html(rig: Rig, plan: Plan) -> str:
    """The plan's 3D head alone, with its landmarks and expressions, as a document for an `iframe srcdoc`."""
    return head_html(rig, plan_head(rig, plan))


def head_html(rig: Rig, head: dict[str, Any]) -> str:
    """A head as `head_data` describes it as a document of its own."""
    script = scripts("three.min.js", "head.js", "viewer.js", "panel.js", "alone.js")
    return (
        templates()
        .get_template("standalone.html.jinja")
        .render(
            title=rig.name,
            expressions=head["expressions"],
            marked=bool(head["landmarks"]),
            head_json=script_json(json.dumps(head)),
            css=asset("style.css"),
            scripts=script,
            policy=policy(script),
        )
    )


def plan_head(rig: Rig, plan: Plan) -> dict[str, Any]:
    """What `CapturePlan.start` reads of a plan."""
    return head_data(
        rig,
        plan.audit.used,
        landmarks=plan.layout.markers,
        expressions=plan.in_session,
        titles={item.name: f"{shot_title(item)} {shot_note(item, plan.session)}" for item in plan.session.items},
        seers="the cameras" if plan.settings.cameras else "directions",
    )


def head_data(
    rig: Rig,
    used: tuple[str, ...],
    *,
    landmarks: tuple[Landmark, ...] = (),
    expressions: tuple[Expression, ...] = (),
    titles: Mapping[str, str] = MappingProxyType({}),
    seers: str = "directions",
    shade: Float[np.ndarray, " v"] | None = None,
) -> dict[str, Any]:
    """What `CapturePlan.start` reads: the head with its `used` blendshapes, its landmarks and its expressions, called
    by their names or, where they have such, their `titles`.

    `shade` darkens vertices, 1 is full light; without it those that little light reaches are dark.
    """
    names = tuple(dict.fromkeys([*used, *(name for expression in expressions for name in expression.pose)]))
    number = {name: k for k, name in enumerate(names)}
    packed = packed_landmarks(rig, landmarks)
    for shown, landmark in zip(packed, landmarks, strict=True):
        shown["facts"] = marker_facts(landmark, seers)
    return {
        "head": packed_head(rig, names, openness(rig) if shade is None else shade),
        "landmarks": packed,
        "expressions": [
            {
                "title": titles.get(expression.name, expression.name),
                "sentence": expression.sentence,
                "blendshapes": expression.blendshapes,
                "weights": [[number[name], w] for name, w in expression.pose.items()],
            }
            for expression in expressions
        ],
    }


def openness(rig: Rig) -> Float[np.ndarray, " v"]:
    """Share of the hemisphere that each vertex sees (ambient occlusion); lashes and clear shells hide nothing."""
    opaque = opaque_triangles(rig)
    used = np.unique(opaque)
    share = np.ones(len(rig.neutral))
    share[used] = hemisphere_visibility(rig.neutral, opaque, used, rays=SHADE_RAYS)
    return share


def embedded(picture: _Picture, alt: str) -> dict[str, Any]:
    """A picture as a data URL with its size and what it shows."""
    buffer = io.BytesIO()
    picture.save(buffer, "WEBP", quality=WEBP_QUALITY, method=4)
    width, height = picture.size
    source = f"data:image/webp;base64,{base64.b64encode(buffer.getvalue()).decode()}"
    return {"source": source, "alt": alt, "width": width, "height": height}


def cameras_html(rig: Rig, plan: Plan) -> str:
    """What each camera of the plan sees, as a document of its own for an `iframe srcdoc`."""
    cards = camera_cards(plan, rig, embedded_pixels)
    return (
        templates()
        .get_template("cameras_alone.html.jinja")
        .render(cameras=cards, css=asset("style.css"), policy=policy(""))
    )


def embedded_pixels(pixels: UInt8[np.ndarray, "p q 3"], alt: str) -> dict[str, Any]:
    """Pixels as a data URL with their size and what they show."""
    return embedded(image_of(pixels), alt)


def script_json(text: str) -> Markup:
    """JSON as it may stand inside a script element: nothing in a name can end the element."""
    for sign, escape in UNSAFE.items():
        text = text.replace(sign, escape)
    return Markup(text)


def asset(name: str) -> Markup:
    """A file of ours, as it is."""
    return Markup(ASSETS.joinpath(name).read_text(encoding="utf-8"))


def scripts(*names: str) -> Markup:
    """Scripts of the package by their names, one after another."""
    return Markup("\n").join(asset(name) for name in names)


def policy(script: str) -> str:
    """The content security policy of a page on which `script` runs and nothing else does, and nothing is fetched."""
    known = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{known}'; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def templates() -> jinja2.Environment:
    """The page's templates; an unknown name in one is an error."""
    loader = jinja2.FunctionLoader(lambda name: ASSETS.joinpath(name).read_text(encoding="utf-8"))
    return jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
