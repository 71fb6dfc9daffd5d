"""What a person can decide about expressions, with what we would decide for them."""

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from capture_plan.errors import SettingsError
from capture_plan.input.documents import MOST_COUNTED

Share = Annotated[float, Meta(ge=0, le=1)]
Number = Annotated[int, Meta(ge=1, le=MOST_COUNTED)]


class DistortionForm(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the distortion of a triangle is read (Carrigan et al. 2020, eq. 6 and 7).

    `edges`: `three` counts all edges and gives 0 for equal triangles; `two`, as printed, counts two of them and gives
    2. `reduce`: the sum over active triangles favours large areas and dense meshes, the mean does not. `scaled`: the
    target is first brought to the size of the rig. `targets`: of several targets the largest distortion, or the mean.
    As in the paper: `edges = "two"`, `scaled = false`.
    """

    edges: Literal["three", "two"] = "three"
    reduce: Literal["sum", "mean"] = "sum"
    scaled: bool = True
    targets: Literal["max", "mean"] = "max"


class Edits(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What an artist decides about single blendshapes of a list.

    `locked`: the number of the expression that a blendshape is performed in, or names that it is performed with.
    `together`: groups that are performed in one expression. `apart`: pairs that are not. `dropped`: not scanned at all.
    """

    locked: dict[str, Number | tuple[str, ...]] = {}
    together: tuple[tuple[str, ...], ...] = ()
    apart: tuple[tuple[str, str], ...] = ()
    dropped: tuple[str, ...] = ()

    @property
    def numbers(self) -> dict[str, int]:
        """The number of the expression of every blendshape locked to one."""
        return {name: where for name, where in self.locked.items() if isinstance(where, int)}

    @property
    def companions(self) -> list[tuple[str, ...]]:
        """Groups that are performed in one expression, whether asked for by number or by name."""
        numbers = self.numbers
        by_number = {n: tuple(name for name, m in numbers.items() if m == n) for n in numbers.values()}
        by_name = [(name, *where) for name, where in self.locked.items() if not isinstance(where, int)]
        return [*self.together, *by_name, *by_number.values()]

    @property
    def names(self) -> tuple[str, ...]:
        """Every blendshape that an edit is about, once."""
        listed = [*self.dropped, *(name for group in (*self.companions, *self.apart) for name in group)]
        return tuple(dict.fromkeys(listed))


Importance = Literal["error", "paper"]
MEASURED_BY: dict[Importance, str] = {
    "error": "what the full list brings",  # the expected squared error that its scans take from the rebuilt rig
    "paper": "the importance of the full list",
}


class PackingSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a person decides about expressions, after Carrigan et al. 2020: shares from 0 to 1.

    `method`: `early` is of the provably shortest lists one whose first expressions leave little error in the rebuilt
    rig, and so does the whole, what one scan cannot take apart counted, and that is little behind other lists for each
    of some made-up persons; `minimum` is the provably shortest list whose first expressions are proved the most
    important, `sequential` the paper's Algorithm 1, `greedy` its baseline.
    `mu`: a vertex is active where a blendshape moves it by this share of the blendshape's largest movement; 0.25 to 0.4
    is the paper's range. `paired`: left and right partners are performed together. `local_pairs`: so are the upper and
    the lower half of a movement of lips or lids. `poseable`: what no face can do at once is kept apart (closed and wide
    eyes), and what asks an actor for too much, after `rules`: ours, or a rule file. `most_things`: separate movements
    that an expression asks for at most, a left/right pair counted once; nothing where the rules decide. `importance`:
    what a scan of a blendshape is worth: the `error` that it is expected to take from the rebuilt rig, or the strength
    and distortion of the `paper`. `distortion`:
    weight of triangle distortion against displacement, used when a target neutral is known (1 - alpha of eq. 4), read
    as `distortion_form` says. `uniqueness`: beta of eq. 4, for all methods but `early`.
    `limit`: the most expressions there is time for; the rest is
    listed as left out. `edits`: an artist's decisions about single blendshapes.
    """

    method: Literal["early", "minimum", "sequential", "greedy"] = "early"
    mu: Annotated[float, Meta(gt=0, le=1)] = 0.3
    paired: bool = True
    local_pairs: bool = False
    poseable: bool = True
    rules: str | None = None
    most_things: Number | None = None
    importance: Importance = "error"
    distortion: Share = 0.5
    distortion_form: DistortionForm = field(default_factory=DistortionForm)
    uniqueness: Share = 0.0
    limit: Number | None = None
    edits: Edits = field(default_factory=Edits)

    def __post_init__(self) -> None:
        if self.uniqueness and self.method == "early":
            raise SettingsError(
                "uniqueness is a term of the paper's order, which 'early' has not: set method 'minimum'"
            )
