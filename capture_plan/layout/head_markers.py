"""Head markers and landmarks in one program: where the head markers go depends on where landmarks have to be.

Data       sites as in `cover`, and beside them sites of head markers: skin that hardly moves, in sectors (`head`)
           c[q, s]   head site s lies in sector q
           r[q, s]   stillness in place of relative displacement: 1 where nothing moves, epsilon at the sector's limit
Model      the cover program over both kinds: every blendshape has a landmark, every sector a head marker, all of them
           at the spacing; limits count landmarks alone, and there are exactly as many head markers as asked for
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import block_diag

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.face import Face
from capture_plan.layout.head_sites import SECTORS, HeadSites, head_candidates, sectors_for
from capture_plan.layout.multicover import best_cover
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites, mirrored_sites, single_sites


def choose_head_markers(
    face: Face,
    settings: LayoutSettings,
    sites: Sites,
    limits: tuple[Limit, ...],
    rows: Int[np.ndarray, " r"],
) -> Int[np.ndarray, " m"]:
    """Vertices of `settings.head_markers` head markers, beside the best cover of blendshapes `rows`.

    Raises:
        InfeasibleError: a sector has no skin that is still enough, or the constraints clash.
    """
    found = head_candidates(face, face.cameras)
    sectors = sectors_for(found, settings.head_markers, settings.min_visibility)
    for sector in sectors:
        if not (found.sector == sector).any():
            raise InfeasibleError(f"head markers: {SECTORS[sector]} has no skin that stays still: ask for fewer")
    head = sites_of_sectors(face, settings, found, sectors)
    s = len(sites.visibility)
    joined = Sites(
        np.concatenate([sites.vertices, head.vertices]),
        np.asarray(block_diag(sites.relative_displacement, head.relative_displacement)),
        np.concatenate([sites.visibility, head.visibility]),
    )
    extra = np.zeros(len(head.visibility), dtype=int)
    asked = Limit(
        f"{settings.head_markers} head markers",
        np.concatenate([0 * sites.size, head.size]),
        settings.head_markers,
        settings.head_markers,
    )
    cover = best_cover(
        joined,
        settings,
        np.concatenate([rows, len(sites.relative_displacement) + np.arange(len(sectors))]),
        np.arange(len(joined.visibility)),
        face.spacing(joined, settings.spacing_mm),
        [*(_better_of(limit, extra) for limit in limits), asked],
    )
    return joined.members(cover.chosen[cover.chosen >= s])


def _better_of(limit: Limit, extra: Int[np.ndarray, " h"]) -> Limit:
    """A limit with further sites that do not count in it."""
    return Limit(limit.name, np.concatenate([limit.amount, extra]), limit.least, limit.most)


def sites_of_sectors(face: Face, settings: LayoutSettings, found: HeadSites, sectors: tuple[int, ...]) -> Sites:
    """Head sites with their stillness in each of the sectors, on skin that is seen well enough where a sector has any;
    mirrored where that leaves a choice in every sector."""
    v = len(face.rig.neutral)
    stillness, visibility = stillness_of(found, sectors, settings.epsilon, v), np.zeros(v)
    visibility[found.vertices] = found.visibility
    seen = visibility >= settings.min_visibility
    for row in stillness:
        if row[seen].any():
            row[~seen] = 0
    allowed = stillness.max(axis=0) > 0
    if settings.symmetric:
        mirrored = mirrored_sites(
            stillness,
            visibility,
            allowed,
            neutral=face.rig.neutral,
            mirror=face.mirror,
            spacing_mm=settings.spacing_mm,
        )
        if (mirrored.relative_displacement.max(axis=1, initial=0) > 0).all():
            return mirrored
    return single_sites(stillness, visibility, allowed)


def stillness_of(found: HeadSites, sectors: tuple[int, ...], epsilon: float, v: int) -> Float[np.ndarray, "q v"]:
    """1 where nothing moves, epsilon at the limit of the sector, 0 outside it."""
    stillness = np.zeros((len(sectors), v))
    for q, sector in enumerate(sectors):
        mine = found.sector == sector
        stillness[q, found.vertices[mine]] = 1 - (1 - epsilon) * found.motion_mm[mine] / found.limit_mm[sector]
    return stillness
