"""Files that people write by hand: plain files of a bounded size, and TOML read in bounded time and memory."""

import difflib
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from capture_plan.errors import CapturePlanError

MOST_BYTES = 4_000_000  # a settings, rule, name or camera file has a few thousand
MOST_COUNTED = 1_000_000  # of anything that a setting counts: solvers have whole numbers of 64 bits
MOST_NUMBER = 2**31 - 1  # of a vertex
LONGEST_MM = 1000.0  # of any length on a face
DEEPEST = 16  # tables within tables; ours have three
WORD = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
TOO_DEEP = re.compile(rf"(?<![\w-]){WORD}(?:[ \t]*\.[ \t]*{WORD}){{{DEEPEST}}}|[\[{{](?:\s*[\[{{]){{{DEEPEST}}}")


def closest(name: str, names: Iterable[str]) -> str:
    """'; did you mean X?' where one of the names comes near, else nothing."""
    near = difflib.get_close_matches(name, list(names), n=1)
    return f"; did you mean '{near[0]}'?" if near else ""


def meant(path: Path) -> str:
    """What a path that is not there may have meant, among what lies beside it."""
    try:
        return closest(path.name, (other.name for other in path.parent.iterdir()))
    except OSError:
        return ""


def read_plain(path: Path, error: type[CapturePlanError], give: str, *, most: int = MOST_BYTES) -> bytes:
    """The content of a file.

    Raises:
        error: missing, no plain file (a folder, a device, a pipe), or of more than `most` bytes; ends in `give`.
    """
    try:
        if not path.exists():
            raise error(f"{path} does not exist{meant(path)}: {give}")
        if not path.is_file():
            raise error(f"{path} is a {'folder' if path.is_dir() else 'device'}, expected a file: {give}")
        if path.stat().st_size > most:
            raise error(f"{path} has {path.stat().st_size:,} bytes, expected at most {most:,}: {give}")
        return path.read_bytes()
    except OSError as reason:
        raise error(f"{path} cannot be read ({reason.strerror}): {give}") from None


def read_toml(path: Path, error: type[CapturePlanError], give: str) -> dict[str, Any]:
    """The document in a TOML file.

    Raises:
        error: it cannot be read, is no TOML, or nests deeper than anybody writes by hand; ends in `give`.
    """
    content = read_plain(path, error, give)
    try:
        text = content.decode("utf-8-sig")
        if TOO_DEEP.search(text):
            raise error(f"{path} is not TOML as a person writes it (more than {DEEPEST} levels): {give}")
        return tomllib.loads(text)
    except RecursionError:
        raise error(f"{path} is not TOML as a person writes it (too deep): {give}") from None
    except ValueError as reason:  # TOMLDecodeError, UnicodeDecodeError, and a number of thousands of digits
        raise error(f"{path} is not TOML ({reason}): {give}") from None
