"""Which recorded weight drives which blendshape, and why; what is left out, and why.

A column drives, of these, the first that the rig has
    1  what the user's name map says            [weights] "AU25_r" = "jawOpen"
    2  the blendshape of the same name
    3  the blendshape that means the same        EyeBlinkLeft -> eyeBlink_L, AU12 -> AU12L and AU12R
    4  both halves of what it moves undivided, or the undivided one together with the other half     cheekPuff_L
    5  the ARKit blendshapes nearest to it       AU12_r -> mouthSmileLeft, mouthSmileRight
A blendshape is driven by the best of these alone: what comes later for the same one is left out.
Parts      halves, quarters, upper and lower lip of one blendshape drive it by their mean, unless a whole one is there
Weights    w[t, k] = sum_c s[c, k] x[t, c] with the shares s; OpenFace's intensities, 0 to 5, have the share 1/5
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.names.name_map import NameMap
from capture_plan.names.recognise import INTENSITY, Recognised, recognise, recognise_all

INTENSITY_FULL = 5.0  # OpenFace: AU12_r runs from 0 to 5
QUADRANTS = ("UL", "UR", "DL", "DR")  # of MetaHuman lips
HOW = ("by your name map", "same name", "means the same", "half and whole", "nearest")
NO_FIT = len(HOW)
PART = 0.0  # stands for the share of a column that is a part of a movement: all parts of it get the same
EXACT = ("ARKit", "FACS", "MetaHuman", "VRM", "MB-Lab", "yours")  # no two names of these are one movement


@dataclass(frozen=True)
class Drive:
    """Column `column`, times `share`, drives `blendshape`; `how` is one of `HOW`."""

    column: str
    blendshape: str
    share: float
    how: str


@dataclass(frozen=True)
class WeightMapping:
    """`drives` in the columns' order; `left_out`: columns and why; `idle`: blendshapes that nothing drives."""

    drives: tuple[Drive, ...]
    left_out: tuple[tuple[str, str], ...]
    idle: tuple[str, ...]

    @property
    def columns(self) -> frozenset[str]:
        """The columns that drive something."""
        return frozenset(one.column for one in self.drives if one.share)

    def text(self) -> str:
        """The mapping as lines to read."""
        wide = max((len(one.column) for one in self.drives), default=0)
        high = max((len(one.blendshape) for one in self.drives), default=0)
        lines = [
            f"{one.column:<{wide}}  drives {one.blendshape:<{high}}  {one.how}"
            + ("" if one.share == 1 else f", times {one.share:.3g}")
            for one in self.drives
        ]
        lines += [f"{column} is left out: {why}" for column, why in self.left_out]
        if self.idle:
            lines.append(f"nothing drives {', '.join(self.idle)}")
        return "\n".join(lines) + "\n"


def map_weights(
    columns: Sequence[str],
    names: Sequence[str],
    *,
    mine: NameMap | None = None,
    skipped: Iterable[tuple[str, str]] = (),
    scale: float = 1.0,
    read_as: Mapping[str, str] | None = None,
    still: Collection[str] = (),
) -> WeightMapping:
    """Which of `columns` drives which of the blendshapes `names`; `skipped` were left out by the reader already.

    `scale` is what one unit of the columns is worth (0.01 where they are per cent), but for OpenFace's intensities.
    `read_as` are other names to read columns by, whose values say something else than their names. Columns that are
    `still` all through the take yield to others that fit as well: of a blink and a wink the one that happens counts.
    RigError when nothing fits.
    """
    offers = _offers(columns, names, mine, read_as or {})
    move = {(blendshape, rank) for column, blendshape, rank, _ in offers if column not in still}
    offers = [one for one in offers if one[0] not in still or one[2] == 0 or (one[1], one[2]) not in move]
    best: dict[str, int] = {}
    for _, blendshape, rank, _ in offers:
        best[blendshape] = min(rank, best.get(blendshape, NO_FIT))
    drives, beaten, taken = [], {}, first_columns(offers, best)
    parts = Counter(name for _, name, rank, share in offers if share == PART and rank == best[name])
    for column, blendshape, rank, share in offers:
        if rank > best[blendshape] or (rank > 0 and taken.get(blendshape, column) != column):
            beaten[column] = f"{blendshape} is driven by another column already"
            continue
        unit = 1 / INTENSITY_FULL if INTENSITY.fullmatch(column) else scale
        drives.append(Drive(column, blendshape, (share or 1 / parts[blendshape]) * unit, HOW[rank]))
    driving, driven = {drive.column for drive in drives}, {drive.blendshape for drive in drives}
    if not drives:
        raise RigError(
            f"none of the {len(columns)} weights ({', '.join(columns[:3])} ...) fits a blendshape of the rig "
            f"({', '.join(names[:3])} ...): write a name map"
        )
    left_out = [*skipped]
    left_out += [(column, beaten.get(column) or _why(column, mine)) for column in columns if column not in driving]
    return WeightMapping(tuple(drives), tuple(left_out), tuple(name for name in names if name not in driven))


def first_columns(offers: Sequence[tuple[str, str, int, float]], best: dict[str, int]) -> dict[str, str]:
    """The column that alone drives a blendshape where several could: the one that drives fewest others, then the first.

    Where all of them are parts of the movement, none is alone: their mean drives it.
    """
    targets = Counter(column for column, *_ in offers)
    taken: dict[str, str] = {}
    for column, blendshape, rank, share in sorted(offers, key=lambda offer: targets[offer[0]]):
        if rank == best[blendshape] and share != PART:
            taken.setdefault(blendshape, column)
    return taken


def drive(
    mapping: WeightMapping, columns: Sequence[str], names: Sequence[str], x: Float[np.ndarray, "t c"]
) -> Float[np.ndarray, "t k"]:
    """w[t, k] = sum_c s[c, k] x[t, c]."""
    s = np.zeros((len(columns), len(names)))
    for one in mapping.drives:
        s[columns.index(one.column), names.index(one.blendshape)] = one.share
    return x @ s


def _offers(
    columns: Sequence[str], names: Sequence[str], mine: NameMap | None, read_as: Mapping[str, str]
) -> list[tuple[str, str, int, float]]:
    """(column, blendshape, rank in HOW, share or PART) of everything that each column could drive by its first rank."""
    meant, means = recognise_all(columns, mine=mine), recognise_all(names, mine=mine)
    meant |= {column: recognise(name) for column, name in read_as.items()}
    offers = []
    for column in columns:
        known = meant[column]
        if mine is not None and column in mine.weights:
            for blendshape, share in mine.weights[column].items():
                if blendshape not in names:
                    raise RigError(f"the name map lets '{column}' drive '{blendshape}', which the rig does not have")
                offers.append((column, blendshape, 0, share))
        elif column in names:
            offers.append((column, column, 1, 1.0))
        elif known is not None:
            ranked = [(name, *_fit(known, other)) for name, other in means.items() if other is not None]
            ranked = _without_doubles(ranked, means)
            first = min((rank for _, rank, _ in ranked), default=NO_FIT)
            for name, rank, part in ranked:
                if rank == first < NO_FIT:
                    offers.append((column, name, rank, PART if part else 1.0))
    return offers


def _without_doubles(
    ranked: list[tuple[str, int, bool]], means: Mapping[str, Recognised | None]
) -> list[tuple[str, int, bool]]:
    """Of several blendshapes that only their words make one movement, the surest alone: a weight opens a mouth once."""
    surest: dict[tuple[str, ...], tuple[str, int, bool]] = {}
    for one in ranked:
        meaning = means[one[0]]
        if meaning is None or meaning.standard in EXACT or not meaning.arkit or one[1] == NO_FIT:
            surest[(one[0],)] = one
            continue
        key = ("nearest", meaning.part, *meaning.arkit)
        if key not in surest or _confidence(means[surest[key][0]]) < meaning.confidence:
            surest[key] = one
    return list(surest.values())


def _confidence(meaning: Recognised | None) -> float:
    return meaning.confidence if meaning else 0.0


def _fit(column: Recognised, blendshape: Recognised) -> tuple[int, bool]:
    """Rank in HOW with which a column drives a blendshape, and whether it is only a part of what does."""
    same = (column.standard, column.name) == (blendshape.standard, blendshape.name)
    if same and column.side == blendshape.side:
        return 2, False
    if same and column.standard == "FACS":
        halves = column.side is None or blendshape.side is None
        return (3 if halves else NO_FIT), blendshape.side is None
    if column.standard == blendshape.standard != "ARKit":
        return NO_FIT, False
    rank = 3 if column.standard == blendshape.standard else 4
    part = column.standard == "MetaHuman" and column.name[-2:] in QUADRANTS
    part = part or (bool(column.part) and not blendshape.part)
    if set(column.arkit) & set(blendshape.arkit):
        return rank, part or set(column.arkit) < set(blendshape.arkit)
    if any(half in (whole + "Left", whole + "Right") for half in column.arkit for whole in blendshape.arkit):
        return rank, True
    if any(half in (whole + "Left", whole + "Right") for whole in column.arkit for half in blendshape.arkit):
        return rank, False
    return NO_FIT, False


def _why(column: str, mine: NameMap | None) -> str:
    """Why a column drives nothing."""
    low = column.lower()
    if low in ("_neutral", "neutral"):
        return "it says how far the face is at rest"
    if mine is not None and column in mine.weights:
        return "your name map says so"
    if INTENSITY.fullmatch(column) and column.endswith("c"):
        return f"it says whether, {column[:-1]}r says how much"
    if low.startswith(("head", "pose_")):
        return "it moves the whole head, which is held still"
    if "eye" in low and low.endswith(("yaw", "pitch", "roll")):
        return "it turns an eyeball, whose blendshapes have weights of their own"
    known = recognise(column, mine=mine)
    return f"the rig has no blendshape for it: {known.words}" if known else "its name says nothing that is known here"
