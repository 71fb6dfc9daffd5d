"""What a plan says of its landmarks, recomputed: places, constraints, costs, bounds, information."""

import numpy as np

from capture_plan.anatomy.regions import mirrored_label
from capture_plan.layout.assembly import most_of
from capture_plan.layout.head_sites import SECTORS, head_candidates, sectors_for
from capture_plan.layout.lower_bound import bound_from, shares_of
from capture_plan.layout.problem import Task
from capture_plan.layout.record import Landmark
from capture_plan.layout.settings import BY_ERROR
from capture_plan.layout.spacing import nearest_straight, nearest_two
from capture_plan.plan.claims import TOLERANCE, Claim, claim
from capture_plan.plan.predicted import under_noise
from capture_plan.plan.record import Plan

HARDLY = 1e-3  # of a landmark: prices carry six decimals, rounded down


def landmark_claims(plan: Plan, task: Task) -> list[Claim]:
    """Skin, coverage, symmetry, spacing, constraints and the bound of every program."""
    settings, landmarks, face = task.settings, plan.layout.landmarks, task.face
    vertices = np.array([m.vertex for m in landmarks])
    covers = face.relative_displacement(settings)[:, vertices] >= settings.epsilon
    missed = [name for name, row in zip(face.used, covers, strict=True) if not row.any()]
    claims = [
        claim("every landmark lies on the skin", face.rig.skin[vertices].all(), f"{len(vertices)} landmarks"),
        claim(
            "every blendshape has a landmark, but for those listed as uncovered",
            set(missed) == set(plan.layout.uncovered),
            f"{len(face.used) - len(missed)} of {len(face.used)} covered",
        ),
    ]
    if settings.symmetric:
        alone = set(vertices.tolist()) - set(face.mirror[vertices].tolist())
        claims.append(claim("the layout is symmetric", not alone, f"{len(alone)} landmarks without a mirror image"))
        claims.append(mirrored_claim(plan, task))
    if settings.spacing_mm and settings.method != "trivial":
        dots = np.array([m.vertex for m in plan.layout.markers])
        along, straight = nearest_two(face.graph, dots), nearest_straight(face.rig.neutral, dots)
        claims.append(
            claim(
                f"markers stand at least {settings.spacing_mm:g} mm apart, straight and along the skin",
                min(along, straight) >= settings.spacing_mm - 1e-6,
                f"nearest two {straight:.1f} mm straight, {along:.1f} mm along the skin",
            )
        )
    claims += [method_claim(plan), *constraint_claims(plan, task)]
    if plan.layout.method in BY_ERROR:
        return [*claims, *error_claims(plan, task)]
    return [
        *claims,
        *(
            claim(
                f"program {number + 1} costs no less than its bound",
                program.objective >= program.bound - TOLERANCE,
                f"{program.objective:.4f} for {program.landmarks} landmarks",
            )
            for number, program in enumerate(plan.layout.programs)
        ),
    ]


def method_claim(plan: Plan) -> Claim:
    """The method that was asked for answers, or `budget` where `studio` was given a budget that binds."""
    asked, answers = plan.settings.landmarks, plan.layout.method
    within = asked.method == "studio" and answers == "budget" and asked.budget is not None
    return claim(f"the method '{asked.method}' is the one that answers", within or asked.method == answers, answers)


def mirrored_claim(plan: Plan, task: Task) -> Claim:
    """Landmarks that mirror each other are called so: other side; same region and number where places have names and no
    pair of landmarks lies across a border of regions. Two that lie in the middle are counted one after the other."""
    at = {m.vertex: m for m in plan.layout.landmarks}
    pairs = [(m, at[n]) for m in at.values() if (n := int(task.face.mirror[m.vertex])) in at and n != m.vertex]
    other, regions = {"left": "right", "right": "left", "middle": "middle"}, task.face.regions
    named = regions.known and all(regions.region(a.vertex) == regions.region(b.vertex) for a, b in pairs)
    unlike = [
        f"{a.name} {a.label}, {b.name} {b.label}"
        for a, b in pairs
        if a.vertex < b.vertex
        and (b.side != other[a.side] or (named and (a.region != b.region or not _called_alike(a, b))))
    ]
    return claim("mirrored landmarks have mirrored names", not unlike, "; ".join(unlike) or f"{len(pairs) // 2} pairs")


def _called_alike(a: Landmark, b: Landmark) -> bool:
    return a.side == "middle" or b.label == mirrored_label(a.label)


def constraint_claims(plan: Plan, task: Task) -> list[Claim]:
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
            f"{task.settings.head_markers or 'no'} head markers",
            len(plan.layout.head) == task.settings.head_markers,
            f"{len(plan.layout.head)}, {pose.surface_mm:.2f} mm of error from the head's pose" if pose else "none",
        ),
        *head_claims(plan, task),
    ]


def head_claims(plan: Plan, task: Task) -> list[Claim]:
    """Head markers stand where the face stays still."""
    if not plan.layout.head:
        return []
    found = head_candidates(task.face, task.face.cameras)
    still = found.vertices
    moving = [m.name for m in plan.layout.head if m.vertex not in still]
    asked = sectors_for(found, len(plan.layout.head), task.settings.min_visibility)
    held = found.sector[np.isin(still, [m.vertex for m in plan.layout.head])]
    empty = [SECTORS[sector] for sector in asked if sector not in held]
    return [
        claim("head markers stand where the face stays still", not moving, ", ".join(moving) or "all of them"),
        claim("head markers stand around the face", not empty, f"none on: {', '.join(empty)}" if empty else "spread"),
    ]


def error_claims(plan: Plan, task: Task) -> list[Claim]:
    """A budget is kept, and where it pays for a cover, the layout is one and has no fewer landmarks than any has;
    the shares of the certificate prove the least error."""
    layout, sites = plan.layout, task.sites
    budget = most_of(plan.settings.landmarks, layout.method, len(layout.landmarks))
    held = len(layout.landmarks) <= budget
    found = f"{len(layout.landmarks)} landmarks"
    if layout.programs:
        unseen = set(plan.audit.used) - {plan.audit.used[k] for k in task.reachable}
        held &= set(layout.uncovered) == unseen and layout.programs[0].bound <= len(layout.landmarks)
        held &= layout.programs[0].bound <= layout.programs[0].objective + TOLERANCE
        found += f", at least {layout.programs[0].bound:g} to see every blendshape under these constraints"
    what = f"keeps its budget of {budget} landmarks" if layout.method == "budget" else "has a landmark on all it can"
    claims = [claim(f"the layout {what}", held, found)]
    if not layout.error_bound:
        claims.append(claim("the least error of any layout is stated", holds=False, found="no certificate"))
    else:
        shares = shares_of(sites, layout.error_bound)
        proved = bound_from(task.observation, sites, shares, budget=budget, limits=task.limits)
        said = layout.error_bound.error_mm
        claims.append(
            claim(
                f"no layout of {budget} landmarks has an upper estimate below {said:.3f} mm",
                (shares >= 0).all()
                and abs(proved - said) < TOLERANCE
                and said <= layout.information.error_mm + TOLERANCE,
                f"the shares prove {proved:.3f} mm, this layout has {layout.information.error_mm:.3f} mm",
            )
        )
    return [*claims, *target_claims(plan, task)]


def target_claims(plan: Plan, task: Task) -> list[Claim]:
    """The shares of its own certificate prove the bound of the number that any layout needs to equal the others; that
    number itself is compared with what follows from the certificate (`follow.target_landmarks`)."""
    fewest, said = plan.layout.target_landmarks, plan.layout.target_bound
    if fewest is None or said is None:
        holds = fewest is None and said is None
        return [claim("the number that others' error takes has its certificate", holds, f"{fewest or 'no'} landmarks")]
    shares = shares_of(task.sites, said)
    proved = bound_from(task.observation, task.sites, shares, budget=fewest, limits=task.limits)
    return [
        claim(
            f"no layout of {fewest} landmarks has an upper estimate below {said.error_mm:.3f} mm, whatever the budget",
            (shares >= 0).all() and abs(proved - said.error_mm) < TOLERANCE,
            f"the shares prove {proved:.3f} mm",
        )
    ]


def bound_claims(plan: Plan, task: Task) -> list[Claim]:
    """The dual prices keep every site's limit and add up to the bound."""
    layout, settings, face, sites = plan.layout, task.settings, task.face, task.sites
    prices = np.zeros(len(face.used))
    prices[[face.used.index(name) for name in layout.certificate.blendshapes]] = layout.certificate.weights
    paid = (prices @ sites.covers(settings.epsilon))[task.open_]
    slack = np.where(sites.covers(settings.epsilon)[:, task.open_], sites.size[task.open_] - paid, np.inf).min(axis=1)
    raised = [name for name, more in zip(face.used, slack.tolist(), strict=True) if HARDLY < more < np.inf]
    bound, said = int(np.ceil(prices.sum() - 1e-9)), layout.certificate.landmarks
    return [
        claim(
            f"to see every blendshape takes at least {said} landmarks",
            (paid <= sites.size[task.open_] + 1e-9).all()
            and (prices >= 0).all()
            and bound == layout.certificate.landmarks,
            f"the prices that prove it add up to {prices.sum():.3f}",
        ),
        claim(
            "the prices prove as much as they can: none can be raised alone",
            not raised,
            f"{', '.join(raised[:3])} and so on, {len(raised)} in all, can" if raised else "every one is at its limit",
        ),
        claim(
            "the layout has as many landmarks as are proved to be needed, or says what it leaves out",
            said <= len(layout.landmarks) or bool(layout.uncovered),
            f"{len(layout.landmarks)} landmarks",
        ),
    ]


def information_claims(plan: Plan, task: Task) -> list[Claim]:
    """Rank, condition and upper estimate of the error."""
    said = plan.layout.information
    found = task.observation.information(np.array([m.vertex for m in plan.layout.landmarks]))
    return [
        claim(
            f"{said.rank} of {said.full_rank} mixes of blendshapes are distinguished",
            (found.rank, found.full_rank) == (said.rank, said.full_rank),
            f"rank {found.rank}, {found.full_rank} at most",
        ),
        claim(
            f"upper estimate of the error {said.error_mm:.3f} mm {under_noise(said)}",
            abs(found.error_mm - said.error_mm) < TOLERANCE and np.isclose(found.condition, said.condition, rtol=1e-2),
            f"{found.error_mm:.3f} mm, condition {found.condition:.0f}",
        ),
    ]
