"""The terminal: progress as one line that is drawn over, on standard error; streams that may be closed."""

import os
import shutil
import sys
import time
from contextlib import suppress
from typing import TextIO

BAR = 24
EVERY_S = 0.1
_last = 0.0


def report_to_terminal(label: str, done: int, total: int) -> None:
    """A bar for `label`, at most ten times a second, cleared when it is done."""
    global _last
    if not sys.stderr.isatty() or total == 0:
        return
    if done < total and time.monotonic() - _last < EVERY_S:
        return
    _last = time.monotonic()
    filled = BAR * done // total
    line = f"{'█' * filled}{'░' * (BAR - filled)} {done / total:4.0%}  {label}"
    width = shutil.get_terminal_size().columns - 1
    sys.stderr.write("\r" + (" " * width if done == total else line[:width].ljust(width)) + "\r" * (done == total))
    sys.stderr.flush()


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
