"""The HTML plan and what is packed into it, without a browser."""

import base64
import html
import json
import re
import zlib
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capture_plan.audit.audit import Audit, Finding
from capture_plan.errors import PlanError
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.session import session
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.glossary import glossary
from capture_plan.layout.record import Bound, Information, Landmark, Layout, Prediction, Program, Reference
from capture_plan.plan.files import plan_bytes
from capture_plan.plan.record import Plan, RigReference, sealed
from capture_plan.plan.settings import Settings
from capture_plan.report import viewer_html, write_html
from capture_plan.report.contents import WORDS, chart, compared_layouts, tiles
from capture_plan.report.head import packed_head
from capture_plan.report.page import page_html, script_json
from capture_plan.report.proofs import minimum_proof, packing_proof, proofs
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig

OTHER = Prediction("talking", 0.2, 0.62, 0.5, 0.8, 0.01)
HOSTILE = (
    "</script><script>window.harmed=1</script>",
    '<img src=x onerror="window.harmed=2">',
    "\"'`${window.harmed=3}<!--",
    "line\u2028break\u2029 \\u003c &amp; {{ 7 * 7 }}",
)
JAW_OPEN, SMILE_LEFT, SMILE_RIGHT, BROW_UP = 24, 43, 44, 2


def hostile_rig() -> Rig:
    """The sample head with four names that try to leave their place."""
    rig = sample_rig()
    names = dict(zip((JAW_OPEN, SMILE_LEFT, SMILE_RIGHT, BROW_UP), HOSTILE, strict=True))
    return replace(rig, name=HOSTILE[0], names=tuple(names.get(k, name) for k, name in enumerate(rig.names)))


def small_plan(rig: Rig) -> Plan:
    """A plan by hand for the blendshapes of `hostile_rig`: a landmark where each moves most, two expressions."""
    chosen = (JAW_OPEN, SMILE_LEFT, SMILE_RIGHT, BROW_UP)
    names = tuple(rig.names[k] for k in chosen)
    landmarks = tuple(landmark(rig, m, k) for m, k in enumerate(chosen))
    expressions = (
        Expression("E01", names[:1], (1.0,), 0.5, 0.5, f"Open the jaw wide, {rig.names[JAW_OPEN]}."),
        Expression("E02", names[1:], (1.0, 1.0, 1.0), 0.5, 1.0, "Smile with both corners."),
    )
    information = Information(4, 4, 4, 12.0, 0.2, 0.41)
    findings = (Finding("static", ("tongueOut",), f"{rig.names[SMILE_LEFT]} stands still", "Leave it out.", True),)
    packing = Packing("minimum", expressions, 2, 2, 2, True, True, names[:2], (), (), (), (), ())
    return Plan(
        format=1,
        rig=RigReference(rig.name, "sample", rig.fingerprint, len(rig.neutral)),
        settings=Settings(),
        audit=Audit(len(rig.neutral), len(rig.triangles), 4183, 52, names, 4, 1.0, "y", "+z", 62.0, findings),
        layout=Layout(
            method="studio",
            landmarks=landmarks,
            programs=(Program(4, names, 4.0, 4.0, True, tuple(m.vertex for m in landmarks)),),
            certificate=Bound(names[:3], (1.0, 1.0, 1.0), 3),
            uncovered=(),
            information=information,
            references={HOSTILE[1]: Reference(68, 4, 4, 3.0, 0.2, 0.72, vertices=(), predictions=(OTHER,))},
            predictions=(Prediction(HOSTILE[0], 0.2, 0.31, 0.2, 0.4, 0.01, 0.1),),
        ),
        packing=packing,
        session=session(rig, names, packing, SessionSettings()),
        versions={"capture-plan": "0.1.0"},
    )


def landmark(rig: Rig, m: int, k: int) -> Landmark:
    skin = np.flatnonzero(rig.skin)
    vertex = int(skin[rig.displacement[k, skin].argmax()])
    triangle = int(np.flatnonzero((rig.triangles == vertex).any(axis=1))[0])
    corner = tuple((rig.triangles[triangle] == vertex).astype(float).tolist())
    place = tuple(rig.neutral[vertex].tolist())
    side = "left" if place[0] > 4 else "right" if place[0] < -4 else "middle"
    return Landmark(
        name=f"M{m + 1:02}",
        label=f"{side} {HOSTILE[1]}" if m == 1 else f"{side} chin",
        region="chin" if m else "cheek",
        side=side,
        role="primary",
        vertex=vertex,
        source_vertex=vertex,
        position=place,
        triangle=triangle,
        barycentric=corner,
        blendshapes=(rig.names[k],),
        quality=0.8,
        visibility=0.7,
        round=0,
    )


@pytest.fixture(scope="session")
def rig():
    return hostile_rig()


@pytest.fixture(scope="session")
def plan(rig):
    return small_plan(rig)


@pytest.fixture(scope="session")
def page(rig, plan, tmp_path_factory):
    return write_html(plan, rig, tmp_path_factory.mktemp("plan") / "plan.html")


def unpacked(head):
    content = zlib.decompress(base64.b64decode(head["blob"]))
    arrays, offset = {}, 0
    for name, kind, size in head["arrays"]:
        arrays[name] = np.frombuffer(content, dtype=kind, count=size, offset=offset)
        offset += arrays[name].nbytes
    return arrays


def test_the_page_explains_its_words_from_the_glossary(page):
    text = html.unescape(page.read_text())
    for word in WORDS:
        assert f"<dt>{word}</dt><dd>{glossary()[word].says}" in text


def test_a_packed_head_unpacks_to_the_rig_within_its_steps(rig):
    names = rig.names[10:30]
    head = packed_head(rig, names, np.ones(len(rig.neutral)))
    arrays = unpacked(head)
    positions = arrays["positions"].reshape(3, -1).T * head["unit"] + head["centre"]
    np.testing.assert_allclose(positions, rig.neutral, atol=0.5 * head["unit"] + 1e-9)
    assert head["unit"] < 0.01

    deltas = np.zeros((len(names), *rig.neutral.shape))
    vertices = np.cumsum(arrays["delta_vertices"])
    k = np.repeat(np.arange(len(names)), arrays["delta_counts"])
    deltas[k, vertices] = arrays["delta_steps"].reshape(3, -1).T * head["step"]
    np.testing.assert_allclose(deltas, rig.deltas[10:30], atol=0.5 * head["step"] + 1e-6)
    np.testing.assert_array_equal(arrays["triangles"].reshape(3, -1).T, rig.triangles)


def test_skin_is_skin_and_other_parts_are_what_their_names_say(rig):
    head = packed_head(rig, rig.names[:1], np.ones(len(rig.neutral)))
    materials = np.array(head["materials"])[unpacked(head)["materials"]]
    np.testing.assert_array_equal(materials == "skin", rig.skin[rig.triangles[:, 0]])
    assert set(head["materials"]) == {"skin", "inside", "eye", "teeth", "tongue", "lash"}


@given(st.text())
def test_json_in_a_script_reads_back_and_cannot_end_the_script(text):
    written = script_json(json.dumps(text, ensure_ascii=False))
    assert json.loads(written) == text
    assert not set(written) & {"<", ">", "&", "\u2028", "\u2029"}


def test_the_page_holds_plan_json_to_the_byte(page, plan):
    text = re.search(r'id="plan-data">(.*?)</script>', page.read_text(), re.DOTALL)[1]
    signs = {"\\u003c": "<", "\\u003e": ">", "\\u0026": "&", "\\u2028": "\u2028", "\\u2029": "\u2029"}
    plain = re.sub(r"\\(\\|u003c|u003e|u0026|u2028|u2029)", lambda m: signs.get(m[0], m[0]), text)
    assert plain.encode() == plan_bytes(plan)
    assert msgspec.json.decode(text, type=Plan) == sealed(plan)


def test_no_name_becomes_markup(page, rig, plan):
    for document in (page.read_text(), viewer_html(rig, plan)):
        markup = re.sub(r"<script.*?</script>", "", document, flags=re.DOTALL)
        assert "<img src=x" not in document
        assert "window.harmed=1</script" not in document
        assert "{{" not in markup.replace("{{ 7 * 7 }}", "")
        assert document.count("<script") == document.count("</script>")


def test_the_page_asks_nothing_of_a_network(page):
    document = page.read_text()
    assert set(re.findall(r"https?://[^\s\"'`)\\]+", document)) <= {"http://www.w3.org/1999/xhtml"}
    assert not re.findall(r"(?:src|href)=[\"'](?!data:|#)", document)


def test_the_same_plan_gives_the_same_page(page, plan, rig, tmp_path):
    assert write_html(plan, rig, tmp_path / "again.html").read_bytes() == page.read_bytes()


def test_a_place_that_cannot_be_written_is_named_and_left_alone(plan, rig, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(PlanError, match="cannot be written"):
        write_html(plan, rig, tmp_path / "file" / "plan.html")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_only_what_was_proved_is_called_proved(plan):
    assert packing_proof(plan) == "Proved: fewer than 2 cannot show every blendshape"
    assert minimum_proof(plan) == "Proved: under these constraints fewer than 3 cannot show every blendshape even once"
    open_packing = msgspec.structs.replace(plan.packing, proven_optimal=False, order_proven=False, bound=1)
    open_program = msgspec.structs.replace(plan.layout.programs[0], proven_optimal=False)
    certificate = Bound((), (), 0)
    open_layout = msgspec.structs.replace(plan.layout, programs=(open_program,), certificate=certificate)
    unproved = msgspec.structs.replace(plan, packing=open_packing, layout=open_layout)
    assert proofs(unproved) == []


def test_a_gap_is_told_as_a_bound(plan):
    packing = msgspec.structs.replace(plan.packing, objective=9, bound=7, proven_optimal=False)
    said = packing_proof(msgspec.structs.replace(plan, packing=packing))
    assert said.endswith("Proved: at least 7 are needed to show every blendshape")


def with_covered(plan, *covered):
    """The plan with so many expressions, shot the last first, and what is covered after each of them."""
    put, item = msgspec.structs.replace, next(item for item in plan.session.items if item.kind == "expression")
    names = [f"E{number:02}" for number in range(len(covered), 0, -1)]
    expressions = tuple(put(plan.packing.expressions[0], name=name, covered=0.0) for name in reversed(names))
    items = tuple(put(item, name=name, covered=share) for name, share in zip(names, covered, strict=True))
    session = put(plan.session, items=items)
    return put(plan, packing=put(plan.packing, expressions=expressions), session=session)


def test_the_bars_of_the_chart_grow_with_what_is_covered(plan):
    bars = chart(with_covered(plan, 0.25, 0.5, 0.9, 1.0))["bars"]
    assert [bar["height"] for bar in bars] == [25.0, 50.0, 90.0, 100.0]
    assert [bar["needed"] for bar in bars] == [True, True, True, False]


def test_cards_and_chart_stand_in_the_order_of_shooting(plan):
    said = chart(with_covered(plan, 0.25, 1.0))["alt"]
    assert said.index("E02") < said.index("E01")


def test_the_largest_error_fills_the_bar_of_the_comparison(plan):
    rows = compared_layouts(plan)
    assert [row["share"] for row in rows] == [0.5, 1.0]
    assert [row["own"] for row in rows] == [True, False]
    assert (rows[0]["error"], rows[0]["upper"]) == ("0.310 mm", "0.410 mm")


def test_the_predicted_error_stands_with_its_unit_and_the_noise(plan):
    error = tiles(plan)[-1]
    assert (error.figure, error.unit) == ("0.31", "mm")
    assert "0.2 mm of noise" in error.note
    assert "between 0 and 1" in error.note


def test_the_page_of_a_draft_says_so_and_why_and_that_of_a_sound_plan_does_not(rig, plan, page):
    assert "DRAFT:" not in page.read_text()
    text = page_html(msgspec.structs.replace(plan, draft=("<b>a label</b> was wrong",)), rig)
    assert "<title>DRAFT: " in text
    assert '<div class="draft" aria-hidden="true"><b>DRAFT</b></div>' in text
    assert "&lt;b&gt;a label&lt;/b&gt; was wrong</p>" in text
