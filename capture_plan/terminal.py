"""Progress in the terminal: one line that is drawn over, on standard error; nothing where nobody watches."""

import shutil
import sys
import time

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
