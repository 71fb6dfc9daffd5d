"""The wheel holds everything: it works where no checkout is."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The wheel, unpacked as an installer would."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=CHECKOUT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def run(installed, code, cwd):
    elsewhere = f"sys.path = [{str(installed)!r}] + [p for p in sys.path if p != {str(CHECKOUT)!r}]"
    command = [sys.executable, "-P", "-c", f"import sys; {elsewhere}; {code}"]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True)


def test_the_sample_is_planned_from_the_wheel_alone(installed, tmp_path):
    arguments = ["x", "plan", "sample", "--method", "cover", "-o", "p.json"]
    code = f"import capture_plan, capture_plan.cli as c; sys.argv = {arguments}; c.main()"
    done = run(installed, code, tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "p.json").is_file()


def test_the_notebooks_travel_in_the_wheel(installed, tmp_path):
    code = "from capture_plan.notebook import notebooks_folder; print(*(p.name for p in notebooks_folder().iterdir()))"
    done = run(installed, code, tmp_path)
    shipped = {path.name for path in (CHECKOUT / "notebooks").iterdir() if path.is_file()}
    assert set(done.stdout.split()) >= shipped
    assert str(CHECKOUT) not in run(installed, "import capture_plan; print(capture_plan.__file__)", tmp_path).stdout


def test_every_package_file_is_in_the_wheel(installed):
    source = CHECKOUT / "capture_plan"
    files = {p.relative_to(source) for p in source.rglob("*") if p.is_file() and "__pycache__" not in p.parts}
    shipped = {p.relative_to(installed / "capture_plan") for p in (installed / "capture_plan").rglob("*")}
    assert not {p for p in files if p.suffix != ".pyc"} - shipped


def test_the_bill_of_materials_travels_in_the_wheel_and_is_of_what_is_installed(installed):
    (bill,) = installed.glob("*.dist-info/sboms/bill.cdx.json")
    packages = {part["name"].lower() for part in json.loads(bill.read_text())["components"]}
    assert {"marimo", "numpy", "trimesh", "pyrender", "embreex", "ortools", "pillow"} <= packages
    script = CHECKOUT / ".ci" / "bill"
    if sys.version_info[:2] == (3, 11):  # the packages of other versions are a few others
        assert subprocess.run([sys.executable, script, "--check"], check=False).returncode == 0
