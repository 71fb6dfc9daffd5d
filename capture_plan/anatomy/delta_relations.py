"""What can be wrong with a rig's blendshapes, one function for each thing; `findings_sides`, `findings_mesh` and
`findings_cover` have the others.

Data     d[k]     deltas of the skin, millimetres;  a[k] = max_v |d[k, v]|;  o[k] the same over all that is no skin
         c[i, j]  cosine <d[i], d[j]> / (|d[i]| |d[j]|)
Left out        static     a[k] = o[k] = 0
                non-face   a[k] < NOISE_MM <= o[k]
                noise      0 < a[k] < NOISE_MM, and o[k] too
                duplicate  c[i, k] = 1 for an earlier i; the negative of another is none, since weights never are
                head movements, what lies off the face and plain sums of others (`kinds.py`, `apart.py`)
Only reported   dependent  two sums of blendshapes, their weights above 0, are one movement
                opposite   c[i, j] near -1, or mirror images of each other that move the whole face sideways
                corrective undoes part of a larger blendshape and folds the skin when used alone
"""

import re
from collections.abc import Collection
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct

from capture_plan.face.moving import NOISE_MM
from capture_plan.mesh.geometry import triangle_cross
from capture_plan.names.arkit import arkit_name
from capture_plan.once import once
from capture_plan.rig import Rig

STILL_MM = 1e-4  # float32 coordinates of a head in millimetres are no finer
ALIKE = 0.05  # of the length of movements that are told to be equally strong
SAME = 1e-4  # 1 - cosine; 1 % of the displacement differs
DEPENDENT = 3e-3  # share of a blendshape that earlier ones leave unexplained; real ones leave over 0.04
AGAINST, SIDEWAYS = -0.9, -0.2  # cosines: eyes looking in and out -0.85 to -1, a jaw moved left and right -0.3 to -1
OPPOSITE, UNDOES, FOLDS = -0.8, 0.4, 2e-3  # cosine, share of what is undone, share of triangles turned inside out
CORRECTIVE_WORD = re.compile(r"correct|(^|[^a-z])(corr|fix|combo)([^a-z]|$)", re.IGNORECASE)

FindingKind = Literal[
    "static", "noise", "duplicate", "dependent", "opposite", "non-face", "partner", "overlap", "corrective", "name",
    "size", "export", "winding", "cover", "geometry", "head", "elsewhere", "calls", "fine", "bare",
]  # fmt: skip
KINDS: dict[FindingKind, str] = {
    "size": "Size",
    "export": "Exported wrongly",
    "winding": "Normals",
    "static": "Does not move",
    "noise": "Too weak to see",
    "non-face": "Not on the face",
    "head": "Head movements",
    "elsewhere": "Not of the face",
    "calls": "Mixes of others",
    "duplicate": "There twice",
    "dependent": "Mix of others",
    "name": "Names",
    "partner": "Left and right",
    "overlap": "Shared midline",
    "opposite": "Opposites",
    "corrective": "Corrective",
    "bare": "No dot holds",
    "cover": "Covered skin",
    "geometry": "Mesh",
    "fine": "Fine mesh",
}


Pairs = Collection[tuple[str, str]]


class Finding(Struct, frozen=True, forbid_unknown_fields=True):
    """One thing found: what it is, what it does to the plan, and what to change.

    `left_out` says whether its `blendshapes` take no part in the plan. `urgency` says who acts: nobody shoots before a
    `stop` is settled, `rigger` is for who made the rig, `know` for who is on set.
    """

    kind: FindingKind
    blendshapes: tuple[str, ...]
    message: str
    advice: str
    left_out: bool
    urgency: Literal["stop", "rigger", "know"] = "know"


def motionless(rig: Rig) -> list[Finding]:
    """Blendshapes that a marker cannot see: they move nothing, no skin, or less than the noise of a marker."""
    skin = rig.displacement[:, rig.skin].max(axis=1)
    elsewhere = np.where(rig.skin, 0, rig.displacement)
    other = elsewhere.max(axis=1)
    nothing = np.maximum(skin, other) < STILL_MM
    weak = (skin < NOISE_MM) & ~nothing
    off = weak & (other >= NOISE_MM)
    return [
        *_moving_nothing([rig.names[k] for k in np.flatnonzero(nothing)]),
        *_moving_no_skin(rig, np.flatnonzero(off), skin, elsewhere),
        *_too_weak([(rig.names[k], float(skin[k])) for k in np.flatnonzero(weak & ~off)]),
    ]


def _moving_nothing(names: list[str]) -> list[Finding]:
    if not names:
        return []
    message = f"{names[0]} moves nothing: its shape is the neutral"
    advice = "Export it again, or delete it from the rig."
    if len(names) > 1:
        message = f"{len(names)} blendshapes move nothing, their shape is the neutral: {', '.join(names)}"
        advice = "Export them again, or delete them from the rig."
    return [Finding("static", tuple(names), message, advice, True, "rigger")]


def _moving_no_skin(
    rig: Rig, rows: Int[np.ndarray, " n"], skin: Float[np.ndarray, " k"], elsewhere: Float[np.ndarray, "k v"]
) -> list[Finding]:
    """One finding for each part of the rig that such blendshapes move most."""
    parts = rig.parts[elsewhere[rows].argmax(axis=1)] if len(rig.part_names) > 1 else np.zeros(len(rows), dtype=int)
    findings = []
    for part in dict.fromkeys(parts.tolist()):
        own = rows[parts == part].tolist()
        moved = f"'{rig.part_names[part]}'" if len(rig.part_names) > 1 else "what is no skin"
        names = tuple(rig.names[k] for k in own)
        at_most = [f"{elsewhere[k].max():.1f} mm" for k in own]
        if len(own) == 1:
            skin_text = f"by {skin[own[0]]:.2f} mm" if skin[own[0]] >= STILL_MM else "not at all"
            message = f"{names[0]} moves {moved} by up to {at_most[0]}, the skin {skin_text}"
            advice = "Capture it without markers, from a close-up or a scan, if the character needs it."
        else:
            listing = ", ".join(f"{name} ({mm})" for name, mm in zip(names, at_most, strict=True))
            message = f"{len(own)} blendshapes move {moved} and not the skin: {listing}"
            advice = "Capture them without markers, from a close-up or a scan, if the character needs them."
        findings.append(Finding("non-face", names, message, advice, True))
    return findings


def _too_weak(found: list[tuple[str, float]]) -> list[Finding]:
    if not found:
        return []
    names = tuple(name for name, _ in found)
    message = f"{names[0]} moves the skin by {found[0][1]:.2g} mm at most, less than a marker can show ({NOISE_MM} mm)"
    advice = "Make it stronger, or check the unit of the rig if every blendshape is that small."
    if len(found) > 1:
        listing = ", ".join(f"{name} ({mm:.2g} mm)" for name, mm in found)
        message = f"{len(found)} blendshapes move the skin by less than a marker can show ({NOISE_MM} mm): {listing}"
        advice = "Make them stronger, or check the unit of the rig if every blendshape is that small."
    return [Finding("noise", names, message, advice, True, "rigger")]


def duplicates(names: tuple[str, ...], gram: Float[np.ndarray, "k k"]) -> list[Finding]:
    """Blendshapes that move every vertex the same way as another one, as strongly or not; gram = D D^T.

    Of those that move alike the strongest stays, since weaker ones are steps on its way; of equally strong ones that
    with a name of ARKit's, else the first.
    """
    length = np.sqrt(np.diag(gram))
    cosine = gram / np.outer(length, length)
    findings, retained = [], []
    strength = np.round(np.log(np.maximum(length, np.finfo(float).tiny)) / ALIKE)
    unknown = np.array([arkit_name(name) is None for name in names], dtype=bool)
    best: dict[int, int] = {}
    for k in np.lexsort((np.arange(len(names)), unknown, -strength)).tolist():
        first = next((i for i in retained if cosine[i, k] >= 1 - SAME), None)
        if first is None:
            retained.append(k)
        else:
            best[k] = first
    for k, first in sorted(best.items()):
        name = names[k]
        times = length[k] / length[first]
        times = "" if abs(times - 1) < 0.01 else f", {times:.2f} times as strong"
        message = f"{name} is the same movement as {names[first]}{times}: no capture can tell them apart"
        advice = f"Delete one of the two; what is captured for {names[first]} serves both."
        findings.append(Finding("duplicate", (name,), message, advice, True, "rigger"))
    return findings


def dependent(names: tuple[str, ...], gram: Float[np.ndarray, "k k"]) -> list[Finding]:
    """Blendshapes of which two sums are one movement: no face tells their weights, never negative, from each other.

    The part of d[k] that the earlier ones leave over has the squared length G[k, k] - G[k, m] G[m, m]^-1 G[m, k]. A
    blendshape that only takes back what earlier ones do is distinguished from them by its direction, and is no finding.
    """
    length = np.sqrt(np.diag(gram))
    cosine = gram / np.outer(length, length)
    members, findings = [], []
    for k, name in enumerate(names):
        share = np.linalg.solve(cosine[np.ix_(members, members)], cosine[members, k])
        if 1 - cosine[k, members] @ share > DEPENDENT**2:
            members.append(k)
            continue
        share *= length[k] / length[members]
        parts = [i for i in np.abs(share).argsort()[::-1] if abs(share[i]) > 0.02]
        weights = {names[members[i]]: float(share[i]) for i in parts}
        if any(weight > 0 for weight in weights.values()):
            advice = "Remove one of them, or expect the solver to share the movement between them as it likes."
            message = _same_movement(name, weights)
            findings.append(Finding("dependent", (name, *weights), message, advice, False, "rigger"))
    return findings


def _same_movement(name: str, weights: dict[str, float]) -> str:
    """That a blendshape is a sum of others; with `weights` below 0, which two sums are the same."""
    adds = {other: weight for other, weight in weights.items() if weight > 0}
    takes = {other: -weight for other, weight in weights.items() if weight < 0}
    if not takes:
        return f"{name} is the sum {_sum(adds)}: its weight cannot be told from theirs"
    return f"{_sum({name: 1.0} | takes)} is the same movement as {_sum(adds)}: their weights cannot be distinguished"


def _sum(weights: dict[str, float]) -> str:
    """'0.50 smile + 1.00 squint', four at most."""
    message = " + ".join(f"{weight:.2f} {name}" for name, weight in list(weights.items())[:4])
    return message + (" + ..." if len(weights) > 4 else "")


def opposites(names: tuple[str, ...], gram: Float[np.ndarray, "k k"], sideways: Pairs) -> list[Finding]:
    """Pairs that move the same skin in opposite ways; `sideways` are mirror images of each other that may be such."""
    length = np.sqrt(np.diag(gram))
    cosine = gram / np.outer(length, length)
    also = {frozenset(pair) for pair in sideways}
    pairs = [
        (cosine[i, j], names[i], names[j])
        for i, j in zip(*np.triu_indices(len(names), 1), strict=True)
        if cosine[i, j] < (SIDEWAYS if frozenset((names[i], names[j])) in also else AGAINST)
    ]
    if not pairs:
        return []
    listing = ", ".join(f"{a} and {b} ({100 * -c:.0f} %)" for c, a, b in sorted(pairs))
    message = f"these move the same skin in opposite ways: {listing}"
    advice = "They are shot in different expressions. Let no solver use negative weights, or one stands for the other."
    involved = tuple(dict.fromkeys(name for pair in sorted(pairs) for name in pair[1:]))
    return [Finding("opposite", involved, message, advice, False)]


@once
def correctives(rig: Rig, used: tuple[str, ...]) -> tuple[Finding, ...]:
    """Blendshapes that make sense only on top of another one, as ARKit's mouthClose on jawOpen, by name or by shape: a
    viseme that opens the mouth as far as the jaw does is undone as well, and is not what the name asks for."""
    at = rig.rows(used)
    deltas = rig.deltas[at][:, rig.skin].astype(float)
    triangles = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    findings = []
    for i, name in enumerate(used):
        length = np.linalg.norm(deltas[i], axis=1)
        moved = length >= 0.1 * length.max()
        mine, theirs = deltas[i, moved].ravel(), deltas[:, moved].reshape(len(used), -1)
        size = np.linalg.norm(theirs, axis=1)
        both = size * np.linalg.norm(mine)
        cosine = theirs @ mine / np.where(both > 0, both, np.inf)
        undone = -(theirs @ mine) / np.where(size > 0, size**2, np.inf)
        fits = (cosine < OPPOSITE) & (undone > UNDOES) & (undone < 1)
        partner = _base_by_name(rig, name, used)
        if partner is None:
            base = next((j for j in cosine.argsort() if fits[j] and _mends(rig, triangles, at[i], at[j])), None)
            partner = None if base is None else used[base]
        if partner is not None or CORRECTIVE_WORD.search(name):
            on = partner or "another blendshape"
            message = f"{name} is a corrective of {on}: alone it pushes the skin through itself"
            advice = f"Shoot it together with {on}, and judge its markers in that pose."
            findings.append(Finding("corrective", (name, partner) if partner else (name,), message, advice, False))
    return tuple(findings)


def _mends(rig: Rig, triangles: Int[np.ndarray, "f 3"], i: int, j: int) -> bool:
    """Whether blendshape i alone folds the skin and j underneath takes at least half of the folds away."""
    still = triangle_cross(rig.neutral, triangles)

    def folded(delta: Float[np.ndarray, "v 3"]) -> float:
        return float((np.einsum("fx,fx->f", triangle_cross(rig.neutral + delta, triangles), still) < 0).mean())

    alone = folded(rig.deltas[i])
    return alone > FOLDS and folded(rig.deltas[i] + rig.deltas[j]) < alone / 2


def _base_by_name(rig: Rig, name: str, used: tuple[str, ...]) -> str | None:
    """jawOpen where ARKit's mouthClose is asked for and the rig has it."""
    if rig.arkit(name) != "mouthClose":
        return None
    return next((other for other in used if rig.arkit(other) == "jawOpen"), None)
