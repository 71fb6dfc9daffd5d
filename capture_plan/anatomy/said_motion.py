"""What the movements that names say must do to the skin, so that names exchanged for each other are noticed.

Letters    e[k, r]  energy of blendshape k in region r of the skin, a |d|^2 summed; U[k, r] the same times the way up,
           a |d| d_y, and N[k, r] times the way out of the skin, a |d| d n
Measures   up        sum_r U / sum_r e: -1 straight down, 1 straight up
           opens     (U[upper lid] - U[lower lid]) / e[lids]: a blink -0.6 to -1, wide eyes 0.4 to 1
           corners   U / e of the mouth corners, or of the upper lip where that goes further up and is seen to move,
                     since the corners of an open smile go down with the jaw
           lowers    U / e of the mouth corners alone
           upper     (e[upper lip] - e[lower lip]) / e[lips]
           puffs     N / e of the cheeks: puffed 0.6 to 1, in any other movement 0.3 at most
           lifts     U / e of the cheeks: raised 0.8 to 1, puffed 0.3 at most
           nose      e[nose] / sum_r e: a sneer 0.1 to 0.9, a raised or puffed cheek 0.02 at most
Figures are of sixteen rigs. A measure whose regions hold less than SEEN of the energy says nothing, but that cheeks
that stay behind go nowhere; and none says anything of what moves no skin.
"""

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.face.moving import NOISE_MM
from capture_plan.face.sense import outward
from capture_plan.mesh import vertex_areas
from capture_plan.rig.record import Rig

Measure = Literal["up", "opens", "corners", "lowers", "upper", "puffs", "lifts", "nose"]
SEEN = 0.02  # of a blendshape's energy: the upper lip of an open smile has 0.05
LIPS_SEEN = 0.1  # of it for which of the two lips moves: painted mouths of avatars are all corner
APART = 0.2  # of `opens`: half of the least of wide eyes
BENT = 0.3  # of `corners`: frowns of avatars have 0.46
WAY = 0.4  # of `up`, as brows and jaws
FALLS = 0.3  # of `up`: a jaw that opens has 0.6 and more downwards, a puffed cheek 0.1
ONE_LIP = 0.5  # of `upper`: three times as much in the one as in the other
OUT, RAISED = 0.45, 0.6  # halfway between what is called so and what is not
AT_NOSE = 0.05


class _Claim(NamedTuple):
    """That `sign` times `measure` is at least `least`; `instead` is what a blendshape does of which it is not true."""

    measure: Measure
    sign: int
    least: float
    instead: str


UPPER = _Claim("upper", 1, -ONE_LIP, "it moves the lower lip")
LOWER = _Claim("upper", -1, -ONE_LIP, "it moves the upper lip")
CLAIMS: dict[str, tuple[_Claim, ...]] = {
    "eyeBlink": (_Claim("opens", -1, -APART, "the lids go apart"),),
    "eyeSquint": (_Claim("opens", -1, -APART, "the lids go apart"),),
    "eyeWide": (_Claim("opens", 1, -APART, "the lids close"),),
    "jawOpen": (_Claim("up", -1, FALLS, "the jaw does not go down"),),
    "mouthSmile": (_Claim("corners", 1, -BENT, "the mouth corners go down"),),
    "mouthFrown": (_Claim("lowers", -1, -BENT, "the mouth corners go up"),),
    "mouthUpperUp": (_Claim("up", 1, -WAY, "it moves down"), UPPER),
    "mouthLowerDown": (_Claim("up", -1, -WAY, "it moves up"), LOWER),
    "mouthRollUpper": (UPPER,),
    "mouthRollLower": (LOWER,),
    "mouthShrugUpper": (UPPER,),
    "mouthShrugLower": (LOWER,),
    "cheekPuff": (_Claim("puffs", 1, OUT, "the cheeks do not go outwards"),),
    "cheekSquint": (
        _Claim("lifts", 1, RAISED, "the cheeks do not go up"),
        _Claim("nose", -1, -AT_NOSE, "it moves the nose"),
    ),
    "noseSneer": (_Claim("nose", 1, AT_NOSE, "it leaves the nose still"),),
}


def measures(rig: Rig) -> dict[Measure, Float[np.ndarray, " k"]]:
    """Every measure of every blendshape, NaN where it says nothing; none where the regions of the face are in doubt."""
    regions = face_regions(rig)
    return _measured(rig, regions) if regions.known else {}


def instead(base: str, measured: dict[Measure, float]) -> str | None:
    """What a blendshape does that is not what ARKit's `base` does; None where the two agree or nothing is known."""
    for claim in CLAIMS.get(base, ()):
        if claim.sign * measured.get(claim.measure, np.nan) < claim.least:
            return claim.instead
    return None


def _measured(rig: Rig, regions: FaceRegions) -> dict[Measure, Float[np.ndarray, " k"]]:
    weight = vertex_areas(rig.neutral, rig.triangles) * rig.skin * rig.displacement
    places = (regions.of_vertex[:, None] == np.arange(len(regions.names))).astype(weight.dtype)
    e = (weight * rig.displacement) @ places
    U = (weight * rig.deltas[..., 1]) @ places
    N = (weight * np.einsum("kvx,vx->kv", rig.deltas, outward(rig))) @ places
    r = {name: place for place, name in enumerate(regions.names)}
    total = e.sum(axis=1)
    total = np.where((rig.displacement[:, rig.skin].max(axis=1) >= NOISE_MM) & (total > 0), total, np.nan)
    cheek = e[:, r["cheek"]]
    behind = cheek < SEEN * total
    upper_lid, lower_lid = r["upper eyelid"], r["lower eyelid"]
    upper, lower = r["upper lip"], r["lower lip"]
    lids, lips = e[:, upper_lid] + e[:, lower_lid], e[:, upper] + e[:, lower]
    lowers = _of(U[:, r["mouth corner"]], e[:, r["mouth corner"]], SEEN * total)
    lip = _of(U[:, upper], e[:, upper], SEEN * total)
    return {
        "up": U.sum(axis=1) / total,
        "opens": _of(U[:, upper_lid] - U[:, lower_lid], lids, SEEN * total),
        "corners": np.where(np.isnan(lowers), np.nan, np.fmax(lowers, lip)),
        "lowers": lowers,
        "upper": _of(e[:, upper] - e[:, lower], lips, LIPS_SEEN * total),
        "puffs": np.where(behind, 0, _of(N[:, r["cheek"]], cheek, SEEN * total)),
        "lifts": np.where(behind, 0, _of(U[:, r["cheek"]], cheek, SEEN * total)),
        "nose": e[:, r["nose"]] / total,
    }


def _of(
    part: Float[np.ndarray, " k"], whole: Float[np.ndarray, " k"], least: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """part / whole, NaN where the whole is not above `least`."""
    return np.where(whole > least, part / np.where(whole > least, whole, 1), np.nan)
