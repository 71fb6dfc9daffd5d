"""Files that people write by hand: plain files of a bounded size, and TOML read in bounded time and memory."""

import re
import tomllib
from pathlib import Path
from typing import Any

from capture_plan.errors import CapturePlanError

MOST_BYTES = 4_000_000  # a settings, rule, name or camera file has a few thousand
DEEPEST = 16  # tables within tables; ours have three
WORD = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
TOO_DEEP = re.compile(rf"(?<![\w-]){WORD}(?:[ \t]*\.[ \t]*{WORD}){{{DEEPEST}}}|[\[{{](?:\s*[\[{{]){{{DEEPEST}}}")


def read_plain(path: Path, error: type[CapturePlanError], give: str, *, most: int = MOST_BYTES) -> bytes:
    """The content of a file.

    Raises:
        error: missing, no plain file (a folder, a device, a pipe), or of more than `most` bytes; ends in `give`.
    """
    try:
        if path.exists() and not path.is_file():
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
