"""How long work reports progress: silent by default, a bar in the terminal, a marimo bar in a notebook.

Code that takes long iterates over `track(items, "what it does")`; whoever runs it decides what is shown,
by `with show_progress(reporter):`. A reporter receives (label, done, total) and must not raise.
What a reader understood of a file goes the same way: `tell(lines)`, heard by who asked, `with listen(hear):`.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")
Reporter = Callable[[str, int, int], None]

Hearer = Callable[[Iterable[str]], None]

_hearer: ContextVar[Hearer | None] = ContextVar("hearer", default=None)
_reporter: ContextVar[Reporter | None] = ContextVar("reporter", default=None)


@contextmanager
def show_progress(reporter: Reporter) -> Iterator[None]:
    """Report the progress of everything inside the block to `reporter(label, done, total)`."""
    token = _reporter.set(reporter)
    try:
        yield
    finally:
        _reporter.reset(token)


def track(items: Iterable[T], label: str, *, total: int | None = None) -> Iterator[T]:
    """Yield `items` in order, reporting (label, done, total) before the first and after each."""
    reporter = _reporter.get()
    if reporter is None:
        yield from items
        return
    if total is None:
        items = items if isinstance(items, Sequence) else tuple(items)
        total = len(items)
    reporter(label, 0, total)
    for done, item in enumerate(items, start=1):
        yield item
        reporter(label, done, total)


@contextmanager
def listen(hear: Hearer) -> Iterator[None]:
    """Let `hear(lines)` receive everything that is told inside the block."""
    token = _hearer.set(hear)
    try:
        yield
    finally:
        _hearer.reset(token)


def tell(lines: Iterable[str]) -> None:
    """Tell whoever listens what was understood; nobody by default."""
    if hear := _hearer.get():
        hear(lines)
