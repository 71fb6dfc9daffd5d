"""Faces side by side in the columns of one table: `face0_jawOpen` and `face1_jawOpen`, `A.jawOpen` and `B.jawOpen`.

Affix     what stands before or behind the same names in several columns and says nothing of a face itself: a side does
Two       affixes are of two faces, or of two versions of one, where their columns of the same names hold other numbers;
          the meshes of one face (`Head.jawOpen`, `Teeth.jawOpen`) hold the same
Ways      affixes that stand for opposite directions behind one name are no faces: chinRaise_u and chinRaise_d, pupil_x
          and pupil_y
Read      the face with the most numbers, of equals the first; the columns of the others are left out, and named
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from capture_plan.curves.columns import plain
from capture_plan.names.arkit import INTENSITY
from capture_plan.names.paired_sides import PAIRS
from capture_plan.names.recognise import SLIDER, recognise

ABOUT = re.compile(
    r"std|sd|stdev|stddev|dev|var|variance|vel|velocity|speed|acc|accel|acceleration|conf|confidence|prob|quality|err|"
    r"error|diff|delta|d|min|max|raw|unfiltered|prev|previous|old"
)  # what is no weight itself, or not the one that was meant
OPPOSITE = (
    ("u", "d"),
    ("up", "down"),
    ("upper", "lower"),
    ("in", "out"),
    ("top", "bottom"),
    ("x", "y"),
    ("y", "z"),
    *PAIRS,
)
LEAST = 2  # names that two affixes share
SHARED = 0.5  # of the names of the smaller one
MOST = 24  # affixes of one stem looked at: more are names with a common ending
MARK = r"_.:|/\-\s"
AFTER = re.compile(rf"(?<=[{MARK}\])])(?![{MARK}])|(?<=[a-z0-9])(?=[A-Z])|(?<=\d)(?=[A-Za-z])")
BEFORE = re.compile(rf"(?<![{MARK}])(?=[{MARK}\[(])|(?<=[a-z])(?=[A-Z0-9])")
Affix = tuple[str, str]  # before, behind
PLAIN: Affix = ("", "")


def other_columns(columns: Sequence[str], x: Float[np.ndarray, "t c"]) -> tuple[list[int], str]:
    """The columns of other faces than the one that is read, and a sentence that says so; none where there is one."""
    stems = _disjoint(stems_of(columns))
    faces = [
        affix for affix in stems if any(_apart(stems[affix], stems[other], x) for other in stems if other != affix)
    ]
    if len(faces) < 2:
        return [], ""
    common = set.intersection(*(set(stems[affix]) for affix in faces)) or set(stems[faces[0]])
    filled = np.isfinite(x).sum(axis=0)
    counts = {affix: sum(int(filled[c]) for stem, c in stems[affix].items() if stem in common) for affix in faces}
    mine = max(
        faces, key=lambda affix: (not is_about(affix), counts[affix], affix == PLAIN, -min(stems[affix].values()))
    )
    others = [affix for affix in faces if affix != mine]
    left = [c for c, name in enumerate(columns) if any(stands_in(name, c, affix, mine, stems) for affix in others)]
    return left, _sentence(columns, stems, mine, others, len(left))


def stands_in(name: str, c: int, affix: Affix, mine: Affix, stems: Mapping[Affix, Mapping[str, int]]) -> bool:
    """Whether column c is of another face by its affix; without one, by a name that is known without any."""
    if c in stems[mine].values() or has(name, mine):
        return False
    if affix != PLAIN:
        return has(name, affix)
    return c in stems[PLAIN].values() or (recognise(name) is not None and not any(has(name, other) for other in stems))


def _sentence(
    columns: Sequence[str], stems: Mapping[Affix, Mapping[str, int]], mine: Affix, others: Sequence[Affix], left: int
) -> str:
    """What has to be said of the columns of other faces."""
    stem = next(stem for stem in stems[mine] if all(stem in stems[affix] for affix in others[:1]))
    alike = ", ".join(f"'{columns[stems[affix][stem]]}'" for affix in (mine, *others) if stem in stems[affix])
    retained = f"'{columns[stems[mine][stem]]}'"
    return (
        f"its columns are of {1 + len(others)} faces, or versions of one ({alike}): only those like {retained} are "
        f"read, {left:,} of the others are left out; if they are sides of one, name them Left and Right"
    )


def stems_of(columns: Sequence[str]) -> dict[Affix, dict[str, int]]:
    """Columns by what stands around the same names: of affixes that share names and change none of their meaning."""
    by_stem: dict[str, dict[Affix, int]] = defaultdict(dict)
    for c, name in enumerate(columns):
        for affix, stem in cuts(name):
            by_stem[stem].setdefault(affix, c)
    ways = {affix for affixes in by_stem.values() for affix in directions(affixes)}
    found: dict[Affix, dict[str, int]] = defaultdict(dict)
    for stem, affixes in by_stem.items():
        if not 1 < len(affixes) <= MOST:
            continue
        for affix, c in affixes.items():
            if affix not in ways and says_the_same(columns[c], stem):
                found[affix][stem] = c
    return {affix: stems for affix, stems in found.items() if len(stems) >= LEAST}


def directions(affixes: Iterable[Affix]) -> set[Affix]:
    """The affixes of one name that stand for directions: those of which the opposite is there too."""
    ends = {plain(after): (before, after) for before, after in affixes if not before}
    return {ends[end] for pair in OPPOSITE if set(pair) <= set(ends) for end in pair}


def _disjoint(stems: Mapping[Affix, dict[str, int]]) -> dict[Affix, dict[str, int]]:
    """Of affixes that share columns (`face0` and `face0_`) the one of most columns, of equals the longest."""
    retained: dict[Affix, dict[str, int]] = {}
    taken: set[int] = set()
    for affix in sorted(stems, key=lambda affix: (-len(stems[affix]), -len("".join(affix)))):
        if taken.isdisjoint(stems[affix].values()):
            retained[affix] = stems[affix]
            taken.update(stems[affix].values())
    return retained


def cuts(name: str) -> Iterator[tuple[Affix, str]]:
    """(affix, stem) of all ways to cut something off a name at one end; the whole name first."""
    yield PLAIN, small(name)
    if INTENSITY.fullmatch(name) or SLIDER.fullmatch(name):
        return
    for at in {cut.start() for cut in AFTER.finditer(name)} - {0, len(name)}:
        yield (name[:at], ""), small(name[at:])
    for at in {cut.start() for cut in BEFORE.finditer(name)} - {0, len(name)}:
        yield ("", name[at:]), small(name[:at])


def small(stem: str) -> str:
    """A stem that begins with a small letter, so that JawOpen and jawOpen are one; AU12 stays."""
    return stem[:1].lower() + stem[1:] if stem[1:2].islower() else stem


def is_about(affix: Affix) -> bool:
    """Whether an affix is that of something about a weight: its speed, its spread, its raw value."""
    return any(ABOUT.fullmatch(plain(end)) for end in affix)


def has(name: str, affix: Affix) -> bool:
    """Whether a name stands in this affix."""
    before, behind = affix
    return affix != PLAIN and name.startswith(before) and name.endswith(behind)


@lru_cache(4096)
def says_the_same(name: str, stem: str) -> bool:
    """Whether a name says of a face what its stem says, and no more surely: what stands around it means nothing."""
    short, whole = recognise(stem), recognise(name)
    if short is None or whole is None:
        return short is not None
    return (whole.arkit, whole.side) == (short.arkit, short.side) and whole.confidence <= short.confidence


def _apart(mine: Mapping[str, int], other: Mapping[str, int], x: Float[np.ndarray, "t c"]) -> bool:
    """Whether two affixes share enough names, and the numbers of most of these differ."""
    shared = [stem for stem in mine if stem in other]
    if len(shared) < max(LEAST, SHARED * min(len(mine), len(other))):
        return False
    differ = [not np.array_equal(x[:, mine[stem]], x[:, other[stem]], equal_nan=True) for stem in shared]
    return 2 * sum(differ) > len(shared)
