"""The words of a name, in any script: at separators and capitals, and inside runs that are known words end to end.

split_words("head__eyeBlink_L")   head eye blink l
split_words("mouthopen")          mouth open
split_words("browser")            browser
split_words("左目を閉じる")         左 目 を 閉じる
split_words("ｳｨﾝｸ２右")             ウィンク 2 右
"""

import re
import tomllib
import unicodedata
from functools import cache, lru_cache
from importlib.resources import files

from capture_plan.names.arkit import Side, subjects_own

MARKS = "\u0591-\u05c7\u0610-\u061a\u064b-\u065f\u0670\u0900-\u0903\u093a-\u094f\u0e31\u0e34-\u0e3a\u0e47-\u0e4e"
PIECE = re.compile(
    r"CTRL|PHM|JCM|[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+"
    rf"|[^\W\d_A-Za-z](?:[^\W\d_A-Za-z]|[{MARKS}])*"  # letters of other scripts with their vowel signs
    r"|[^\s\w.:|/,;()\[\]{}!?。、・-]"
)
DATA = files("capture_plan.names").joinpath("data", "movements.toml")
SHORT = ("up",)  # two letters that may close a run: "browup"
LEAST = 3  # letters of a known word inside a run of Latin letters


@lru_cache(maxsize=8192)
def split_words(name: str) -> tuple[str, ...]:
    """Words of `name` in small letters, numbers among them; half-width, full-width and accented forms are folded."""
    folded = "".join(_plain(letter) for letter in unicodedata.normalize("NFKC", subjects_own(name)))
    return tuple(word for piece in PIECE.findall(folded) for word in _split(piece.lower()))


def _plain(letter: str) -> str:
    """A Latin letter without its accent; any other as it is."""
    base = unicodedata.normalize("NFD", letter)[0]
    return base if base.isascii() else letter


def _split(piece: str) -> tuple[str, ...]:
    """A run as the fewest known words that make it up end to end; the run itself where none do."""
    if piece.isdigit() or piece in _known():
        return (piece,)
    best: list[tuple[str, ...] | None] = [(), *[None] * len(piece)]
    for end in range(1, len(piece) + 1):
        ways = [
            (*before, piece[start:end])
            for start in range(end)
            if (before := best[start]) is not None and _is_word(piece[start:end], start, end == len(piece))
        ]
        best[end] = min(ways, key=len, default=None)
    return best[-1] or (piece,)


def _is_word(part: str, start: int, last: bool) -> bool:
    if part not in _known():
        return False
    return not part.isascii() or len(part) >= LEAST or (part in SHORT and last and start > 0)


@cache
def _known() -> frozenset[str]:
    """Every word of the tables that may stand inside a run."""
    data = tomllib.loads(DATA.read_text(encoding="utf-8"))
    tables = (data["words"], data["sides"], data["filler"], data["syllables"])
    words = {word for table in tables for words in table.values() for word in words}
    return frozenset(words | set(data["mmd"]))


@cache
def side_words() -> dict[str, Side]:
    """Words for left and right."""
    sides = tomllib.loads(DATA.read_text(encoding="utf-8"))["sides"]
    return {word: side for side, words in sides.items() for word in words}
