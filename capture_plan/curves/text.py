"""The text of a file whatever its encoding, in lines, without what is no data.

Packed     gzip files are unpacked
Encoding   by its mark (UTF-8, UTF-16, UTF-32); without one, UTF-16 where every other byte is 0, else UTF-8, else the
           Windows code page 932 where it reads as Japanese, or 1252, which is said
Lines      ended as on any system; "sep=;" and lines that begin with # are left out, the first is remembered
"""

import codecs
import csv
import gzip
import io
import math
import re
import zlib
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from capture_plan.errors import RigError
from capture_plan.input.bounds import MOST_TAKE_BYTES, content

MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
SAMPLE_BYTES = 4096
MOST_COMMENTS = 50
MOSTLY = 0.8  # of the signs
NOTHING = ("", "nan", "null", "none", "n/a", "na", "-")  # in a cell
COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)(e[+-]?\d+)?", re.IGNORECASE)
SEPARATOR = re.compile(r'"?sep=(.)"?[,;\t]*', re.IGNORECASE)


@dataclass(frozen=True)
class Lines:
    """Lines that hold something, each with its number in the file counted from 1; the delimiter that `sep=` tells.

    `comments` are the first lines that begin with #.
    """

    texts: tuple[str, ...]
    numbers: Sequence[int]
    delimiter: str | None
    notes: tuple[str, ...]
    comments: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class TextTable:
    """Rows of text below a line of names. `numbers`: their lines in the file; `percent`: cells carry a %; `stated`: the
    full weight that cells or units state; `fps`: the frame rate that lines above the names tell."""

    names: tuple[str, ...]
    rows: tuple[str, ...]
    numbers: Sequence[int]
    delimiter: str
    comma: bool = False
    percent: bool = False
    stated: float | None = None
    notes: tuple[str, ...] = ()
    fps: float | None = None

    def cells(self, row: str) -> list[str]:
        """The fields of one row, as many as there are names or more."""
        fields = split(row, self.delimiter)
        while len(fields) > len(self.names) and not fields[-1].strip():
            fields.pop()
        return fields

    def column(self, c: int) -> list[str]:
        """All cells of one column, without quotes, empty where a row is too short."""
        cut = [split(row, self.delimiter) if '"' in row else row.split(self.delimiter, c + 1) for row in self.rows]
        return [fields[c] if len(fields) > c else "" for fields in cut]

    def at(self, chosen: Sequence[int]) -> "TextTable":
        """The table with these of its rows alone."""
        rows, numbers = tuple(self.rows[t] for t in chosen), tuple(self.numbers[t] for t in chosen)
        return replace(self, rows=rows, numbers=numbers)


def text_of(path: Path) -> tuple[str, tuple[str, ...]]:
    """The file's text, at most `MOST_TAKE_BYTES` of it, and what has to be said of its encoding."""
    data = _unpacked(content(path, MOST_TAKE_BYTES))
    if data.startswith(b"PK\x03\x04"):
        raise RigError("is a zip archive or a workbook, no text: save the sheet as CSV, or name the archive .zip")
    try:
        return data.decode(encoding_of(data)), ()
    except UnicodeDecodeError as error:
        if 0 in data[:SAMPLE_BYTES]:
            raise RigError("is not text: export the take again") from error
        page = 932 if is_japanese(data) else 1252
        message = f"it is not UTF-8: its text is read as Windows code page {page}"
        return data.decode(f"cp{page}", errors="replace"), (f"{message}{', Japanese' if page == 932 else ''}",)


def is_japanese(content: bytes) -> bool:
    """Whether a text that is not UTF-8 reads as code page 932, and hardly any of it as western letters with accents.

    Kana and common kanji begin with bytes of 0x81 to 0x9f, which code page 1252 has for signs alone.
    """
    try:
        signs = [sign for sign in content.decode("cp932") if ord(sign) > 0x7F]
    except UnicodeDecodeError:
        return False
    return sum(0x81 <= sign.encode("cp932")[0] <= 0x9F for sign in signs) > MOSTLY * len(signs)


def _unpacked(data: bytes) -> bytes:
    """What a gzip file holds; other datas as they are. RigError where it is damaged or holds too much."""
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        with gzip.open(io.BytesIO(data)) as file:
            text = file.read(MOST_TAKE_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise RigError("is no whole gzip file: copy it again, or unpack it") from error
    if len(text) > MOST_TAKE_BYTES:
        raise RigError(f"unpacks to more than {MOST_TAKE_BYTES / 1e6:,.0f} MB: cut the take")
    return text


def encoding_of(content: bytes) -> str:
    """The encoding that the first bytes tell."""
    for mark, name in MARKS.items():
        if content.startswith(mark):
            return name
    start = content[: SAMPLE_BYTES - SAMPLE_BYTES % 2]
    even, odd = start[0::2].count(0), start[1::2].count(0)
    if max(even, odd) > 0.4 * len(start) / 2:
        return "utf-16-le" if odd > even else "utf-16-be"
    return "utf-8"


def lines_of(text: str, notes: tuple[str, ...] = ()) -> Lines:
    """The lines of a text that hold something."""
    if "\r" in text:
        text = re.sub(r"\r\r?\n?", "\n", text)  # some write \r\r\n
    text = text.replace("\N{MINUS SIGN}", "-")  # what spreadsheets write in Sweden and Norway
    texts, numbers, comments, delimiter = [], array("q"), [], None
    for number, line in enumerate(text.split("\n"), start=1):
        if not line or line.isspace():
            continue
        if line.lstrip().startswith("#"):
            comments += [line] if len(comments) < MOST_COMMENTS else []
            continue
        if delimiter is None and not texts and (match := SEPARATOR.fullmatch(line.strip(" "))):
            delimiter = match[1]
            continue
        texts.append(line)
        numbers.append(number)
    return Lines(tuple(texts), numbers, delimiter, notes, tuple(comments))


def split(line: str, delimiter: str) -> list[str]:
    """Fields of a line, quoted or not."""
    if '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    except (csv.Error, StopIteration):
        return line.split(delimiter)


def to_number(cell: str) -> float:
    """The number in a cell, with a full stop or a comma; NaN where there is none."""
    text = cell.strip().strip("\"'").removesuffix("%").strip()
    try:
        return float(text)
    except ValueError:
        return float(text.replace(",", ".")) if COMMA.fullmatch(text) else float("nan")


def of_one_delimiter(lines: Lines, first: int, delimiter: str, others: Sequence[str]) -> Lines:
    """The lines with one delimiter, and a note: rows below line `first` that another one cuts into as many cells as
    there are names, more of them numbers, are joined anew; decimal commas become points."""
    whole = lines.texts[first].count(delimiter)
    texts, message = list(lines.texts), dict.fromkeys(others, 0)
    for t in range(first + 1, len(texts)):
        ways = [other for other in others if other != delimiter and texts[t].count(other) == whole]
        best = max((delimiter, *ways), key=lambda way: numbers_in(split(texts[t], way))) if ways else delimiter
        if best != delimiter:
            texts[t] = delimiter.join(plain_cell(cell, delimiter) for cell in split(texts[t], best))
            message[best] += 1
    notes = [
        f"{n:,} of {len(texts) - first - 1:,} rows are cut by {_spelled(other)}, not by {_spelled(delimiter)} as "
        "the names are: they are read as the others"
        for other, n in message.items()
        if n
    ]
    return replace(lines, texts=tuple(texts), notes=(*lines.notes, *notes)) if notes else lines


def numbers_in(cells: Sequence[str]) -> int:
    """How many of these cells are numbers."""
    return sum(not math.isnan(to_number(cell)) for cell in cells)


def plain_cell(cell: str, delimiter: str) -> str:
    """A cell as it can stand between these delimiters."""
    if delimiter not in cell:
        return cell
    return cell.replace(",", ".") if COMMA.fullmatch(cell.strip()) else f'"{cell}"'


def _spelled(delimiter: str) -> str:
    """A delimiter as it is called."""
    return "a tab" if delimiter == "\t" else f"'{delimiter}'"
