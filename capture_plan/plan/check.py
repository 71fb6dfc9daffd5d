"""Check a plan: recompute every claim from the rig, by code that knows no solver.

Each claim is one function that says what was found; it holds or it does not. A proof that only the solver has (that no
cover has fewer landmarks than `minimum`, that no shorter list of expressions exists) is checked as far as its
certificate goes: the dual prices of the set cover, the clique of blendshapes no two of which fit together.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capture_plan.expressions.certificate import packing_claims
from capture_plan.layout.face import Face, see_face
from capture_plan.layout.quality import importance_weights, mean_quality, total_quality
from capture_plan.layout.sites import Sites
from capture_plan.layout.worth import Observation, error_against_budget
from capture_plan.mesh import geodesic_distance, surface_graph
from capture_plan.mesh.mirror import mirror_map
from capture_plan.plan.places import read_cameras_of
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig

TOLERANCE = 2e-4  # numbers in a plan carry four decimals


@dataclass(frozen=True)
class Claim:
    """One thing that a plan says, whether it holds, and what was found."""

    what: str
    holds: bool
    found: str


def claim(what: str, holds: bool | np.bool, found: str) -> Claim:
    """A claim from what NumPy compared."""
    return Claim(what, bool(holds), found)


def check_plan(plan: Plan, rig: Rig, *, folder: Path = Path()) -> tuple[Claim, ...]:
    """Every claim of the plan, recomputed on the rig it was made for; `folder` is where the plan file lies."""
    face = see_face(rig, plan.audit.used, read_cameras_of(rig, plan.settings, folder))
    return (
        *landmark_claims(plan, rig, face),
        *bound_claims(plan, face),
        *worth_claims(plan, face),
        *expression_claims(plan, rig),
    )


def landmark_claims(plan: Plan, rig: Rig, face: Face) -> list[Claim]:
    """Places, coverage, symmetry, spacing and the cost of every program."""
    settings, landmarks = plan.settings.landmarks, plan.layout.landmarks
    vertices = np.array([m.vertex for m in landmarks])
    corners = rig.neutral[rig.triangles[[m.triangle for m in landmarks]]]
    rebuilt = np.einsum("mc,mcx->mx", np.array([m.barycentric for m in landmarks]), corners)
    off = np.abs(rebuilt - [m.position for m in landmarks]).max()
    covers = face.reach(settings)[:, vertices] >= settings.epsilon
    listed = np.array([[name in m.blendshapes for m in landmarks] for name in face.used])
    missed = [name for name, row in zip(face.used, covers, strict=True) if not row.any()]
    claims = [
        claim("every landmark lies on the skin", rig.skin[vertices].all(), f"{len(vertices)} landmarks"),
        claim("positions agree with triangles and barycentric coordinates", off < 2e-3, f"{off:.4f} mm apart at most"),
        claim("landmarks list what moves them", (covers == listed).all(), f"{covers.sum()} entries"),
        claim(
            "every blendshape has a landmark, but for those listed as uncovered",
            set(missed) == set(plan.layout.uncovered),
            f"{len(face.used) - len(missed)} of {len(face.used)} covered",
        ),
    ]
    if settings.symmetric:
        alone = set(vertices.tolist()) - set(mirror_map(rig.neutral)[vertices].tolist())
        claims.append(claim("the layout is symmetric", not alone, f"{len(alone)} landmarks without a mirror image"))
    if settings.method != "cover":
        skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
        distance = geodesic_distance(surface_graph(rig.neutral, skin), vertices)[:, vertices]
        np.fill_diagonal(distance, np.inf)
        claims.append(
            claim(
                f"landmarks stand at least {settings.spacing_mm:g} mm apart on the skin",
                distance.min() >= settings.spacing_mm - 1e-6,
                f"nearest two {distance.min():.1f} mm apart",
            )
        )
    sites = face.sites(settings)
    if settings.method == "budget":
        return [*claims, budget_claim(plan, sites)]
    for number, program in enumerate(plan.layout.programs):
        cost = program_cost(plan, sites, number)
        claims.append(
            claim(
                f"program {number + 1} costs what it says, and no less than its bound",
                abs(cost - program.objective) < TOLERANCE * len(landmarks) and cost >= program.bound - 1e-2,
                f"{cost:.4f} for {program.landmarks} landmarks",
            )
        )
    return claims


def budget_claim(plan: Plan, sites: Sites) -> Claim:
    """The budget is kept, and where it pays for a cover, the layout is one and has no fewer landmarks than any has."""
    layout, settings = plan.layout, plan.settings.landmarks
    held = len(layout.landmarks) <= (settings.budget or 0)
    found = f"{len(layout.landmarks)} landmarks"
    if layout.programs:
        reachable = np.flatnonzero(sites.covers(settings.epsilon).any(axis=1))
        unseen = set(plan.audit.used) - {plan.audit.used[k] for k in reachable}
        held &= set(layout.uncovered) == unseen and layout.programs[0].bound <= len(layout.landmarks)
        found += f", at least {layout.programs[0].bound:g} to see every blendshape at this spacing"
    return claim(f"the layout keeps its budget of {settings.budget} landmarks", held, found)


def program_cost(plan: Plan, sites: Sites, number: int) -> float:
    """The objective of one program, recomputed for the sites that it chose and the blendshapes it had to cover."""
    settings = plan.settings.landmarks
    mine = [m.vertex for m in plan.layout.landmarks if m.round == number]
    chosen = np.flatnonzero(np.isin(sites.vertices[:, 0], mine) & np.isin(sites.vertices[:, 1], mine))
    if settings.weights == "count":
        return float(sites.size[chosen].sum())
    rows = [plan.audit.used.index(name) for name in plan.layout.programs[number].blendshapes]
    covers = sites.covers(settings.epsilon)[rows][:, chosen]
    w = importance_weights(sites.reach, sites.visibility, settings.alpha)[rows][:, chosen]
    cost = total_quality(covers, w) if settings.weights == "paper" else sites.size[chosen] * mean_quality(covers, w)
    return float(cost.sum())


def bound_claims(plan: Plan, face: Face) -> list[Claim]:
    """The dual prices keep every site's limit and add up to the bound."""
    layout, settings = plan.layout, plan.settings.landmarks
    sites = face.sites(settings)
    prices = np.zeros(len(face.used))
    prices[[face.used.index(name) for name in layout.certificate.blendshapes]] = layout.certificate.weights
    paid = prices @ sites.covers(settings.epsilon)
    bound = int(np.ceil(prices.sum() - 1e-9))
    return [
        claim(
            f"any cover needs at least {layout.certificate.landmarks} landmarks (dual prices)",
            (paid <= sites.size + 1e-9).all() and (prices >= 0).all() and bound == layout.certificate.landmarks,
            f"prices add up to {prices.sum():.3f}; the solver's own bound is {layout.minimum}",
        ),
        claim(
            "the bounds and the layout agree",
            layout.certificate.landmarks <= layout.minimum <= len(layout.landmarks) or bool(layout.uncovered),
            f"{layout.certificate.landmarks} <= {layout.minimum}"
            + (f" <= {len(layout.landmarks)} landmarks" if not layout.uncovered else " landmarks"),
        ),
    ]


def worth_claims(plan: Plan, face: Face) -> list[Claim]:
    """Rank, condition and predicted error of the landmarks."""
    said, observation = plan.layout.worth, face.observation(plan.settings.landmarks.noise_mm)
    found = observation.worth(np.array([m.vertex for m in plan.layout.landmarks]))
    return [
        *curve_claims(plan, observation),
        claim(
            f"rank {said.rank} of {said.full_rank}",
            (found.rank, found.full_rank) == (said.rank, said.full_rank),
            f"{found.rank} of {found.full_rank}",
        ),
        claim(
            f"predicted error {said.error_mm:.3f} mm under {said.noise_mm:g} mm of noise",
            abs(found.error_mm - said.error_mm) < TOLERANCE and np.isclose(found.condition, said.condition, rtol=1e-2),
            f"{found.error_mm:.3f} mm, condition {found.condition:.0f}",
        ),
    ]


def curve_claims(plan: Plan, observation: Observation) -> list[Claim]:
    """The predicted error with the first landmarks of the order, where the plan has one."""
    layout, vertex_of = plan.layout, {m.name: m.vertex for m in plan.layout.landmarks}
    if plan.settings.landmarks.method != "budget":
        return []
    whole = sorted(layout.order) == sorted(vertex_of) and len(layout.curve_mm) == len(layout.order)
    vertices = np.array([vertex_of[name] for name in layout.order if name in vertex_of], dtype=int)
    curve = error_against_budget(observation, vertices)
    return [
        claim(
            "the curve of error against budget is that of the first landmarks of the order",
            whole and np.allclose(curve, layout.curve_mm, atol=TOLERANCE, rtol=0),
            f"{len(curve)} budgets",
        )
    ]


def expression_claims(plan: Plan, rig: Rig) -> list[Claim]:
    """Every blendshape once, no overlap, partners together, the clique, and shares that add up."""
    packing, mu = plan.packing, plan.settings.expressions.mu
    found = f"{len(packing.expressions)} expressions of {packing.objective}, the solver's own bound is {packing.bound}"
    faults = packing_claims(rig, plan.audit.used, packing, mu)
    running = np.cumsum([e.gain for e in packing.expressions])
    adds_up = np.allclose(running, [e.covered for e in packing.expressions], atol=1e-3)
    return [
        *(claim(what, not lines, "; ".join(lines) or found) for what, lines in faults.items()),
        claim("covered importance adds up", adds_up, f"{running[-1]:.1%} after the last expression"),
    ]
