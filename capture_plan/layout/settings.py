"""What a person can decide about landmarks, with what we would decide for them."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

Share = Annotated[float, Meta(ge=0, le=1)]


class LayoutSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Lengths in millimetres, shares from 0 to 1.

    `method`: `studio` is adaptive multi-cover repaired to full rank and to the error of a 68-point layout (where the
    rig has no face to lay 68 points on, to an error of `noise_mm`); `adaptive`
    is Algorithm 1 of Zell & McDonnell 2022; `cover` is their single set cover; `budget` has the least predicted error
    that `budget` landmarks buy. `weights`: fewest landmarks first and
    then the best places (`lexicographic`), the paper's own sum (`paper`), or the number alone (`count`).
    `epsilon`: a vertex can stand for a blendshape that moves it by this share of the blendshape's largest movement;
    0.3 to 0.7 is the working range. `alpha`: weight of visibility against displacement. `rounds`: landmarks that a
    blendshape gets at most from the multi-cover. `spacing_mm`: least distance along the skin between landmarks.
    `noise_mm`: standard deviation of a measured landmark coordinate, for the predicted error.
    `min_visibility`: vertices that are seen from less than this share of their hemisphere are no candidates; 0 leaves
    visibility out.
    """

    method: Literal["studio", "adaptive", "cover", "budget"] = "studio"
    weights: Literal["lexicographic", "paper", "count"] = "lexicographic"
    epsilon: Annotated[float, Meta(gt=0, le=1)] = 0.5
    alpha: Share = 0.5
    symmetric: bool = True
    spacing_mm: Annotated[float, Meta(ge=0)] = 8.0
    rounds: Annotated[int, Meta(ge=1)] = 3
    noise_mm: Annotated[float, Meta(gt=0)] = 0.2
    min_visibility: Share = 0.05
    budget: Annotated[int, Meta(ge=1)] | None = None

    def __post_init__(self) -> None:
        if self.method == "budget" and self.budget is None:
            raise ValueError("method 'budget' needs a budget: the number of landmarks")
