"""What a person can decide about landmarks, with what we would decide for them."""

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from capture_plan.anatomy.zones import CLEAR_ZONES, DOT_MM, MARGINS_MM
from capture_plan.audit.bare import LEAST_SEEN, STANDS_FOR
from capture_plan.errors import SettingsError
from capture_plan.input.documents import LONGEST_MM, MOST_COUNTED, MOST_NUMBER
from capture_plan.registration.known import Known

Share = Annotated[float, Meta(ge=0, le=1)]
Length = Annotated[float, Meta(ge=0, le=LONGEST_MM)]
Count = Annotated[int, Meta(ge=0, le=MOST_COUNTED)]
Some = Annotated[int, Meta(ge=1, le=MOST_COUNTED)]
Vertex = Annotated[int, Meta(ge=0, le=MOST_NUMBER)]
FINEST_MM = 1e-4  # of noise: a tenth of a micrometre, whose square single numbers still tell from 0
Method = Literal["studio", "adaptive", "trivial", "distance", "cover", "budget", "motion"]
Weights = Literal["lexicographic", "paper", "count"]

BUDGETED = ("budget", "motion")  # methods that are given the number of landmarks
BY_ERROR = ("studio", "budget")  # methods that look for the least predicted error
NEUTRAL_ONLY = ("adaptive", "trivial", "distance", "cover")  # the paper's, which ask for distances in the neutral alone
ORDERED = ("studio", *BUDGETED)  # methods that choose all landmarks as one set, whose order tells which to spare


class LayoutSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a person decides about landmarks: lengths in millimetres, shares from 0 to 1.

    `method`: `studio` is the fewest landmarks found that reach every blendshape, have no larger upper estimate of the
    error than 68 points, those of iBUG or as many spread evenly, whichever is better, and tell all mixes apart but for
    those that cost the others more than 0.5 % of the error; it ends earlier where another landmark is not worth its
    while (`layout.studio`). `adaptive` is Algorithm 1 of Zell &
    McDonnell 2022; `trivial` has `rounds` sites for every blendshape next to each other, `distance` has them at the
    spacing; `cover` is their single set cover, at the spacing where that is not 0; `budget` has the least upper
    estimate that `budget` landmarks buy; `motion` loses least of a recorded take. `weights`: fewest landmarks first and
    then the best places (`lexicographic`), the paper's own sum (`paper`), or the number alone (`count`).
    `epsilon`: a vertex can stand for a blendshape that moves it by this share of the blendshape's largest movement;
    0.3 to 0.7 is the working range. `alpha`: weight of visibility against displacement. `rounds`: landmarks that a
    blendshape gets at most from the multi-cover. `spacing_mm`: least distance between landmarks, straight and so along
    the skin too.
    `noise_mm`: standard deviation of a measured landmark coordinate, for the upper estimate and the predicted error.
    `min_visibility`: vertices that are seen from less than this share of their hemisphere are no candidates; 0 leaves
    visibility out. `budget`: most landmarks there may be; `number`: exactly so many.
    Constraints, by vertex number in the artist's file: `pins` carry a landmark whatever else is decided, `forbidden`
    carry none. `keep_out`: zones without dots and the margin around each, to the dot's edge, by name (`anatomy.zones`)
    or as a file that paints one. `relaxed_for`: a layout that people use (`registration.empirical_layouts`); within a
    dot's diameter of its points landmarks may stand as its own do, in zones without dots and where they are hardly
    seen. `caps`: most landmarks in a region, by its name ("nose"). `min_views`: cameras that have to see a landmark in
    every expression, where cameras are known (2 where they triangulate); one of them never smaller than 3 pixels; 0
    leaves cameras out of it. `dot_mm`: diameter of a marker. `label_margin_mm`: by how much each of two dots may be
    found off and still be told from the other, in every expression and on the way from each to the next (`labels`);
    without it a plan only tells which dots may be taken for each other.
    `head_markers`: 3 to 5 further markers where the face hardly moves, from which the motion of the head is taken.
    """

    method: Method = "studio"
    weights: Weights = "lexicographic"
    epsilon: Annotated[float, Meta(gt=0, le=1)] = STANDS_FOR
    alpha: Share = 0.5
    symmetric: bool = True
    spacing_mm: Length = 8.0
    rounds: Some = 3
    noise_mm: Annotated[float, Meta(ge=FINEST_MM, le=LONGEST_MM)] = 0.2
    min_visibility: Share = LEAST_SEEN
    budget: Some | None = None
    number: Some | None = None
    pins: tuple[Vertex, ...] = ()
    forbidden: tuple[Vertex, ...] = ()
    keep_out: dict[str, Length] = field(default_factory=lambda: {name: MARGINS_MM[name] for name in CLEAR_ZONES})
    relaxed_for: Known | None = None
    caps: dict[str, Count] = field(default_factory=dict)
    min_views: Count = 1
    dot_mm: Annotated[float, Meta(gt=0, le=LONGEST_MM)] = DOT_MM
    label_margin_mm: Length | None = None
    head_markers: Annotated[int, Meta(ge=0, le=5)] = 0

    def __post_init__(self) -> None:
        if self.method in BUDGETED and self.budget is None and self.number is None:
            raise SettingsError(f"method '{self.method}' needs a budget: the number of landmarks")
        if self.number and self.method not in ("cover", *BUDGETED):
            raise SettingsError(
                f"method '{self.method}' settles the number itself: give number with 'cover', 'budget' or 'motion'"
            )
        if self.head_markers in (1, 2):
            raise SettingsError(
                f"{self.head_markers} head markers do not fix a head's pose: give 3, 4 or 5, or 0 for none"
            )
