"""What a person means by a dot: its name in a layout ("M12", "H02"), or the whole number of a vertex in the rig's file.

A name is never read as a number, and what is neither is refused with what was found and what is expected.
"""

import re
from collections.abc import Iterable, Mapping

from capture_plan.errors import PlanError
from capture_plan.layout.record import Layout

SHOWN = 40  # letters of a word that is refused
LONGEST = 12  # digits of a vertex: no mesh has more
THOUSANDS = re.compile(r"\d{1,3}([,.]\d{3})+")  # one number with its thousands parted, or several numbers?


def dots_of(layout: Layout) -> dict[str, int]:
    """Vertex in the artist's file of every landmark and head marker, by name."""
    return {m.name: m.source_vertex for m in layout.markers}


def is_vertex(word: str) -> bool:
    """Whether it is the whole number of a vertex."""
    return len(word) <= LONGEST and word.isascii() and word.isdigit()


def vertices_of(words: Iterable[str], dots: Mapping[str, int], *, what: str, whose: str = "") -> tuple[int, ...]:
    """Vertices in the artist's file that are meant by names in `dots` or by numbers.

    `what` is asked at them ("pin"); `whose` names the plan of the dots, empty where there is none.

    Raises:
        PlanError: a word is neither.
    """
    return tuple(_vertex(word.strip(), dots, what, whose) for word in words)


def words_in(text: str) -> list[str]:
    """Names and numbers of a list that commas, semicolons or spaces part; a number such as 1,225 stays one word, which
    is none that is meant for sure."""
    parts = [part for part in re.split(r"[\s;]+|,(?=\s)", text) if part]
    return [word for part in parts for word in ([part] if THOUSANDS.fullmatch(part) else part.split(",")) if word]


def _vertex(word: str, dots: Mapping[str, int], what: str, whose: str) -> int:
    if word in dots:
        return dots[word]
    if is_vertex(word):
        return int(word)
    number = "the whole number of a vertex in the rig's file, such as 1225"
    if not dots:
        raise PlanError(f"{what}: '{word[:SHOWN]}' is not {number}, and there is no plan here whose dot it could be")
    names = list(dots)
    raise PlanError(f"{what}: '{word[:SHOWN]}' is neither a dot of {whose} ({names[0]} to {names[-1]}) nor {number}")
