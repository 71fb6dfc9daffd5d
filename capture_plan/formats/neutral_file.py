"""Which file of a folder is the neutral, when every blendshape has a file of its own.

Names     plainest[a]: how many words stand beside the one that means a neutral, then how good that word is; without
          such a word, a name that says only "head" or "0" and no movement
Middle    m[a] = mean over the other shapes j of |x_a - x_j|, the least for the neutral
Unmoved   s[a] = mean share of vertices that lie in another shape where they lie in a, the most for the neutral: of
          two blendshapes the vertices of both differ

One file with a word for a neutral is it. Of several, names and shapes are asked, and the note says which was taken; no
file is taken when the names mean one and the shapes clearly another, or when neither tells.

Letters: a candidates, j shapes, v vertices.
"""

import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.input.source import Source
from capture_plan.names.recognise import recognise

SURE_WORDS = (  # the best first
    *("neutral", "base", "basis", "rest", "default", "mean", "template", "reference"),
    *("average", "neutre", "neutro", "neutrale", "нейтральное", "無表情", "ニュートラル", "中性", "무표정"),
)
NEUTRAL_WORDS = (  # the others may also be expressions
    *SURE_WORDS,
    *("relaxed", "resting", "expressionless", "bind", "bindpose", "idle", "natural", "calm", "blank", "unposed"),
    *("undeformed", "neutra", "repos", "relax", "reposo", "ruhe", "нейтраль", "真顔", "基準", "中立", "自然", "기본"),
)
AROUND = "pose|mesh|face|head|shape|expression|model|position"  # in one word with these: neutralpose, basemesh
PLAIN = re.compile(rf"(?:{AROUND}|obj|mat|mouth|lips|the|my)s?")  # says nothing of what a face does
ASKED, VERTICES = 60, 500  # files and vertices that are compared: spread evenly
SAME = 1e-5  # of the size: as near, a vertex has not moved (text of five digits)
NEARER, MORE = 0.95, 0.03  # how much less the middle's distance, and how much more unmoved, is clear
FEW, WHOLE = 3, 0.999  # files that share a vertex's usual place, and the share of vertices that lie in theirs
ALIKE = 1e-6  # of the size: so near, two files hold one shape


@dataclass(frozen=True, eq=False)
class Likeness:
    """How two candidates or more lie among the shapes: mean distance to them, shares of vertices unmoved and common."""

    middle: Float[np.ndarray, " a"]
    unmoved: Float[np.ndarray, " a"]
    common: Float[np.ndarray, " a"]
    same: bool = False

    def clear(self) -> int | None:
        """The candidate that both signs prefer and one of them clearly; None where they do not agree on one."""
        best = int(np.argmin(self.middle))
        rest = np.arange(len(self.middle)) != best
        if self.same or (self.unmoved[rest] > self.unmoved[best]).any():
            return None
        nearer = self.middle[best] < NEARER * self.middle[rest].min()
        return best if nearer or self.unmoved[best] > self.unmoved[rest].max() + MORE else None


def find_neutral(
    folder: Source, paths: Sequence[Source], read_vertices: Callable[[Source], Float[np.ndarray, "v 3"]]
) -> tuple[Source, str]:
    """The neutral's file, and a sentence where more than its name decided. RigError where the signs disagree."""
    said = {path: words(path.stem) for path in paths}
    common = set.intersection(*map(set, said.values())) if len(paths) > 2 else set()
    named = [path for path in paths if plainness(said[path], common) is not None]
    if len(named) == 1:
        return named[0], sure_of(named[0], set(said[named[0]]) - common, paths, read_vertices)
    if not named:
        return by_shape(folder, paths, said, common, read_vertices)
    return _of_several(folder, named, [plainness(said[path], common) or (0, 0) for path in named],
                      _compare(named, paths, read_vertices))  # fmt: skip


def sure_of(
    path: Source, said: set[str], paths: Sequence[Source], read_vertices: Callable[[Source], Float[np.ndarray, "v 3"]]
) -> str:
    """A sentence where the only word for a neutral may be an expression's. RigError where shapes speak against it."""
    if said & set(SURE_WORDS):
        return ""
    likeness = _compare(paths, paths, read_vertices) if len(paths) > 2 else None
    best = likeness.clear() if likeness else None
    if best is not None and paths[best] != path:
        raise RigError(
            f"{path.name} may be the neutral by its name, but the other shapes are small changes of "
            f"{paths[best].name}: rename the right one to neutral{path.suffix.lower()}"
        )
    return f"no file is called neutral: {path.name} was taken"


def _of_several(
    folder: Source, named: Sequence[Source], rank: Sequence[tuple[int, int]], likeness: Likeness | None
) -> tuple[Source, str]:
    """The neutral among files that are called so, by names and shapes. RigError where these don't tell or disagree."""
    names = f"{len(named)} files could be the neutral, {' and '.join(path.name for path in named[:3])}"
    advice = f"rename the right one to neutral{named[0].suffix.lower()}"
    plainest = min(range(len(named)), key=rank.__getitem__)
    by_name = plainest if rank.count(rank[plainest]) == 1 else None
    by_motion = likeness.clear() if likeness else None
    agree = by_motion in (None, by_name)
    if named[plainest].stem.lower() == "neutral":  # what the sentences below ask for
        other = (
            ""
            if agree or by_motion is None
            else f", although the others are smaller changes of {named[by_motion].name}"
        )
        return named[plainest], f"{names}: {named[plainest].name} was taken{other}"
    if by_name is not None and by_motion is not None and not agree:
        raise RigError(
            f"{folder.name}: {names}: {named[by_name].name} has the plainer name, but the other shapes are small "
            f"changes of {named[by_motion].name}: {advice}"
        )
    if by_name is None and by_motion is None and not (likeness and likeness.same):
        raise RigError(f"{folder.name}: {names}, and neither names nor shapes tell which: {advice}")
    chosen = next((c for c in (by_name, by_motion) if c is not None), plainest)
    signs = ["its name is the plainest"] * (by_name is not None)
    signs += ["the other shapes are small changes of it"] * (by_motion is not None)
    message = " and ".join(signs) or "they hold the same shape"
    return named[chosen], f"{names}: {named[chosen].name} was taken, {message}"


def by_shape(
    folder: Source,
    paths: Sequence[Source],
    said: dict[Source, list[str]],
    common: set[str],
    read_vertices: Callable[[Source], Float[np.ndarray, "v 3"]],
) -> tuple[Source, str]:
    """The neutral among files of which none is called so: in the middle by its shape, and without a movement by name.

    RigError where that is no file.
    """
    kind = paths[0].suffix.lower()
    likeness = _compare(paths, paths, read_vertices) if len(paths) > 2 else None
    best = likeness.clear() if likeness else None
    advice = (
        f"{folder.name}: none of {len(paths)} {kind[1:].upper()} files is called neutral, base, basis, rest, default, "
        f"template or reference: rename the neutral to neutral{kind}"
    )
    if best is None:
        raise RigError(advice)
    path = paths[best]
    own = [word for word in said[path] if word not in common and not PLAIN.fullmatch(word)]
    first = not own and path == paths[0] and bool(re.search(r"\d", path.stem))  # paths are in the order of numbers
    whole = likeness is not None and likeness.common[best] >= WHOLE
    if not (whole or first) or (own and recognise(path.stem)):
        raise RigError(advice)
    signs = "its number is the first and " * (first and not whole) + "the other shapes are small changes of it"
    return path, f"no file is called neutral: {path.name} was taken, {signs}"


def plainness(said: Sequence[str], common: set[str]) -> tuple[int, int] | None:
    """How many words stand beside the one that means a neutral, and the rank of that one; None without one.

    A word that stands in every file's name says nothing.
    """
    own = [word for word in said if word not in common]
    ranks = [NEUTRAL_WORDS.index(word) for word in own if word in NEUTRAL_WORDS]
    if not ranks:
        return None
    return sum(not (word in NEUTRAL_WORDS or PLAIN.fullmatch(word)) for word in own), min(ranks)


def words(stem: str) -> list[str]:
    """generic_neutral_mesh -> generic, neutral, mesh; headBase01 -> head, base; neutralpose -> neutral."""
    stem = unicodedata.normalize("NFC", stem)
    found = [word.lower() for word in re.findall(r"[A-Z]?[^\W\d_A-Z]+|[A-Z]+", stem)]
    joined = re.compile(rf"(?:{AROUND})?({'|'.join(NEUTRAL_WORDS)})(?:{AROUND})?")
    return [match[1] if (match := joined.fullmatch(word)) else word for word in found]


def _compare(
    candidates: Sequence[Source],
    paths: Sequence[Source],
    read_vertices: Callable[[Source], Float[np.ndarray, "v 3"]],
) -> Likeness | None:
    """How the candidates lie among the shapes; None where they cannot be compared. Other meshes don't count."""
    shapes: dict[Source, Float[np.ndarray, "v 3"]] = {}
    asked = paths[:: max(1, len(paths) // ASKED)]
    for path in dict.fromkeys((*candidates, *asked)):
        try:
            x = read_vertices(path)
        except RigError:
            continue
        if np.isfinite(x).all():
            shapes[path] = x
    if any(path not in shapes for path in candidates):
        return None
    count = len(shapes[candidates[0]])
    if any(len(shapes[path]) != count for path in candidates):
        return None
    some = np.unique(np.linspace(0, count - 1, VERTICES).astype(int))
    x = {path: shape[some] for path, shape in shapes.items() if len(shape) == count}
    size = float(np.ptp(shapes[candidates[0]], axis=0).max()) or 1.0
    others = [path for path in asked if path in x and path not in candidates] or [path for path in asked if path in x]
    apart = np.array([[distances(x[a], x[j]) for j in others] for a in candidates]) / size
    away = np.array([[a is not j for j in others] for a in candidates])
    between = max(np.abs(x[a] - x[candidates[0]]).max() for a in candidates) / size
    here = (apart < SAME).sum(axis=1)
    usual = here.max(axis=0)
    shared = usual >= FEW
    return Likeness(
        np.array([row[own].mean() for row, own in zip(apart, away, strict=True)]),
        np.array([(row[own] < SAME).mean() for row, own in zip(apart, away, strict=True)]),
        (here == usual)[:, shared].mean(axis=1) if 2 * shared.sum() > len(shared) else np.zeros(len(candidates)),
        same=bool(between < ALIKE),
    )


def distances(x: Float[np.ndarray, "v 3"], y: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, " v"]:
    """How far each vertex lies apart."""
    return np.linalg.norm(x - y, axis=1)
