"""How long one unit of a file is: what the format states, and how large the face then would be.

Letters    p     pupil distance, rho  size of what moves (`channels.py`), both in the file's unit
Score of a unit u, nats = its commonness + FORMAT where the format states it + log f(p u) + log g(rho u)
                         + log h(extent u of what moves) where the eyes were not found
           f, g, h  mixtures of log-normal densities over the usual one: human, roughly human, anything
Sure       the lead over every other unit is LEAD, and the face has a size that faces have
The format's unit stands while the face is as large as those of mascots and dolls may be, but is not sure of what no
person has. It falls where the face is built like a person's and another unit gives it the size of one: files that call
inches centimetres, or the reverse, are far more common than figurines of human proportions, and whoever plays such a
figurine has a human face. A face that fits no usual unit is scaled to a human's, which is never sure. Nor are
decimetres that no format states: dolls in metres are as large in their files as people are in those. Inches are sure of
a usual adult's face only: a doll in centimetres that is as large in its file gets the size of the actor who plays it,
and a file that somebody scaled at will to within a tenth of that is read a tenth too large or small at most.
"""

import numpy as np

from capture_plan.formats.raw import UNITS_MM
from capture_plan.rig.understood import Sign, Unit

HUMAN_MM, CARTOON_MM = (50.0, 80.0), (35.0, 130.0)  # between the pupils: the second is enough with the format's word
STANDS_MM, STANDS_RHO_MM, STANDS_EXTENT_MM = (8.0, 400.0), (15.0, 250.0), (60.0, 4000.0)  # mascots, animals and dolls
LIKE_A_PERSON = ((1.0, 1.45), (0.93, 1.25))  # p / rho; eyes to mouth / p: human heads 1.13 to 1.31 and 1.01 to 1.12,
# the faces of seven mascots and anime figures 0.78 or 1.47 to 2.48, and 0.54 to 0.90 or 1.21
PUPILS_MM, RHO_MM = 63.0, 54.0  # adults; four human rigs 49 to 60
FORMAT = 4.5  # nats: of the units that files state about one in a hundred is wrong
COMMON = {1.0: 0.0, 10.0: 0.0, 1000.0: 0.0, 100.0: -0.7, 25.4: -1.2, 304.8: -2.5}
USUAL = (1.0, 10.0, 1000.0, 25.4)  # units that the eyes alone may make sure of: no shape tells a doll from a person
BY_SIZE_MM = {25.4: (57.0, 70.0)}  # between the pupils: most adults; most dolls in centimetres are not so large
ODD = -4.0  # a unit that only this file has
PUPILS = ((0.75, 0.08), (0.22, 0.35))  # share and spread of the logarithm
HEAD_MM = 300.0  # a head with its neck; masks are half of that, bodies six times
WHOLE = ((0.6, 0.4), (0.4, 1.0))
SIZES = ((0.60, 0.20), (0.35, 0.50))
FLOOR = 0.03
LEAD = 2.0
FITS = 0.15  # of the best possible: below it a face has no size of a face


def find_unit(
    stated: float | None, pupils: float | None, rho: float, extent: float, *, drop: float | None, few: bool
) -> Unit:
    """Millimetres in a unit of the file; `pupils` is None where the eyes were not found for sure.

    `extent` is the largest one of the pieces that move, `drop` the way from the eyes down to the mouth, None where
    either was not found for sure; where `few` blendshapes move, rho says little.
    """
    units = sorted(set(COMMON) | set(UNITS_MM.values()) | ({stated} if stated else set()))
    sizes = ((1.0, 1.4),) if few else SIZES
    common = np.array([COMMON.get(unit, ODD if unit != stated else 0.0) for unit in units])
    by_format = np.array([FORMAT * (unit == stated) for unit in units])
    by_eyes = np.array([_log_mixture(pupils * unit / PUPILS_MM, PUPILS) if pupils else 0.0 for unit in units])
    by_size = np.array([_log_mixture(rho * unit / RHO_MM, sizes) for unit in units])
    by_mesh = np.array([0.0 if pupils else _log_mixture(extent * unit / HEAD_MM, WHOLE) for unit in units])
    total = common + by_format + by_eyes + by_size + by_mesh
    best = int(np.argmax(total))
    low, high = BY_SIZE_MM.get(units[best], HUMAN_MM)
    person = pupils and drop and not few and _like_a_person(pupils, rho, drop) and low <= pupils * units[best] <= high
    if stated and not person and _can_be(stated, pupils, rho, extent, few=few):
        best = units.index(stated)
    lead = float(total[best] - np.delete(total, best).max())
    fits = (
        _fits(pupils * units[best] / PUPILS_MM, PUPILS) if pupils else few or _fits(rho * units[best] / RHO_MM, sizes)
    )
    if not fits and not stated:
        scaled = PUPILS_MM / pupils if pupils else RHO_MM / rho
        return Unit(
            float(scaled), False, (Sign("no usual unit fits", f"scaled to a human face, {scaled:.4g} mm", 0.0),)
        )
    messages = [("the format", by_format)] if stated else []
    messages += [("the distance between the pupils", by_eyes)] if pupils else []
    messages += [] if pupils else [("the size of the mesh", by_mesh)]
    messages += [("the size of what moves", by_size), ("how common the unit is", common)]
    rest = np.delete(np.arange(len(units)), best)
    signs = tuple(
        Sign(name, f"{units[int(np.argmax(score))]:g} mm", round(float(score[best] - score[rest].max()), 2))
        for name, score in messages
    )
    low, high = CARTOON_MM if units[best] == stated else BY_SIZE_MM.get(units[best], HUMAN_MM)
    human = pupils is None or low <= pupils * units[best] <= high
    stated_or_seen = units[best] == stated or (pupils is not None and units[best] in USUAL)
    sure = lead > LEAD and human and fits and stated_or_seen
    return Unit(float(units[best]), sure, signs)


def human_apart(pupils_mm: float) -> bool:
    """Whether pupils are as far apart as a person's, as far as is said of them."""
    return HUMAN_MM[0] <= round(pupils_mm, 1) <= HUMAN_MM[1]


def apart_words(pupils_mm: float) -> str:
    """How far apart the pupils are, rounded alike wherever it is said."""
    return f"{pupils_mm:,.1f} mm apart"


def _like_a_person(pupils: float, rho: float, drop: float) -> bool:
    """Whether eyes and mouth lie to each other, and in what moves, as they do in people, whatever their size."""
    shares = (pupils / rho, drop / pupils)
    return all(low <= share <= high for share, (low, high) in zip(shares, LIKE_A_PERSON, strict=True))


def _can_be(stated: float, pupils: float | None, rho: float, extent: float, *, few: bool) -> bool:
    """Whether a face of the format's own size is one of a person, a mascot or an animal: then its unit stands."""
    if pupils:
        length, (low, high) = pupils, STANDS_MM
    else:
        length, (low, high) = (extent, STANDS_EXTENT_MM) if few else (rho, STANDS_RHO_MM)
    return low <= length * stated <= high


def _log_mixture(ratio: float, parts: tuple[tuple[float, float], ...]) -> float:
    x = np.log(ratio)
    return float(np.log(FLOOR + sum(share / spread * np.exp(-0.5 * (x / spread) ** 2) for share, spread in parts)))


def _fits(ratio: float, parts: tuple[tuple[float, float], ...]) -> bool:
    """Whether a length is one that a human or a cartoon has."""
    widest = max(spread for _, spread in parts)
    return bool(abs(np.log(ratio)) < widest * np.sqrt(-2 * np.log(FITS)))
