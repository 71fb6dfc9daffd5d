"""Check a plan with nothing but this file, Python and NumPy: `python verify_plan.py [DIR]`.

Reads DIR/plan.json and DIR/rig.npz (`capture-plan export PLAN --only verify` writes both), computes again what the plan
says, prints one line for each check and exits with 1 if one fails. It imports nothing of the program that made the plan
and asks no solver: a proof is a certificate in the plan, of which only the arithmetic is done here.

Given in rig.npz, taken as true: the mesh (millimetres, y up, the face looks along z, the subject's left at +x), its
  blendshapes, which vertices are skin, which blendshapes are planned for and the audit that says why; how well each
  vertex is seen; vertices shut by keep-outs and limits; the mirror map (tested below); left/right partners, correctives
  (`drivers`) and what no face does at once; how much each blendshape matters; 68 points; recorded motion.
Not looked at: sentences, session times, regions and words of labels but for their side, cameras' views, hard pairs,
  overlap warnings, what was split from its partner and why, the order of expressions, blendshapes that a take never
  shows, which blendshapes a later program is about, versions and the seal. `capture-plan check` looks at these too.

Letters  v vertices, k blendshapes, s sites (one vertex, or a vertex and its mirror image), m markers
"""

import hashlib
import heapq
import json
import sys
from itertools import combinations
from math import ceil
from pathlib import Path

import numpy as np

STILL, RANK, PRIOR_SD = 0.01, 1e-4, 0.2  # share of motion; share of singular values; standard deviation of weights
SAME = 2e-4  # the plan rounds to four decimals


class Face:
    """What follows from the rig and the settings alone."""

    def __init__(self, plan, rig):
        self.plan, self.rig, self.want = plan, rig, plan["settings"]["landmarks"]
        self.x, self.skin, self.mirror, self.used = rig["neutral"], rig["skin"], rig["mirror"], rig["used"].tolist()
        names = rig["names"].tolist()
        self.deltas = rig["deltas"][[names.index(name) for name in self.used]]
        self.moved = np.where(self.skin, np.linalg.norm(self.deltas, axis=2), 0)  # |d[k, v]|, 0 off the skin
        self.moving = self.skin & (self.moved.max(axis=0) > STILL * self.moved.max())
        seen = self.skin & (self.moving | self.moving[self.mirror]) & (rig["visibility"] >= self.want["min_visibility"])
        # r[k, v] = |d[k, v]| / largest of k on seen skin, 0 where k drowns in noise
        self.pins = [int(np.flatnonzero(rig["source_index"] == pin)[0]) for pin in self.want["pins"]]
        largest = np.where(seen, self.moved, 0).max(axis=1, keepdims=True)
        may = seen.copy()
        may[self.pins] = True
        known = np.where(may & (largest > self.want["noise_mm"]), self.moved, 0)
        self.reach = np.minimum(known / np.where(largest > 0, largest, 1), 1)
        self.covers = self.reach >= self.want["epsilon"]
        # G = mean over the moving skin of D_v' D_v
        D = self.deltas[:, self.moving].astype(float).reshape(len(self.used), -1)
        self.G = D @ D.T / self.moving.sum()
        self.sites = self.sites_of(may)
        self.size = 1 + (self.sites[:, 0] != self.sites[:, 1])
        self.neighbours = skin_graph(self.x, rig["triangles"][self.skin[rig["triangles"]].all(axis=1)])
        self.open = ~rig["shut"][self.sites].any(axis=1)
        for head in plan["layout"]["head"]:
            near = list(within(self.neighbours, head["vertex"], self.want["spacing_mm"]))
            self.open &= ~np.isin(self.sites, [*near, head["vertex"]]).any(axis=1)

    def sites_of(self, may):
        """(s 2) vertices where landmarks may stand: each with its mirror image where the layout is symmetric."""
        v = np.arange(len(self.x))
        if not self.want["symmetric"]:
            return np.stack([v[may], v[may]], axis=1)
        may = may.copy()
        may[self.mirror[self.pins]] = True
        image, x = self.mirror, self.x
        apart = np.linalg.norm(x - x[image], axis=1) >= self.want["spacing_mm"]
        kept = may & may[image] & (image[image] == v) & ((image == v) | (apart & (x[:, 0] < x[image, 0])))
        return np.stack([v[kept], image[kept]], axis=1)

    def site_at(self, vertices):
        """Numbers of the sites that these vertices belong to."""
        return np.flatnonzero(np.isin(self.sites, vertices).any(axis=1))

    def covariance(self, vertices):
        """C = (B' B / sigma^2 + I / tau^2)^-1, B the three rows of deltas of every landmark."""
        B = self.deltas[:, vertices].astype(float).reshape(len(self.used), -1).T
        return np.linalg.inv(B.T @ B / self.want["noise_mm"] ** 2 + np.eye(len(self.used)) / PRIOR_SD**2)

    def error(self, vertices):
        """sqrt(trace(G C)), millimetres."""
        return float(np.sqrt((self.G * self.covariance(vertices)).sum()))


# The skin: distances along it


def skin_graph(x, triangles):
    """{v: [(neighbour, length)]}: edges, and straight ways across an edge to the apex of the triangle beyond it."""
    around, across = {}, {}
    for a, b, c in triangles.tolist():
        for i, j, k in ((a, b, c), (b, c, a), (c, a, b)):
            around.setdefault(i, {})[j] = around.setdefault(j, {})[i] = max(float(np.linalg.norm(x[i] - x[j])), 1e-9)
            across.setdefault((min(i, j), max(i, j)), []).append(k)
    for (i, j), apexes in across.items():
        for k, n in zip(apexes, apexes[1:], strict=False):
            e, p, q = x[j] - x[i], x[k] - x[i], x[n] - x[i]
            length = float(np.linalg.norm(e)) or 1.0
            # unfolded into the plane of the edge: apexes at (s, h) and (t, -g)
            s, t = float(p @ e) / length, float(q @ e) / length
            h, g = (float(np.linalg.norm(y - u * e / length)) for y, u in ((p, s), (q, t)))
            if h + g > 0 and 0 < (s * g + t * h) / (h + g) < length:
                way = max(float(np.hypot(s - t, h + g)), 1e-9)
                around[k][n] = around[n][k] = min(way, around[k].get(n, np.inf))
    return {v: list(ways.items()) for v, ways in around.items()}


def within(neighbours, start, radius):
    """{vertex: distance along the skin} of all nearer than a radius (Dijkstra)."""
    found, heap = {}, [(0.0, start)]
    while heap:
        far, v = heapq.heappop(heap)
        if v in found or far >= radius:
            continue
        found[v] = far
        for u, length in neighbours.get(v, ()):
            if u not in found and far + length < radius:
                heapq.heappush(heap, (far + length, u))
    return found


# The checks: each yields (what, holds, found)


def check_rig(face):
    """The plan is for this rig."""
    plan, rig = face.plan, face.rig
    meant = [repr(tuple(map(str, pair))) for pair in rig["meanings"]]
    digest = hashlib.sha256("\0".join([*rig["names"].tolist(), *meant]).encode())
    for key, kind in (("neutral", "<f4"), ("triangles", "<i4"), ("deltas", "<f4"), ("skin", bool)):
        digest.update(np.ascontiguousarray(rig[key].astype(kind)).tobytes())
    own = digest.hexdigest()[:16]
    yield "the plan is for this rig", plan["rig"]["fingerprint"] == own, f"fingerprint {own}"
    same = plan["audit"] == json.loads(str(rig["audit"])) and plan["audit"]["used"] == face.used
    yield "the audit is that of the rig", same, f"{len(face.used)} blendshapes planned for"
    image, bad = face.sites[:, 1], 0
    for some in np.array_split(face.sites[:, 0], max(1, len(face.sites) // 500)):
        turned = face.x[some] * [-1, 1, 1] + [2 * float(rig["mirror_x_mm"]), 0, 0]
        nearest = np.sqrt(((turned[:, None] - face.x[None]) ** 2).sum(axis=2).min(axis=1))
        bad += int((np.linalg.norm(turned - face.x[face.mirror[some]], axis=1) > nearest + 0.03).sum())
    found = f"{len(image)} sites, {bad} with a nearer one"
    yield "no vertex is nearer to a mirror image than its partner", bad == 0, found


def check_places(face):
    """Where markers stand, and on which side."""
    rig, layout = face.rig, face.plan["layout"]
    for group, letter in ((layout["landmarks"], "M"), (layout["head"], "H")):
        wrong, sides = [], []
        for number, m in enumerate(group, start=1):
            v, corners = m["vertex"], rig["triangles"][m["triangle"]]
            place = np.array(m["barycentric"]) @ face.x[corners]
            holds = m["name"] == f"{letter}{number:02d}" and 0 <= v < len(face.x) and bool(face.skin[v])
            holds &= m["triangle"] >= 0 and m["source_vertex"] == rig["source_index"][v]
            holds &= max(np.abs(face.x[v] - m["position"]).max(), np.abs(place - m["position"]).max()) < 1e-3
            wrong += [] if holds else [m["name"]]
            x = face.x[v, 0] - float(rig["midline_mm"])
            side = "middle" if abs(x) <= float(rig["middle_mm"]) else "left" if x > 0 else "right"
            word = m["label"].split(" ")[0]
            told = {"left": "left", "right": "right"}.get(word, "middle" if rig["sided"] else side)
            sides += [] if side == m["side"] == told else [f"{m['name']} '{m['label']}' is on the {side}"]
        if group:
            what = "landmarks" if letter == "M" else "head markers"
            found = f"{len(group)}, wrong: {', '.join(wrong) or 'none'}"
            yield f"{what} lie at their vertex, place and triangle, on skin", not wrong, found
            yield f"{what} called left lie on the left, right ones on the right", not sides, "; ".join(sides) or "all"
    v = [m["vertex"] for m in layout["landmarks"]]
    yield "no two landmarks share a vertex", len(set(v)) == len(v) > 0, f"{len(v)} landmarks"
    open_ = set(face.sites[face.open].ravel().tolist())
    stray = [m["name"] for m in layout["landmarks"] if m["vertex"] not in open_]
    yield "landmarks stand where one may: seen, moving, outside the keep-outs", not stray, ", ".join(stray) or "all"
    if face.want["symmetric"]:
        alone = [m["name"] for m in layout["landmarks"] if face.mirror[m["vertex"]] not in v]
        yield "every landmark has its mirror twin", not alone, f"without: {', '.join(alone) or 'none'}"


def check_cover(face):
    """Every blendshape has a landmark; no layout has fewer than the prices prove."""
    layout, eps = face.plan["layout"], face.want["epsilon"]
    wrong = []
    for m in layout["landmarks"]:
        own = [name for name, covers in zip(face.used, face.covers[:, m["vertex"]], strict=True) if covers]
        wrong += [] if own == m["blendshapes"] else [m["name"]]
    said = f"every landmark moves by {eps:g} or more of what it stands for"
    yield said, not wrong, f"wrong: {', '.join(wrong) or 'none'}"
    v = [m["vertex"] for m in layout["landmarks"]]
    none = [name for name, row in zip(face.used, face.covers[:, v], strict=True) if not row.any()]
    found = f"{len(face.used) - len(none)} of {len(face.used)}, not: {', '.join(none) or 'none'}"
    yield "every blendshape has a landmark, but for those listed", none == layout["uncovered"], found
    # y >= 0 and sum_k y[k] c[k, s] <= n[s] at every site: any cover has sum_s n[s] f[s] >= sum_k y[k] landmarks
    bound = layout["certificate"]
    y = np.zeros(len(face.used))
    y[[face.used.index(name) for name in bound["blendshapes"]]] = bound["weights"]
    pair_covers = face.covers[:, face.sites].any(axis=2)
    over = int((y @ pair_covers > face.size + 1e-9)[face.open].sum())
    least = ceil(y.sum() - 1e-9)
    holds = bool((y >= 0).all()) and not over and least == bound["landmarks"]
    found = f"prices add up to {y.sum():.3f}, over the limit at {over} of {int(face.open.sum())} sites"
    yield f"proved: no fewer than {bound['landmarks']} landmarks see every blendshape", holds, found
    reachable = pair_covers[:, face.open].any(axis=1)
    enough = least <= len(v) or bool((set(none) & {n for n, r in zip(face.used, reachable, strict=True) if r}))
    yield "the layout has at least as many as are proved to be needed", enough, f"{len(v)} landmarks"


def check_programs(face):
    """What every program chose covers its blendshapes at the stated cost."""
    layout, counts = face.plan["layout"], face.plan["layout"]["method"] in ("budget", "motion")
    chosen = {m["vertex"]: m["round"] for m in layout["landmarks"]}
    for number, program in enumerate(layout["programs"]):
        rows = [face.used.index(name) for name in program["blendshapes"]]
        at = face.site_at(program["vertices"])
        reach, seen = face.reach[rows][:, face.sites[at]].max(axis=2), face.rig["visibility"][face.sites[at]].min(axis=1)
        covers = reach >= face.want["epsilon"]
        # w = 2 - (1 - alpha) r - alpha l (Zell & McDonnell 2022, eq. 1)
        w = np.where(covers, 2 - (1 - face.want["alpha"]) * reach - face.want["alpha"] * seen, 0).sum(axis=0)
        kind = "count" if counts else face.want["weights"]
        mean = np.where(covers.any(axis=0), w / np.maximum(covers.sum(axis=0), 1), 2.0)
        cost = {"count": face.size[at], "paper": w, "lexicographic": face.size[at] * mean}[kind]
        cost = np.rint(cost / 1e-4).sum() * 1e-4
        holds = bool(covers.any(axis=1).all()) and abs(cost - program["objective"]) < SAME
        holds &= int(face.size[at].sum()) == program["landmarks"] == len(set(program["vertices"]))
        holds &= program["bound"] <= program["objective"] + SAME
        holds &= program["proven_optimal"] == (program["bound"] >= program["objective"])
        holds &= counts or all(chosen.get(v) == number for v in program["vertices"])
        found = f"{covers.any(axis=1).sum()} of {len(rows)} blendshapes, cost {cost:.4f}"
        yield f"program {number + 1} covers its blendshapes at its cost", holds, found


def check_distances(face):
    """Least distance of two markers, along the skin and straight."""
    layout, least = face.plan["layout"], face.want["spacing_mm"]
    v = [m["vertex"] for m in (*layout["landmarks"], *layout["head"])]
    names = {m["vertex"]: m["name"] for m in (*layout["landmarks"], *layout["head"])}
    close = []
    for a in v:
        near = within(face.neighbours, a, max(least, 1e-6))
        close += [(far, names[a], names[b]) for b, far in near.items() if b in names and b > a]
    x = face.x[v]
    straight = np.linalg.norm(x[:, None] - x[None], axis=2)[np.triu_indices(len(v), 1)].min(initial=np.inf)
    told = "; ".join(f"{a} and {b}: {far:.2f} mm" for far, a, b in sorted(close)[:3])
    if least and face.want["method"] != "trivial":
        what = f"markers stand at least {least:g} mm apart along the skin"
        yield what, not close, told or f"none closer; straight, the nearest two are {straight:.2f} mm apart"


def check_worth(face):
    """Rank, condition and predicted error of the layout, of its first landmarks and of other layouts."""
    layout = face.plan["layout"]
    strength = np.sqrt(np.clip(np.linalg.eigvalsh(face.G)[::-1], 0, None))
    full = max(1, int((strength > RANK * strength[0]).sum()))
    own = {"the layout": ([m["vertex"] for m in layout["landmarks"]], layout["worth"])}
    for name, (v, said) in (own | {name: (one["vertices"], one) for name, one in layout["references"].items()}).items():
        sigma = np.linalg.svd(face.deltas[:, v].astype(float).reshape(len(face.used), -1), compute_uv=False)
        rank, error = max(1, int((sigma > RANK * sigma[0]).sum())), face.error(v)
        holds = (said["rank"], said["full_rank"], said["landmarks"]) == (rank, full, len(v))
        holds &= said["noise_mm"] == face.want["noise_mm"] and abs(said["error_mm"] - error) < SAME
        holds &= abs(said["condition"] - sigma[0] / sigma[rank - 1]) <= 0.01 * said["condition"]
        yield (
            f"{name}: rank {said['rank']} of {said['full_rank']}, predicted error {said['error_mm']:.3f} mm",
            holds,
            f"{len(v)} landmarks, rank {rank} of {full}, {error:.4f} mm",
        )
        if name != "the layout" and len(v) == len(face.rig["points68"]) and "68" in name:
            yield f"{name} stand where they belong", v == face.rig["points68"].tolist(), f"{len(v)} points"
        elif name != "the layout":
            missed = face.covers[:, face.sites].any(axis=(1, 2)) & ~face.covers[:, v].any(axis=1)
            yield f"{name} covers every blendshape", not missed.any(), f"{int(missed.sum())} missed"
    at, order = {m["name"]: m["vertex"] for m in layout["landmarks"]}, layout["order"]
    if order or layout["method"] in ("budget", "motion"):
        off = [abs(face.error([at[n] for n in order[: i + 1]]) - mm) for i, mm in enumerate(layout["curve_mm"])]
        holds = sorted(order) == sorted(at) and len(off) == len(at) and max(off) < SAME
        yield "the curve is the error of the first landmarks in their order", holds, f"{max(off):.5f} mm off at most"


def check_error_bound(face):
    """Shares of sites prove that no layout of the budget predicts less (convexity: f(mu) >= f(lam) + g (lam - mu))."""
    layout, said = face.plan["layout"], face.plan["layout"]["error_bound"]
    if layout["method"] != "budget":
        return
    budget = face.want["budget"] or face.want["number"]
    yield f"the layout keeps its budget of {budget}", len(layout["landmarks"]) <= budget, str(len(layout["landmarks"]))
    share = dict(zip(said["vertices"], said["shares"], strict=True))
    lam = np.array([share.get(v, 0.0) for v in face.sites[:, 0].tolist()])
    at, sigma2 = np.flatnonzero(lam), face.want["noise_mm"] ** 2
    A = face.deltas.astype(float).transpose(1, 2, 0)  # (v 3 k)
    H = np.eye(len(face.used)) / PRIOR_SD**2
    for s in at:
        rows = A[np.unique(face.sites[s])].reshape(-1, len(face.used))
        H += lam[s] * rows.T @ rows / sigma2
    C = np.linalg.inv(H)
    w, Q = np.linalg.eigh(face.G)
    per_vertex = ((A @ (C @ (Q * np.sqrt(np.clip(w, 0, None))))) ** 2).sum(axis=(1, 2)) / sigma2
    g = np.where(face.size == 2, per_vertex[face.sites].sum(axis=1), per_vertex[face.sites[:, 0]])
    held = face.open & np.isin(face.sites, face.pins).any(axis=1)
    left, best = budget - face.size[held].sum(), g[held].sum()
    free = np.flatnonzero(face.open & ~held)
    for s in free[np.argsort(-g[free] / face.size[free], kind="stable")]:
        part = min(1.0, max(0.0, left / face.size[s]))
        left, best = left - face.size[s], best + part * g[s]
    squared = float((face.G * C).sum() + g @ lam - best)
    unseen = PRIOR_SD**2 * float(np.clip(w[::-1][3 * budget :], 0, None).sum())  # M landmarks answer to 3 M mixes
    bound = np.sqrt(max(squared, unseen, 0.0))
    holds = bool((lam >= 0).all()) and abs(bound - said["error_mm"]) < SAME and bound <= layout["worth"]["error_mm"] + SAME
    yield f"proved: no layout of {budget} landmarks predicts less than {said['error_mm']:.3f} mm", holds, f"{bound:.4f} mm"


def check_head_pose(face):
    """Errors of a rigid fit to the head markers."""
    layout, said = face.plan["layout"], face.plan["layout"]["head_pose"]
    yield "as many head markers as asked for", len(layout["head"]) == face.want["head_markers"], str(len(layout["head"]))
    if not layout["head"]:
        return
    x, noise = face.x[[m["vertex"] for m in layout["head"]]], face.want["noise_mm"]
    r, d = x - x.mean(axis=0), face.x[face.moving] - x.mean(axis=0)
    # cov of the rotation = sigma^2 J^-1, J = sum |r|^2 I - r r'; of the shift sigma^2 / m I
    J = np.linalg.inv((r**2).sum() * np.eye(3) - r.T @ r)
    turned = (d**2).sum(axis=1) * np.trace(J) - np.einsum("vx,xy,vy->v", d, J, d) + 3 / len(x)
    own = (np.degrees(noise * np.sqrt(np.trace(J))), noise * np.sqrt(3 / len(x)), noise * np.sqrt(turned.mean()))
    off = np.abs(np.array(own) - [said["rotation_degrees"], said["translation_mm"], said["surface_mm"]]).max()
    yield "the head's pose is as exact as stated", off < SAME, f"{own[0]:.3f} degrees, {own[1]:.3f} mm, {own[2]:.3f} mm"


def joined(names, links):
    """Names in groups: whoever is linked, directly or by others."""
    group = {name: {name} for name in names}
    for link in links:
        merged = set().union(*(group[name] for name in link if name in group))
        group |= dict.fromkeys(merged, merged)
    return group


def check_expressions(face):
    """Every blendshape once, none disturbed by another; no list is shorter than what the clique or a count proves."""
    rig, packing, want = face.rig, face.plan["packing"], face.plan["settings"]["expressions"]
    edits, shots = want["edits"], packing["expressions"]
    largest = face.moved.max(axis=1, keepdims=True)
    on = (face.moved >= want["mu"] * largest) & (face.moved > 0) & (largest > 1e-3)
    active = dict(zip(face.used, on, strict=True))
    rules = {kind: [tuple(pair) for pair in rig[kind].tolist()] for kind in RULES}
    for corrective, base in rules["drivers"]:  # who performs a corrective performs what it corrects
        active[corrective] = active[corrective] | on[face.used.index(base)]
    wrong = [kind for kind in RULES if [tuple(pair) for pair in packing[kind]] != rules[kind]]
    yield "partners, rules and correctives are those of the rig", not wrong, f"other: {', '.join(wrong) or 'none'}"
    names = [name for name in face.used if name not in edits["dropped"]]
    lists = [*(shot["blendshapes"] for shot in shots), *packing["unscanned"]]
    listed = [name for one in lists for name in one]
    holds = sorted(listed) == sorted(names) and sorted(packing["left_out"]) == sorted(sum(packing["unscanned"], []))
    yield "every blendshape is in one expression, or listed as left out", holds, f"{len(listed)} of {len(names)}"
    partners = joined(names, rules["pairs"] + rules["local"])
    apart = {frozenset(p) for p in (*rules["exclusive"], *rules["colliding"], *map(tuple, edits["apart"]))}
    clash = []
    for number, one in enumerate(lists, start=1):
        for a, b in combinations(one, 2):
            shared = 0 if b in partners[a] else int((active[a] & active[b]).sum())
            clash += [f"E{number:02d}: {a} and {b} share {shared} vertices"] if shared else []
            clash += [f"E{number:02d}: {a} and {b} cannot be performed at once"] if frozenset((a, b)) in apart else []
    found = "; ".join(clash[:3]) or f"{len(lists)} expressions"
    yield "no two blendshapes of an expression share skin or exclude each other", not clash, found
    locked = {name: where for name, where in edits["locked"].items() if isinstance(where, int)}
    asked = [*edits["together"], *([n, *w] for n, w in edits["locked"].items() if not isinstance(w, int))]
    asked += [[n for n, w in locked.items() if w == number] for number in set(locked.values())]
    kept = [pair for pair in rules["pairs"] + rules["local"] if pair not in rules["relaxed"]]
    place = {name: number for number, one in enumerate(lists, start=1) for name in one}
    split = [f"{' and '.join(g)}" for g in [*kept, *asked] if len({place.get(name) for name in g}) > 1]
    split += [f"{n} from E{w:02d}" for n, w in locked.items() if place.get(n) != w and place.get(n, 0) <= len(shots)]
    yield "partners and the artist's edits are kept", not split, "; ".join(split) or "all"
    item = joined(names, [*kept, *asked])
    # clique: in every two of its items some blendshapes share skin or exclude each other
    fit = []
    for a, b in combinations(packing["clique"], 2):
        meets = any(
            (active[i] & active[j]).any() or frozenset((i, j)) in apart or locked.get(i, n) != locked.get(j, n)
            for i in item[a]
            for j in item[b]
            for n in [locked.get(i, locked.get(j))]
        )
        fit += [] if meets and item[a] is not item[b] else [f"{a} and {b}"]
    most = int(rig["most_things"])  # movements that one expression asks for at most, 0 for any
    things = sum(len({id(g) for g in joined(list(one), rules["pairs"]).values()}) for one in unique(item))
    counted, J = (ceil(things / most) if most else 0), len(lists)
    least = max(len(packing["clique"]), counted)
    holds = not fit and packing["bound"] == least <= packing["objective"] == J and things == packing["things"]
    found = f"a clique of {len(packing['clique'])}, {things} movements; fit together: {'; '.join(fit) or 'none'}"
    yield f"proved: no list has fewer than {packing['bound']} expressions", holds, found
    holds = packing["proven_optimal"] == (least == J) and least <= packing["solver_bound"] <= J
    words = "proved" if packing["proven_optimal"] else "not proved"
    yield f"{packing['objective']} expressions, {words} the fewest", holds, f"{J} expressions, at least {least} proved"
    many = [s["name"] for s in shots if most and len({id(g) for g in joined(s["blendshapes"], rules["pairs"]).values()}) > most]
    yield "no expression asks for too many movements", not many and (packing["most_things"] or 0) == most, str(most)
    share, covered, off = dict(zip(face.used, rig["importance"].tolist(), strict=True)), 0.0, 0.0
    for number, shot in enumerate(shots, start=1):
        gain = sum(share[name] for name in shot["blendshapes"])
        covered += gain
        bases = dict.fromkeys(b for name in shot["blendshapes"] for c, b in rules["drivers"] if c == name)
        same = shot["name"] == f"E{number:02d}" and shot["drivers"] == [*bases]
        same &= shot["weights"] == [1.0] * len(shot["blendshapes"])
        off = max(off, abs(gain - shot["gain"]), abs(min(covered, 1) - shot["covered"]), 0.0 if same else np.inf)
    yield "names, weights and importance of the expressions add up", off < SAME, f"{off:.6f} off at most"


RULES = ("pairs", "local", "relaxed", "exclusive", "colliding", "drivers")


def unique(groups):
    """Every group of `joined` once."""
    return list({id(group): group for group in groups.values()}.values())


# The thin shell: K d = forces, K = -kS L + kB L M^-1 L (Botsch & Sorkine 2008; Le et al. 2013), kS = 1, kB = 10 in mm


def stiffness(x, triangles):
    """K as (row, column, value) of its entries."""
    n, corners = len(x), x[triangles]
    side = ((np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)) ** 2).sum(axis=2)  # opposite to each corner
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)[:, None] / 2
    cot = (side.sum(axis=1, keepdims=True) - 2 * side) / (4 * area)
    part = cot * side / 8  # mixed Voronoi areas (Meyer et al. 2003)
    blunt = np.where(cot < 0, area / 2, area / 4)
    share = np.where((cot < 0).any(axis=1, keepdims=True), blunt, np.roll(part, -1, axis=1) + np.roll(part, -2, axis=1))
    M = np.bincount(triangles.ravel(), share.ravel(), n)
    u, v, half = np.roll(triangles, -1, axis=1).ravel(), np.roll(triangles, -2, axis=1).ravel(), cot.ravel() / 2
    row, col, L = added(np.r_[u, v, u, v], np.r_[v, u, u, v], np.r_[half, half, -half, -half], n)
    # (L M^-1 L)_ij = sum_m L_im L_mj / M_m: every two entries of each row m
    count = np.bincount(row, minlength=n)
    first = np.cumsum(count) - count
    e = np.repeat(np.arange(len(row)), count[row])
    f = first[row[e]] + np.arange(len(e)) - np.repeat(np.cumsum(count[row]) - count[row], count[row])
    bend = 10.0 * L[e] * L[f] / M[row[e]]
    return added(np.r_[row, col[e]], np.r_[col, col[f]], np.r_[-1.0 * L, bend], n)


def added(row, col, value, n):
    """Entries with the same place added up, in the order of rows."""
    at, place = np.unique(row.astype(np.int64) * n + col, return_inverse=True)
    return at // n, at % n, np.bincount(place.ravel(), value)


def bend(K, n, held, given):
    """W (n h): how far each vertex goes when one of the vertices `given` does; `held` ones stay. None if a piece floats.

    K_UU W_U = -K_UG. Vertices by their distance in the graph of K make it block tridiagonal: Gauss, block by block.
    """
    row, col, value = K
    still = held.copy()
    still[given] = True
    level, number = np.where(still, -1, n), 0
    front = np.unique(col[still[row] & ~still[col]])
    while len(front):
        level[front] = number
        number += 1
        front = np.unique(col[(level[row] == number - 1) & (level[col] == n)])
    if (level == n).any():
        return None
    order = np.argsort(level, kind="stable")
    start = np.searchsorted(level[order], np.arange(number + 1))
    at = np.zeros(n, dtype=int)
    at[order] = np.arange(n) - start[np.maximum(level[order], 0)]
    size = np.diff(start)
    W, rights, downs, solved = np.zeros((n, len(given))), [], [], None
    W[given, np.arange(len(given))] = 1
    for i in range(number):
        mine = level[row] == i
        to = mine & (level[col] == i)
        S, B = np.zeros((size[i], size[i])), np.zeros((size[i], len(given)))
        S[at[row[to]], at[col[to]]] = value[to]
        out = mine & (level[col] == -1)
        np.add.at(B, at[row[out]], -value[out][:, None] * W[col[out]])
        if solved is not None:
            S, B = S - downs[-1].T @ solved[:, : size[i]], B - downs[-1].T @ solved[:, size[i] :]
        up = mine & (level[col] == i + 1)
        down = np.zeros((size[i], size[i + 1] if i + 1 < number else 0))
        down[at[row[up]], at[col[up]]] = value[up]
        solved = np.linalg.solve(S, np.hstack([down, B]))
        downs.append(down)
        rights.append(solved)
    for i in reversed(range(number)):
        mine, wide = order[start[i] : start[i + 1]], downs[i].shape[1]
        W[mine] = rights[i][:, wide:]
        if wide:
            W[mine] -= rights[i][:, :wide] @ W[order[start[i + 1] : start[i + 2]]]
    return W


def take_errors(face, vertices):
    """RMSE over all takes with markers at these vertices, and of each person, millimetres."""
    rig = face.rig
    at, fixed, s = rig["shell_at"], rig["shell_fixed"], rig["shell_importance"].astype(float)
    markers = np.flatnonzero(np.isin(at, vertices) & ~fixed)
    squares, shares = {}, {}
    for q in range(len(rig["take_person"])):
        person, share = int(rig["take_person"][q]), float(rig["take_share"][q])
        if person not in face.shells:
            face.shells[person] = stiffness(rig[f"person{person}_neutral"], rig["shell_triangles"])
        key = (person, *markers.tolist())
        if key not in face.bent:
            face.bent[key] = bend(face.shells[person], len(at), fixed, markers)
        W, X, C = face.bent[key], rig[f"take{q}_shapes"].astype(float), rig[f"take{q}_weights"].astype(float)
        R = X if W is None else X - np.einsum("vm,rmx->rvx", W, X[:, markers])
        R = (R * np.sqrt(s)[:, None]).reshape(len(X), -1)
        # mean over the frames of |sum_r C_tr R_r|^2 = sum_rr' (C'C / F)_rr' R_r . R_r'
        squares.setdefault(person, []).append(share * float(((C.T @ C / len(C)) * (R @ R.T)).sum()))
        shares.setdefault(person, []).append(share)
    each = [float(np.sqrt(sum(squares[p]) / (sum(shares[p]) * s.sum()))) for p in squares]
    total, weight = sum(map(sum, squares.values())), sum(map(sum, shares.values())) * s.sum()
    return float(np.sqrt(total / weight)), each


def check_motion(face):
    """What recorded takes lose when only the markers are known and a thin shell follows them."""
    rig, layout, said = face.rig, face.plan["layout"], face.plan["layout"]["motion"]
    if "take_person" not in rig:
        yield "no take, nothing said of one", said is None, "no take in rig.npz"
        return
    face.shells, face.bent = {}, {}
    furthest = np.zeros(len(rig["shell_at"]))
    for q in range(len(rig["take_person"])):
        X, C = rig[f"take{q}_shapes"].astype(float), rig[f"take{q}_weights"].astype(float)
        for c in C:
            np.maximum(furthest, np.linalg.norm(np.tensordot(c, X, 1), axis=1), out=furthest)
    frames, fixed = sum(len(rig[f"take{q}_weights"]) for q in range(len(rig["take_person"]))), rig["shell_fixed"]
    holds = (said["frames"], said["boundary"], said["stretching"], said["bending"]) == (frames, fixed.sum(), 1, 10)
    holds &= said["vertices"] == int((rig["shell_importance"] > 0).sum()) and bool((furthest[fixed] < 0.5).all())
    found = f"{frames} frames, {len(fixed)} vertices, held at {fixed.sum()} that stay still"
    yield "frames and shell are those of the takes", holds, found
    at = {m["name"]: m["vertex"] for m in layout["landmarks"]}
    order = layout["order"] if said["curve_mm"] else list(at)
    v = [at[name] for name in order]
    own, each = take_errors(face, v)
    yield f"the takes lose {said['rmse_mm']:.3f} mm", abs(own - said["rmse_mm"]) < SAME, f"{own:.4f} mm"
    if len(each) > 1 or said["subjects"]:
        told = [one["rmse_mm"] for one in said["subjects"]]
        names = [n for one in said["subjects"] for n in one["sequences"]]
        holds = len(told) == len(each) and names == rig["take_name"].tolist()
        holds &= all(abs(a - b) < SAME for a, b in zip(told, each, strict=False))
        yield f"the takes are of {len(told)} people", holds, ", ".join(f"{mm:.4f} mm" for mm in each)
    for name, mm in said["references_mm"].items():
        found = take_errors(face, layout["references"][name]["vertices"])[0]
        yield f"{name} would lose {mm:.3f} mm", abs(found - mm) < SAME, f"{found:.4f} mm"
    if said["curve_mm"]:
        some = sorted({max(1, len(v) * part // 4) for part in (1, 2, 3, 4)})
        off = max(abs(take_errors(face, v[:m])[0] - said["curve_mm"][m - 1]) for m in some)
        steps = np.diff(said["curve_mm"]).max(initial=0)
        holds = off < SAME and len(said["curve_mm"]) == len(v)
        yield "the curve is what the first landmarks lose", holds, f"at {some}: {off:.5f} mm off, steps up {steps:.4f}"


CHECKS = (
    check_rig,
    check_places,
    check_cover,
    check_programs,
    check_distances,
    check_worth,
    check_error_bound,
    check_head_pose,
    check_expressions,
    check_motion,
)


def verify(plan, rig):
    """(what, holds, found) of every check; what cannot be read at all does not hold."""
    lines = []
    try:
        face = Face(plan, rig)
    except Exception as error:
        return [("the plan can be read", False, repr(error))]
    for check in CHECKS:
        try:
            lines += [(what, bool(holds), found) for what, holds, found in check(face)]
        except Exception as error:
            lines.append((f"{check.__doc__.split('.')[0]}: the plan can be read", False, repr(error)))
    return lines


def main(folder):
    """Print every check of the plan in a folder; the exit code."""
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    with np.load(folder / "rig.npz", allow_pickle=False) as archive:
        rig = dict(archive)
    lines = verify(plan, rig)
    for what, holds, found in lines:
        print(f"{'ok  ' if holds else 'FAIL'}  {what}: {found}")
    failed = sum(not holds for _, holds, _ in lines)
    print(f"{len(lines) - failed} of {len(lines)} checks hold")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent))
