"""Repair: add sites until every blendshape mix can be told apart and the upper estimate of the error is small enough.

With P = D C (three rows a vertex, D its deltas), adding a site whose rows of D are A gives

    C' = C - C A^T S^-1 A C,   S = sigma^2 I + A C A^T,

and lowers trace(G C) by trace(S^-1 A C G C A^T): a closed form for all sites at once (A-optimal design). Where the
error is small enough and the rank is not, the site that answers most to the mixes nobody sees yet is added.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.layout.limits import Limit, open_under
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing, taken_by
from capture_plan.layout.worth import RANK_TOLERANCE, Observation
from capture_plan.progress import track


def repair(
    observation: Observation,
    sites: Sites,
    chosen: Int[np.ndarray, " n"],
    *,
    target_mm: float,
    spacing: Spacing | None,
    limits: Sequence[Limit] = (),
) -> Int[np.ndarray, " a"]:
    """Sites to add to `chosen`, at the spacing, so that the rank is full and the error at most `target_mm`.

    What cannot be had is not forced: the answer stops where no open site helps. Added sites that later ones made
    superfluous are taken back.
    """
    A = site_rows(sites, observation.deltas)
    added = np.empty(0, dtype=int)
    for _ in track(range(len(sites.visibility)), "Telling every blendshape apart", total=len(sites.visibility)):
        vertices = sites.members(np.concatenate([chosen, added]))
        C = observation.covariance(vertices)
        open_ = open_sites(sites, np.concatenate([chosen, added]), spacing, limits)
        wanting = observation.error(C) > target_mm
        gain = error_gains(observation, A, C) if wanting else rank_gains(observation, A, vertices)
        if not gain[open_].any():
            break
        added = np.append(added, np.where(open_, gain, -1).argmax())
    return prune(observation, sites, chosen, added, target_mm)


def open_sites(
    sites: Sites, chosen: Int[np.ndarray, " n"], spacing: Spacing | None, limits: Sequence[Limit]
) -> Bool[np.ndarray, " s"]:
    """Sites that keep spacing and limits beside all that are chosen."""
    count = len(sites.visibility)
    return open_under(limits, chosen, count) & ~taken_by(chosen, spacing, count)


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


def prune(
    observation: Observation,
    sites: Sites,
    chosen: Int[np.ndarray, " n"],
    added: Int[np.ndarray, " a"],
    target_mm: float,
) -> Int[np.ndarray, " b"]:
    """`added` without the sites that neither the rank nor the error needs, the earliest tried first."""
    whole = observation.worth(sites.members(np.concatenate([chosen, added])))
    for site in added:
        rest = added[added != site]
        worth = observation.worth(sites.members(np.concatenate([chosen, rest])))
        if worth.rank == whole.rank and worth.error_mm <= max(target_mm, whole.error_mm):
            added = rest
    return added
