"""Where eyes and mouth are: of the places that signs take for them, the pair that most signs agree on.

Data       a head in the rig's axes (+y up, +z forward, the subject's left +x), in any unit; x0 its mirror plane
Agreement  candidates within NEAR pupil distances are one; their trusts add up, each kind of sign once
Score      trust of the eyes + trust of the mouth - (log(h / (USUAL p)) / LOOSE)^2 / 2, h from the eyes to the mouth and
           p between the pupils
Sure       the score leads that of every other place by LEAD, at least two kinds of sign agree and not the weakest
           alone, no sign that would be enough alone points to other eyes or another mouth, the mouth lies below the
           eyes as it does in faces, and what is named for it does not move before it, as a picture of a mouth that
           hangs before the face does
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from capture_plan.face.candidate import PUPILS_RHO, Candidate
from capture_plan.face.eyes import OTHER_EYES, eye_candidates
from capture_plan.face.mouth import LIPS, mouth_candidates
from capture_plan.face.shape import Shape
from capture_plan.rig.understood import Sign

BY_WORD = {"blink", "eye name", "part"}  # kinds of sign that fall together where names lie
ENOUGH = {*BY_WORD, "ball", "lids"}  # kinds that suffice alone above a mouth; other small movements may be brows
NEAR = 0.35  # pupil distances
USUAL, LOOSE = 1.0, 0.35  # pupil distances from the eyes to the mouth: four human heads 0.9 to 1.15; in logarithms
LEAD = 0.5
ALONE = 1.8  # trust in what is named for the mouth, or in skin that parts widely: enough without another sign
BEFORE = 0.05  # pupil distances: the middle of what is named for the mouth lies 0.09 to 0.39 behind its front
LOPSIDED = 0.2  # rho to the mirror image: 22 avatars 0.03 at most, halves of heads 0.27 to 0.65
WEAK = 0.85  # trust of all signs of the eyes: sharp motion and two openings, 0.8, are found beside any mouth
WITHOUT_MOUTH, NO_FACE = 1.5, 4.0  # trust that eyes lose that no mouth fits, or one that is not below them
BELOW, DEEP = (0.3, 1.9), 0.9  # pupil distances from the eyes down and in depth to the mouth


@dataclass(frozen=True, eq=False)
class Found:
    """The places chosen, None where no sign speaks; `signs` carry each candidate's trust, below 0 if elsewhere."""

    places: Float[np.ndarray, "n 3"] | None
    sure: bool
    signs: tuple[Sign, ...]


@dataclass(frozen=True, eq=False)
class Points:
    """Mirror plane x0, eyes (left, right) and mouth of a head."""

    x0: float
    eyes: Found
    mouth: Found


def find_points(shape: Shape, *, named: bool) -> Points:
    """Eyes and mouth of a head in the rig's axes; names are heeded where `named` says that they do not contradict.

    Where nothing moves there is no face. Of two heads in one file none is sure, nor of half a head; nor is a mouth that
    few movements show, without eyes above it; what the edge of the mesh cut off is not found.
    """
    off, x0 = shape.mirror_across(0)
    if shape.channels.still:
        return Points(x0, Found(None, False, ()), Found(None, False, ()))
    eyes = [one for one in eye_candidates(shape, x0, named=named) if _possible(one, shape)]
    mouths = mouth_candidates(shape, x0, named=named)
    points = Points(x0, *_on_the_mesh(eyes, mouths, shape, named=named))
    if off > LOPSIDED * shape.channels.rho:
        return replace(points, eyes=_doubted(points.eyes), mouth=_doubted(points.mouth))
    several = shape.doubled or shape.parted
    eyes_sure = points.eyes.sure and not several
    mouth_sure = points.mouth.sure and not several and (eyes_sure or not shape.channels.few)
    return replace(points, eyes=replace(points.eyes, sure=eyes_sure), mouth=replace(points.mouth, sure=mouth_sure))


def _on_the_mesh(eyes: list[Candidate], mouths: list[Candidate], shape: Shape, *, named: bool) -> tuple[Found, Found]:
    """Eyes and mouth, without what the edge of the mesh cut off, where names say what was there."""
    no_eyes, no_mouth = (named and shape.channels.gone(*kinds) for kinds in (("blink", *OTHER_EYES), LIPS))
    found = choose(eyes, [] if no_mouth else mouths)
    if no_eyes:
        found = _gone(eyes, "the eyes"), mouth_alone(mouths, shape.channels.rho)
    return found[0], _gone(mouths, "the mouth") if no_mouth else found[1]


def _gone(candidates: list[Candidate], what: str) -> Found:
    """Nothing, of what lies beyond the edge of the mesh."""
    words = f"most of what is named for {what}, which goes on beyond the edge of the mesh"
    return Found(None, False, (*_signs(candidates, ()), Sign(words, "", -1.0)))


def mouth_alone(mouths: list[Candidate], rho: float) -> Found:
    """The mouth of a face without eyes: where most signs agree, `sure` where several do and none is as strong."""
    if not mouths:
        return Found(None, False, ())
    best = max(mouths, key=lambda one: _trust(one, mouths, rho))
    agreeing = [one for one in mouths if _same(one, best, rho)]
    others = max((_trust(one, mouths, rho) for one in mouths if not _same(one, best, rho)), default=0.0)
    several = len({one.kind for one in agreeing}) > 1
    place = max(agreeing, key=lambda one: (one.kind == "tear", one.trust)).places
    return Found(place, several and _trust(best, mouths, rho) - others > ALONE, _signs(mouths, agreeing))


def _doubted(found: Found) -> Found:
    """The same place, not sure, of a head whose two sides are unlike."""
    return replace(
        found, sure=False, signs=(*found.signs, Sign("its two sides, which do not mirror each other", "", -1.0))
    )


def choose(eyes: list[Candidate], mouths: list[Candidate]) -> tuple[Found, Found]:
    """The pair of eyes and mouth of the highest score, each with its doubt."""
    if not eyes:
        return Found(None, False, ()), Found(None, False, _signs(mouths, ()))
    scored = [
        (_trust(eye, eyes, pupils(eye)) + _trust_of_mouth(eye, mouth, mouths), i, j)
        for i, eye in enumerate(eyes)
        for j, mouth in enumerate([*mouths, None])
    ]
    best, i, j = max(scored, key=lambda one: (round(one[0], 6), -one[1], -one[2]))
    eye, mouth = eyes[i], mouths[j] if j < len(mouths) else None
    other_eyes = max((s for s, a, _ in scored if not _same(eyes[a], eye, pupils(eye))), default=-np.inf)
    found = _chosen_eyes(eye, eyes, mouth, mouths, sure=best - other_eyes > LEAD)
    if mouth is None:
        return found, Found(None, False, ())
    others = (s for s, a, b in scored if a == i and b < len(mouths) and not _same(mouths[b], mouth, pupils(eye)))
    return found, _chosen_mouth(eye, mouth, mouths, sure=best - max(others, default=0.0) > LEAD)


def _chosen_eyes(
    eye: Candidate, eyes: list[Candidate], mouth: Candidate | None, mouths: list[Candidate], *, sure: bool
) -> Found:
    """The places of all eyes that agree with one; `sure` where several independent kinds do and the mouth fits."""
    agreeing = [one for one in eyes if _same(one, eye, pupils(eye))]
    kinds = {one.kind for one in agreeing}
    several = len(kinds - BY_WORD) + bool(kinds & BY_WORD) > 1 or (mouth is not None and bool(kinds & ENOUGH))
    several = several and _trust(eye, eyes, pupils(eye)) > WEAK
    fits = not mouths if mouth is None else _face_like(eye, mouth)
    rivals = [one for one in eyes if one.trust >= ALONE and not _same(one, eye, pupils(eye))]
    if mouth is not None:  # what lies below it are no eyes, whatever it is called
        rivals = [one for one in rivals if one.places[:, 1].mean() > mouth.places[0, 1]]
    return Found(_together(agreeing), sure and several and fits and not rivals, _signs(eyes, agreeing))


def _chosen_mouth(eye: Candidate, mouth: Candidate, mouths: list[Candidate], *, sure: bool) -> Found:
    """The place of all mouths that agree with one, that of a tear where there is one: it lies at the lips."""
    agreeing = [one for one in mouths if _same(one, mouth, pupils(eye))]
    several = len({one.kind for one in agreeing}) > 1 or mouth.trust >= ALONE
    rivals = [
        one for one in mouths if one.trust >= ALONE and not _same(one, mouth, pupils(eye)) and _face_like(eye, one)
    ]
    place = max(agreeing, key=lambda one: (one.kind == "tear", one.trust)).places
    hangs = any(one.kind == "name" and one.places[0, 2] - place[0, 2] > BEFORE * pupils(eye) for one in agreeing)
    signs = _signs(mouths, agreeing)
    if hangs:
        signs += (Sign("what is named for the mouth, which lies before it", "elsewhere", -1.0),)
    return Found(place, sure and several and not rivals and not hangs and _face_like(eye, mouth), signs)


def _together(agreeing: list[Candidate]) -> Float[np.ndarray, "n 3"]:
    """Mean of the places of the best sign of each kind, by trust."""
    best = {one.kind: one for one in sorted(agreeing, key=lambda one: one.trust)}.values()
    return np.average([one.places for one in best], axis=0, weights=[one.trust for one in best])


def pupils(eyes: Candidate) -> float:
    """Distance between the places of a pair."""
    return float(np.linalg.norm(eyes.places[0] - eyes.places[1]))


def _possible(eyes: Candidate, shape: Shape) -> bool:
    low, high = (share * shape.channels.rho for share in PUPILS_RHO)
    return low < pupils(eyes) < high


def _same(one: Candidate, other: Candidate, p: float) -> bool:
    return bool(np.linalg.norm((one.places - other.places) * [1, 1, 0.5], axis=1).max() < NEAR * p)


def _trust(one: Candidate, all_of_them: Iterable[Candidate], p: float) -> float:
    """Trusts of all that agree with a candidate, the most trusted of each kind; of two pairs the nearer one says how
    near they must be, or a wide pair would borrow the trust in all that it surrounds."""
    best: dict[str, float] = {}
    for other in all_of_them:
        if _same(one, other, p if len(other.places) == 1 else min(p, pupils(other))):
            best[other.kind] = max(best.get(other.kind, 0.0), other.trust)
    return sum(best.values())


def _trust_of_mouth(eye: Candidate, mouth: Candidate | None, mouths: list[Candidate]) -> float:
    if mouth is None:
        return -WITHOUT_MOUTH if mouths else 0.0
    p = pupils(eye)
    h = float(np.linalg.norm(eye.places.mean(axis=0) - mouth.places[0]))
    usual = np.log(max(h, 1e-9) / (USUAL * p)) / LOOSE
    return _trust(mouth, mouths, p) - 0.5 * float(usual) ** 2 - (0 if _face_like(eye, mouth) else NO_FACE)


def _face_like(eye: Candidate, mouth: Candidate) -> bool:
    """Whether the mouth lies below the eyes, and not far behind or before them."""
    p, off = pupils(eye), eye.places.mean(axis=0) - mouth.places[0]
    return bool(BELOW[0] * p < off[1] < BELOW[1] * p and abs(off[2]) < DEEP * p)


def _signs(all_of_them: list[Candidate], agreeing: Iterable[Candidate]) -> tuple[Sign, ...]:
    agree = {id(one) for one in agreeing}
    best: dict[tuple[str, bool], Candidate] = {}
    for one in all_of_them:
        key = (one.words, id(one) in agree)
        if key not in best or best[key].trust < one.trust:
            best[key] = one
    return tuple(
        Sign(words, "here" if here else "elsewhere", one.trust if here else -one.trust)
        for (words, here), one in best.items()
        if here or (words, True) not in best
    )
