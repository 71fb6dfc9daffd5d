"""Check a plan with nothing but this file, Python and NumPy: `python verify_plan.py [DIR]`.

Reads DIR/plan.json and DIR/rig.npz (`capture-plan export PLAN --only verify` writes both), computes again what the plan
says, prints one line for each check and exits with 1 if one fails. It imports nothing of the program that made the plan
and asks no solver: a proof is a certificate in the plan, of which only the arithmetic is done here.

Given in rig.npz, taken as true: the mesh (millimetres, y up, the face looks along z, the subject's left at +x), its
  blendshapes, which vertices are skin, which blendshapes are planned for and the audit that says why; how well each
  vertex is seen, which are asked at all (`places`: not all of a fine mesh), and where landmarks may stand though they
  are not seen; where cameras are known, the share of the blendshapes with which each of them reads a dot at each
  vertex, and how blurred it is; vertices shut by keep-outs and limits; the mirror map (tested below); left/right
  partners, correctives (`drivers`) and what no face does at once; how much each blendshape matters; 68 points; recorded
  motion.
Not looked at: sentences, session times, regions and words of labels but for their side, what cameras read, hard pairs,
  overlap warnings, the order of expressions and whether that of landmarks is the best, the error predicted for weights
  between 0 and 1, dots that meet when the face moves, blendshapes that a take does not show and notes on it, which
  blendshapes a later program is about, whether a program's choice is the cheapest, settings that show nowhere else,
  the actor's head, versions and the seal. `capture-plan check` looks at these too.

Letters  v vertices, k blendshapes, s sites (one vertex, or a vertex and its mirror image), m markers
"""

import hashlib
import json
import sys
from itertools import combinations
from math import ceil
from pathlib import Path

import numpy as np

STILL, RANK, PRIOR_SD = 0.01, 1e-4, 0.2  # share of motion; share of singular values; standard deviation of weights
FORMATS, ORDERED = (8,), ("studio", "budget", "motion")
EVEN, USUAL = "dots spread evenly", 68
RULES = ("pairs", "local", "relaxed", "exclusive", "colliding", "drivers")
TARGETS = ("68 points (iBUG)", EVEN)
SAME = 2e-4  # the plan rounds to four decimals


def unlike(said, own):
    """Where a record of the plan says otherwise than what was computed: ['rank 12, not 11']."""
    return [f"{key} {said[key]}, not {value}" for key, value in own.items() if not alike(said[key], value)]


def alike(said, own):
    """Whether two values are equal, numbers up to their rounding."""
    if isinstance(own, list | tuple):
        return len(said) == len(own) and all(map(alike, said, own))
    if isinstance(said, bool | str | None) or isinstance(own, bool | str | None):
        return said == own
    return bool(abs(said - own) <= SAME + 1e-6 * abs(own))


def pixels(camera, x):
    """Where points (v 3) lie in a camera's picture, by OpenCV's lenses: k1 k2 p1 p2 k3 | k4 k5 k6 | s1 s2 s3 s4 | tilt,
    or k1 k2 k3 k4 of a fisheye lens."""
    p = (x - camera["position"]) @ np.transpose(camera["rotation"])
    k = np.zeros(14)
    k[: len(camera["distortion"])] = camera["distortion"]
    if camera["fisheye"]:
        r = np.hypot(p[:, 0], p[:, 1])
        angle = np.arctan2(r, p[:, 2])
        bent = angle * (1 + sum(k[i] * angle ** (2 * i + 2) for i in range(4))) / np.where(r > 0, r, 1)
        a, b = p[:, 0] * bent, p[:, 1] * bent
    else:
        x, y = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2]
        s = x * x + y * y
        radial = (1 + k[0] * s + k[1] * s**2 + k[4] * s**3) / (1 + k[5] * s + k[6] * s**2 + k[7] * s**3)
        a = x * radial + 2 * k[2] * x * y + k[3] * (s + 2 * x * x) + k[8] * s + k[9] * s**2
        b = y * radial + k[2] * (s + 2 * y * y) + 2 * k[3] * x * y + k[10] * s + k[11] * s**2
        c, d = np.cos(k[12:]), np.sin(k[12:])
        T = np.array([[c[1], 0, -d[1]], [0, 1, 0], [d[1], 0, c[1]]]) @ [[1, 0, 0], [0, c[0], d[0]], [0, -d[0], c[0]]]
        u = np.array([[T[2, 2], 0, -T[0, 2]], [0, T[2, 2], -T[1, 2]], [0, 0, 1]]) @ T @ [a, b, np.ones(len(a))]
        a, b = u[0] / u[2], u[1] / u[2]
    return np.stack([a, b, np.ones(len(a))], axis=1) @ np.transpose(camera["intrinsics"])[:, :2]


class Face:
    """What follows from the rig and the settings alone."""

    def __init__(self, plan, rig):
        self.plan, self.rig, self.layout, self.want = plan, rig, plan["layout"], plan["settings"]["landmarks"]
        self.x, self.skin, self.mirror, self.used = rig["neutral"], rig["skin"], rig["mirror"], rig["used"].tolist()
        names = rig["names"].tolist()
        deltas = rig["deltas"][[names.index(name) for name in self.used]]
        self.moved = np.where(self.skin, np.linalg.norm(deltas, axis=2), 0)  # |d[k, v]|, 0 off the skin
        self.moving = self.skin & (self.moved.max(axis=0) > STILL * self.moved.max())
        seen = (rig["visibility"] >= self.want["min_visibility"]) | rig["opened"]
        seen &= self.skin & rig["places"] & (self.moving | self.moving[self.mirror])
        # r[k, v] = |d[k, v]| / largest of k on seen skin, 0 where k drowns in noise
        self.pins = [int(np.flatnonzero(rig["source_index"] == pin)[0]) for pin in self.want["pins"]]
        largest, may = np.where(seen, self.moved, 0).max(axis=1, keepdims=True), seen.copy()
        may[self.pins] = True
        known = np.where(may & (largest > self.want["noise_mm"]), self.moved, 0)
        self.relative_displacement = np.minimum(known / np.where(largest > 0, largest, 1), 1)
        self.covers = self.relative_displacement >= self.want["epsilon"]
        # G = mean over the moving skin of D_v' D_v
        self.deltas = deltas.astype(float)
        self.measured = self.by_cameras() if plan["cameras"] else self.deltas
        D = self.deltas[:, self.moving].reshape(len(self.used), -1)
        self.G = D @ D.T / self.moving.sum()
        self.sites = self.sites_of(may)
        self.size = 1 + (self.sites[:, 0] != self.sites[:, 1])
        shut = rig["shut"].copy()
        for m in self.layout["head"]:
            shut |= np.linalg.norm(self.x - self.x[m["vertex"]], axis=1) < max(self.want["spacing_mm"], 1e-9)
        self.open = ~shut[self.sites].any(axis=1)

    def by_cameras(self):
        """(k v 2c) deltas in pixels of every camera, each divided by the noise of a dot's middle there and weighted by
        how often the camera reads a dot; times sigma, as all else counts in it."""
        rows = []
        for camera, share, blur in zip(self.plan["cameras"], self.rig["read_share"], self.rig["blur"], strict=True):
            weight = self.want["noise_mm"] * np.sqrt(share / (1 + blur**2)) / camera["noise_px"]
            step = 1e-4 * np.linalg.norm(self.x - camera["position"], axis=1)[:, None]
            J = [
                (pixels(camera, self.x + step * e) - pixels(camera, self.x - step * e)) / (2 * step) for e in np.eye(3)
            ]
            J = np.where(share[:, None, None] > 0, np.nan_to_num(np.stack(J, axis=2)), 0)
            rows.append(weight[:, None, None] * J)
        self.seen = np.concatenate(rows, axis=1)  # (v 2c 3)
        return np.einsum("vij,kvj->kvi", self.seen, self.deltas)

    def exactness(self, vertex):
        """Standard deviations, mm, of a vertex as the cameras measure it, the least first; none for a direction that
        they do not tell."""
        strength = np.linalg.svd(self.seen[vertex], compute_uv=False)[:3] / self.want["noise_mm"]
        return [round(float(1 / one), 4) for one in strength if one > 3.2e-5 * max(strength[0], 1e-99)]

    def sites_of(self, may):
        """(s 2) vertices where landmarks may stand: each with its mirror image where the layout is symmetric."""
        v, image, x = np.arange(len(self.x)), self.mirror, self.x
        if not self.want["symmetric"]:
            return np.stack([v[may], v[may]], axis=1)
        may = may.copy()
        may[image[self.pins]] = True
        apart = np.linalg.norm(x - x[image], axis=1) >= self.want["spacing_mm"]
        retained = may & may[image] & (image[image] == v) & ((image == v) | (apart & (x[:, 0] < x[image, 0])))
        return np.stack([v[retained], image[retained]], axis=1)

    def covariance(self, vertices):
        """C = (B' B / sigma^2 + I / tau^2)^-1, B the rows of every landmark: its deltas, or what cameras see of it."""
        B = self.measured[:, vertices].reshape(len(self.used), -1).T
        return np.linalg.inv(B.T @ B / self.want["noise_mm"] ** 2 + np.eye(len(self.used)) / PRIOR_SD**2)

    def quality(self, relative, seen):
        """w = 2 - (1 - alpha) r - alpha l (Zell & McDonnell 2022, eq. 1): 0 best, 2 worst."""
        return 2 - (1 - self.want["alpha"]) * relative - self.want["alpha"] * seen

    def error(self, vertices):
        """sqrt(trace(G C)), millimetres: the upper estimate, for weights of any size."""
        return float(np.sqrt((self.G * self.covariance(vertices)).sum()))


# The checks: each yields (what, whether it holds or a list of what is wrong, what was found where no list tells)


def check_rig(face):
    """The plan is for this rig."""
    plan, rig = face.plan, face.rig
    meant = [repr(tuple(map(str, pair))) for pair in rig["meanings"]]
    digest = hashlib.sha256("\0".join([*rig["names"].tolist(), *meant]).encode())
    for key, kind in (("neutral", "<f4"), ("triangles", "<i4"), ("deltas", "<f4"), ("skin", bool)):
        digest.update(np.ascontiguousarray(rig[key].astype(kind)).tobytes())
    yield (
        "the plan is for this rig",
        unlike(plan["rig"], {"fingerprint": digest.hexdigest()[:16], "vertices": len(face.x)}),
    )
    yield "the plan is of a format known here", plan["format"] in FORMATS, plan["format"]
    yield "the plan is no draft: nothing was known against it", not plan["draft"], "; ".join(plan["draft"]) or "none"
    same = plan["audit"] == json.loads(str(rig["audit"])) and plan["audit"]["used"] == face.used
    yield "the audit is that of the rig", same, f"{len(face.used)} blendshapes planned for"


def check_mirror(face):
    """The mirror map leads to the nearest vertex."""
    bad, some = 0, 1 + len(face.sites) * len(face.x) // 10_000_000
    for v in np.array_split(face.sites[:, 0], some):
        turned = face.x[v] * [-1, 1, 1] + [2 * float(face.rig["mirror_x_mm"]), 0, 0]
        nearest = np.sqrt(((turned[:, None] - face.x[None]) ** 2).sum(axis=2).min(axis=1, initial=np.inf))
        bad += int((np.linalg.norm(turned - face.x[face.mirror[v]], axis=1) > nearest + 0.03).sum())
    found = f"{len(face.sites)} sites, {bad} with a nearer one"
    yield "no vertex is nearer to a mirror image than its partner", bad == 0, found


def check_places(face):
    """What every marker says of itself, and whether one may stand there."""
    rig, layout, wrong, sides = face.rig, face.layout, [], []
    for group, letter in ((layout["landmarks"], "M"), (layout["head"], "H")):
        for number, m in enumerate(group, start=1):
            v = range(len(face.x))[m["vertex"]]
            on, seen = face.covers[:, v], float(rig["visibility"][v])
            triangle = int(np.flatnonzero((rig["triangles"] == v).any(axis=1))[0])
            own = {
                "name": f"{letter}{number:02d}",
                "vertex": v,
                "source_vertex": int(rig["source_index"][v]),
                "position": np.round(face.x[v], 3).tolist(),
                "triangle": triangle,
                "barycentric": (rig["triangles"][triangle] == v).astype(float).tolist(),
                "blendshapes": [name for name, covers in zip(face.used, on, strict=True) if covers],
                "quality": float(face.quality(face.relative_displacement[:, v], seen)[on].mean()) if on.any() else 2.0,
                "visibility": seen,
                "role": "head" if letter == "H" else "backup" if m["round"] else "primary",
            }
            wrong += [f"{m['name']} {line}" for line in unlike(m, own)] + [f"{m['name']} off the skin"] * (
                not face.skin[v]
            )
            off = face.x[v, 0] - float(rig["midline_mm"])
            side = "middle" if abs(off) <= float(rig["middle_mm"]) else "left" if off > 0 else "right"
            word = m["label"].split(" ")[0]
            named = word if word in ("left", "right") else "middle" if rig["sided"] else side
            sides += [] if side == m["side"] == named else [f"{m['name']} '{m['label']}' is on the {side}"]
    yield "markers say of themselves what their vertex, on skin, gives", wrong
    yield "markers called left lie on the left, right ones on the right", sides
    v = [m["vertex"] for m in layout["landmarks"]]
    yield "no two landmarks share a vertex", len(set(v)) == len(v) > 0, f"{len(v)} landmarks"
    stray = [m["name"] for m in layout["landmarks"] if m["vertex"] not in face.sites[face.open]]
    yield "landmarks stand where one may: seen, moving, outside the keep-outs", stray
    alone = [m["name"] for m in layout["landmarks"] if face.want["symmetric"] and face.mirror[m["vertex"]] not in v]
    yield "every landmark of a symmetric layout has its mirror twin", alone
    markers, least = [*layout["landmarks"], *layout["head"]], face.want["spacing_mm"]
    apart = [
        (float(np.linalg.norm(face.x[a["vertex"]] - face.x[b["vertex"]])), f"{a['name']} and {b['name']}")
        for a, b in combinations(markers, 2)
    ]
    close = [f"{both}: {mm:.2f} mm" for mm, both in sorted(apart) if mm < least - 1e-6]
    if face.want["method"] != "trivial":  # no way along the skin is shorter than the straight one
        what = f"markers stand at least {least:g} mm apart, straight and so along the skin"
        yield what, close, f"the nearest two are {min(apart, default=(np.inf,))[0]:.2f} mm apart"


def check_cover(face):
    """Every blendshape has a landmark; no layout has fewer than the prices prove."""
    layout, said = face.layout, face.layout["certificate"]
    v = [m["vertex"] for m in layout["landmarks"]]
    none = [name for name, row in zip(face.used, face.covers[:, v], strict=True) if not row.any()]
    yield "every blendshape has a landmark, but for those listed", unlike(layout, {"uncovered": none})
    # y >= 0 and sum_k y[k] c[k, s] <= n[s] at every site: any cover has sum_s n[s] f[s] >= sum_k y[k] landmarks
    y = np.zeros(len(face.used))
    y[[face.used.index(name) for name in said["blendshapes"]]] = said["weights"]
    covers = face.covers[:, face.sites[face.open]].any(axis=2)
    over, least = int((y @ covers > face.size[face.open] + 1e-9).sum()), ceil(y.sum() - 1e-9)
    found = f"prices add up to {y.sum():.3f}, over the limit at {over} of {covers.shape[1]} sites"
    holds = bool((y >= 0).all()) and not over and least == said["landmarks"]
    yield f"proved: no fewer than {said['landmarks']} landmarks see every blendshape", holds, found
    spare = np.where(covers, face.size[face.open] - y @ covers, np.inf).min(axis=1)  # by which one price can be raised
    weak = [name for name, more in zip(face.used, spare, strict=True) if 1e-3 < more < np.inf]
    yield "the prices prove as much as they can", weak
    reachable = {name for name, row in zip(face.used, covers, strict=True) if row.any()}
    owed = layout["method"] == "budget" and reachable.intersection(none)  # it did not pay for a cover
    enough = bool(layout["programs"]) or bool(owed) or layout["method"] == "motion"
    yield "a program stands behind the number", enough, f"{len(layout['programs'])} programs"
    enough = least <= len(v) or bool(reachable.intersection(none))
    yield "the layout has at least as many as are proved to be needed", enough, f"{len(v)} landmarks"


def check_programs(face):
    """What every program chose covers its blendshapes at the stated cost; whether none is cheaper, no one can see."""
    layout, programs, ordered = face.layout, face.layout["programs"], face.layout["method"] in ORDERED
    chosen = {m["vertex"]: m["round"] for m in layout["landmarks"]}
    known = ({*range(len(programs))} if not ordered else set()) | ({None} if layout["method"] != "cover" else set())
    holds = {*chosen.values()} <= known and len(programs) <= (
        face.want["rounds"] if layout["method"] == "adaptive" else 1
    )
    yield "every landmark was chosen by a program or added after them", holds, f"{len(programs)} programs"
    for number, program in enumerate(programs):
        rows, v = [face.used.index(name) for name in program["blendshapes"]], program["vertices"]
        at = np.flatnonzero(np.isin(face.sites, v).any(axis=1))
        pairs, size = face.sites[at], face.size[at]
        relative, seen = (
            face.relative_displacement[rows][:, pairs].max(axis=2),
            face.rig["visibility"][pairs].min(axis=1),
        )
        covers = relative >= face.want["epsilon"]
        w = np.where(covers, face.quality(relative, seen), 0).sum(axis=0)
        mean = np.where(covers.any(axis=0), w / np.maximum(covers.sum(axis=0), 1), 2)
        kinds = {"count": size, "paper": w, "lexicographic": size * mean}
        cost = float(np.rint(kinds["count" if ordered else face.want["weights"]] / 1e-4).sum() * 1e-4)
        proved = program["bound"] >= program["objective"]
        own = {"objective": cost, "landmarks": int(size.sum()), "proven_optimal": proved}
        wrong = unlike(program, own) + [face.used[k] for k in np.array(rows)[~covers.any(axis=1)]]
        mine = sorted(v) if ordered else sorted(vertex for vertex in chosen if chosen[vertex] == number)
        holds = not wrong and program["bound"] <= cost + SAME and sorted({*v}) == mine and len(v) == size.sum()
        what = f"program {number + 1} covers its blendshapes at its cost, its bound no higher"
        yield what, holds, f"{len(rows)} blendshapes, cost {cost:.4f} {' '.join(wrong)}"


def check_information(face):
    """Rank, condition and upper estimate of the layout, of its first landmarks and of other layouts."""
    layout, at = face.layout, {m["name"]: m["vertex"] for m in face.layout["landmarks"]}
    strength = np.sqrt(np.clip(np.linalg.eigvalsh(face.G), 0, None))
    full, points = max(1, int((strength > RANK * strength[-1]).sum())), face.rig["points68"].tolist()
    others = layout["references"]
    yield "other layouts stand beside it", len(others) == 2 + bool(points), ", ".join(others)
    for name, said, v in [
        ("the layout", layout["information"], [*at.values()]),
        *((name, one, one["vertices"]) for name, one in others.items()),
    ]:
        sigma = np.linalg.svd(face.measured[:, v].reshape(len(face.used), -1), compute_uv=False)
        rank = max(1, int((sigma > RANK * sigma[0]).sum()))
        own = {"rank": rank, "full_rank": full, "landmarks": len(v), "noise_mm": face.want["noise_mm"]}
        own |= {"condition": round(float(sigma[0] / sigma[rank - 1]), 1), "error_mm": face.error(v)}
        what = f"{name}: rank {said['rank']} of {said['full_rank']}, upper estimate {said['error_mm']:.3f} mm"
        yield what, unlike(said, own), f"{len(v)} landmarks"
        if name.startswith("68"):
            yield f"{name} stand where they belong", v == points, f"{len(v)} points"
        elif name == EVEN:
            enough = len(v) == len({*v}) == min(USUAL, int(face.moving.sum()))
            yield f"{name} are as many, on skin that moves", enough and face.moving[v].all(), f"{len(v)} dots"
        elif name in others:
            missed = face.covers[:, face.sites].any(axis=(1, 2)) & ~face.covers[:, v].any(axis=1)
            yield f"{name} covers every blendshape", not missed.any(), f"{int(missed.sum())} missed"
    order = layout["order"]
    yield (
        "an order has every landmark once",
        sorted(order) == sorted(at if layout["method"] in ORDERED else []),
        order[:3],
    )
    curve = [face.error([at[name] for name in order[: m + 1]]) for m in range(len(order))]
    yield "the curve is the error of the first landmarks in their order", alike(layout["curve_mm"], curve), curve[-1:]


def check_cameras(face):
    """Every marker is measured as exactly as the cameras of the plan can."""
    marks = [*face.layout["landmarks"], *face.layout["head"]]
    own = {m["name"]: face.exactness(m["vertex"]) if face.plan["cameras"] else [] for m in marks}
    wrong = [m["name"] for m in marks if not alike(m["measured_mm"], own[m["name"]])]
    yield "the cameras measure markers as exactly as stated", wrong, f"{len(face.plan['cameras'])} cameras"


def check_error_bound(face):
    """No layout of the budget has less, f(mu) >= f(lam) + g (lam - mu) being true of a convex f at any shares."""
    layout, said = face.layout, face.layout["error_bound"]
    M = face.want["budget"] or face.want["number"] or len(layout["landmarks"])
    yield "the layout keeps its budget", len(layout["landmarks"]) <= M, f"{len(layout['landmarks'])} of {M}"
    asked, within = face.want["method"], face.want["budget"] and layout["method"] == "budget"
    yield "the method asked for answers", asked == layout["method"] or (asked == "studio" and within), layout["method"]
    if layout["method"] not in ("studio", "budget"):
        yield "a bound of the error is stated where the method looks for the least", said is None, layout["method"]
        return
    M = M if layout["method"] == "budget" else len(layout["landmarks"])
    bound = least_by(face, said)(M)
    holds = alike(said["error_mm"], bound) and bound <= layout["information"]["error_mm"] + SAME
    what = f"proved: no layout of {M} landmarks has an upper estimate below {said['error_mm']:.3f} mm"
    yield what, holds, f"the shares prove {bound:.4f} mm"
    target = min(layout["references"][name]["error_mm"] for name in TARGETS if name in layout["references"])
    fewest, everywhere = layout["target_landmarks"], face.error(np.unique(face.sites[face.open]))
    said = layout["target_bound"]
    if fewest is None or said is None:
        yield (
            f"no number of landmarks here has an upper estimate of {target:.3f} mm",
            fewest is None and said is None and everywhere > target,
            f"{everywhere:.4f} mm at all",
        )
        return
    least = least_by(face, said)
    holds = alike(said["error_mm"], least(fewest)) and everywhere <= target
    holds = holds and least(fewest) <= target + SAME and (fewest == 1 or least(fewest - 1) > target)
    what = f"proved: no layout of fewer than {fewest} landmarks has an upper estimate of {target:.3f} mm or less"
    yield what, holds, f"one fewer: {least(fewest - 1):.4f} mm" if fewest > 1 else "no fewer"


def least_by(face, said):
    """What the shares of a certificate prove of any number M of landmarks, mm; NaN where one is negative."""
    sigma, k = face.want["noise_mm"], len(face.used)
    share, A = dict(zip(said["vertices"], said["shares"], strict=True)), face.measured.transpose(1, 2, 0)
    lam = np.array([share.get(v, 0.0) for v in face.sites[:, 0].tolist()])
    if (lam < 0).any():
        return lambda M: np.nan
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

    return least


def check_head_pose(face):
    """Errors of a rigid fit to the head markers."""
    head, said, sigma = face.layout["head"], face.layout["head_pose"], face.want["noise_mm"]
    holds = len(head) == face.want["head_markers"] and bool(head) == (said is not None)
    yield "as many head markers as asked for", holds, len(head)
    if head:
        x = face.x[[m["vertex"] for m in head]]
        r, d = x - x.mean(axis=0), face.x[face.moving] - x.mean(axis=0)
        # cov of the rotation = sigma^2 J^-1, J = sum |r|^2 I - r r'; of the shift sigma^2 / m I
        J = np.linalg.inv((r**2).sum() * np.eye(3) - r.T @ r)
        turned = ((d**2).sum(axis=1) * np.trace(J) - np.einsum("vx,xy,vy->v", d, J, d) + 3 / len(x)).mean()
        own = {"rotation_degrees": np.degrees(sigma * np.sqrt(np.trace(J))), "surface_mm": sigma * np.sqrt(turned)}
        own |= {"translation_mm": sigma * np.sqrt(3 / len(x))}
        yield "the head's pose is as exact as stated", unlike(said, own)


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
        self.barred = {frozenset(p) for p in (*self.rules["exclusive"], *self.rules["colliding"], *edits["apart"])}
        self.number = {name: where for name, where in edits["locked"].items() if isinstance(where, int)}
        companions = [[name, *where] for name, where in edits["locked"].items() if not isinstance(where, int)]
        same = [[n for n in self.number if self.number[n] == where] for where in set(self.number.values())]
        self.together = [p for p in partners if p not in self.rules["relaxed"]] + edits["together"] + companions + same
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
    yield "partners, rules and correctives are those of the rig", wrong
    listed, last = [name for one in scans.lists for name in one], [n for one in packing["unscanned"] for n in one]
    holds = sorted(listed) == sorted(scans.names) and sorted(packing["left_out"]) == sorted(last)
    holds &= len(shots) <= (face.plan["settings"]["expressions"]["limit"] or len(shots))
    holds &= all(one == [name for name in scans.names if name in one] for one in scans.lists)
    yield "every blendshape is in one expression, or listed as left out", holds, f"{len(listed)} of {len(scans.names)}"
    clash, many, place = [], [], {}
    for number, one in enumerate(scans.lists, start=1):
        place |= dict.fromkeys(one, number)
        many += [f"E{number:02d}"] if scans.movements(one) > (scans.most or 99) else []
        for a, b in combinations(one, 2):
            shared = 0 if b in scans.partners[a] else int((scans.active[a] & scans.active[b]).sum())
            clash += [f"E{number:02d}: {a} and {b} share {shared} vertices"] if shared else []
            clash += [f"E{number:02d}: {a} and {b} exclude each other"] if frozenset((a, b)) in scans.barred else []
    what = "no two blendshapes of an expression share skin or exclude each other"
    yield what, clash, f"{len(scans.lists)} expressions"
    split = [" and ".join(group) for group in scans.together if len({place.get(name) for name in group}) > 1]
    split += [n for n, e in scans.number.items() if place.get(n) != e and place.get(n, 0) <= len(shots)]
    yield "partners and the artist's edits are kept", split
    many += [] if (packing["most_things"] or 0) == scans.most else [f"the rules say {scans.most}"]
    yield "no expression asks for too many movements", many, f"at most {scans.most or 'any'}"
    share, covered, off = dict(zip(face.used, face.rig["importance"].tolist(), strict=True)), 0.0, []
    for number, shot in enumerate(shots, start=1):
        names, gain = shot["blendshapes"], sum(share[name] for name in shot["blendshapes"])
        covered += gain
        held = dict.fromkeys(base for name in names for of, base in scans.rules["drivers"] if of == name)
        own = {"name": f"E{number:02d}", "drivers": [*held], "weights": [1.0] * len(names)}
        own |= {"gain": gain, "covered": min(covered, 1.0)}
        off += [f"{shot['name']} {line}" for line in unlike(shot, own)]
    yield "names, weights and importance of the expressions add up", off


def check_fewest(face):
    """No list is shorter than a clique of what cannot be together in pairs, or than movements counted."""
    scans, packing, fit = Scans(face), face.plan["packing"], []
    for a, b in combinations(packing["clique"], 2):
        one, other = scans.item[a], scans.item[b]
        apart = one is not other and any(scans.conflict(i, j) for i in one for j in other)
        fit += [] if apart else [f"{a} and {b}"]
    J, things = len(scans.lists), sum(map(scans.movements, {id(one): one for one in scans.item.values()}.values()))
    least = max(len(packing["clique"]), ceil(things / scans.most) if scans.most else 0)
    outside = [name for name in scans.names if all(scans.item[name] is not scans.item[b] for b in packing["clique"])]
    for name in outside:
        pairs = [[(i, j) for i in scans.item[name] for j in scans.item[b]] for b in packing["clique"]]
        fit += [f"{name} belongs to it"] if all(any(scans.conflict(*p) for p in one) for one in pairs) else []
    fit += [] if packing["clique"] == [name for name in scans.names if name in packing["clique"]] else ["a name twice"]
    found = f"a clique of {len(packing['clique'])}, {things} movements; fit together: {'; '.join(fit[:3]) or 'none'}"
    holds = not fit and not unlike(packing, {"bound": least, "things": things}) and least <= J
    yield f"proved: no list has fewer than {packing['bound']} expressions", holds, found
    wrong = unlike(packing, {"objective": J, "proven_optimal": least == J})
    holds = not wrong and least <= packing["solver_bound"] <= J
    proves = packing["method"] == "early" or (packing["method"] != "greedy" and packing["unmoved"] is None)
    holds &= proves or not packing["order_proven"]
    words = "proved" if packing["proven_optimal"] else "not proved"
    yield f"{packing['objective']} expressions, {words} the fewest", holds, f"{J} expressions, at least {least} proved"


# The thin shell: K d = forces, K = -kS L + kB L M^-1 L (Botsch & Sorkine 2008; Le et al. 2013), kS = 1, kB = 10 in mm


def stiffness(x, triangles):
    """K as {row: {column: value}}."""
    corners = x[triangles]
    side = ((np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)) ** 2).sum(axis=2)  # opposite to each corner
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)[:, None] / 2
    cot = (side.sum(axis=1, keepdims=True) - 2 * side) / (4 * area)
    part = cot * side / 8  # mixed Voronoi areas (Meyer et al. 2003)
    blunt = np.where(cot < 0, area / 2, area / 4)
    share = np.where((cot < 0).any(axis=1, keepdims=True), blunt, np.roll(part, -1, axis=1) + np.roll(part, -2, axis=1))
    M, L = np.bincount(triangles.ravel(), share.ravel(), len(x)).tolist(), {v: {v: 0.0} for v in range(len(x))}
    for (a, b, c), halves in zip(triangles.tolist(), (cot / 2).tolist(), strict=True):
        for (i, j), half in zip(((b, c), (c, a), (a, b)), halves, strict=True):
            for u, v in ((i, j), (j, i)):
                L[u][v] = L[u].get(v, 0.0) + half
                L[u][u] -= half
    K = {u: {v: -value for v, value in row.items()} for u, row in L.items()}
    for m, row in L.items():
        for i, one in row.items():
            for j, other in row.items():
                K[i][j] = K[i].get(j, 0.0) + 10.0 * one * other / M[m]
    return K


def block(K, rows, columns):
    """Some rows and columns of K, dense."""
    at, found = {v: place for place, v in enumerate(columns)}, np.zeros((len(rows), len(columns)))
    for place, u in enumerate(rows):
        some = [v for v in K[u] if v in at]
        found[place, [at[v] for v in some]] = [K[u][v] for v in some]
    return found


def bend(K, held, given):
    """W (n h): how far each vertex goes when one of the vertices `given` does and `held` ones stay: K_UU W_U = -K_UG.

    Vertices by their distance from these make K block tridiagonal: Gauss, block by block. None where a piece floats.
    """
    done, layers = {*held, *given}, []
    while front := sorted({v for u in (layers[-1] if layers else done) for v in K[u]} - done):
        layers.append(front)
        done |= {*front}
    if len(done) < len(K):
        return None
    W, solved = np.zeros((len(K), len(given))), []
    W[given] = np.eye(len(given))
    for mine, before, after in zip(layers, [[], *layers], [*layers[1:], []], strict=False):
        S, right = block(K, mine, mine), np.hstack([block(K, mine, after), -block(K, mine, given)])
        if solved:
            up = block(K, mine, before) @ solved[-1]
            S -= up[:, : len(mine)]
            right[:, len(after) :] -= up[:, len(mine) :]
        solved.append(np.linalg.solve(S, right))
    for mine, after, answer in reversed(list(zip(layers, [*layers[1:], []], solved, strict=True))):
        W[mine] = answer[:, len(after) :] - answer[:, : len(after)] @ W[after]
    return W


class Takes:
    """Recorded takes, and what they lose when only markers are known and a thin shell follows them."""

    def __init__(self, rig):
        self.rig, self.at, self.fixed = rig, rig["shell_at"], rig["shell_fixed"]
        self.s = rig["shell_importance"].astype(float)
        self.people, self.shares = rig["take_person"].tolist(), rig["take_share"].tolist()
        self.shapes = [rig[f"take{q}_shapes"].astype(float) for q in range(len(self.people))]
        self.mixes = [rig[f"take{q}_weights"].astype(float) for q in range(len(self.people))]
        shells = {p: (rig[f"person{p}_neutral"], rig["shell_triangles"]) for p in dict.fromkeys(self.people)}
        self.K = {p: stiffness(*shell) for p, shell in shells.items()}

    def errors(self, vertices):
        """RMSE over all takes with markers at these vertices, and of each person, millimetres."""
        markers = np.flatnonzero(np.isin(self.at, vertices) & ~self.fixed)
        bent = {p: bend(K, np.flatnonzero(self.fixed), markers) for p, K in self.K.items()}
        squares, weight = dict.fromkeys(self.K, 0.0), dict.fromkeys(self.K, 0.0)
        for p, share, X, C in zip(self.people, self.shares, self.shapes, self.mixes, strict=True):
            W = bent[p]
            R = X if W is None else X - np.einsum("vm,rmx->rvx", W, X[:, markers])
            R = (R * np.sqrt(self.s)[:, None]).reshape(len(X), -1)
            # mean over the frames of |sum_r C_tr R_r|^2 = sum_rr' (C'C / F)_rr' R_r . R_r'
            squares[p] += share * float(((C.T @ C / len(C)) * (R @ R.T)).sum())
            weight[p] += share * self.s.sum()
        each = [float(np.sqrt(squares[p] / weight[p])) for p in squares]
        return float(np.sqrt(sum(squares.values()) / sum(weight.values()))), each


def check_motion(face):
    """What recorded takes lose by the layout, by its first landmarks and by others."""
    layout, said = face.layout, face.layout["motion"]
    if "take_person" not in face.rig:
        yield "no take, nothing said of one", said is None, "no take in rig.npz"
        return
    takes = Takes(face.rig)
    lengths = [len(C) for C in takes.mixes]
    own = {"frames": sum(lengths), "vertices": int((takes.s > 0).sum()), "boundary": int(takes.fixed.sum())}
    wrong = unlike(said, own | {"stretching": 1.0, "bending": 10.0})
    held = [(X[:, takes.fixed], c) for X, C in zip(takes.shapes, takes.mixes, strict=True) for c in C]
    moves = any((np.linalg.norm(np.tensordot(c, X, 1), axis=1) >= 0.5).any() for X, c in held)
    wrong += ["vertices that move are held"] if moves else []
    yield "frames and shell are those of the takes", wrong, own
    at = {m["name"]: m["vertex"] for m in layout["landmarks"]}
    v = [at[name] for name in (layout["order"] if said["curve_mm"] else at)]
    own, each = takes.errors(v)
    yield f"the takes lose {said['rmse_mm']:.3f} mm", unlike(said, {"rmse_mm": own}), f"{own:.4f} mm"
    people = [[q for q, p in enumerate(takes.people) if p == person] for person in takes.K] if len(each) > 1 else []
    names = face.rig["take_name"].tolist()
    own = [
        {"sequences": [names[q] for q in takes_of], "frames": sum(lengths[q] for q in takes_of), "rmse_mm": mm}
        for takes_of, mm in zip(people, each, strict=False)
    ]
    holds = len(own) == len(said["subjects"]) and not any(map(unlike, said["subjects"], own))
    yield f"the takes are of {len(each)} people", holds, ", ".join(f"{mm:.4f} mm" for mm in each)
    yield "other layouts are held against the takes", {*said["references_mm"]} == {*layout["references"]}, "by name"
    own = {name: takes.errors(layout["references"][name]["vertices"])[0] for name in said["references_mm"]}
    yield "other layouts lose of the takes what is stated", unlike(said["references_mm"], own)
    yield "an order comes with its curve", bool(said["curve_mm"]) == bool(layout["order"]), layout["method"]
    if said["curve_mm"]:
        some = sorted({max(1, len(v) * part // 4) for part in (1, 2, 3, 4)})
        off = max(abs(takes.errors(v[:m])[0] - said["curve_mm"][m - 1]) for m in some)
        holds = off < SAME and len(said["curve_mm"]) == len(v)
        yield "the curve is what the first landmarks lose", holds, f"at {some}: {off:.5f} mm off"


CHECKS = (
    check_rig,
    check_mirror,
    check_places,
    check_cover,
    check_programs,
    check_information,
    check_cameras,
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
            for what, held, *found in check(face):
                wrong = held if isinstance(held, list) else []
                holds = not wrong if isinstance(held, list) else bool(held)
                lines.append((what, holds, "; ".join(wrong[:3]) or str(*found) or "all"))
        except Exception as error:
            lines.append((f"{check.__name__}: the plan can be read", False, repr(error)))
    return lines


def each_name_once(pairs):
    """A table, in which no key stands twice: who reads the file may see the other value."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise SystemExit("FAIL  plan.json: a key stands twice in one place")
    return found


def main(folder):
    """Print every check of the plan in a folder; the exit code."""
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"), object_pairs_hook=each_name_once)
    with np.load(folder / "rig.npz", allow_pickle=False) as archive:
        rig = dict(archive)
    lines = verify(plan, rig)
    for what, holds, found in lines:
        line = f"{'ok  ' if holds else 'FAIL'}  {what}: {found}"
        print("".join(c if c.isprintable() else "?" for c in line))  # a plan may hold what a screen would obey
    failed = sum(not holds for _, holds, _ in lines)
    print(f"{len(lines) - failed} of {len(lines)} checks hold")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent))
