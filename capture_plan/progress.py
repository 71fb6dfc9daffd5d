"""How long work reports progress: silent by default, a bar in the terminal, a marimo bar in a notebook.

Code that takes long iterates over `track(items, "what it does")`; whoever runs it decides what is shown,
by `with show_progress(reporter):`. A reporter receives (label, done, total) and must not raise.
What a reader understood of a file goes the same way: `tell(lines)`, heard by who asked, `with listen(hear):`.
What runs `with stoppable():` ends in a `StoppedError` soon after another thread called `stop_work()`.
"""

import os
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from contextvars import ContextVar
from threading import Event
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")
Reporter = Callable[[str, int, int], None]

Hearer = Callable[[Iterable[str]], None]

_hearer: ContextVar[Hearer | None] = ContextVar("hearer", default=None)
_reporter: ContextVar[Reporter | None] = ContextVar("reporter", default=None)
_asked: ContextVar[tuple[Event, ...]] = ContextVar("asked", default=())  # any of them ends what runs here
_at_work: set[Event] = set()  # of every block that can be stopped, in any thread


class StoppedError(Exception):
    """Somebody asked for the end of this work: nothing is wrong, and nothing may go on regardless."""


@contextmanager
def show_progress(reporter: Reporter) -> Iterator[None]:
    """Report the progress of everything inside the block to `reporter(label, done, total)`."""
    token = _reporter.set(reporter)
    try:
        yield
    finally:
        _reporter.reset(token)


@contextmanager
def stoppable() -> Iterator[None]:
    """Let `stop_work` end what runs inside the block."""
    asked = Event()
    token = _asked.set((asked,))
    _at_work.add(asked)
    try:
        yield
    finally:
        _at_work.discard(asked)
        _asked.reset(token)


def stop_work() -> None:
    """Ask all work of this process that can be stopped to end."""
    for asked in tuple(_at_work):
        asked.set()


def go_on() -> None:
    """What long work says now and then.

    Raises:
        StoppedError: somebody asked for its end.
    """
    if any(asked.is_set() for asked in _asked.get()):
        raise StoppedError


def track(items: Iterable[T], label: str, *, total: int | None = None) -> Iterator[T]:
    """Yield `items` in order, reporting (label, done, total) before the first and after each.

    Raises:
        StoppedError: somebody asked for the end of the work.
    """
    reporter = _reporter.get()
    if reporter is None:
        for item in items:
            go_on()
            yield item
        return
    if total is None:
        items = items if isinstance(items, Sequence) else tuple(items)
        total = len(items)
    reporter(label, 0, total)
    for done, item in enumerate(items, start=1):
        go_on()
        yield item
        reporter(label, done, total)


def in_threads(do: Callable[[T], R], items: Sequence[T]) -> Generator[R, None, None]:
    """`do(item)` of each item in their order, by a thread for each core: for work that releases the interpreter lock.

    Where whoever asked goes away or the work is stopped, what was not begun is dropped, and what was begun ends at its
    next `go_on()`.
    """
    dropped = Event()
    ends = (*_asked.get(), dropped)
    with ThreadPoolExecutor(os.cpu_count(), initializer=_asked.set, initargs=(ends,)) as pool:
        try:
            yield from pool.map(do, items)
        finally:
            dropped.set()
            pool.shutdown(cancel_futures=True)


def track_in_threads(do: Callable[[T], R], items: Sequence[T], label: str) -> Iterator[R]:
    """What `in_threads` yields, with progress reported."""
    with closing(in_threads(do, items)) as answers:
        yield from track(answers, label, total=len(items))


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
