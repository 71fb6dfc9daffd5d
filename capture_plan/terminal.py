"""The terminal: progress on standard error, and streams that may be closed.

Watched    one line that is drawn over, with how long it will take, cleared when the work is done
Piped      a line for work of more than five seconds, now and then
"""

import os
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol, TextIO, runtime_checkable

BAR = 24
EVERY_S = 0.1  # of a line that is drawn over
LINES_S = 5.0  # of lines that stay


@runtime_checkable
class Stream(Protocol):
    """What is needed of a stream of text."""

    def write(self, text: str, /) -> int:
        """Write a text; the number of letters written."""
        ...

    def flush(self) -> None:
        """Show what was written so far."""
        ...

    def isatty(self) -> bool:
        """Whether a person looks at it."""
        ...


@dataclass
class Terminal:
    """A reporter of progress; `now` is the clock, seconds."""

    stream: Stream
    now: Callable[[], float] = time.monotonic
    _label: str = field(default="", init=False)
    _began: float = field(default=0.0, init=False)
    _said: float = field(default=0.0, init=False)
    _share: float = field(default=0.0, init=False)

    def __call__(self, label: str, done: int, total: int) -> None:
        """So much of `total` is done of what `label` names."""
        now = self.now()
        if label != self._label or not done:
            self._label, self._began, self._said = label, now, now
        if not total:
            return
        self._share = done / total
        with suppress(OSError):
            self._draw(done, total, now) if self.stream.isatty() else self._say(done, total, now)

    def stopped(self) -> str:
        """That work was stopped, at which step and how far it had got, where it reports that; its line is cleared."""
        if not self._label:
            return "stopped"
        with suppress(OSError):
            if self.stream.isatty():
                self._draw(1, 1, self.now())
        step = f"after '{self._label}'" if self._share == 1 else f"at '{self._label}', {self._share:.0%} done"
        return f"stopped {step}"

    def _draw(self, done: int, total: int, now: float) -> None:
        if 0 < done < total and now - self._said < EVERY_S:
            return
        self._said = now
        filled = BAR * done // total
        line = f"{'█' * filled}{'░' * (BAR - filled)} {done / total:4.0%}  {self._label}{self._left(done, total, now)}"
        width = shutil.get_terminal_size().columns - 1
        self.stream.write("\r" + (" " * width if done == total else line[:width].ljust(width)) + "\r" * (done == total))
        self.stream.flush()

    def _say(self, done: int, total: int, now: float) -> None:
        if now - self._said < LINES_S or done == total:
            return
        self._said = now
        self.stream.write(f"{self._label}: {done / total:.0%}{self._left(done, total, now)}\n")
        self.stream.flush()

    def _left(self, done: int, total: int, now: float) -> str:
        """How long it will take, once a second of it has been seen."""
        taken = now - self._began
        return f", about {taken * (total - done) / done:.0f} s left" if done and taken > 1 else ""


def open_streams() -> None:
    """Stand the null device in for standard streams that were closed, lest a file of ours gets the number of one."""
    while (handle := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(handle)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))


def close_quietly(stream: TextIO) -> None:
    """Turn a stream that nobody reads to the null device, so that nothing is said of it at the end."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
