"""Which way is up and which way a face looks: every sign votes on the 24 ways in which a file can lie.

Data       signs[s]  a direction u in the file (any length), the role it speaks for (up, facing or left), how sharply
                     it points (kappa) and how often such a sign is wrong altogether (eps)
Likelihood of sign s for the signed axis a of its role: eps / 6 + (1 - eps) softmax_a(kappa |u| cos(u, a))
Choice     of the 24 right-handed (up, facing) the one with the largest sum of logarithms
Lead       its sum less log sum exp of the others', nats: sure above LEAD, from at least two signs besides the format,
           two of them for up, and still in front when any single sign is left out; never where one group of signs by
           itself (how what is named moves, where it lies, shape) speaks for another axis by more than AGAINST
The format's own statement is one sign, a strong one: only several others together overrule it.

A direction across the face tells nothing about up or facing, so its part along the best mirror axis is taken out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from capture_plan.face.channels import FEW
from capture_plan.rig.read_options import AS_FOUND, AXES, ReadOptions
from capture_plan.rig.understood import Axes, Sign

PAIRS = tuple((up, facing) for up in AXES for facing in AXES if up[1] != facing[1])
Role = Literal["up", "facing", "left"]
Group = Literal["named motion", "named place", "shape"]
LEAD, LEAD_OF_FEW = 3.0, 6.0  # nats; the larger one where fewer than FEW blendshapes speak
AGAINST = 4.0  # nats; on 22 avatars 2.4 at most, where all deltas are negated 7 to 21
AGREES = 0.5  # nats that a sign adds at least to the answer it agrees with
LEAST = 3  # blendshapes that say for sure how a head lies whose format is silent
OWN_LEAD = 2.0  # nats without the format, where fewer blendshapes speak than that
STRONG, TIE = 3.5, -0.8  # nats: so strong a sign may break a tie alone, a weaker one may not
FORMAT = 0.96  # share of files whose own axes are right: of 36 files from the field all but one


@dataclass(frozen=True, eq=False)
class Vote:
    """A sign in words, the direction in the file that it gives to a role, its sharpness and how often it is wrong.

    Signs of one `group` err together: names that lie, deltas that were negated. A `line` runs between two places of
    the face, and tells nothing of the way in which something moves or looks.
    """

    name: str
    role: Role
    direction: Float[np.ndarray, " 3"]
    kappa: float
    eps: float
    group: Group = "shape"
    line: bool = False


def vector(axis: str) -> Float[np.ndarray, " 3"]:
    """+y -> (0, 1, 0)."""
    return np.where(np.arange(3) == "xyz".index(axis[1]), -1.0 if axis[0] == "-" else 1.0, 0.0)


def axes_matrix(up: str, facing: str) -> Float[np.ndarray, "3 3"]:
    """Rotation from the file's axes to ours: its rows are the subject's left, up and facing in the file."""
    return np.stack([np.cross(vector(up), vector(facing)), vector(up), vector(facing)])


def likelihood(vote: Vote, sides: int | None) -> Float[np.ndarray, " 6"]:
    """Logarithm of the vote's likelihood for each of AXES as the axis of its role; `sides` is the mirror axis."""
    u = vote.direction.astype(float)
    if vote.role != "left" and sides is not None:
        u = np.where(np.arange(3) == sides, 0.0, u)
    length = float(np.linalg.norm(u))
    if length == 0:
        return np.zeros(6)
    cosines = np.array([vector(axis) @ u for axis in AXES]) / max(length, 1.0)  # a weak direction speaks less
    power = np.exp(vote.kappa * (cosines - cosines.max()))
    return np.log(vote.eps / 6 + (1 - vote.eps) * power / power.sum())


def decide(
    votes: Sequence[Vote],
    mirror: Float[np.ndarray, " 3"],
    *,
    stated: tuple[str, str] | None,
    given: ReadOptions = AS_FOUND,
    speaking: int,
) -> Axes:
    """The (up, facing) that the votes speak for; `mirror` is the log likelihood of each axis to be the sideways one.

    `stated` are the axes of the format, `given` those of a person, `speaking` how many blendshapes voted.
    """
    up, facing = given.up, given.facing
    sides = int(np.argmax(mirror))
    pairs = [(u, f) for u, f in PAIRS if up in (None, u) and facing in (None, f)]
    tables = [_by_pair(vote.role, likelihood(vote, sides), pairs) for vote in votes]
    tables.append(np.array([mirror[_side_index(pair)] for pair in pairs]))
    if stated is not None:
        tables.append(np.array([np.log(FORMAT if pair == stated else (1 - FORMAT) / 23) for pair in pairs]))
    total = np.sum(tables, axis=0)
    best = int(np.argmax(total))
    overruled = False
    if stated is not None and stated in pairs and speaking < FEW:  # so few do not overrule a format, but leave a doubt
        overruled, best = pairs[best] != stated, pairs.index(stated)
    names = [vote.name for vote in votes] + ["its two sides mirror each other"] + ["the format"] * (stated is not None)
    says = [_says(vote) for vote in votes] + [pairs[best][0][1] + pairs[best][1][1]] + ["".join(stated or ())]
    weights = [_weight(table, best) for table in tables]
    signs = tuple(Sign(name, said, round(weight, 2)) for name, said, weight in zip(names, says, weights, strict=False))
    certain = up is not None and facing is not None
    own = np.sum(tables[: len(votes) + 1], axis=0)
    enough = speaking >= LEAST or (stated == pairs[best] and (len(pairs) == 1 or _lead(own, best) > OWN_LEAD))
    contradicted = _group_against(votes, sides, pairs[best])
    sure = enough and not overruled and not contradicted and _sure(tables, best, stated is not None, speaking)
    upright = sum(vote.role == "up" and weight > AGREES for vote, weight in zip(votes, weights, strict=False))
    alone = up is None and upright < 2 and (stated is None or stated[0] != pairs[best][0])
    return Axes(*pairs[best], sure=certain or (sure and not alone), signs=signs)


def _sure(tables: list[np.ndarray], best: int, has_format: bool, speaking: int) -> bool:
    total = np.sum(tables, axis=0)
    if len(total) == 1:
        return True
    needed = LEAD if speaking >= FEW else LEAD_OF_FEW
    own = tables[: len(tables) - 1 - has_format]
    agreeing = sum(_weight(table, best) > AGREES for table in own)
    alone = [_lead(total - table, best) > (TIE if _weight(table, best) > STRONG else 0) for table in own]
    return _lead(total, best) > needed and agreeing >= 2 and all(alone)


def _group_against(votes: Sequence[Vote], sides: int, chosen: tuple[str, str]) -> bool:
    """Whether the signs of one group, taken alone, speak clearly for another axis than the one chosen."""
    for group, role in product(get_args(Group), ("up", "facing")):
        own = [likelihood(vote, sides) for vote in votes if (vote.group, vote.role) == (group, role)]
        total = np.sum([np.zeros(6), *own], axis=0)
        best = int(np.argmax(total))
        if AXES[best] != _axis_of(role, chosen) and _lead(total, best) > AGAINST:
            return True
    return False


def _lead(total: Float[np.ndarray, " n"], best: int) -> float:
    rest = np.delete(total, best)
    return float(total[best] - np.logaddexp.reduce(rest))


def _weight(table: Float[np.ndarray, " n"], best: int) -> float:
    """How much a sign adds to the best answer over the best other that it tells from it; below 0 it disagrees."""
    others = table[np.abs(table - table[best]) > 1e-9]
    return float(table[best] - others.max()) if len(others) else 0.0


def _by_pair(role: Role, axis: Float[np.ndarray, " 6"], pairs: Sequence[tuple[str, str]]) -> Float[np.ndarray, " n"]:
    return np.array([axis[AXES.index(_axis_of(role, pair))] for pair in pairs])


def _axis_of(role: Role, pair: tuple[str, str]) -> str:
    if role == "up":
        return pair[0]
    return pair[1] if role == "facing" else _left(pair)


def _left(pair: tuple[str, str]) -> str:
    left = axes_matrix(*pair)[0]
    index = int(np.argmax(np.abs(left)))
    return ("-" if left[index] < 0 else "+") + "xyz"[index]


def _side_index(pair: tuple[str, str]) -> int:
    return "xyz".index(_left(pair)[1])


def _says(vote: Vote) -> str:
    index = int(np.argmax(np.abs(vote.direction)))
    return f"{vote.role} {'-' if vote.direction[index] < 0 else '+'}{'xyz'[index]}"


def together(votes: Sequence[Vote], role: Role) -> Float[np.ndarray, " 3"]:
    """Mean direction that the votes give to a role, each by its sharpness: for a pitch between the axes."""
    directions: Iterator[np.ndarray] = (sharpness(vote) * vote.direction for vote in votes if vote.role == role)
    return np.sum([np.zeros(3), *directions], axis=0)


def sharpness(vote: Vote) -> float:
    """How much a sign counts for a pitch, for every unit of its direction's length."""
    return vote.kappa * (1 - vote.eps) / max(1.0, float(np.linalg.norm(vote.direction)))
