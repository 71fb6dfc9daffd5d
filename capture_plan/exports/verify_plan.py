"""Check a plan with nothing but this file, Python and NumPy: `python verify_plan.py [DIR]`.

Reads DIR/plan.json and DIR/rig.npz (`capture-plan export PLAN --only verify` writes both), computes again what the plan
says, prints one line for each check and exits with 1 if one fails. It imports nothing of the program that made the plan
and asks no solver: a proof is a certificate in the plan, of which only the arithmetic is done here.

Given in rig.npz, taken as true: the mesh (millimetres, y up, the face looks along z, the subject's left at +x), its
  blendshapes, which vertices are skin, which blendshapes are planned for and the audit that says why; how well each
  vertex is seen, and where landmarks may stand though they are not; vertices shut by keep-outs and limits; the mirror
  map (tested below); left/right partners, correctives (`drivers`) and what no face does at once; how much each
  blendshape matters; 68 points; recorded motion.
Not looked at: sentences, session times, regions, roles and words of labels but for their side, cameras' views, hard
  pairs, overlap warnings, the order of expressions, blendshapes that a take does not show and notes on it, which
  blendshapes a later program is about, whether a program's choice is the cheapest, settings that show nowhere else,
  versions and the seal. `capture-plan check` looks at these too.

Letters  v vertices, k blendshapes, s sites (one vertex, or a vertex and its mirror image), m markers
"""

import hashlib
import heapq
import json
import sys
from itertools import combinations, pairwise
from math import ceil
from pathlib import Path

import numpy as np

STILL, RANK, PRIOR_SD = 0.01, 1e-4, 0.2  # share of motion; share of singular values; standard deviation of weights
FORMATS, ORDERED = (3, 4), ("studio", "budget", "motion")
EVEN, USUAL = "dots spread evenly", 68
TARGETS = ("68 points (iBUG)", EVEN)
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
        seen = (rig["visibility"] >= self.want["min_visibility"]) | rig["opened"]
        seen &= self.skin & (self.moving | self.moving[self.mirror])
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

    def covariance(self, vertices):
        """C = (B' B / sigma^2 + I / tau^2)^-1, B the three rows of deltas of every landmark."""
        B = self.deltas[:, vertices].astype(float).reshape(len(self.used), -1).T
        return np.linalg.inv(B.T @ B / self.want["noise_mm"] ** 2 + np.eye(len(self.used)) / PRIOR_SD**2)

    def quality(self, reach, seen):
        """w = 2 - (1 - alpha) r - alpha l (Zell & McDonnell 2022, eq. 1): 0 best, 2 worst."""
        return 2 - (1 - self.want["alpha"]) * reach - self.want["alpha"] * seen

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
        for k, n in pairwise(apexes):
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
    same = (plan["rig"]["fingerprint"], plan["rig"]["vertices"]) == (own, len(face.x))
    yield "the plan is for this rig", same, f"fingerprint {own}, {len(face.x):,} vertices"
    yield "the plan is of a format known here", plan["format"] in FORMATS, str(plan["format"])
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
            holds &= abs(m["visibility"] - rig["visibility"][v]) < 1e-4 and m["triangle"] >= 0
            holds &= m["source_vertex"] == rig["source_index"][v]
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
    for m in (*layout["landmarks"], *layout["head"]):
        on, reach = face.covers[:, m["vertex"]], face.reach[:, m["vertex"]]
        holds = [name for name, covers in zip(face.used, on, strict=True) if covers] == m["blendshapes"]
        quality = face.quality(reach, face.rig["visibility"][m["vertex"]])[on].mean() if on.any() else 2.0
        wrong += [] if holds and abs(quality - m["quality"]) < SAME else [m["name"]]
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
    enough = least <= len(v) or bool(set(none) & {n for n, r in zip(face.used, reachable, strict=True) if r})
    yield "the layout has at least as many as are proved to be needed", enough, f"{len(v)} landmarks"


def check_programs(face):
    """What every program chose covers its blendshapes at the stated cost; whether none is cheaper, no one can see."""
    layout, counts = face.plan["layout"], face.plan["layout"]["method"] in ORDERED
    chosen, added = (
        {m["vertex"]: m["round"] for m in layout["landmarks"]},
        {None} if layout["method"] != "cover" else set(),
    )
    holds = {*chosen.values()} <= {*range(len(layout["programs"]) * (not counts))} | added
    yield "every landmark was chosen by a program or added after them", holds, f"{len(layout['programs'])} programs"
    for number, program in enumerate(layout["programs"]):
        rows, v = [face.used.index(name) for name in program["blendshapes"]], program["vertices"]
        at = np.flatnonzero(np.isin(face.sites, v).any(axis=1))
        pairs, size = face.sites[at], face.size[at]
        reach, seen = face.reach[rows][:, pairs].max(axis=2), face.rig["visibility"][pairs].min(axis=1)
        covers = reach >= face.want["epsilon"]
        w = np.where(covers, face.quality(reach, seen), 0).sum(axis=0)
        mean = np.where(covers.any(axis=0), w / np.maximum(covers.sum(axis=0), 1), 2)
        kinds = {"count": size, "paper": w, "lexicographic": size * mean}
        cost = float(np.rint(kinds["count" if counts else face.want["weights"]] / 1e-4).sum() * 1e-4)
        holds = covers.any(axis=1).all() and abs(cost - program["objective"]) < SAME
        holds &= size.sum() == program["landmarks"] == len(v) == len(set(v)) and program["bound"] <= cost + SAME
        holds &= program["proven_optimal"] == (program["bound"] >= program["objective"])
        holds &= counts or sorted(v) == sorted(vertex for vertex in chosen if chosen[vertex] == number)
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
        what = f"markers stand at least {least:g} mm apart, straight and along the skin"
        holds = not close and straight >= least - 1e-6
        yield what, holds, told or f"none closer along it; straight, the nearest two are {straight:.2f} mm apart"


def check_worth(face):
    """Rank, condition and predicted error of the layout, of its first landmarks and of other layouts."""
    layout, k = face.plan["layout"], len(face.used)
    strength = np.sqrt(np.clip(np.linalg.eigvalsh(face.G)[::-1], 0, None))
    full = max(1, int((strength > RANK * strength[0]).sum()))
    at, order = {m["name"]: m["vertex"] for m in layout["landmarks"]}, layout["order"]
    others = {name: (one["vertices"], one) for name, one in layout["references"].items()}
    wanted = 2 + (len(face.rig["points68"]) > 0)
    yield "other layouts stand beside it", len(others) == wanted, ", ".join(others)
    for name, (v, said) in {"the layout": ([*at.values()], layout["worth"]), **others}.items():
        sigma = np.linalg.svd(face.deltas[:, v].astype(float).reshape(k, -1), compute_uv=False)
        rank, error = max(1, int((sigma > RANK * sigma[0]).sum())), face.error(v)
        holds = (said["rank"], said["full_rank"], said["landmarks"]) == (rank, full, len(v))
        holds &= said["noise_mm"] == face.want["noise_mm"] and abs(said["error_mm"] - error) < SAME
        holds &= abs(said["condition"] - sigma[0] / sigma[rank - 1]) <= 0.01 * said["condition"]
        what = f"{name}: rank {said['rank']} of {said['full_rank']}, predicted error {said['error_mm']:.3f} mm"
        yield what, holds, f"{len(v)} landmarks, rank {rank} of {full}, {error:.4f} mm"
        if name.startswith("68"):
            yield f"{name} stand where they belong", v == face.rig["points68"].tolist(), f"{len(v)} points"
        elif name == EVEN:
            enough = len(v) == len({*v}) == min(USUAL, int(face.moving.sum()))
            yield f"{name} are as many, on skin that moves", enough and face.moving[v].all(), f"{len(v)} dots"
        elif name in others:
            missed = face.covers[:, face.sites].any(axis=(1, 2)) & ~face.covers[:, v].any(axis=1)
            yield f"{name} covers every blendshape", not missed.any(), f"{int(missed.sum())} missed"
    ordered = layout["method"] in ORDERED
    off = [abs(face.error([at[n] for n in order[: i + 1]]) - mm) for i, mm in enumerate(layout["curve_mm"])]
    holds = (sorted(order), len(off)) == (sorted(at) if ordered else [], len(at) * ordered) and max(
        off, default=0
    ) < SAME
    yield (
        "the curve is the error of the first landmarks in their order",
        holds,
        f"{max(off, default=0):.5f} mm off at most",
    )


def check_error_bound(face):
    """No layout of the budget predicts less, f(mu) >= f(lam) + g (lam - mu) being true of a convex f at any shares."""
    layout, said, sigma = face.plan["layout"], face.plan["layout"]["error_bound"], face.want["noise_mm"]
    budget = face.want["budget"] or face.want["number"] or len(layout["landmarks"])
    yield "the layout keeps its budget", len(layout["landmarks"]) <= budget, f"{len(layout['landmarks'])} of {budget}"
    if layout["method"] not in ("studio", "budget"):
        yield "a bound of the error is stated where the method looks for the least", said is None, layout["method"]
        return
    budget = budget if layout["method"] == "budget" else len(layout["landmarks"])
    share, k = dict(zip(said["vertices"], said["shares"], strict=True)), len(face.used)
    lam, A = (
        np.array([share.get(v, 0.0) for v in face.sites[:, 0].tolist()]),
        face.deltas.astype(float).transpose(1, 2, 0),
    )
    # f = trace(G C) with C = (sum_s lam_s A_s' A_s / sigma^2 + I / tau^2)^-1, g_s = trace(A_s C G C A_s') / sigma^2
    H = np.eye(k) / PRIOR_SD**2
    for s in np.flatnonzero(lam):
        rows = A[np.unique(face.sites[s])].reshape(-1, k)
        H += lam[s] * rows.T @ rows / sigma**2
    C, (w, Q) = np.linalg.inv(H), np.linalg.eigh(face.G)
    each = ((A @ (C @ (Q * np.sqrt(np.clip(w, 0, None))))) ** 2).sum(axis=(1, 2)) / sigma**2
    g = np.where(face.size == 2, each[face.sites].sum(axis=1), each[face.sites[:, 0]])
    held = face.open & np.isin(face.sites, face.pins).any(axis=1)
    free = np.flatnonzero(face.open & ~held)
    free = free[np.argsort(-g[free] / face.size[free], kind="stable")]  # the mu that lowers the bound most
    before = np.cumsum(face.size[free]) - face.size[free] + face.size[held].sum()

    def least(M):
        mu = np.clip((M - before) / face.size[free], 0, 1)
        unseen = PRIOR_SD**2 * np.clip(w[::-1][3 * M :], 0, None).sum()  # M landmarks answer to 3 M mixes
        return float(np.sqrt(max((face.G * C).sum() + g @ lam - g[held].sum() - g[free] @ mu, unseen, 0)))

    bound = least(budget)
    holds = (lam >= 0).all() and abs(bound - said["error_mm"]) < SAME and bound <= layout["worth"]["error_mm"] + SAME
    what = f"proved: no layout of {budget} landmarks predicts less than {said['error_mm']:.3f} mm"
    yield what, holds, f"the shares prove {bound:.4f} mm"
    target = min(layout["references"][name]["error_mm"] for name in TARGETS if name in layout["references"])
    fewest, everywhere = layout["target_landmarks"], face.error(np.unique(face.sites[face.open]))
    if fewest is None:
        yield (
            f"no number of landmarks here predicts {target:.3f} mm",
            everywhere > target,
            f"{everywhere:.4f} mm at all",
        )
        return
    holds = everywhere <= target and least(fewest) <= target + SAME and (fewest == 1 or least(fewest - 1) > target)
    what = f"proved: no layout of fewer than {fewest} landmarks predicts {target:.3f} mm or less"
    yield what, holds, f"one fewer: {least(fewest - 1):.4f} mm" if fewest > 1 else "no fewer"


def check_head_pose(face):
    """Errors of a rigid fit to the head markers."""
    head, said, noise = face.plan["layout"]["head"], face.plan["layout"]["head_pose"], face.want["noise_mm"]
    holds = len(head) == face.want["head_markers"] and bool(head) == (said is not None)
    yield "as many head markers as asked for", holds, str(len(head))
    if not head:
        return
    x = face.x[[m["vertex"] for m in head]]
    r, d = x - x.mean(axis=0), face.x[face.moving] - x.mean(axis=0)
    # cov of the rotation = sigma^2 J^-1, J = sum |r|^2 I - r r'; of the shift sigma^2 / m I
    J = np.linalg.inv((r**2).sum() * np.eye(3) - r.T @ r)
    turned = (d**2).sum(axis=1) * np.trace(J) - np.einsum("vx,xy,vy->v", d, J, d) + 3 / len(x)
    own = (np.degrees(noise * np.sqrt(np.trace(J))), noise * np.sqrt(3 / len(x)), noise * np.sqrt(turned.mean()))
    off = np.abs(np.array(own) - [said["rotation_degrees"], said["translation_mm"], said["surface_mm"]]).max()
    yield "the head's pose is as exact as stated", off < SAME, f"{own[0]:.3f} degrees, {own[1]:.3f} mm, {own[2]:.3f} mm"


class Scans:
    """What follows from the rig and the settings for expressions."""

    def __init__(self, face):
        rig, want = face.rig, face.plan["settings"]["expressions"]
        edits, self.packing = want["edits"], face.plan["packing"]
        self.rules = {kind: [tuple(pair) for pair in rig[kind].tolist()] for kind in RULES}
        self.names = [name for name in face.used if name not in edits["dropped"]]
        largest = face.moved.max(axis=1, keepdims=True)
        on = (face.moved >= want["mu"] * largest) & (face.moved > 0) & (largest > 1e-3)
        self.active = dict(zip(face.used, on, strict=True))
        for corrective, base in self.rules["drivers"]:  # who performs a corrective performs what it corrects
            self.active[corrective] = self.active[corrective] | on[face.used.index(base)]
        partners = self.rules["pairs"] + self.rules["local"]
        self.partners = joined(self.names, partners)  # may share skin: their side tells them apart
        barred = (*self.rules["exclusive"], *self.rules["colliding"], *edits["apart"])
        self.barred = {frozenset(pair) for pair in barred}
        self.number = {name: where for name, where in edits["locked"].items() if isinstance(where, int)}
        beside = [[name, *where] for name, where in edits["locked"].items() if not isinstance(where, int)]
        same = [[n for n in self.number if self.number[n] == where] for where in set(self.number.values())]
        self.together = [p for p in partners if p not in self.rules["relaxed"]] + edits["together"] + beside + same
        self.item = joined(self.names, self.together)  # what is performed as one
        self.most = int(rig["most_things"])  # movements that one expression asks for at most, 0 for any
        self.lists = [*(shot["blendshapes"] for shot in self.packing["expressions"]), *self.packing["unscanned"]]

    def movements(self, names):
        """How many separate movements: left and right partners are one."""
        return len({id(group) for group in joined(names, self.rules["pairs"]).values()})

    def conflict(self, a, b):
        """Whether two blendshapes cannot be in one expression."""
        numbers = {self.number.get(a), self.number.get(b)} - {None}
        return bool((self.active[a] & self.active[b]).any()) or frozenset((a, b)) in self.barred or len(numbers) > 1


def joined(names, links):
    """{name: its group}: whoever is linked, directly or by others."""
    group = {name: {name} for name in names}
    for link in links:
        merged = set().union(*(group[name] for name in link if name in group))
        group |= dict.fromkeys(merged, merged)
    return group


def check_expressions(face):
    """Every blendshape in one expression, and none disturbed by another."""
    scans, packing, shots = Scans(face), face.plan["packing"], face.plan["packing"]["expressions"]
    wrong = [kind for kind in RULES if [tuple(pair) for pair in packing[kind]] != scans.rules[kind]]
    yield "partners, rules and correctives are those of the rig", not wrong, f"other: {', '.join(wrong) or 'none'}"
    listed, last = [name for one in scans.lists for name in one], [n for one in packing["unscanned"] for n in one]
    holds = sorted(listed) == sorted(scans.names) and sorted(packing["left_out"]) == sorted(last)
    holds &= len(shots) <= (face.plan["settings"]["expressions"]["limit"] or len(shots))
    yield "every blendshape is in one expression, or listed as left out", holds, f"{len(listed)} of {len(scans.names)}"
    clash = []
    for number, one in enumerate(scans.lists, start=1):
        for a, b in combinations(one, 2):
            shared = 0 if b in scans.partners[a] else int((scans.active[a] & scans.active[b]).sum())
            barred = "cannot be performed at once" if frozenset((a, b)) in scans.barred else ""
            told = f"share {shared} vertices" if shared else barred
            clash += [f"E{number:02d}: {a} and {b} {told}"] if told else []
    found = "; ".join(clash[:3]) or f"{len(scans.lists)} expressions"
    yield "no two blendshapes of an expression share skin or exclude each other", not clash, found
    place = {name: number for number, one in enumerate(scans.lists, start=1) for name in one}
    split = [" and ".join(group) for group in scans.together if len({place.get(name) for name in group}) > 1]
    split += [n for n, e in scans.number.items() if place.get(n) != e and place.get(n, 0) <= len(shots)]
    yield "partners and the artist's edits are kept", not split, "; ".join(split) or "all"
    many = [f"{number}" for number, one in enumerate(scans.lists, start=1) if scans.movements(one) > (scans.most or 99)]
    holds = not many and (packing["most_things"] or 0) == scans.most
    yield (
        "no expression asks for too many movements",
        holds,
        f"at most {scans.most}; more in: {', '.join(many) or 'none'}",
    )
    share, covered, off = dict(zip(face.used, face.rig["importance"].tolist(), strict=True)), 0.0, 0.0
    for number, shot in enumerate(shots, start=1):
        gain = sum(share[name] for name in shot["blendshapes"])
        covered += gain
        held = dict.fromkeys(base for name in shot["blendshapes"] for of, base in scans.rules["drivers"] if of == name)
        same = (shot["name"], shot["drivers"]) == (f"E{number:02d}", [*held]) and {*shot["weights"]} == {1.0}
        same &= len(shot["weights"]) == len(shot["blendshapes"])
        off = max(off, abs(gain - shot["gain"]), abs(min(covered, 1) - shot["covered"]), 0.0 if same else np.inf)
    yield "names, weights and importance of the expressions add up", off < SAME, f"{off:.6f} off at most"


def check_fewest(face):
    """No list is shorter than a clique of what cannot be together in pairs, or than movements counted."""
    scans, packing, J = Scans(face), face.plan["packing"], len(Scans(face).lists)
    fit = []
    for a, b in combinations(packing["clique"], 2):
        one, other = scans.item[a], scans.item[b]
        apart = one is not other and any(scans.conflict(i, j) for i in one for j in other)
        fit += [] if apart else [f"{a} and {b}"]
    things = sum(scans.movements(one) for one in {id(one): one for one in scans.item.values()}.values())
    least = max(len(packing["clique"]), ceil(things / scans.most) if scans.most else 0)
    holds = not fit and packing["bound"] == least <= J == packing["objective"] and things == packing["things"]
    found = f"a clique of {len(packing['clique'])}, {things} movements; fit together: {'; '.join(fit[:3]) or 'none'}"
    yield f"proved: no list has fewer than {packing['bound']} expressions", holds, found
    holds = packing["proven_optimal"] == (least == J) and least <= packing["solver_bound"] <= J
    words = "proved" if packing["proven_optimal"] else "not proved"
    yield f"{packing['objective']} expressions, {words} the fewest", holds, f"{J} expressions, at least {least} proved"


RULES = ("pairs", "local", "relaxed", "exclusive", "colliding", "drivers")

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


def dense(K, n, a, b):
    """Rows a, columns b of K."""
    (row, col, value), i, j = K, np.full(n, -1), np.full(n, -1)
    i[a], j[b] = np.arange(len(a)), np.arange(len(b))
    some, block = (i[row] >= 0) & (j[col] >= 0), np.zeros((len(a), len(b)))
    block[i[row[some]], j[col[some]]] = value[some]
    return block


def bend(K, n, held, given):
    """W (n h): how far each vertex goes when one of the vertices `given` does and `held` ones stay: K_UU W_U = -K_UG.

    Vertices by their distance from these make K block tridiagonal: Gauss, block by block. None where a piece floats.
    """
    done, layers = held.copy(), []
    done[given] = True
    while len(front := np.unique(K[1][done[K[0]] & ~done[K[1]]])):
        layers.append(front)
        done[front] = True
    if not done.all():
        return None
    W, solved = np.zeros((n, len(given))), []
    W[given] = np.eye(len(given))
    for mine, before, after in zip(layers, [[], *layers], [*layers[1:], []], strict=False):
        S, right = dense(K, n, mine, mine), np.hstack([dense(K, n, mine, after), -dense(K, n, mine, given)])
        if solved:
            up = dense(K, n, mine, before) @ solved[-1]
            S -= up[:, : len(mine)]
            right[:, len(after) :] -= up[:, len(mine) :]
        solved.append(np.linalg.solve(S, right))
    for mine, after, answer in reversed(list(zip(layers, [*layers[1:], []], solved, strict=True))):
        W[mine] = answer[:, len(after) :] - answer[:, : len(after)] @ W[after] if len(after) else answer
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
    lengths = [len(rig[f"take{q}_weights"]) for q in range(len(rig["take_person"]))]
    frames, fixed = sum(lengths), rig["shell_fixed"]
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
        own = [int(sum(n for q, n in enumerate(lengths) if rig["take_person"][q] == p)) for p in range(len(each))]
        holds = [one["frames"] for one in said["subjects"]] == own and names == rig["take_name"].tolist()
        holds &= all(abs(a - b) < SAME for a, b in zip(told, each, strict=False))
        yield f"the takes are of {len(told)} people", holds, ", ".join(f"{mm:.4f} mm" for mm in each)
    yield "other layouts are held against the takes", {*said["references_mm"]} == {*layout["references"]}, "by name"
    for name, mm in said["references_mm"].items():
        found = take_errors(face, layout["references"][name]["vertices"])[0]
        yield f"{name} would lose {mm:.3f} mm", abs(found - mm) < SAME, f"{found:.4f} mm"
    yield "an order comes with its curve", bool(said["curve_mm"]) == bool(layout["order"]), layout["method"]
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
    check_fewest,
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
            lines.append((f"{check.__name__}: the plan can be read", False, repr(error)))
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
