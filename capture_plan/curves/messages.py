"""Takes as lines of messages: names with numbers, as trackers send them over a network and as dumps keep them.

Pairs    jawOpen-34|eyeBlink_L-7|=head#-21.4,-6.0,...      iFacialMocap: whole per cents, `-` or `&`
         t=0.016, jawOpen=0.34, eyeBlinkLeft=0.07          any names with = or : and a number; a time may stand before
Blocks   {  jawOpen:0.34  eyeBlink_L:0.07  ... }           a pair in each line
OSC      /VMC/Ext/Blend/Val ,sf "jawOpen" 0.34             VMC; the name is the text, else the address's last part
         e3b0c442.0a3d70a4 /avatar/parameters/JawOpen f 0.34       with the time tag of OSC 1.0, seconds in base 16

Frame    a line of several pairs; else up to the message that says so (/VMC/Ext/Blend/Apply), or to a name that comes
         again
All become the lines of a table, one for each frame (`delimited.py`), with the time before them where there is one.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from capture_plan.curves.columns import kind_of
from capture_plan.curves.face_cap import USUAL
from capture_plan.curves.frames import evenly
from capture_plan.curves.json_weights import known
from capture_plan.curves.text import Lines
from capture_plan.formats.naming import listed

DELIMITER = "\t"
TIME = "time"
CUTS = tuple(re.compile(cut) for cut in (r"\|", r"[;\t]", r",", r"\s+"))
NUMBER = r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:e[-+]?\d+)?%?"
PAIR = re.compile(
    rf"(?P<lead>.*?[\s,;:|>\])}}\"'])??(?P<name>[^\W\d][\w .\-]*?)[\"']?\s*(?P<mark>[-&=:])\s*(?P<number>{NUMBER})",
    re.IGNORECASE,
)
PLACE = re.compile(r"=?(\w+)[#:=].*")  # =head#1,2,3 of iFacialMocap: a place and angles
CLOCK = re.compile(r"\d{4}-\d\d-\d\d[T ]\d+:\d\d:\d\d(?:[.,]\d+)?|\d+(?::\d\d){1,3}(?:[.;,]\d+)?|\d+(?:\.\d+)?")
WHOLE = re.compile(r"[-+]?\d+")
PERCENT_MARKS = "-&"
ADDRESS = re.compile(r"(?<![\w/.])/[A-Za-z]\w*(?:/[\w.\-]+)*")
TAG = re.compile(r"[0-9a-f]{8}\.[0-9a-f]{8}", re.IGNORECASE)
TYPES = re.compile(r",?[sifdhTFN]+")
ARGUMENT = re.compile(r"[\"']([^\"']*)[\"']|(?:STRING|FLOAT|[sifd]:)\(?([^\s,()]+)\)?|([^\s,()\[\]|]+)")
APPLY = re.compile(r".*/apply", re.IGNORECASE)
BRACKETS = "{}[](),; \t"
FACE_CAP = "/W"  # Face Cap sends a number for each of its names
SAMPLE, MOST = 60, 0.7  # lines looked at, and the share of them that has to be messages
FEWEST = 2  # known names


@dataclass
class _Frame:
    """Numbers by name, as text, of one frame; the number of its first line in the file."""

    number: int
    time: str = ""
    cells: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Message:
    """A name with its number in one line; `ends` where a frame ends with it."""

    number: int
    time: str
    name: str
    cell: str
    ends: bool = False


def message_values(lines: Lines) -> Lines:
    """The lines of a table of the frames that messages make; the lines themselves where they are no messages."""
    some = [lines.texts[t] for t in evenly(len(lines.texts), SAMPLE)]
    if sum(ADDRESS.search(text) is not None for text in some) >= MOST * len(some):
        return of_osc(lines)
    if cut := pairs_cut_by(some):
        return of_pairs(lines, cut)
    return lines


def pairs_cut_by(some: Sequence[str]) -> re.Pattern[str] | None:
    """What cuts the lines into pairs of a name that says something of a face and a number; None where nothing does."""
    some = [text for text in some if text.strip(BRACKETS)]
    best, found = 0, None
    for cut in CUTS:
        pairs = [pairs_in(text, cut) for text in some]
        names = Counter(match["name"] for line in pairs for match in line if known(match["name"]))
        full = sum(bool(line) for line in pairs) >= MOST * len(some)
        if full and len(names) >= FEWEST and names.total() > best:
            best, found = names.total(), cut
    return found


def _pieces(text: str, cut: re.Pattern[str]) -> list[str]:
    """What stands between the cuts of a line."""
    return [stripped for piece in cut.split(text) if (stripped := piece.strip("{}() \t\r\"'"))]


def pairs_in(text: str, cut: re.Pattern[str]) -> list[re.Match[str]]:
    """Pairs of a name and a number in a line; before the first one other text may stand."""
    found = [match for piece in _pieces(text, cut) if (match := PAIR.fullmatch(piece.rstrip(",;")))]
    return [match for i, match in enumerate(found) if i == 0 or not match["lead"]]


def of_pairs(lines: Lines, cut: re.Pattern[str]) -> Lines:
    """A table of the frames in lines of pairs; whole numbers behind `-` or `&` are per cents, as iFacialMocap sends."""
    found = [pairs_in(text, cut) for text in lines.texts]
    several = sum(len(line) > 1 for line in found) > len(found) / 2
    every = [match for line in found for match in line]
    percent = all(match["mark"] in PERCENT_MARKS and WHOLE.fullmatch(match["number"]) for match in every)
    messages = (
        Message(number, lead_of(text, line[0]), match["name"], cell_of(match, percent), several and match is line[-1])
        for text, number, line in zip(lines.texts, lines.numbers, found, strict=True)
        for match in line
    )
    return across(message_frames(messages), "are names with numbers", (*lines.notes, *not_pairs(lines, found, cut)))


def cell_of(match: re.Match[str], percent: bool) -> str:
    """The number of a pair as a cell, with a % where it is a weight in per cent."""
    return match["number"] + "%" * (percent and kind_of(match["name"]) is None)


def not_pairs(lines: Lines, found: Sequence[Sequence[re.Match[str]]], cut: re.Pattern[str]) -> tuple[str, ...]:
    """Sentences about places and angles between pairs, and about lines that hold no pair."""
    rest = [piece for text in lines.texts[:SAMPLE] for piece in _pieces(text, cut)
            if not PAIR.fullmatch(piece.rstrip(",;")) and not CLOCK.fullmatch(piece.strip("[]"))]  # fmt: skip
    other = {match[1] if (match := PLACE.fullmatch(piece)) else f"'{piece[:24]}'" for piece in rest}
    odd = [text for text, line in zip(lines.texts, found, strict=True) if not line and text.strip(BRACKETS)]
    notes = [f"{listed(sorted(other))} of its lines are no weights and are left out"] if other else []
    if odd:
        some = "1 line holds" if len(odd) == 1 else f"{len(odd):,} lines hold"
        notes.append(f"{some} no name with a number and {'is' if len(odd) == 1 else 'are'} left out ('{odd[0][:24]}')")
    return tuple(notes)


def lead_of(text: str, first: re.Match[str]) -> str:
    """The time before the pairs of a line; nothing where there is none."""
    start = re.search(rf"(?<!\w){re.escape(first['name'])}[\"']?\s*{re.escape(first['mark'])}", text)
    match = CLOCK.search(text[: start.start()]) if start else None
    return match[0] if match else ""


def of_osc(lines: Lines) -> Lines:
    """A table of the frames in a dump of OSC messages."""
    messages, other = [], dict[str, None]()
    for text, number in zip(lines.texts, lines.numbers, strict=True):
        message = osc_message(text, number)
        if message is None:
            other[match[0] if (match := ADDRESS.search(text)) else text.strip()[:40]] = None
        else:
            messages.append(message)
    listing = f"messages without one number are left out ({listed(other)})"
    return across(message_frames(messages), "are messages of OSC", (*lines.notes, *([listing] if other else [])))


def osc_message(text: str, number: int) -> Message | None:
    """A message of one number and at most one text, or one that ends a frame; None for others."""
    match = ADDRESS.search(text)
    if match is None:
        return None
    if APPLY.fullmatch(match[0]):
        return Message(number, "", "", "", ends=True)
    texts, numbers = arguments(text[match.end() :])
    clock = TAG.search(text[: match.start()]) or CLOCK.search(text[: match.start()])
    time = seconds(clock[0]) if clock else ""
    if (
        len(numbers) == 2
        and not texts
        and match[0].endswith(FACE_CAP)
        and len(numbers[0]) < 6
        and WHOLE.fullmatch(numbers[0])
    ):
        at = int(numbers[0])
        return Message(number, time, USUAL[at], numbers[1]) if 0 <= at < len(USUAL) else None
    if len(numbers) != 1 or len(texts) > 1:
        return None
    return Message(number, time, (texts or [match[0].rpartition("/")[2]])[0], numbers[0])


def arguments(rest: str) -> tuple[list[str], list[str]]:
    """Texts and numbers behind the address of a message, without the types that may stand before them."""
    found = [next(filter(None, groups), "") for groups in ARGUMENT.findall(rest.lstrip("\"'):, \t"))]
    if len(found) > 1 and TYPES.fullmatch(found[0]):
        found = found[1:]
    numbers = [word for word in found if re.fullmatch(NUMBER, word, re.IGNORECASE)]
    return [word for word in found if word and word not in numbers], numbers


def seconds(time: str) -> str:
    """A time tag of OSC, whole seconds and parts of 2^32 in base 16, as seconds; other times as they are."""
    if not TAG.fullmatch(time):
        return time
    whole, part = (int(digits, 16) for digits in time.split("."))
    return f"{whole + part / 2**32:.6f}"


def message_frames(messages: Iterable[Message]) -> list[_Frame]:
    """The frames that messages make: each ends where one says so, or where a name comes again."""
    frames: list[_Frame] = []
    now: _Frame | None = None
    for message in messages:
        if message.name:
            if now is None or message.name in now.cells:
                now = _Frame(message.number, message.time)
                frames.append(now)
            now.cells[message.name] = message.cell
        if message.ends:
            now = None
    return frames


def across(frames: Sequence[_Frame], what: str, notes: Sequence[str]) -> Lines:
    """A table with a line for each frame, below a line of all names."""
    names = list(dict.fromkeys(name for frame in frames for name in frame.cells))
    timed = any(frame.time for frame in frames) and not any(kind_of(name) in ("time", "code") for name in names)
    rows = [[frame.time] * timed + [frame.cells.get(name, "") for name in names] for frame in frames]
    message = f"its lines {what}: they make {len(frames):,} frames of {len(names):,} names"
    texts = [DELIMITER.join(cells) for cells in ([TIME] * timed + names, *rows)]
    numbers = [0, *(frame.number for frame in frames)]
    return Lines(tuple(texts), tuple(numbers), DELIMITER, (*notes, message))
