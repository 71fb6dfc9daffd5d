"""The frame of every notebook: which rig it is about, progress while it works, one sentence when it cannot."""

import html
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import marimo as mo

from capture_plan.errors import CapturePlanError
from capture_plan.notebook_guard import Guard
from capture_plan.plan.record import SAMPLE, RigReference
from capture_plan.progress import Reporter, StoppedError, show_progress, stoppable
from capture_plan.reader.read import read_rig
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from capture_plan.shell.takes import Takes, takes_of


def chosen_rig() -> Rig:
    """The rig given as `-- --rig PATH`, else the sample head."""
    path = _rig_path()
    with working():
        return sample_rig() if path == SAMPLE else read_rig(path)


def is_sample() -> bool:
    """Whether the session is about the sample head."""
    return _rig_path() == SAMPLE


def rig_reference(rig: Rig) -> RigReference:
    """How a plan of this session remembers its rig: by its full path, since nobody knows where a download ends up."""
    path = _rig_path()
    place = SAMPLE if path == SAMPLE else Path(path).resolve().as_posix()
    return RigReference(rig.name, place, rig.fingerprint, len(rig.neutral))


def given_takes() -> tuple[str, ...]:
    """Full paths of the takes given as `-- --take PATH`, several allowed."""
    return tuple(Path(str(path)).resolve().as_posix() for path in mo.cli_args().get_all("take"))


def takes_of_the_session(rig: Rig) -> Takes | None:
    """The given takes of the rig together; None where none is given."""
    with working():
        sequences = [read_sequence(path, rig=rig) for path in given_takes()]
        return takes_of(rig, sequences) if sequences else None


def markdown_plain(name: str) -> str:
    """A name as it may stand in Markdown: every sign that could mean something there is written as its number."""
    return "".join(sign if sign.isalnum() or sign == " " else f"&#{ord(sign)};" for sign in name)


def wanted(button: Any) -> bool:
    """Whether slow work is to be done now: when the button was pressed, and always where nobody can press it."""
    return bool(button.value) or mo.app_meta().mode not in ("run", "edit")


def stop_link() -> Any:
    """Stops what the notebook works out; it shows while bars do. Nothing where marimo has a button for it."""
    served = Guard.stop_path and mo.app_meta().mode == "run"
    return mo.Html(f'<a class="stop" href="{Guard.stop_path}">Stop</a>') if served else None


@contextmanager
def working() -> Iterator[None]:
    """Progress of what runs inside as bars in the cell; an expected error as one sentence, and the notebook waits.
    So it does where somebody stopped it."""
    try:
        with ExitStack() as bars, show_progress(_bars(bars)), stoppable():
            yield
    except StoppedError:
        mo.stop(True, mo.callout("Stopped. Turn a knob above, or reload the page, to work this out again."))
    except CapturePlanError as error:
        mo.stop(True, mo.callout(mo.Html(f"<p>{html.escape(str(error))}</p>"), kind="danger"))


def _rig_path() -> str:
    return str(mo.cli_args().get("rig") or SAMPLE)


def _bars(stack: ExitStack) -> Reporter:
    """A reporter that shows each piece of work as a bar of the running cell."""
    bars: dict[tuple[str, int], Any] = {}
    shown: dict[tuple[str, int], int] = {}

    def report(label: str, done: int, total: int) -> None:
        if total < 2:
            return
        work = label, total
        if work not in bars:
            bar = mo.status.progress_bar(total=total, title=label, show_rate=False, show_eta=False, remove_on_exit=True)
            bars[work], shown[work] = stack.enter_context(bar), 0
        if done > shown[work]:
            bars[work].update(increment=done - shown[work])
            shown[work] = done

    return report
