"""What others do with the same budget: M vertices of the same candidates, chosen from their displacements alone.

Data       X[n] = (d_1n, ..., d_Kn)   what candidate n does in all blendshapes, 3K numbers, millimetres
random           any M
farthest point   each next as far along the skin as can be from those before (Gonzalez 1985)
RGL15            k-means of the rows X; of each cluster the row nearest to its centre (Reverdy et al. 2015)
CXZ02            the same with |A[n]|, A the principal directions of the deltas (principal feature analysis, Cohen et
                 al. 2002): a vertex has three rows of q directions that keep 99 % of the movement
QR pivot         each next is what is largest once the mixes answered so far are projected out; when nothing is left,
                 all start again with the vertices left (pivoted QR of Manohar et al. 2018, three rows a sensor)
SCO04            each next is where the least-squares mesh through those before is most wrong (Sorkine & Cohen-Or 2004),
                 here of the movement: L x = 0, x = X at the landmarks
LS-meshes        the same of the neutral's own shape, omega x = omega X at the landmarks with omega = 20, as Le et al.
                 2013, section 6.3, compare with
MSLS, our reading of "clustered teleconnection analysis" (Southern & Zhang 2011, which we know from Le et al. 2013
                 alone): vertices in 6 clusters that move alike; each next in the cluster whose movement the
                 least-squares mesh misses most, where regression on one vertex explains most of what its cluster
                 misses (a teleconnection); their lambda and mu have no place in it

Least-squares meshes in closed form: with A = L'L + tiny I and K = A^-1 at the landmarks H, an added h changes the
residual by R - g R[h], g = G[:, h] / (G[h, h] + omega^-2), where G[:, h] = A^-1 e_h - K (K_HH + omega^-2 I)^-1 K[h]':
one factorisation, one solve each; omega^-2 = 0 holds the landmarks exactly.
"""

import warnings
from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.cluster.vq import kmeans2
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import splu

from capture_plan.errors import InfeasibleError
from capture_plan.layout.farthest import Candidates, farthest_points
from capture_plan.layout.pivoted_qr import Pivots
from capture_plan.registration.nonrigid_icp import graph_stiffness

RETAINED_VARIANCE = 0.99
KMEANS_ROUNDS = 50
RESTARTS = 5  # k-means ends in local minima: the best of five is kept
OMEGA, CLUSTERS = 20.0, 6  # Le et al. 2013, section 6.3
NOTHING = 1e-30  # mm^2
GROUND = 1e-6  # of L'L, whose entries are about 1: skin without any landmark stays in the neutral


def at_random(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """A random choice, the same start for every count."""
    return np.random.default_rng(seed).permutation(candidates.vertices)[:count]


def rgl15(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Clusters of vertices that move alike."""
    return candidates.vertices[nearest_to_centres(candidates.rows, count, seed)]


def cxz02(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Clusters of vertices that weigh alike in the principal directions."""
    k = len(candidates.deltas)
    X = candidates.rows.reshape(len(candidates.vertices), k, 3)
    _, sigma, A = np.linalg.svd(X.transpose(1, 0, 2).reshape(k, -1), full_matrices=False)
    retained = 1 + int(np.searchsorted(np.cumsum(sigma**2) / np.sum(sigma**2), RETAINED_VARIANCE))
    rows = np.abs(A[:retained]).reshape(min(retained, len(A)), len(X), 3).transpose(1, 0, 2).reshape(len(X), -1)
    return candidates.vertices[nearest_to_centres(rows, count, seed)]


def nearest_to_centres(rows: Float[np.ndarray, "n r"], count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Of each cluster of a k-means the row nearest to the centre; rows far from their centre where clusters are empty.

    Rows are given in any scale; the same seed gives the same rows.
    """
    label, distance = best_clusters(rows, count, seed)
    order = np.lexsort((distance, label))
    chosen = order[np.r_[True, np.diff(label[order]) > 0]]
    others = np.setdiff1d(np.argsort(-distance, kind="stable"), chosen, assume_unique=True)
    return np.sort(np.concatenate([chosen, others[: count - len(chosen)]]))


def best_clusters(
    rows: Float[np.ndarray, "n r"], count: int, seed: int
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """The cluster of every row and its distance to the centre, of a few k-means the one with the least spread."""
    best = None
    for start in range(RESTARTS):
        rng = np.random.default_rng([seed, start])
        with warnings.catch_warnings(action="ignore"):  # equal rows: some clusters stay empty
            centres, label = kmeans2(rows, count, iter=KMEANS_ROUNDS, minit="++", missing="warn", rng=rng)
        distance = np.linalg.norm(rows - centres[label], axis=1)
        if best is None or (distance**2).sum() < best[0]:
            best = ((distance**2).sum(), label, distance)
    assert best is not None
    return best[1], best[2]


def qr_pivot(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Blockwise pivoted QR of the response; needs no seed."""
    n = len(candidates.vertices)
    pivots, free = Pivots(candidates.rows.reshape(n, -1, 3).transpose(0, 2, 1)), np.ones(n, dtype=bool)
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(pivots.take(np.flatnonzero(free), np.ones(n, dtype=int)))
        free[chosen[-1]] = False
    return candidates.vertices[chosen]


class LeastSquaresMesh:
    """The skin's least-squares mesh through more and more landmarks; `at` are the skin's vertices.

    `R`: what it misses of X (v r) at each of them, in X's unit.
    """

    def __init__(self, candidates: Candidates, X: Callable[[np.ndarray], np.ndarray], omega: float) -> None:
        """No landmark yet. `X` gives the rows of some vertices; `omega` is infinite where landmarks hold exactly."""
        self.at, inside = np.unique(candidates.skin_triangles, return_inverse=True)
        LL = graph_stiffness(inside.reshape(-1, 3), len(self.at))
        A = csc_array(LL + GROUND * eye_array(len(self.at)))
        self.solver = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options={"SymmetricMode": True})
        self.R, self.slack = X(self.at), omega**-2.0
        self.own = np.flatnonzero(np.isin(self.at, candidates.vertices))
        self.chosen: list[int] = []
        self.K = np.empty((len(self.at), 0))

    def free(self) -> Bool[np.ndarray, " n"]:
        """Which of the candidates `own` are not landmarks yet."""
        return ~np.isin(self.own, self.chosen)

    def add(self, h: int) -> None:
        """One more landmark, at number h of `at`."""
        column = self.solver.solve((np.arange(len(self.at)) == h).astype(float))
        candidates = self.K[self.chosen] + self.slack * np.eye(len(self.chosen))
        G = column - self.K @ np.linalg.solve(candidates, self.K[h]) if self.chosen else column
        self.R = self.R - np.outer(G / (G[h] + self.slack), self.R[h])
        self.K, self.chosen = np.column_stack([self.K, column]), [*self.chosen, h]

    def add_worst(self, count: int) -> None:
        """`count` landmarks, each where the mesh is most wrong."""
        for _ in range(count):
            wrong = np.where(self.free(), np.square(self.R[self.own]).sum(axis=1), -1)
            self.add(int(self.own[wrong.argmax()]))


def sco04(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Greedily where the least-squares mesh of the movement is most wrong; needs no seed."""
    mesh = LeastSquaresMesh(candidates, candidates.rows_at, np.inf)
    mesh.add_worst(count)
    return mesh.at[mesh.chosen]


def ls_meshes(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Greedily where the least-squares mesh of the neutral is most wrong, from its mean on; needs no seed."""
    mesh = LeastSquaresMesh(candidates, lambda at: candidates.neutral[at] - candidates.neutral[at].mean(axis=0), OMEGA)
    mesh.add_worst(count)
    return mesh.at[mesh.chosen]


def msls_meshes(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Greedily where one vertex explains most of what the least-squares mesh misses of its cluster."""
    mesh, rows = LeastSquaresMesh(candidates, candidates.rows_at, OMEGA), candidates.rows
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    cluster = best_clusters(rows / np.where(size > 0, size, 1), min(CLUSTERS, len(rows)), seed)[0]
    for _ in range(count):
        R, free = mesh.R[mesh.own], mesh.free()
        missed = np.bincount(cluster, np.square(R).sum(axis=1), CLUSTERS)
        missed[np.bincount(cluster, free, CLUSTERS) == 0] = -1
        inside = np.flatnonzero(cluster == missed.argmax())
        # sum_n (R_h . R_n)^2 / |R_h|^2: what regression on R_h explains
        own = R[inside]
        message = np.square(own @ own.T).sum(axis=1) / np.maximum(np.square(own).sum(axis=1), NOTHING)
        mesh.add(int(mesh.own[inside[np.where(free[inside], message, -1).argmax()]]))
    return mesh.at[mesh.chosen]


Baseline = Callable[[Candidates, int, int], np.ndarray]
BASELINES: dict[str, Baseline] = {
    "random": at_random,
    "farthest point": farthest_points,
    "RGL15 (k-means)": rgl15,
    "CXZ02 (principal features)": cxz02,
    "QR pivot": qr_pivot,
    "SCO04 (surface error)": sco04,
    "LS-meshes (neutral)": ls_meshes,
    "MSLS-meshes (our reading)": msls_meshes,
}


def choose_baseline(name: str, candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """`count` vertices by the baseline of that name.

    Raises:
        InfeasibleError: there are fewer candidates.
    """
    must_have(candidates, count)
    return BASELINES[name](candidates, count, seed)


def must_have(candidates: Candidates, count: int) -> None:
    """Refuses a number of landmarks that there are not as many candidates for.

    Raises:
        InfeasibleError: there are fewer.
    """
    if count > len(candidates.vertices):
        raise InfeasibleError(
            f"{count:,} landmarks asked for, {len(candidates.vertices):,} vertices may carry one: ask for fewer"
        )
