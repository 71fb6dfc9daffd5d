"""What many tests share: a Chromium that draws in software and asks no network, and the sample's face and layout."""

import os
import shutil
import time

import pytest
from hypothesis import settings
from playwright.sync_api import sync_playwright

SOFTWARE_GL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
QUIET = ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--no-first-run"]

# How long an example takes says what else the machine does; everything else is as hypothesis chose for this place.
settings.register_profile("untimed", parent=settings(), deadline=None)
settings.load_profile("untimed")


STARTED = time.monotonic()


def pytest_addoption(parser):
    parser.addoption("--within", type=float, metavar="SECONDS", help="Start no test later than so many seconds.")


def pytest_runtest_setup(item):
    within = item.config.getoption("--within")
    if within and time.monotonic() - STARTED > within:
        pytest.skip(f"{within:g} s are over")


def pytest_collection_modifyitems(items):
    """What takes longest comes first, so that one worker does not end minutes after the other."""
    items.sort(key=lambda item: item.path.name != "test_notebooks_browser.py")


@pytest.fixture(scope="session")
def browser():
    """The system's Chromium where there is one, else the one that playwright installed."""
    with sync_playwright() as playwright:
        path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        chromium = playwright.chromium.launch(executable_path=path, args=QUIET + SOFTWARE_GL)
        yield chromium
        chromium.close()


@pytest.fixture(scope="session", autouse=True)
def cache_of_the_tests(tmp_path_factory):
    """Tests neither use nor fill the user's cache; what one has computed, the others find, also in other workers."""
    folder = tmp_path_factory.getbasetemp()
    if os.environ.get("PYTEST_XDIST_WORKER"):
        folder = folder.parent  # a worker's own folder lies in the run's
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        yield


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """Plans of several kinds on the bundled head by name, written once for all workers; what a check of them asks for
    twice is answered once."""
    from tests.tampering import answers_kept, plans

    folder = tmp_path_factory.getbasetemp()
    folder = (folder.parent if os.environ.get("PYTEST_XDIST_WORKER") else folder) / "plans"
    folder.mkdir(exist_ok=True)
    with answers_kept():
        written = plans(folder)
    return written


@pytest.fixture(scope="session")
def rig():
    """The sample head."""
    from capture_plan.sample import sample_rig

    return sample_rig()


@pytest.fixture(scope="session")
def used(rig):
    """Its blendshapes that a plan uses."""
    from capture_plan.audit.audit import audit_rig

    return audit_rig(rig).used


@pytest.fixture(scope="session")
def face(rig, used):
    """The sample head with all blendshapes that a plan uses."""
    from capture_plan.layout.face import see_face

    return see_face(rig, used)


@pytest.fixture(scope="session")
def studio():
    """The layout of the sample that nobody changed a setting of."""
    from tests.once import layout_of

    return layout_of()
