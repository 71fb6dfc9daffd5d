"""Tables whose cells stand between spaces, and names that a table keeps behind #: both as other tables have them.

Spaces   one or more between cells, where no other delimiter stands in the rows; a comma is then a decimal sign
Names    "# time jawOpen ..." above rows of numbers, as NumPy and MATLAB write them
"""

import re
from collections import Counter
from collections.abc import Sequence

from capture_plan.curves.frames import evenly
from capture_plan.curves.json_weights import known
from capture_plan.curves.text import COMMA, Lines, numbers_in, split

DELIMITER = "\t"
OTHERS = re.compile(r"[;|\t]")
CELL = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?%?|\d+(?:[:;]\d+){1,3}(?:[.;,]\d+)?|nan", re.IGNORECASE)
SAMPLE, MOST = 200, 0.8
FEWEST = 2


def without_spaces(lines: Lines) -> Lines:
    """Lines with one tab between cells, where cells stand between spaces."""
    if lines.delimiter is not None or len(lines.texts) < FEWEST or not is_spaced(lines.texts[1:]):
        return lines
    texts = tuple(DELIMITER.join(between_spaces(text)) for text in lines.texts)
    comments = tuple(DELIMITER.join(between_spaces(text)) for text in lines.comments)
    return Lines(texts, lines.numbers, DELIMITER, lines.notes, comments)


def is_spaced(texts: Sequence[str]) -> bool:
    """Whether most rows are cut by spaces into equally many cells, at least half of them numbers."""
    rows = [texts[t] for t in evenly(len(texts), SAMPLE)]
    cut = [between_spaces(text) for text in rows if not OTHERS.search(text.strip()) and not between_commas(text)]
    good = Counter(
        len(cells)
        for cells in cut
        if 2 * sum(bool(CELL.fullmatch(cell) or COMMA.fullmatch(cell)) for cell in cells) >= len(cells)
        and not any(cell.endswith(",") for cell in cells)
    )
    width, often = max(good.items(), key=lambda item: item[1], default=(0, 0))
    return width >= FEWEST and often >= MOST * len(rows)


def between_commas(text: str) -> bool:
    """Whether commas cut a line into more numbers than spaces do: "0,30 fps,0.5,0.1"."""
    return numbers_in(split(text, ",")) > numbers_in(between_spaces(text))


def between_spaces(text: str) -> list[str]:
    """The cells of a line that stand between spaces."""
    return [cell for cell in split(text.strip(), " ") if cell] if '"' in text else text.split()


def with_names(lines: Lines, delimiters: Sequence[str]) -> Lines:
    """The lines below the names that a line with # holds, where the first line without one has numbers instead."""
    first = lines.texts[0] if lines.texts else ""
    for delimiter in delimiters:
        wide = len(split(first, delimiter))
        if wide < FEWEST or any(map(known, split(first, delimiter))):
            continue
        for comment in reversed(lines.comments):
            names = [name.strip() for name in split(comment.lstrip("#% \t"), delimiter)]
            if len(names) == wide and sum(map(known, names)) >= FEWEST:
                texts, numbers = (delimiter.join(names), *lines.texts), (0, *lines.numbers)
                return Lines(texts, numbers, lines.delimiter, lines.notes, lines.comments)
    return lines
