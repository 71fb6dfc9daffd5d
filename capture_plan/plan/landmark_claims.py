"""What a plan says of its landmarks, recomputed: places, wishes, costs, bounds, worth."""

import numpy as np

from capture_plan.layout.face import Face
from capture_plan.layout.quality import importance_weights, mean_quality, total_quality
from capture_plan.layout.relaxation import bound_from, shares_of
from capture_plan.layout.settings import ORDERED
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import nearest_two
from capture_plan.layout.task import Task, task_of
from capture_plan.layout.worth import Observation, error_against_budget
from capture_plan.mesh.mirror import mirror_map
from capture_plan.plan.claims import TOLERANCE, Claim, claim
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig


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
    if settings.spacing_mm and settings.method != "trivial":
        dots = np.array([m.vertex for m in plan.layout.markers])
        nearest = nearest_two(face.graph, dots)
        claims.append(
            claim(
                f"markers stand at least {settings.spacing_mm:g} mm apart on the skin",
                nearest >= settings.spacing_mm - 1e-6,
                f"nearest two {nearest:.1f} mm apart",
            )
        )
    task = task_of(face, settings)
    sites = task.sites
    claims += wish_claims(plan, task)
    if plan.layout.method == "budget":
        return [*claims, *budget_claims(plan, task)]
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


def wish_claims(plan: Plan, task: Task) -> list[Claim]:
    """Every pin, keep-out, cap, number and view that the settings ask for."""
    vertices = [m.vertex for m in plan.layout.landmarks]
    chosen = np.flatnonzero(np.isin(task.sites.vertices, vertices).all(axis=1))
    pose = plan.layout.head_pose
    return [
        *(
            claim(limit.name, limit.shortfall(chosen) == 0, f"{int(limit.amount[chosen].sum())} landmarks")
            for limit in task.limits
        ),
        claim(
            f"{task.settings.head_markers} head markers",
            len(plan.layout.head) == task.settings.head_markers,
            f"{len(plan.layout.head)}, {pose.surface_mm:.2f} mm of error from the head's pose" if pose else "none",
        ),
    ]


def budget_claims(plan: Plan, task: Task) -> list[Claim]:
    """The budget is kept, and where it pays for a cover, the layout is one and has no fewer landmarks than any has;
    the shares of the certificate prove the least error."""
    layout, settings, sites = plan.layout, plan.settings.landmarks, task.sites
    budget = settings.budget or settings.number or 0
    held = len(layout.landmarks) <= budget
    found = f"{len(layout.landmarks)} landmarks"
    if layout.programs:
        unseen = set(plan.audit.used) - {plan.audit.used[k] for k in task.reachable}
        held &= set(layout.uncovered) == unseen and layout.programs[0].bound <= len(layout.landmarks)
        found += f", at least {layout.programs[0].bound:g} to see every blendshape under these wishes"
    claims = [claim(f"the layout keeps its budget of {budget} landmarks", held, found)]
    if layout.error_bound:
        if layout.head:
            task = task.beside(np.array([m.vertex for m in layout.head]))
        shares = shares_of(sites, layout.error_bound)
        proved = bound_from(task.observation, sites, shares, budget=budget, limits=task.limits)
        said = layout.error_bound.error_mm
        claims.append(
            claim(
                f"no layout of {budget} landmarks predicts less than {said:.3f} mm",
                (shares >= 0).all() and abs(proved - said) < TOLERANCE and said <= layout.worth.error_mm + TOLERANCE,
                f"the shares prove {proved:.3f} mm, this layout has {layout.worth.error_mm:.3f} mm",
            )
        )
    return claims


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
    task = task_of(face, settings)
    if layout.head:
        task = task.beside(np.array([m.vertex for m in layout.head]))
    sites = task.sites
    prices = np.zeros(len(face.used))
    prices[[face.used.index(name) for name in layout.certificate.blendshapes]] = layout.certificate.weights
    paid = (prices @ sites.covers(settings.epsilon))[task.open_]
    bound, said = int(np.ceil(prices.sum() - 1e-9)), layout.certificate.landmarks
    return [
        claim(
            f"any cover needs at least {said} landmarks (dual prices)",
            (paid <= sites.size[task.open_] + 1e-9).all()
            and (prices >= 0).all()
            and bound == layout.certificate.landmarks,
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
    if layout.method not in ORDERED:
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
