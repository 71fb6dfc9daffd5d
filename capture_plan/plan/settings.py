"""Everything a person can decide about a plan, with what we would decide for them."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

Share = Annotated[float, Meta(ge=0, le=1)]
Millimetres = Annotated[float, Meta(ge=0)]


class Settings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Lengths in millimetres, shares from 0 to 1.

    `method`: `studio` is adaptive multi-cover repaired to full rank and to the error of a 68-point layout; `adaptive`
    is Algorithm 1 of Zell & McDonnell 2022; `cover` is their single set cover. `weights`: fewest landmarks first and
    then the best places (`lexicographic`), the paper's own sum (`paper`), or the number alone (`count`).
    `expressions`: `minimum` is the provably shortest list, `sequential` the method of Carrigan et al. 2020.
    """

    method: Literal["studio", "adaptive", "cover"] = "studio"
    weights: Literal["lexicographic", "paper", "count"] = "lexicographic"
    epsilon: Annotated[float, Meta(gt=0, le=1)] = 0.5
    alpha: Share = 0.5
    symmetric: bool = True
    spacing_mm: Millimetres = 8.0
    rounds: Annotated[int, Meta(ge=1)] = 3
    noise_mm: Annotated[float, Meta(gt=0)] = 0.2
    min_visibility: Share = 0.15
    cameras: str | None = None
    expressions: Literal["minimum", "sequential"] = "minimum"
    mu: Annotated[float, Meta(gt=0, le=1)] = 0.3
    paired: bool = True
    distortion: Share = 0.5
    uniqueness: Share = 0.0
    target_neutral: str | None = None
    max_expressions: Annotated[int, Meta(ge=1)] | None = None
