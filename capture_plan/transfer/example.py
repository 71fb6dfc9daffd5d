"""Example-based rigging: a rig of another face from its neutral and J scanned expressions (Li, Weise & Pauly 2010).

Data       P[k, t]   gradient of blendshape k in cell t by deformation transfer: a triangle's (3 2) as 6 numbers
           Y[j, t]   gradient of scan j against the target's neutral;  a[t] share of the cell in the whole area
           W*[j, k]  the weights that were asked of the actor
           u[k, t]   how freely blendshape k may change there (`prior.py`)
Variables  X[k, t]   gradients of the target's blendshapes;  W[j, k] the weights that were shown, 0 to 1
Model      min sum_t a_t ( sum_j |sum_k W_jk X_kt - Y_jt|^2 + beta sum_k |X_kt - P_kt|^2 / u_kt ) + gamma |W - W*|^2
Solution   X = P + U W' (W U W' + beta I)^-1 (Y - W P),  U = diag u[., t], in every cell by itself
           where W is held (Carrigan et al. 2020, section 4.3, keep 0 and 1): what a scan shows more than the prior is
           shared out among its blendshapes by u. Then deltas from gradients, one Poisson problem each.
           Else in turns with a bounded least squares problem for each row of W: the energy never rises. Then a scan
           shows what nobody asked for with its transferred gradients P, at any W: an X that fitted it would change by
           what the scan shows more, divided by a small W: many times too much.

`hard` keeps a vertex still that blendshape k leaves still on the source, the variant named in Carrigan et al. 2020,
section 4.1: what a scan shows there belongs to the others. Without it some of every correction leaks over the face.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import lsq_linear

from capture_plan.errors import RigError
from capture_plan.progress import track
from capture_plan.transfer.prior import Prior, cells, per_cell
from capture_plan.transfer.surface import Surface

BETA = 1e-4  # trust in the prior against scans: alone in a scan, skin strained by 0.1 keeps 1 % of the prior
GAMMA = 0.01  # trust in the weights asked for, against gradients whose mean square over the face is of that order
ROUNDS = 10
CELLS = 4096  # whose small systems are solved at a time


@dataclass(frozen=True, eq=False)
class Rebuilt:
    """A target's deltas (mm), the weights of its scans, and the energy after each round, without unit."""

    deltas: Float[np.ndarray, "k v 3"]
    weights: Float[np.ndarray, "j k"]
    energies: tuple[float, ...]


def rebuild(
    prior: Prior,
    scans: Float[np.ndarray, "j n 3"],
    weights: Float[np.ndarray, "e k"],
    *,
    beta: float = BETA,
    hard: bool = True,
) -> Float[np.ndarray, "k v 3"]:
    """The target's deltas from scans whose weights are known, millimetres; in no scan, deformation transfer.

    Raises:
        RigError: scans of another mesh, or another number of them than rows of weights.
    """
    check_scans(prior, scans, weights)
    if len(scans) == 0:
        return prior.deltas
    Y = cells(prior.surface, scans - prior.surface.neutral)
    X = best_gradients(prior, Y, weights, prior.freedom(hard=hard), beta)
    return integrate(prior, X, np.flatnonzero((weights != 0).any(axis=0)), hard=hard)


def rebuild_and_weigh(
    prior: Prior,
    scans: Float[np.ndarray, "j n 3"],
    asked: Float[np.ndarray, "e k"],
    *,
    beta: float = BETA,
    gamma: float = GAMMA,
    hard: bool = True,
) -> Rebuilt:
    """The target's deltas and the weights shown, where the actor may have shown others than asked for.

    Raises:
        RigError: scans of another mesh, or another number of them than rows of weights.
    """
    check_scans(prior, scans, asked)
    Y, u, P = cells(prior.surface, scans - prior.surface.neutral), prior.freedom(hard=hard), prior.cells
    X, W, wanted, left, energies = P, asked, asked != 0, Y, []
    for _ in track(range(ROUNDS), "Fitting blendshapes and weights in turns"):
        X = best_gradients(prior, left, W * wanted, u, beta)
        W = _weights_of_each(prior, X, Y, asked, gamma)
        left = Y - (W * ~wanted) @ P  # of each scan, what was asked for has to show
        energies.append(energy(prior, X, left, W * wanted, u, beta) + gamma * float(np.square(W - asked).sum()))
    changed = np.flatnonzero(wanted.any(axis=0))
    return Rebuilt(integrate(prior, X, changed, hard=hard), W, tuple(energies))


def _weights_of_each(
    prior: Prior,
    X: Float[np.ndarray, "k n"],
    Y: Float[np.ndarray, "j n"],
    asked: Float[np.ndarray, "j k"],
    gamma: float,
) -> Float[np.ndarray, "j k"]:
    """W of every scan, in which X is seen of what was asked for and P of all else."""
    shapes = (np.where(row[:, None] != 0, X, prior.cells) for row in asked)
    scans = zip(shapes, Y, asked, strict=True)
    return np.concatenate([best_weights(prior.surface, x, y[None], row[None], gamma) for x, y, row in scans])


def best_gradients(
    prior: Prior,
    Y: Float[np.ndarray, "j n"],
    W: Float[np.ndarray, "j k"],
    u: Float[np.ndarray, "k t"],
    beta: float,
) -> Float[np.ndarray, "k n"]:
    """X = P + U W' (W U W' + beta I)^-1 (Y - W P)."""
    shown = np.flatnonzero((W != 0).any(axis=0))
    W, u = W[:, shown], u[shown]
    X, j, start = prior.cells.copy(), len(W), 0
    missed, change = Y - W @ X[shown], np.empty((len(shown), Y.shape[1]))
    squares = np.einsum("ik,jk->kij", W, W).reshape(len(shown), j * j)
    for t in _blocks(prior.surface):
        size = prior.surface.cell_sizes[t.start]
        stop = start + size * (t.stop - t.start)
        R = missed[:, start:stop].reshape(j, -1, size).transpose(1, 0, 2)
        H = (u[:, t].T @ squares).reshape(-1, j, j) + beta * np.eye(j)
        Z = W.T @ np.linalg.solve(H, R)
        change[:, start:stop] = (u[:, t].T[:, :, None] * Z).transpose(1, 0, 2).reshape(len(shown), stop - start)
        start = stop
    X[shown] += change
    return X


def best_weights(
    surface: Surface,
    X: Float[np.ndarray, "k n"],
    Y: Float[np.ndarray, "j n"],
    asked: Float[np.ndarray, "j k"],
    gamma: float,
) -> Float[np.ndarray, "j k"]:
    """min sum_t a_t |W X_t - Y_t|^2 + gamma |W - W*|^2, 0 <= W <= 1, for every scan by itself."""
    a = _spread(surface, surface.shares)
    # H w = b without bounds; with H = C' C it is |C w - C'^-1 b|^2 that is bounded
    H, b = (X * a) @ X.T + gamma * np.eye(len(X)), (X * a) @ Y.T + gamma * asked.T
    C = np.linalg.cholesky(H).T
    right = np.linalg.solve(C.T, b)
    return np.stack([lsq_linear(C, column, bounds=(0, 1), method="bvls").x for column in right.T])


def energy(
    prior: Prior,
    X: Float[np.ndarray, "k n"],
    Y: Float[np.ndarray, "j n"],
    W: Float[np.ndarray, "j k"],
    u: Float[np.ndarray, "k t"],
    beta: float,
) -> float:
    """The model's sum over cells; infinite where a cell changed that is not free."""
    a = prior.surface.shares
    fit = per_cell(prior.surface, np.square(W @ X - Y)) @ a
    moved = per_cell(prior.surface, np.square(X - prior.cells))
    retained = np.divide(moved, u, out=np.where(moved > 0, np.inf, 0), where=u > 0) @ a
    return float(fit.sum() + beta * retained.sum())


def integrate(
    prior: Prior, X: Float[np.ndarray, "k n"], which: Int[np.ndarray, " _"], *, hard: bool
) -> Float[np.ndarray, "k v 3"]:
    """Deltas with these gradients for the blendshapes `which`, the prior's for the others, millimetres."""
    deltas, f = prior.deltas.copy(), len(prior.surface.triangles)
    for k in track(which, "Building blendshapes"):
        surface = prior.hard_surfaces[k] if hard else prior.surface
        held = np.where(prior.still[k][:, None], 0, prior.deltas[k]) if hard else prior.deltas[k]
        loose = X[k, 6 * f :].reshape(-1, 3) * prior.surface.sizes[:, None]
        deltas[k] = surface.integrate(X[k, : 6 * f].reshape(f, 6), held, means_on(surface, prior.surface, loose))
    return deltas


def means_on(surface: Surface, whole: Surface, means: Float[np.ndarray, "c 3"]) -> Float[np.ndarray, "d 3"]:
    """The means of the loose pieces of `whole` that are loose on `surface` too, where more is held."""
    loose = surface.piece >= 0
    retained = np.zeros(surface.piece.max(initial=-1) + 1, dtype=int)
    retained[surface.piece[loose]] = whole.piece[loose]
    return means[retained]


def _spread(surface: Surface, a: Float[np.ndarray, " t"]) -> Float[np.ndarray, " n"]:
    """A value of each cell for all its numbers."""
    return np.repeat(a, surface.cell_sizes)


def check_scans(prior: Prior, scans: Float[np.ndarray, "j n 3"], weights: Float[np.ndarray, "e k"]) -> None:
    """RigError where scans do not fit the rig or their weights."""
    if len(scans) != len(weights):
        raise RigError(f"{len(scans)} scans but {len(weights)} rows of weights: give one row for each scan")
    if scans.shape[1] != len(prior.surface.neutral):
        raise RigError(
            f"the scans have {scans.shape[1]:,} vertices, the rig has {len(prior.surface.neutral):,}: "
            "bring them onto the rig's mesh first"
        )


def _blocks(surface: Surface) -> list[slice]:
    f, t = len(surface.triangles), len(surface.cell_sizes)
    starts = [*range(0, f, CELLS), *range(f, t, CELLS)]
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], t], strict=True)]
