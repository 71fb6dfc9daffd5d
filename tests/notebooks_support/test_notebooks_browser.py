"""The notebooks as people open them: marimo apps in Chromium, a knob turned, the result changed."""

import io
import os
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image

from capture_plan.mesh.decimate import decimate
from capture_plan.notebook import notebooks_folder
from capture_plan.sample import sample_rig

START_S = 60  # a server on a busy machine
WORK_MS = 240_000
READY_HEAD = "#viewer.ready canvas"
MANY_COLOURS = 500  # a lit head has thousands, an empty stage a few


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def served(arguments, port, folder):
    """The address of a server that runs while the block does."""
    environment = os.environ | {"MARIMO_SKIP_UPDATE_CHECK": "1"}
    log = folder / "server.log"
    with log.open("wb") as output:
        server = subprocess.Popen(arguments, cwd=folder, env=environment, stdout=output, stderr=subprocess.STDOUT)
    try:
        wait_for(f"http://127.0.0.1:{port}/health", server, log)
        token = re.search(r"access_token=([\w-]+)", log.read_text())
        yield f"http://127.0.0.1:{port}/" + (f"?{token[0]}" if token else "")
    finally:
        server.terminate()
        try:
            server.wait(10)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def wait_for(address, server, log):
    until = time.monotonic() + START_S
    while time.monotonic() < until:
        if server.poll() is not None:
            break
        try:
            urllib.request.urlopen(address, timeout=2).close()
            return
        except (urllib.error.URLError, OSError):
            time.sleep(0.1)
    pytest.fail(f"no server at {address}: {log.read_text()}")


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The session notebook, opened by the command line from another folder."""
    port, command = (
        free_port(),
        [sys.executable, "-c", "from capture_plan.cli import main; main()", "notebook", "sample"],
    )
    with served([*command, "--headless", "--port", str(port)], port, tmp_path_factory.mktemp("session")) as address:
        yield address


@pytest.fixture(scope="module")
def stages(tmp_path_factory):
    """One server for the notebooks of all stages, on a coarser sample with every fourth blendshape, of which they show
    the same in a fraction of the time."""
    port, folder, place = free_port(), str(notebooks_folder()), tmp_path_factory.mktemp("stages")
    rig = sample_rig()
    retained, triangles = decimate(rig.neutral, rig.triangles, len(rig.triangles) // 3)
    arrays = {"faces": triangles, "names": np.array(rig.names[1::4]), "units": "mm"}
    np.savez(place / "coarse.npz", vertices=rig.neutral[retained], deltas=rig.deltas[1::4, retained], **arrays)
    command = [sys.executable, "-m", "marimo", "run", folder, "--headless", "--no-sandbox", "--port", str(port)]
    with served([*command, "--", "--rig", str(place / "coarse.npz")], port, place) as address:
        yield address


@pytest.fixture
def visit(browser):
    """Opens an address on a page that asks nothing of a network; afterwards nothing may have gone wrong."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    wrong = []

    def watch(request):
        if not re.match(r"(https?|wss?)://(127\.0\.0\.1|localhost)|data:|blob:|about:", request.url):
            wrong.append(f"asked for {request.url}")

    def visit(address):
        page = context.new_page()
        page.set_default_timeout(WORK_MS)
        page.on("request", watch)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(address)
        page.wait_for_selector("h1")
        return page

    yield visit
    context.close()
    assert not wrong


def tile(page, what):
    """What the tile called `what` says: its figure, and the note under it."""
    found = page.locator(".tiles > div", has=page.locator(f"p.what:text-is('{what}')"))
    return found.locator("p.figure").inner_text(), found.locator("p").last.inner_text()


def turn(page, label, key, times):
    """Move the slider beside `label` by so many steps."""
    slider = page.locator("marimo-slider", has_text=label).get_by_role("slider")
    slider.focus()
    for _ in range(times):
        slider.press(key)


def changed(page, what, before):
    """Wait until the tile says something else, and return that."""
    page.wait_for_function(
        "([what, before]) => [...document.querySelectorAll('.tiles > div')].some((tile) =>"
        " tile.querySelector('.what').textContent === what"
        " && (tile.querySelector('.figure').textContent !== before[0]"
        " || tile.lastElementChild.textContent !== before[1]))",
        arg=[what, list(before)],
    )
    return tile(page, what)


def needed(said):
    """How many landmarks are needed at least, as a tile says."""
    return int(re.search(r"at least (\d+)", said[1])[1])


def assert_no_error(page):
    text = page.locator("body").inner_text()
    assert "Traceback" not in text
    assert "This cell" not in text
    assert (
        page.locator(".marimo-error, [data-testid='marimo-error'], marimo-callout-output[data-kind*='danger']").count()
        == 0
    )


def colours_of_the_head(page, number=0):
    """How many colours the 3D head of the numbered frame shows."""
    frame = page.frame_locator("iframe").nth(number)
    frame.locator(READY_HEAD).wait_for(state="attached")
    shot = Image.open(io.BytesIO(frame.locator(".stage").screenshot())).convert("RGB")
    return len(np.unique(np.asarray(shot).reshape(-1, 3), axis=0))


@pytest.mark.parametrize(
    ("name", "what"), [("rig", "Blendshapes planned"), ("visibility", "Seen well enough"), ("landmarks", "Landmarks")]
)
def test_a_notebook_opens_with_its_figures_and_a_head(visit, stages, name, what):
    page = visit(f"{stages}?file={name}.py")
    assert re.match(r"\d", tile(page, what)[0])
    assert colours_of_the_head(page) > MANY_COLOURS
    assert_no_error(page)


def test_a_higher_mu_needs_fewer_expressions(visit, stages):
    page = visit(f"{stages}?file=expressions.py")
    before = tile(page, "Expressions")
    turn(page, "Mu", "ArrowRight", 4)
    assert int(changed(page, "Expressions", before)[0]) < int(before[0])
    assert_no_error(page)


def test_more_noise_leaves_more_error_whatever_the_method(visit, stages):
    page = visit(f"{stages}?file=compare_layouts.py")
    assert colours_of_the_head(page) > MANY_COLOURS
    before = {what: tile(page, what) for what in ("Predicted error", "Best other", "Landmarks")}
    turn(page, "Noise, mm", "ArrowRight", 3)
    for what in ("Predicted error", "Best other"):
        assert float(changed(page, what, before[what])[0].split()[0]) > float(before[what][0].split()[0])
    assert tile(page, "Landmarks") == before["Landmarks"]
    assert_no_error(page)


def test_the_figures_of_the_paper_stand_below_each_other(visit, stages):
    page = visit(f"{stages}?file=compact_landmarks.py")
    page.wait_for_function("() => document.querySelectorAll('figure.paper img').length === 13")
    assert_no_error(page)


def test_the_sheets_notebook_shows_pages_as_pictures(visit, stages):
    page = visit(f"{stages}?file=sheets.py")
    first = page.locator(".pages img").first
    first.wait_for()
    assert first.evaluate("(picture) => picture.decode().then(() => picture.naturalWidth)") > 400
    assert_no_error(page)


PROBE = """async ([page, socket]) => {
  const fetched = await fetch(page).then(() => "answered", () => "refused");
  const opened = await new Promise(done => {
    const ws = new WebSocket(socket);
    ws.onopen = () => done("answered");
    ws.onerror = ws.onclose = () => done("refused");
  });
  return [fetched, opened];
}"""


def test_another_page_of_the_browser_gets_neither_page_nor_socket_of_a_session(visit, session):
    page = visit(session)
    page.wait_for_selector("h1, h2")  # so that the browser holds the cookie of this session
    others, port = page.context.new_page(), re.search(r":(\d+)/", session)[1]
    others.route("http://other.example/", lambda route: route.fulfill(body="<h1>other</h1>", content_type="text/html"))
    others.goto("http://other.example/")
    for mine in (f"127.0.0.1:{port}/", f"localhost:{port}/"):
        answers = others.evaluate(PROBE, [f"http://{mine}", f"ws://{mine}ws?session_id=s_abcdef"])
        assert answers == ["refused", "refused"]
    others.close()


def test_the_session_walks_from_the_rig_to_the_downloads(visit, session):
    page = visit(session)
    page.get_by_text("Sheets for print (PDF)").wait_for()
    before = {what: tile(page, what) for what in ("Landmarks", "Expressions", "Seen well enough")}
    assert colours_of_the_head(page, 1) > MANY_COLOURS
    turn(page, "Epsilon", "ArrowRight", 4)
    assert needed(changed(page, "Landmarks", before["Landmarks"])) > needed(before["Landmarks"])
    assert {what: tile(page, what) for what in before} | {"Landmarks": before["Landmarks"]} == before
    with page.expect_download() as download:
        page.get_by_text("plan.json", exact=True).last.click()
    assert download.value.suggested_filename == "plan.json"
    assert_no_error(page)
