"""What the layout room answers: landmarks, and what they are worth."""

from typing import Literal

from msgspec import Struct

from capture_plan.layout.settings import Method

Side = Literal["left", "right", "middle"]
Role = Literal["primary", "backup", "head"]


class View(Struct, frozen=True, forbid_unknown_fields=True):
    """One camera's view of a marker in the neutral and every blendshape alone at full weight.

    `always`: the camera reads it in all of them; `share`: in how many of them; `pixels`: the least of the marker's
    smaller diameter, pixels, over those in which the camera sees it at all (0 where it never does). `why` it is not
    read (`visibility.seen.WORDS`) the first time that it is not, which is with the blendshape `when`, or in the
    neutral; both empty where it always is.
    """

    camera: str
    always: bool
    pixels: float
    share: float = 1.0
    why: str = ""
    when: str = ""


class Landmark(Struct, frozen=True, forbid_unknown_fields=True):
    """One chosen point of the skin. Sides are the subject's own.

    `position` is on the neutral face in millimetres; `barycentric` are the weights of the corners of `triangle`
    that give it back; `source_vertex` is the vertex number in the artist's file; `blendshapes` are those that move
    it by at least epsilon of their own maximum; `quality` is the mean weight w of Zell & McDonnell 2022 eq. 1 over
    them (0 best, 2 worst); `visibility` is the share of the hemisphere (or of the cameras) that sees it, 0 to 1;
    `round` is the index in `Layout.programs` of the program that chose it, none where all were chosen as one set.
    `views` has one entry for every known camera; `measured_mm` are the standard deviations of its place as these
    cameras measure it, millimetres along three axes, the most exact first: two where no second camera tells its depth.
    """

    name: str
    label: str
    region: str
    side: Side
    role: Role
    vertex: int
    source_vertex: int
    position: tuple[float, float, float]
    triangle: int
    barycentric: tuple[float, float, float]
    blendshapes: tuple[str, ...]
    quality: float
    visibility: float
    round: int | None
    views: tuple[View, ...] = ()
    measured_mm: tuple[float, ...] = ()

    @property
    def stands_for(self) -> str:
        """Its blendshapes in words; a landmark that was chosen for the error alone may stand for none."""
        nothing = "the head's own motion" if self.role == "head" else "several, each a little"
        return ", ".join(self.blendshapes) or nothing


class HeadPose(Struct, frozen=True, forbid_unknown_fields=True):
    """Root mean square errors of a head pose fitted to the head markers under the noise of the plan: its rotation, its
    shift at the markers' middle, and what both do to the skin that moves."""

    rotation_degrees: float
    translation_mm: float
    surface_mm: float


class Bound(Struct, frozen=True, forbid_unknown_fields=True):
    """A lower bound on the number of landmarks that anybody can check without a solver.

    `weights[k]` is a dual price of blendshape k: no vertex sees blendshapes of more than 1 in total, and no mirrored
    pair of vertices of more than 2, so that at least `ceil(sum of weights)` landmarks are needed (duality of linear
    programs).
    """

    blendshapes: tuple[str, ...]
    weights: tuple[float, ...]
    landmarks: int


class ErrorBound(Struct, frozen=True, forbid_unknown_fields=True):
    """No layout has an upper estimate (`Information.error_mm`) below `error_mm`, millimetres. The certificate: shares
    of sites, each named by its first vertex, at which `relaxation.bound_from` gives this bound."""

    error_mm: float
    vertices: tuple[int, ...]
    shares: tuple[float, ...]


class Information(Struct, frozen=True, forbid_unknown_fields=True):
    """What landmarks tell about the blendshape weights, beside how many they are.

    `rank` of `full_rank`: blendshape mixes that the landmarks tell apart, of those that the rig itself can tell apart.
    `condition` is of the landmark response restricted to its rank. `error_mm` is the upper estimate, the root mean
    square error of the skin, millimetres, when each landmark coordinate is measured with noise of standard deviation
    `noise_mm` and weights of any size and sign are solved for. Search, budgets and bounds speak of it; what a solve
    between 0 and 1 gives is a `Prediction`. `by_cameras`: every landmark is measured as exactly as the cameras of the
    plan tell its place instead (`Landmark.measured_mm`).
    """

    landmarks: int
    rank: int
    full_rank: int
    condition: float
    noise_mm: float
    error_mm: float
    by_cameras: bool = False


class Prediction(Struct, frozen=True, forbid_unknown_fields=True):
    """The root mean square error of the skin to expect when weights are solved between 0 and 1 from landmarks measured
    with noise `noise_mm`, by a seeded simulation of one `performance`; lengths in millimetres.

    `performance` says what is performed, or names a take. 5 % of frames have less error than `low_mm` and 5 % more
    than `high_mm`; `standard_error_mm` is that of `error_mm`. `beyond_mm` is what the rig cannot show of a take: it is
    part of `error_mm` and left even where all of the skin is measured without noise; None where no take is performed.
    `by_cameras` is as in `Information`.
    """

    performance: str
    noise_mm: float
    error_mm: float
    low_mm: float
    high_mm: float
    standard_error_mm: float
    beyond_mm: float | None = None
    by_cameras: bool = False


class Reference(Information, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Another layout of the same face, what it is worth, and the errors to expect as in `Layout.predictions`. Landmarks
    that fall on one vertex stand there once."""

    vertices: tuple[int, ...]
    predictions: tuple[Prediction, ...] = ()


class Program(Struct, frozen=True, forbid_unknown_fields=True):
    """One integer program that was solved: the vertices that it chose for which blendshapes, what they cost, and the
    best proven lower limit of that cost."""

    landmarks: int
    blendshapes: tuple[str, ...]
    objective: float
    bound: float
    proven_optimal: bool
    vertices: tuple[int, ...]


class SubjectFit(Struct, frozen=True, forbid_unknown_fields=True):
    """One of several people: root mean square distance over the frames of the person's takes, millimetres."""

    sequences: tuple[str, ...]
    frames: int
    rmse_mm: float


class MotionFit(Struct, frozen=True, forbid_unknown_fields=True):
    """What a take loses when only the landmarks are recorded: a thin shell that they bend, against its frames.

    `rmse_mm` is the root mean square distance over all `frames` and the `vertices` of the skin that the take moves;
    `curve_mm` is the same with the first 1, 2, ... landmarks of `Layout.order`. `boundary` vertices of still skin hold
    the shell, of `stretching` and `bending` stiffness (millimetres). The search began on the `rank` strongest rows
    of the take, which leave out `tail_mm` of root mean square distance, and went on to finer ones until what they leave
    out is less than 1 % of the error. `missing` blendshapes are not in the take, so that
    nothing here speaks of them. `references_mm` is what the take loses by the layouts of `Layout.references`.
    `subjects` are the people, where the takes are of several; `notes` say what was assumed of the takes.
    """

    frames: int
    vertices: int
    rank: int
    tail_mm: float
    rmse_mm: float
    curve_mm: tuple[float, ...]
    boundary: int
    stretching: float
    bending: float
    missing: tuple[str, ...]
    references_mm: dict[str, float] = {}
    subjects: tuple[SubjectFit, ...] = ()
    notes: tuple[str, ...] = ()


class Layout(Struct, frozen=True, forbid_unknown_fields=True):
    """A set of landmarks, what the programs that chose them proved, and what they are worth.

    `certificate` proves how many landmarks any cover of these candidates needs at least. Of `settings.ORDERED` methods
    the program is the fewest landmarks of any cover at the spacing, where a budget pays for them; `order` names the
    landmarks from the most telling to the first to be spared, and `curve_mm` is the upper estimate with the first
    1, 2, ... of them, millimetres. `uncovered` are blendshapes that no landmark stands for. `head` are the markers that
    the head's own motion is taken from, `head_pose` what they are worth, where any were asked for. `error_bound` is the
    least upper estimate that any layout of the budget, or of as many landmarks, could have; no
    layout of fewer than `target_landmarks`, whatever the budget, has as low a one as the better of 68 points and dots
    spread evenly, by the certificate `target_bound`; both None where no number of landmarks on these sites has.
    `references` are other layouts of the same face under the same noise, by name: the paper's single cover, 68 points,
    dots spread evenly.
    `motion` is what a recorded take loses by this layout, where one is known. `predictions` are the errors to expect of
    weights solved between 0 and 1, for made-up performances and for every take.
    """

    method: Method
    landmarks: tuple[Landmark, ...]
    programs: tuple[Program, ...]
    certificate: Bound
    uncovered: tuple[str, ...]
    information: Information
    references: dict[str, Reference]
    head: tuple[Landmark, ...] = ()
    head_pose: HeadPose | None = None
    order: tuple[str, ...] = ()
    curve_mm: tuple[float, ...] = ()
    error_bound: ErrorBound | None = None
    target_landmarks: int | None = None
    target_bound: ErrorBound | None = None
    motion: MotionFit | None = None
    predictions: tuple[Prediction, ...] = ()

    @property
    def markers(self) -> tuple[Landmark, ...]:
        """Every dot that goes on the skin: landmarks, then head markers."""
        return (*self.landmarks, *self.head)
