"""What a person, a face and a camera ask of a layout, as named limits over its sites.

pins, forbidden    vertices by their number in the artist's file; mirrored where the layout is
keep-outs          zones of the skin, but for places of a layout that they are relaxed for; a site with either landmark
                   inside is out
caps               landmarks of a region, both of a mirrored pair counted
number, budget     landmarks in all
views              cameras that read a site at once (`visibility.seen`), in the neutral, every blendshape and every pose
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int

from capture_plan.anatomy.regions import REGIONS
from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.dot_contact import NO_POSES, Poses
from capture_plan.layout.face import Face
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.visibility import FEWEST_PIXELS, SEEN, WORDS, Sight, Views

OTHER_SHARE = 0.2  # of the landmarks: fewer is the same layout with a dot or two moved


def constraints(face: Face, settings: LayoutSettings, sites: Sites) -> tuple[Limit, ...]:
    """All constraints of the settings.

    Raises:
        InfeasibleError: a constraint names a vertex, a zone or a region that this face does not have.
    """
    return (
        *pins(face, settings, sites),
        *keep_outs(face, settings, sites),
        *caps(face, settings, sites),
        *views(face, settings, sites),
        *_numbers(settings, sites),
    )


def pins(face: Face, settings: LayoutSettings, sites: Sites) -> list[Limit]:
    """A landmark at every pinned vertex, none at a forbidden one nor within a marker's width of it."""
    limits = []
    for source, vertex in zip(settings.pins, face.pinned(settings).tolist(), strict=True):
        at = (sites.vertices == vertex).any(axis=1)
        if not at.any():
            raise InfeasibleError(
                f"pin: vertex {source:,} has no mirror image at least {settings.spacing_mm:g} mm away: "
                "pin a vertex on the midline or further from it, or switch symmetric off"
            )
        limits.append(Limit(f"the pin at vertex {source}", at.astype(int), least=1))
    for source in settings.forbidden:
        around = face.around(np.array([face.skin_vertex(source, "forbidden")]), settings.dot_mm)
        limits.append(Limit(f"no landmark at vertex {source}", touching(sites, around).astype(int), most=0))
    return limits


def keep_outs(face: Face, settings: LayoutSettings, sites: Sites) -> list[Limit]:
    """No part of a dot inside the zones and their margins: its middle stays half a diameter further off; but for places
    of the layout that the zones are relaxed for."""
    radius, known = settings.dot_mm / 2, settings.relaxed_for
    spared = face.relaxed(settings)
    but = f" but for the places of {known}" if known else ""
    return [
        Limit(
            f"nothing on the {Path(name).stem}{but}",
            touching(sites, face.zone(name, margin + radius) & ~spared).astype(int),
            most=0,
        )
        for name, margin in settings.keep_out.items()
    ]


def caps(face: Face, settings: LayoutSettings, sites: Sites) -> list[Limit]:
    """At most so many landmarks in a region."""
    if not settings.caps:
        return []
    if not face.regions.known:
        raise InfeasibleError(
            "caps: eyes or mouth of this face are not certain, so that its regions have no names: leave caps out, or "
            "correct the reading with --up, --facing or --skin (`capture-plan audit` shows it)"
        )
    limits = []
    for name, most in settings.caps.items():
        if name not in REGIONS:
            raise InfeasibleError(f"caps: there is no region '{name}': name one of {', '.join(REGIONS)}")
        inside = face.regions.of_vertex == REGIONS.index(name)
        limits.append(Limit(f"at most {most} on the {name}", counted(sites, inside), most=most))
    return limits


def _numbers(settings: LayoutSettings, sites: Sites) -> list[Limit]:
    """Exactly so many landmarks, at most so many."""
    limits = []
    if settings.number:
        limits.append(Limit(f"exactly {settings.number} landmarks", sites.size, settings.number, settings.number))
    if settings.budget and settings.method != "budget":
        limits.append(Limit(f"at most {settings.budget} landmarks", sites.size, most=settings.budget))
    return limits


def views(face: Face, settings: LayoutSettings, sites: Sites, poses: Poses = NO_POSES) -> list[Limit]:
    """Only what enough cameras read at once in the neutral and with every blendshape or, of a plan's expressions, in
    every pose, where cameras are known.

    Raises:
        InfeasibleError: more views than cameras, or no place is read by as many.
    """
    if not (face.cameras and settings.min_views):
        return []
    if settings.min_views > len(face.cameras):
        raise InfeasibleError(
            f"min_views is {settings.min_views} and there are {len(face.cameras)} cameras: lower it or add cameras"
        )
    found = face.pose_views(poses, settings.dot_mm) if poses else face.views(settings.dot_mm)
    few = np.ones(len(face.rig.neutral), dtype=bool)
    few[face.rig.skin] = found.views < settings.min_views
    if touching(sites, few).all():
        raise InfeasibleError(why_unread(found, settings))
    cameras = "camera" if settings.min_views == 1 else "cameras"
    where = "in every expression of the plan" if poses else "with every blendshape"
    name = f"every landmark read by {settings.min_views} {cameras} at once {where}"
    return [Limit(name, touching(sites, few).astype(int), most=0)]


def why_unread(found: Views, settings: LayoutSettings) -> str:
    """Why no place where a landmark may stand is read by enough cameras, and what would help."""
    seen, widest = np.isin(found.how, SEEN).all(axis=0), 0.0
    if seen.any():
        widest = float(found.pixels[seen].max())
    if 0 < widest < FEWEST_PIXELS:
        larger = np.ceil(2 * settings.dot_mm * FEWEST_PIXELS / widest) / 2
        return (
            f"a dot of {settings.dot_mm:g} mm is at most {widest:.1f} px wide in a camera that always sees it, "
            f"{FEWEST_PIXELS:g} px are needed: use dots of {larger:g} mm, or move the cameras closer"
        )
    if found.views.max() >= settings.min_views:
        return "no place on the skin where a landmark may stand is read by a camera: allow more of it, or add a camera"
    why, counts = np.unique(found.how[found.how != Sight.READ], return_counts=True)
    return (
        f"no place on the skin is read by {settings.min_views} cameras at once in every expression (at most "
        f"{found.views.max()}; most often a dot is {WORDS[Sight(int(why[counts.argmax()]))]}): lower min_views, or "
        "move the cameras to the front"
    )


def difference_limits(
    face: Face, settings: LayoutSettings, sites: Sites, unlike: Sequence[Sequence[int]]
) -> list[Limit]:
    """Of every layout given by its vertices, a fifth of the places or more is left: landmarks stand elsewhere instead.

    A place is left when no landmark stands within the spacing of it, or of a marker's width where that is more.
    """
    limits, radius = [], max(settings.spacing_mm, settings.dot_mm)
    for vertices in unlike:
        far = counted(sites, ~face.around(np.array(vertices), radius))
        least = max(1, round(OTHER_SHARE * len(vertices)))
        limits.append(Limit(f"{least} landmarks away from those of another layout", far, least=least))
    return limits


def touching(sites: Sites, mask: Bool[np.ndarray, " v"]) -> Bool[np.ndarray, " s"]:
    """Sites with a landmark inside a mask."""
    first, second = mask[sites.vertices].T
    return first | second


def counted(sites: Sites, mask: Bool[np.ndarray, " v"]) -> Int[np.ndarray, " s"]:
    """Landmarks that every site places inside a mask."""
    first, second = mask[sites.vertices].T.astype(int)
    return first + second * (sites.size - 1)
