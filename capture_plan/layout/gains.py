"""What every site would tell, beside the sites that are chosen: closed forms for leaving some out and taking others in.

Data       s           sites; A_s (r k) the rows of the deltas at the members of a site
           C           covariance of the weights given the chosen sites, G the skin's Gram matrix (`information`)
Products   P = A C,  T = A C A^T,  H = P G P^T            at every site
Gain       trace(G C) falls by trace((sigma^2 I + T_s)^-1 H_s) when site s is added
Step       C' = C + w U U^T, w = 1 to leave out rows R, U = C R^T (sigma^2 I - R C R^T)^-1/2,
                             w = -1 to take them in,    U = C R^T (sigma^2 I + R C R^T)^-1/2:
           T' = T + w V V^T,   H' = H + w (X V^T + V X^T) + V U^T G U V^T,   V = A U,   X = P G U

As T is no less than 0, the gain is at most trace(H_s) / sigma^2: sites that cannot reach what is to be beaten are told
by thin products alone, and the small inverses are taken of the few others.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from capture_plan.layout.observation import RANK_TOLERANCE, Observation
from capture_plan.layout.sites import Sites

BLOCK = 512  # sites at a time: their products stay in the cache


@dataclass(frozen=True, eq=False)
class Gains:
    """A, C, P, T and H of all sites, see above; lengths in millimetres."""

    observation: Observation
    A: Float[np.ndarray, "s r k"]
    C: Float[np.ndarray, "k k"]
    P: Float[np.ndarray, "s r k"]
    T: Float[np.ndarray, "s r r"]
    H: Float[np.ndarray, "s r r"]

    def root(self, R: Float[np.ndarray, "q k"], w: int) -> Float[np.ndarray, "k q"]:
        """U of a step that leaves out (w = 1) or takes in (w = -1) the rows R."""
        RC = R @ self.C
        L = np.linalg.cholesky(self.observation.noise_mm**2 * np.eye(len(R)) - w * RC @ R.T)
        return np.linalg.solve(L, RC).T

    def loss(self, R: Float[np.ndarray, "q k"]) -> float:
        """By how much trace(G C) grows without the rows R of chosen sites, mm^2."""
        U = self.root(R, 1)
        return float(np.sum(U * (self.observation.gram @ U)))

    def without(
        self, R: Float[np.ndarray, "q k"], subset: Int[np.ndarray, " n"], *, beat: float
    ) -> Float[np.ndarray, " n"]:
        """By how much each of the sites `subset` lowers trace(G C) once the rows R of chosen sites are gone, mm^2.

        Where it cannot be more than `beat`, -2.
        """
        U, noise, r = self.root(R, 1), self.observation.noise_mm**2, self.A.shape[1]
        GU = self.observation.gram @ U
        V, X = times(self.A, U)[subset], times(self.P, GU)[subset]
        W = 2 * X + V @ (U.T @ GU)
        most = np.trace(self.H[subset], axis1=1, axis2=2) + np.einsum("nrq,nrq->n", W, V)
        at = np.flatnonzero(most > beat * noise)
        V, W, VT = V[at], W[at], V[at].transpose(0, 2, 1)
        half = W @ VT
        H = self.H[subset[at]] + (half + half.transpose(0, 2, 1)) / 2
        gain = np.full(len(subset), -2.0)
        gain[at] = traces(self.T[subset[at]] + V @ VT + noise * np.eye(r), H)
        return gain

    def most(self, left: Float[np.ndarray, "n r k"]) -> Float[np.ndarray, "n s"]:
        """What `without` cannot exceed at any site, for each of n chosen sites whose rows are left out, mm^2."""
        roots = np.stack([self.root(R, 1) for R in left])
        K, M = np.concatenate(roots, axis=1), roots.transpose(0, 2, 1) @ self.observation.gram @ roots
        GK, (n, r, k) = self.observation.gram @ K, left.shape
        bound = np.empty((n, len(self.A)))
        for start in range(0, len(self.A), BLOCK):
            at = slice(start, start + BLOCK)
            V = (self.A[at].reshape(-1, k) @ K).reshape(-1, n, r).transpose(1, 0, 2)
            X = (self.P[at].reshape(-1, k) @ GK).reshape(-1, n, r).transpose(1, 0, 2)
            spread = np.einsum("nzq,nzq->nz", 2 * X + V @ M, V).reshape(n, -1, r).sum(axis=2)
            bound[:, at] = spread + np.trace(self.H[at], axis1=1, axis2=2)
        return bound / self.observation.noise_mm**2

    def step(self, R: Float[np.ndarray, "q k"], w: int) -> "Gains":
        """The gains once the rows R are left out (w = 1) or taken in (w = -1)."""
        U = self.root(R, w)
        GU = self.observation.gram @ U
        V, X = times(self.A, U), times(self.P, GU)
        VT = V.transpose(0, 2, 1)
        cross = w * X @ VT
        return replace(
            self,
            C=self.C + w * U @ U.T,
            P=self.P + w * times(V, U.T),
            T=self.T + w * V @ VT,
            H=self.H + cross + cross.transpose(0, 2, 1) + V @ (U.T @ GU) @ VT,
        )

    def at(self, subset: Int[np.ndarray, " n"]) -> "Gains":
        """The gains of these sites alone."""
        return replace(self, A=self.A[subset], P=self.P[subset], T=self.T[subset], H=self.H[subset])

    def all(self, subset: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """By how much each of the sites `subset` lowers trace(G C), mm^2."""
        noise = self.observation.noise_mm**2 * np.eye(self.A.shape[1])
        return traces(self.T[subset] + noise, self.H[subset])


def gains_at(observation: Observation, A: Float[np.ndarray, "s r k"], C: Float[np.ndarray, "k k"]) -> Gains:
    """`Gains` at a covariance C, by large products."""
    P = times(A, C)
    return Gains(observation, A, C, P, P @ A.transpose(0, 2, 1), times(P, observation.gram) @ P.transpose(0, 2, 1))


def traces(S: Float[np.ndarray, "n r r"], H: Float[np.ndarray, "n r r"]) -> Float[np.ndarray, " n"]:
    """trace(S^-1 H) of each of the n pairs."""
    return np.trace(np.linalg.solve(S, H), axis1=1, axis2=2)


def site_rows(sites: Sites, deltas: Float[np.ndarray, "k v 3"]) -> Float[np.ndarray, "s r k"]:
    """A: the deltas at both members of every site, zeros for the second of a single; 3 rows where all are singles."""
    count = sites.size.max()
    A = np.moveaxis(deltas[:, sites.vertices[:, :count]], 0, 3).reshape(len(sites.vertices), 3 * count, -1)
    A = A.astype(np.float64)
    A[sites.size == 1, 3:] = 0
    return A


def error_gains(
    observation: Observation, A: Float[np.ndarray, "s r k"], C: Float[np.ndarray, "k k"]
) -> Float[np.ndarray, " s"]:
    """By how much each site would lower trace(G C), square millimetres."""
    P = times(A, C)
    S = P @ A.transpose(0, 2, 1) + observation.noise_mm**2 * np.eye(A.shape[1])
    return np.trace(np.linalg.solve(S, times(P, observation.gram) @ P.transpose(0, 2, 1)), axis1=1, axis2=2)


def rank_gains(
    observation: Observation, A: Float[np.ndarray, "s r k"], vertices: Int[np.ndarray, " m"]
) -> Float[np.ndarray, " s"]:
    """How strongly each site answers to the mixes that `vertices` do not see, square millimetres."""
    _, sigma, V = np.linalg.svd(observation.response(vertices), full_matrices=True)
    seen = (sigma > RANK_TOLERANCE * sigma[0]).sum()
    if seen >= observation.full_rank:
        return np.zeros(len(A))
    visible_mixes = np.linalg.eigh(observation.gram)[1][:, -observation.full_rank :]
    unseen = V[seen:] @ visible_mixes @ visible_mixes.T
    return np.sum(times(A, unseen.T) ** 2, axis=(1, 2))


def times(rows: Float[np.ndarray, "s r k"], matrix: Float[np.ndarray, "k j"]) -> Float[np.ndarray, "s r j"]:
    """One large product instead of s small ones."""
    return (rows.reshape(-1, rows.shape[2]) @ matrix).reshape(*rows.shape[:2], -1)
