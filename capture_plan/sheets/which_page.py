"""Which page shows which marker: each marker once, in the view in which it is seen best, on as few pages as that takes.

Data     a[w, n]  angle between the skin's normal at marker n and the direction of view w, degrees; seen[w, n]
Views    front, both three-quarters, both profiles, chin up; twins go together. A profile, or the view of a raised
         chin, is open only to markers that front and three-quarters show at more than STEEP degrees
Cost     PAGE for each page that shows anything, and for each marker max(a - STEEP, 0) / 5 + (a / STEEP)^2 in its view;
         UNSEEN for one that a set of views does not show though another would
Answer   the cheapest of the 8 sets of views with the front, which everybody takes up first; a marker in its set's view
         of the largest cosine, the front's raised by FRONT_BONUS, since hands and eyes come back to that page
"""

from collections.abc import Sequence
from itertools import chain, combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.sheets.view import CHIN_UP, FRONT, LEFT, LEFT_PROFILE, RIGHT, RIGHT_PROFILE

VIEWS = (FRONT, RIGHT, LEFT, RIGHT_PROFILE, LEFT_PROFILE, CHIN_UP)
TWINS = ((0,), (1, 2), (3, 4), (5,))  # indices into VIEWS
NARROW = (3, 4, 5)  # open to what the others show badly
STEEP, PAGE, UNSEEN, FRONT_BONUS = 45.0, 2.0, 50.0, 0.08
NOWHERE = -1


def page_of_each(normals: Float[np.ndarray, "n 3"], seen: Bool[np.ndarray, "w n"]) -> Int[np.ndarray, " n"]:
    """The view of each marker, an index into `VIEWS`, or NOWHERE. `normals` are those of the skin at the markers."""
    cosine = np.stack([view.project(normals)[:, 2] for view in VIEWS])
    usual = np.where(seen & ~np.isin(np.arange(len(VIEWS)), NARROW)[:, None], cosine, -1).max(axis=0)
    open_ = seen.copy()
    open_[list(NARROW)] &= usual < np.cos(np.radians(STEEP))
    answers = [_of_set(list(chain.from_iterable(some)), cosine, open_) for some in _sets(TWINS[1:])]
    return min(answers, key=lambda answer: answer[0])[1]


def _sets(groups: Sequence[tuple[int, ...]]) -> list[tuple[tuple[int, ...], ...]]:
    """Every set of groups, each with the front."""
    return [(TWINS[0], *some) for size in range(len(groups) + 1) for some in combinations(groups, size)]


def _of_set(
    views: list[int], cosine: Float[np.ndarray, "w n"], open_: Bool[np.ndarray, "w n"]
) -> tuple[float, Int[np.ndarray, " n"]]:
    """What a set of views costs, and the view of each marker."""
    bonus = np.where(np.array(views) == 0, FRONT_BONUS, 0)[:, None]
    ranked = np.where(open_[views], cosine[views] + bonus, -np.inf)
    best = np.array(views)[ranked.argmax(axis=0)]
    found = np.isfinite(ranked.max(axis=0))
    angle = np.degrees(np.arccos(np.clip(cosine[best, np.arange(len(best))], -1, 1)))[found]
    lost = open_.any(axis=0) & ~found
    cost = PAGE * len(np.unique(best[found])) + UNSEEN * int(lost.sum())
    cost += float((np.maximum(angle - STEEP, 0) / 5 + (angle / STEEP) ** 2).sum())
    return cost, np.where(found, best, NOWHERE)
