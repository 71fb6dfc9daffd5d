"""A disk that fails: `os` as the writers see it, of which a chosen call that changes something is refused."""

import os
from types import SimpleNamespace

from capture_plan.output import leavings, together, whole

FULL = OSError(28, "No space left on device")
CHANGING = ("open", "mkdir", "makedirs", "replace", "unlink", "rmdir", "fsync", "link")


class FailingDisk:
    """`os`, whose call number `first` raises `error`, and all behind it where `ever`; `calls` counts them."""

    def __init__(self, first=None, error=FULL, *, ever=False):
        self.first, self.error, self.ever, self.calls = first, error, ever, 0

    def count(self):
        self.calls += 1
        if self.calls == self.first or (self.ever and self.first and self.calls > self.first):
            raise self.error

    def __getattr__(self, name):
        real = getattr(os, name)
        if name == "fdopen":
            return self.fdopen
        if name not in CHANGING:
            return real

        def call(*arguments, **options):
            self.count()
            return real(*arguments, **options) if name != "fsync" else None

        return call

    def fdopen(self, handle, mode):
        file = os.fdopen(handle, mode)
        real = file.write

        def write(content):
            self.count()
            return real(content)

        proxy = SimpleNamespace(write=write, flush=file.flush, read=file.read, seek=file.seek, tell=file.tell)
        return Closing(proxy, file)

    def at(self, monkeypatch):
        """Let the writers see this disk."""
        for module in (leavings, together, whole):
            monkeypatch.setattr(module, "os", self)
        return self


class Closing:
    """A file that is handed out as something else and closed at the end."""

    def __init__(self, proxy, file):
        self.proxy, self.file = proxy, file

    def __enter__(self):
        return self.proxy

    def __exit__(self, *error):
        self.file.close()


def tree(folder):
    """All files below a folder with their content."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
