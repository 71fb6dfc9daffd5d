"""Opening the session notebook: a marimo server on this machine, which needs no network and answers its own page alone.

The notebooks lie in `notebooks/` of a checkout and travel in the wheel as `capture_plan/_notebooks`.
"""

import os
import runpy
import secrets
import shutil
import socket
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import uvicorn

from capture_plan.errors import RigError
from capture_plan.notebook_guard import Guard
from capture_plan.plan.record import SAMPLE
from capture_plan.reader.read import read_rig
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence

INSTALLED = Path(__file__).parent / "_notebooks"
OUTPUT_BYTES = (
    64_000_000  # the 3D head of a rig of 60,000 vertices takes about 10 MB; marimo drops what is larger than 8
)


def notebooks_folder() -> Path:
    """The folder that the notebooks lie in."""
    return INSTALLED if INSTALLED.is_dir() else Path(__file__).parents[1] / "notebooks"


def open_notebook(
    rig: str,
    takes: Sequence[str] = (),
    *,
    edit: bool = False,
    headless: bool = False,
    host: str = "127.0.0.1",
    port: int | None = None,
) -> int:
    """Serve the session notebook on `rig`, with recorded `takes` of it, until it is stopped; marimo prints the address,
    with a token without which nobody gets an answer. Returns the exit code.

    To be edited, an installed notebook is copied into the current folder first, unless a copy is there.

    Raises:
        RigError: the rig or a take cannot be read, or nobody can listen at the address; nothing was started.
    """
    check_address(host, port or 0)
    read = sample_rig() if rig == SAMPLE else read_rig(rig)
    for take in takes:
        read_sequence(take, rig=read)
    rig = rig if rig == SAMPLE else str(Path(rig).resolve())
    session = notebooks_folder() / "session.py"
    arguments = [*_options(headless=headless, host=host, port=port), "--", "--rig", rig]
    arguments += [part for take in takes for part in ("--take", str(Path(take).resolve()))]
    if edit:
        return serve("edit", str(own_copy(session)), *arguments)
    return serve("run", str(session), *arguments)


def open_lessons(*, headless: bool = False, port: int | None = None) -> int:
    """Serve the lessons until they are stopped; marimo prints the address. Returns the exit code.

    Raises:
        RigError: nobody can listen at the address.
    """
    check_address("127.0.0.1", port or 0)
    lessons = str(notebooks_folder() / "learn")
    return serve("run", lessons, *_options(headless=headless, host="127.0.0.1", port=port))


def check_address(host: str, port: int) -> None:
    """RigError where nobody can listen at an address: one line before the server says it in many."""
    try:
        if not host:
            raise OSError(0, "no name")
        kind, _, _, _, at = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        with socket.socket(kind, socket.SOCK_STREAM) as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(at)
    except (OSError, UnicodeError, OverflowError) as error:
        why = getattr(error, "strerror", None) or "no address"
        where = f"'{host}'" + (f", port {port}" if port else "")
        raise RigError(
            f"nobody can listen at {where} ({why}): give another --host or --port, or leave them out"
        ) from None


def _options(*, headless: bool, host: str, port: int | None) -> list[str]:
    """What marimo is told. The token stands in no list of processes: the server is this one."""
    chosen = ["--no-sandbox", "--host", host, "--token", "--token-password", secrets.token_urlsafe(24)]
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


class Guarded(uvicorn.Config):
    """What uvicorn is told by marimo, with the guard before its application."""

    def __init__(self, app: Any, *, host: str, port: int, **others: Any) -> None:
        super().__init__(Guard(app, host, port), host=host, port=port, **others)


def serve(*arguments: str) -> int:
    """`python -m marimo …` in this process, so that stopping the command stops the server, behind our guard."""
    os.environ.setdefault("MARIMO_OUTPUT_MAX_BYTES", str(OUTPUT_BYTES))
    os.environ.setdefault("MARIMO_SKIP_UPDATE_CHECK", "1")
    sys.argv = ["marimo", *arguments]
    Guard.stop_path = f"/stop/{secrets.token_urlsafe(24)}"
    uvicorn.Config = Guarded
    try:
        runpy.run_module("marimo", run_name="__main__")
    except SystemExit as stopped:
        return stopped.code if isinstance(stopped.code, int) else int(stopped.code is not None)
    return 0
