"""Opening the session notebook: a marimo server on this machine, which needs no network.

The notebooks lie in `notebooks/` of a checkout and travel in the wheel as `capture_plan/_notebooks`.
"""

import os
import runpy
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from capture_plan.errors import RigError
from capture_plan.plan.record import SAMPLE
from capture_plan.rig import read_rig, sample_rig
from capture_plan.rig.sequence import read_sequence

INSTALLED = Path(__file__).parent / "_notebooks"
OUTPUT_BYTES = (
    64_000_000  # the 3D head of a rig of 60,000 vertices takes about 10 MB; marimo drops what is larger than 8
)


def notebooks_folder() -> Path:
    """Where the notebooks lie."""
    return INSTALLED if INSTALLED.is_dir() else Path(__file__).parents[1] / "notebooks"


def open_notebook(
    rig: str, takes: Sequence[str] = (), *, edit: bool = False, headless: bool = False, port: int | None = None
) -> int:
    """Serve the session notebook on `rig`, with recorded `takes` of it, until it is stopped; marimo prints the address.
    Returns the exit code.

    To be edited, an installed notebook is copied into the current folder first, unless a copy is there.

    Raises:
        RigError: the rig or a take cannot be read; nothing was started.
    """
    read = sample_rig() if rig == SAMPLE else read_rig(rig)
    for take in takes:
        read_sequence(take, rig=read)
    rig = rig if rig == SAMPLE else str(Path(rig).resolve())
    session = notebooks_folder() / "session.py"
    arguments = [*options(headless=headless, port=port), "--", "--rig", rig]
    arguments += [part for take in takes for part in ("--take", str(Path(take).resolve()))]
    if edit:
        return serve("edit", str(own_copy(session)), *arguments)
    return serve("run", str(session), *arguments)


def options(*, headless: bool, port: int | None) -> list[str]:
    """What marimo is told."""
    chosen = ["--no-sandbox"]
    chosen += ["--headless"] if headless else []
    return chosen + (["--port", str(port)] if port else [])


def own_copy(session: Path) -> Path:
    """The notebook itself in a checkout; a copy in the current folder where it is installed.

    Raises:
        RigError: the current folder cannot be written.
    """
    if session.parent != INSTALLED:
        return session
    copy = Path.cwd() / session.name
    try:
        for name in (session.name, "notebook.css"):
            if not (Path.cwd() / name).exists():
                shutil.copyfile(session.parent / name, Path.cwd() / name)
    except OSError as error:
        raise RigError(f"{Path.cwd()} cannot be written ({error.strerror}): change to another folder first") from None
    return copy


def serve(*arguments: str) -> int:
    """`python -m marimo …` in this process, so that stopping the command stops the server."""
    os.environ.setdefault("MARIMO_OUTPUT_MAX_BYTES", str(OUTPUT_BYTES))
    os.environ.setdefault("MARIMO_SKIP_UPDATE_CHECK", "1")
    sys.argv = ["marimo", *arguments]
    try:
        runpy.run_module("marimo", run_name="__main__")
    except SystemExit as stopped:
        return stopped.code if isinstance(stopped.code, int) else int(stopped.code is not None)
    return 0
