"""What an order of expressions is worth: the error of the rig that its first J scans give.

Data       truth[k]    deltas of a target, millimetres; scans show them without noise
           J           expressions in order, each as the weights of its blendshapes
Rig        deformation transfer, corrected by the first J scans (`example.py`)
Scores     e[k, v] = rebuilt - truth on the skin;  G = e e' / v
           rms of each blendshape sqrt(G_kk): their mean and their largest; root mean square over all
           sqrt(E[w' G w]) for random mixes w: 3 to 8 blendshapes, weights evenly from 0 to 1; exact, none is drawn

Scans that share no blendshape are independent: each group of scans is solved once for all orders and counts.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np
from jaxtyping import Float
from msgspec import Struct
from scipy.sparse.csgraph import connected_components

from capture_plan.curves.random_mixes import moment_of_mixes
from capture_plan.errors import RigError
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.transfer.example import rebuild
from capture_plan.transfer.prior import Prior, transfer_prior
from capture_plan.transfer.targets import Target

Pose = Mapping[str, float]


class RebuildScore(Struct, frozen=True, kw_only=True):
    """Errors of the rig after `count` scans, on the skin, millimetres; `worst` has the largest error `max_mm`."""

    target: str
    order: str
    count: int
    mean_mm: float
    max_mm: float
    worst: str
    rms_mm: float
    mixes_mm: float


class Bench:
    """One rig and one target; remembers what each group of scans gives."""

    def __init__(self, rig: Rig, target: Target) -> None:
        """No scan yet. RigError where the target is on another mesh or has other blendshapes."""
        if target.deltas.shape != rig.deltas.shape:
            raise RigError(
                f"{target.name} has {len(target.deltas)} blendshapes of {target.deltas.shape[1]:,} vertices, "
                f"{rig.name} {len(rig.deltas)} of {len(rig.neutral):,}: give one delta for each of the rig's"
            )
        self.rig, self.target = rig, target
        self._errors: dict[tuple[tuple[tuple[str, float], ...], ...], np.ndarray] = {}

    @cached_property
    def prior(self) -> Prior:
        """Deformation transfer onto the target."""
        return transfer_prior(self.rig.neutral, self.rig.triangles, self.rig.deltas, self.target.neutral)

    def errors(self, expressions: Sequence[Pose]) -> Float[np.ndarray, "k s 3"]:
        """e of every blendshape on the skin, once these expressions are scanned, millimetres."""
        e = self._error(self.prior.deltas).copy()
        W = weights(self.rig, expressions)
        group = connected_components((W != 0) @ (W != 0).T, directed=False)[1] if len(W) else np.empty(0, dtype=int)
        for number in np.unique(group):
            members = np.flatnonzero(group == number).tolist()
            key = tuple(sorted(tuple(sorted(expressions[j].items())) for j in members))
            shown = np.flatnonzero((W[members] != 0).any(axis=0))
            if key not in self._errors:
                self._errors[key] = self._rebuilt(W[members])[shown]
            e[shown] = self._errors[key]
        return e

    def score(self, order: str, expressions: Sequence[Pose]) -> RebuildScore:
        """The scores of all of `expressions` together."""
        e = self.errors(expressions).reshape(len(self.rig.names), -1)
        G = e @ e.T / (e.shape[1] / 3)
        rms = np.sqrt(np.diag(G))
        return RebuildScore(
            target=self.target.name,
            order=order,
            count=len(expressions),
            mean_mm=float(rms.mean()),
            max_mm=float(rms.max()),
            worst=self.rig.names[int(rms.argmax())],
            rms_mm=float(np.sqrt(np.mean(rms**2))),
            mixes_mm=float(np.sqrt(np.sum(moment_of_mixes(len(rms)) * G))),
        )

    def _rebuilt(self, W: Float[np.ndarray, "j k"]) -> Float[np.ndarray, "k s 3"]:
        scans = self.target.neutral + np.einsum("jk,kvx->jvx", W, self.target.deltas)
        return self._error(rebuild(self.prior, scans, W))

    def _error(self, deltas: Float[np.ndarray, "k v 3"]) -> Float[np.ndarray, "k s 3"]:
        return (deltas - self.target.deltas)[:, self.rig.skin]


def score_packing(
    rig: Rig,
    target_neutral: Float[np.ndarray, "n 3"],
    target_deltas: Float[np.ndarray, "k n 3"],
    expressions: Sequence[Pose],
    *,
    counts: Iterable[int] = (0, 5, 10, 15, 20),
) -> tuple[RebuildScore, ...]:
    """What the first `counts` of these expressions are worth, and all of them."""
    return score_orders(rig, [Target("target", target_neutral, target_deltas)], {"given": expressions}, counts=counts)


def score_orders(
    rig: Rig, targets: Sequence[Target], orders: Mapping[str, Sequence[Pose]], *, counts: Iterable[int]
) -> tuple[RebuildScore, ...]:
    """One row for each target, order and count, and for the whole of each order: ready for a table or a figure."""
    counts, rows = sorted(set(counts)), []
    for target in track(targets, "Rebuilding rigs from scans"):
        bench = Bench(rig, target)
        for order, expressions in orders.items():
            reached = [count for count in counts if count < len(expressions)]
            rows.extend(bench.score(order, expressions[:count]) for count in [*reached, len(expressions)])
    return tuple(rows)


def weights(rig: Rig, expressions: Sequence[Pose]) -> Float[np.ndarray, "j k"]:
    """The weights of every expression in the rig's order of blendshapes."""
    W = np.zeros((len(expressions), len(rig.names)))
    number = {name: k for k, name in enumerate(rig.names)}
    for row, pose in zip(W, expressions, strict=True):
        for name, weight in pose.items():
            if name not in number:
                raise RigError(f"{rig.name} has no blendshape '{name}': name those of the rig in an expression")
            row[number[name]] = weight
    return W
