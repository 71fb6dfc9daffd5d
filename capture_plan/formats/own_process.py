"""Programs that read a stranger's file with native code, in a process of their own: it may end, but not with ours."""

import io
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np

ONE_THREAD = {"PXR_WORK_THREAD_LIMIT": "1", "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"}  # spares memory


class BrokenProcessError(Exception):
    """The program ended without an answer, or took too long for one: its file is damaged or too large."""


def arrays_from(program: Path, source: Path, *words: str, seconds: float) -> dict[str, np.ndarray]:
    """The arrays of the archive that `program` writes of the file `source`; it is called with its path, the words, and
    the path of the archive.

    Raises:
        BrokenProcessError: there is no whole archive within `seconds`.
    """
    environment = {name: text for name, text in os.environ.items() if name != "PXR_AR_DEFAULT_SEARCH_PATH"}
    environment |= {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))} | ONE_THREAD
    with tempfile.TemporaryDirectory() as folder:  # also where a library describes its end when it is ended
        environment["TMPDIR"], answer = folder, Path(folder) / "answer.npz"
        command = [sys.executable, "-P", str(program), str(source), *words, str(answer)]
        try:
            subprocess.run(command, capture_output=True, timeout=seconds, env=environment)
            with np.load(io.BytesIO(answer.read_bytes()), allow_pickle=False) as arrays:
                return {name: arrays[name] for name in arrays.files}
        except (subprocess.TimeoutExpired, zipfile.BadZipFile, OSError, ValueError, EOFError) as error:
            raise BrokenProcessError from error
