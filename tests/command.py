"""The command line inside this process: what a shell would see, without the seconds that a new interpreter takes."""

import io
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

from capture_plan.cli import main


def run(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """`capture-plan` with these arguments in a folder; its exit code, standard output and standard error."""
    said, wrong = io.StringIO(), io.StringIO()
    given = ["capture-plan", *map(str, arguments)]
    with chdir(cwd), patch.object(sys, "argv", given), redirect_stdout(said), redirect_stderr(wrong):
        try:
            main()
        except SystemExit as end:
            return subprocess.CompletedProcess(given, int(end.code or 0), said.getvalue(), wrong.getvalue())
    raise AssertionError("the command did not say how it ended")
