"""What the expressions room answers: which blendshapes are performed together, in which order."""

from msgspec import Struct, field

from capture_plan.expressions.settings import Edits


class Expression(Struct, frozen=True, forbid_unknown_fields=True):
    """One reference expression: all its blendshapes at full weight (Carrigan et al. 2020, section 4.2).

    `gain` is its share of the importance of all blendshapes (uniqueness, which depends on the order, left aside),
    `covered` the share after it, both 0 to 1. `sentence` tells the actor what to do in plain words; sides in it are
    the actor's own.

    `drivers` are held at full weight besides: what one of the blendshapes corrects and is not performed without (lips
    closed over an open jaw). They show here and are scanned for themselves in another expression.
    """

    name: str
    blendshapes: tuple[str, ...]
    weights: tuple[float, ...]
    gain: float
    covered: float
    sentence: str
    drivers: tuple[str, ...] = ()

    @property
    def pose(self) -> dict[str, float]:
        """The weight of every blendshape that is not at rest in the picture."""
        return dict(zip(self.blendshapes, self.weights, strict=True)) | dict.fromkeys(self.drivers, 1.0)


class Overlap(Struct, frozen=True, forbid_unknown_fields=True):
    """Partners that share much: `share` of the smaller active set, 0 to 1, moves with both. One scan of the two shows
    the sum there, and what belongs to which is a guess."""

    names: tuple[str, str]
    share: float


class Packing(Struct, frozen=True, forbid_unknown_fields=True):
    """Expressions, the most telling first (`Plan.in_session`: as they are shot), and what was proved of their number.

    `objective` counts the whole list; a limit shows its first expressions only: `unscanned` are the blendshapes of the
    others, and `left_out` all of these. `bound` is a lower limit on `objective` under the same pairs and rules that
    anybody can check: the clique, or movements counted. `solver_bound` is the solver's own, which may be higher.
    `order_proven` says that each expression is proved the most important one possible after those before it: of all, or
    (`minimum`) of those that keep the list shortest; of a list that is `early` only that no other order of the same
    expressions leaves less expected error after any of them, locked ones aside. `clique` names blendshapes no two of
    which fit into one expression, so that anybody can check a limit without a solver; a partner in it stands for its
    pair, whose active set is the union of both. `pairs` are left/right partners that are performed together; `relaxed`
    those pairs that had to be split. `exclusive` are blendshapes that no face performs at once, kept apart although
    they may share no active vertex: conflicts in the clique are of either kind. `drivers` are pairs of a corrective and
    what it corrects: the corrective counts as active wherever either is.

    `local` are upper/lower partners of lips and lids that are performed together. `colliding` are blendshapes whose
    surfaces would run through each other. An expression asks for `most_things` separate movements at most (nothing
    where there is no limit), of `things` in the whole list. `hard` are (a, b, cost) of what is performed at once though
    it is hard to. `overlaps` are the partners whose shared vertices are a warning. `edits` are the artist's decisions
    that the list follows, and `unmoved` counts the blendshapes that stayed where they were when it was last edited, or
    another list was asked for; nothing where it is still the list that the method made.
    """

    method: str
    expressions: tuple[Expression, ...]
    objective: int
    bound: int
    solver_bound: int
    proven_optimal: bool
    order_proven: bool
    clique: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    relaxed: tuple[tuple[str, str], ...]
    exclusive: tuple[tuple[str, str], ...]
    drivers: tuple[tuple[str, str], ...]
    left_out: tuple[str, ...]
    unscanned: tuple[tuple[str, ...], ...] = ()
    local: tuple[tuple[str, str], ...] = ()
    colliding: tuple[tuple[str, str], ...] = ()
    most_things: int | None = None
    things: int = 0
    hard: tuple[tuple[str, str, int], ...] = ()
    overlaps: tuple[Overlap, ...] = ()
    edits: Edits = field(default_factory=Edits)
    unmoved: int | None = None

    @property
    def poses(self) -> dict[str, dict[str, float]]:
        """The pose of every expression, by its name."""
        return {expression.name: expression.pose for expression in self.expressions}

    @property
    def as_made(self) -> bool:
        """Whether the list is still the one that its method made."""
        return self.unmoved is None

    @property
    def gap(self) -> int:
        """Expressions that might still be saved: 0 where the number is proved."""
        return self.objective - self.bound

    @property
    def counted(self) -> int:
        """No list is shorter than this, by counting movements."""
        return -(-self.things // self.most_things) if self.most_things else 0

    @property
    def bound_from(self) -> str:
        """Who says that no list is shorter than the solver's bound: a clique, a count, or the solver alone."""
        if self.solver_bound <= len(self.clique):
            return "clique"
        return "count" if self.solver_bound <= self.counted else "solver"
