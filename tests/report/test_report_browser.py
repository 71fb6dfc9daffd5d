"""The HTML plan as people open it: in Chromium, from a file, with the network off."""

import io

import numpy as np
import pytest
from PIL import Image

from capture_plan.plan.files import plan_bytes
from capture_plan.report import viewer_html, write_html
from tests.report.test_report import HOSTILE, hostile_rig, small_plan

READY = "#viewer.ready"
FIRST = "Shot 6 of 9 · E01"  # after the colour chart, a neutral, the teeth and two turned heads


class Visit:
    """A page with everything that went wrong on it."""

    def __init__(self, browser, target, **options):
        self.context = browser.new_context(offline=True, viewport={"width": 720, "height": 600}, **options)
        self.page = self.context.new_page()
        self.wrong = []
        self.page.on("console", lambda message: message.type == "error" and self.wrong.append(message.text))
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("request", self.watch)
        self.page.goto(target.as_uri())

    def watch(self, request):
        if not request.url.startswith(("file:", "data:", "blob:")):
            self.wrong.append(f"asked for {request.url}")

    def head(self):
        """The head's pixels (p q 3) once everything asked for is drawn, without names and focus ring."""
        self.page.evaluate("document.querySelector('.stage').scrollIntoView({ block: 'start', behavior: 'instant' })")
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        hide = ".layer, .views, .switch, .scale { visibility: hidden; } .stage { outline: none !important; }"
        shot = self.page.locator(".stage canvas").screenshot(style=hide)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def changed(before, after):
    """Share of pixels that look different."""
    return (np.abs(after - before).max(axis=2) > 12).mean()


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    rig = hostile_rig()
    plan = small_plan(rig)
    folder = tmp_path_factory.mktemp("page")
    alone = folder / "alone.html"
    alone.write_text(viewer_html(rig, plan))
    return plan, write_html(plan, rig, folder / "plan.html"), alone


@pytest.fixture(scope="module")
def visit(browser, paths):
    visit = Visit(browser, paths[1], reduced_motion="reduce")
    visit.page.wait_for_selector(READY)
    yield visit
    visit.context.close()


@pytest.fixture(autouse=True)
def nothing_goes_wrong(request):
    yield
    if "visit" in request.fixturenames:
        assert request.getfixturevalue("visit").wrong == []


def test_the_head_is_drawn(visit):
    assert len(np.unique(visit.head().reshape(-1, 3), axis=0)) > 2000


def test_the_plan_is_checked_on_the_page(visit):
    lines = visit.page.locator("#checks li").count()
    assert lines >= 10
    assert f"of {lines} checks hold" in visit.page.locator("#checked").inner_text()
    assert visit.page.locator("#checks .fails").count()  # the plan was made by hand


def test_stepping_through_the_expressions_moves_the_face(visit):
    before = visit.head()
    visit.page.get_by_role("button", name="Next expression").click()
    assert visit.page.locator('[data-role="count"]').inner_text() == FIRST
    assert changed(before, visit.head()) > 0.01
    visit.page.get_by_role("button", name="Previous expression").click()
    assert changed(before, visit.head()) < 0.001


def test_strength_and_heat_change_the_picture(visit):
    visit.page.get_by_label("Expression", exact=True).select_option("1")
    full = visit.head()
    visit.page.locator('[data-role="strength"]').fill("30")
    assert changed(full, visit.head()) > 0.005
    visit.page.get_by_label("Colour by movement").check()
    assert visit.page.locator('[data-role="most"]').inner_text().endswith(" mm")
    visit.page.get_by_label("Colour by movement").uncheck()
    visit.page.get_by_label("Expression", exact=True).select_option("-1")


def test_dragging_turns_the_head(visit):
    before = visit.head()
    box = visit.page.locator(".stage canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + 60
    visit.page.mouse.move(x, y)
    visit.page.mouse.down()
    visit.page.mouse.move(x + 120, y, steps=4)
    visit.page.mouse.up()
    assert changed(before, visit.head()) > 0.01
    visit.page.get_by_role("button", name="Front", exact=True).click()


def test_arrow_keys_turn_the_head(visit):
    before = visit.head()
    visit.page.locator(".stage").focus()
    visit.page.keyboard.press("ArrowLeft")
    assert changed(before, visit.head()) > 0.01
    visit.page.keyboard.press("Home")
    assert changed(before, visit.head()) < 0.001


def test_a_row_of_the_table_shows_its_marker(visit, paths):
    first = paths[0].layout.landmarks[1]
    visit.page.get_by_role("row").filter(has_text=first.name).get_by_role("button").click()
    card = visit.page.locator('[data-role="marker"]')
    assert first.label in card.inner_text()
    assert first.blendshapes[0] in card.locator(".chip").all_inner_texts()


def test_a_name_behind_the_head_is_hidden(visit):
    seen = "[...document.querySelectorAll('.tag')].filter((tag) => !tag.hidden).length"
    visit.page.get_by_role("button", name="Front", exact=True).click()
    visit.page.wait_for_function(f"() => {seen} >= 3")
    for _ in range(18):
        visit.page.locator(".stage").press("ArrowLeft")
    visit.page.wait_for_function(f"() => {seen} === 0")
    visit.page.get_by_role("button", name="Front", exact=True).click()


def test_hostile_names_are_shown_as_text_and_do_nothing(visit):
    assert visit.page.evaluate("window.harmed") is None
    assert visit.page.locator("h1").inner_text() == HOSTILE[0]
    shown = visit.page.locator("#expressions").inner_text()
    assert all(" ".join(name.split()) in " ".join(shown.split()) for name in HOSTILE[1:])
    assert visit.page.locator("img[src=x]").count() == 0


@pytest.mark.parametrize("alone", [False, True], ids=["page", "head_alone"])
def test_a_script_that_got_onto_the_page_all_the_same_never_runs(browser, paths, tmp_path, alone):
    planted = "<script>window.owned = 1</script><img src='x' onerror='window.owned = 2'></body>"
    text = paths[1 + alone].read_text()
    (tmp_path / "page.html").write_text(text.replace("</body>", planted))
    visit = Visit(browser, tmp_path / "page.html")
    visit.page.wait_for_selector(READY)
    assert visit.page.evaluate("window.owned") is None
    assert any("Content Security Policy" in line for line in visit.wrong)
    visit.context.close()


def test_the_search_finds_markers(visit):
    visit.page.get_by_label("Find a marker").fill("m02")
    assert visit.page.locator("[data-marker]:visible").count() == 1
    visit.page.get_by_label("Find a marker").fill("")
    assert visit.page.locator("[data-marker]:visible").count() == 4


def test_saving_gives_plan_json_to_the_byte(visit, paths):
    with visit.page.expect_download() as download:
        visit.page.get_by_role("button", name="Save plan.json").click()
    assert download.value.suggested_filename == "plan.json"
    with open(download.value.path(), "rb") as file:
        assert file.read() == plan_bytes(paths[0])


def test_every_picture_has_a_text_and_every_control_a_name(visit):
    assert visit.page.locator("img:not([alt]), img[alt='']").count() == 0
    nameless = """[...document.querySelectorAll("button, select, input")].filter((control) =>
      !control.innerText?.trim() && !control.getAttribute("aria-label") && !control.labels?.length).length"""
    assert visit.page.evaluate(nameless) == 0


@pytest.mark.parametrize("width", [390, 834])
def test_small_screens_need_no_sideways_scrolling(visit, width):
    visit.page.set_viewport_size({"width": width, "height": 844})
    assert visit.page.evaluate("document.documentElement.scrollWidth") == width


def test_without_webgl_a_line_says_so_and_the_tables_remain(browser, paths):
    visit = Visit(browser, paths[1], java_script_enabled=True)
    visit.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
    visit.page.reload()
    visit.page.wait_for_selector("#viewer.no-webgl")
    assert visit.page.get_by_text("cannot show the head in 3D").is_visible()
    assert visit.page.locator("[data-marker]").count() == 4
    visit.context.close()


def test_the_head_alone_works_inside_an_iframe(browser, paths, tmp_path):
    host = tmp_path / "host.html"
    host.write_text("<iframe style='width:900px;height:600px;border:0'></iframe>")
    visit = Visit(browser, host)
    visit.page.evaluate("(html) => { document.querySelector('iframe').srcdoc = html; }", paths[2].read_text())
    frame = visit.page.frame_locator("iframe")
    frame.locator(READY).wait_for()
    frame.get_by_role("button", name="Next expression").click()
    assert frame.locator('[data-role="count"]').inner_text() == FIRST
    assert visit.wrong == []
    visit.context.close()
