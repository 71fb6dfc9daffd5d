"""What can be wrong with a rig's mesh: its size, the way its triangles face, holes, and loose ends.

Size      pupils further apart or closer than a person's, or a moving face of no human breadth where no eyes are found;
          a blendshape that moves the skin further than a face can
Winding   two triangles that share an edge run along it in opposite directions; where they do not, one of the two is
          turned over: the fewer of each connected sheet are. A whole sheet of skin is turned over where its normals
          look into the head: more rays are stopped above it than below it
Lids      the height of an eye's opening in its middle over its width
Lips      the border of the mouth, on the midline, higher than closed lips leave it
Hole      a border of the mesh within the skin that is no lid opening, mouth, nostril, and no rim of the whole
Fine      more vertices of skin than there are places that a person can tell apart with a brush: some stand for all
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.regions import face_regions
from capture_plan.face.anchors import Anchors
from capture_plan.face.flying import flying
from capture_plan.face.lids import lid_gaps, shut
from capture_plan.face.of_rig import rig_channels
from capture_plan.face.sense_size import size_reason
from capture_plan.face.shape import border_loops
from capture_plan.face.unit import HUMAN_MM, apart_words, human_apart
from capture_plan.face.votes import names_agree
from capture_plan.mesh import boundary_vertices, counted_edges, half_edges, pieces, triangle_areas
from capture_plan.mesh.geometry import triangle_cross
from capture_plan.rig.record import Rig
from capture_plan.visibility.occluder import Occluder

BREADTH_MM = (60, 300)  # of what moves: one lip to a whole head with its neck
MOVES = 0.1  # share of the largest displacement
FAR = 1.5  # pupil distances: an open jaw moves the chin by 0.7
LOOKED_AT = 400  # triangles of a piece that say which way it faces
FACES_IN = 0.2  # of these: so many more are stopped above than below
FINE = 40_000  # vertices of skin: all of a finer mesh would ask for millions of close pairs
GRAIN_MM = 1.5  # half a dot: no hand places one more exactly
LIPS_APART = 0.2  # pupil distances: twelve faces with closed lips 0.09 at most
LEAST_MOVED = {"jaw open": 0.3, "blink": 0.1}  # pupil distances: eleven faces 0.6 and 0.15 at least
NOSTRIL = 0.45  # pupil distances from the tip of the nose


def sizes(rig: Rig, pupils_mm: float | None, used: tuple[str, ...], unit: float) -> list[Finding]:
    """The head's size and the size of what its blendshapes do; `unit` is the distance of the eyes, found or not."""
    found = []
    change = f"Check the unit: one unit of the file was taken as {rig.unit_mm:g} mm (--unit-mm changes it)"
    if pupils_mm is not None and not human_apart(pupils_mm):
        message = f"the pupils are {apart_words(pupils_mm)}, a person's {HUMAN_MM[0]:g} to {HUMAN_MM[1]:g} mm"
        advice = f"{change}. If the character is no human, scale the rig to the actor who wears the markers."
        stated = size_reason(rig) if rig.unit_found == "format" else ""
        found.append(
            Finding(
                "size", (), f"{message}; {stated}" if stated else message, advice, False, "know" if stated else "stop"
            )
        )
    flies = flying(rig.neutral, rig.triangles, rig.deltas)
    moved = rig.displacement[~flies].max(axis=0, initial=0) * rig.skin
    x = rig.neutral[moved > MOVES * moved.max(), 0] if moved.any() else rig.neutral[:0, 0]
    if pupils_mm is None and len(x) and not BREADTH_MM[0] <= np.ptp(x) <= BREADTH_MM[1]:
        message = f"no eyes were found, and the moving face is {np.ptp(x):.3g} mm wide, a person's about 140 mm"
        found.append(Finding("size", (), message, f"{change}.", False, "stop"))
    largest = {name: rig.displacement[k, rig.skin].max() for k, name in enumerate(rig.names) if name in used}
    far = tuple(name for name, mm in largest.items() if mm > FAR * unit)
    if far:
        listing = ", ".join(f"{name} ({largest[name]:,.0f} mm)" for name in far)
        message = f"further than a face can move: {listing}"
        advice = "Export these again with weight 1 as offsets from the neutral. Expressions cannot be posed with them."
        found.append(Finding("size", far, message, advice, False, "stop"))
    return found


def flown(rig: Rig) -> list[Finding]:
    """Blendshapes in which a few vertices fly off: they are left out, and go back to who made them."""
    far = np.flatnonzero(flying(rig.neutral, rig.triangles, rig.deltas))
    if not len(far):
        return []
    listing = ", ".join(f"{rig.names[k]} ({rig.displacement[k].max():,.0f} mm)" for k in far)
    message = f"a few vertices fly off, further than a face can move: {listing}"
    advice = "Put these vertices back or clean the mesh, and export them again. Until then they are not planned."
    return [Finding("size", tuple(rig.names[k] for k in far), message, advice, True, "stop")]


def windings(rig: Rig) -> list[Finding]:
    """Triangles of the skin that face inwards: all, those of a piece, or some among others."""
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    if len(skin) == 0:
        return []
    sheet, against = sheets(skin)
    occluder = Occluder(rig.neutral, rig.triangles)
    inwards = np.array([faces_in(rig.neutral, skin[(sheet == i) & ~against], occluder) for i in range(sheet.max() + 1)])
    inwards = inwards[sheet]
    wrong = inwards ^ against
    area = triangle_areas(rig.neutral, skin)
    share = area[wrong].sum() / area.sum()
    hidden = "markers would be kept off there, since the skin seems to look away"
    if share > 0.5:
        message = f"the faces of the skin are wound inwards ({100 * share:.0f} % of its area): {hidden}"
        return [Finding("winding", (), message, "Reverse the normals and export the rig again.", False, "stop")]
    if wrong.any():
        message = (
            f"{wrong.sum():,} of {len(skin):,} triangles of the skin ({100 * share:.2g} % of its area) are wound "
            f"inwards: {hidden}"
        )
        return [Finding("winding", (), message, "Make the normals consistent and export again.", False, "rigger")]
    return []


def sheets(triangles: Int[np.ndarray, "f 3"]) -> tuple[Int[np.ndarray, " f"], Bool[np.ndarray, " f"]]:
    """The sheet of each triangle, joined along edges of two, and whether it runs against most of its sheet.

    Each triangle is in a graph twice, as it is (0..f) and turned over (f..2f); neighbours that agree are joined alike,
    others crosswise. What can be reached from a triangle as it is agrees with it.
    """
    f = len(triangles)
    directed = half_edges(triangles)
    _, edge, uses = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(edge.ravel(), kind="stable")
    order = order[uses[edge.ravel()[order]] == 2]
    a, b = order[::2], order[1::2]
    crossed = directed[a, 0] == directed[b, 0]
    i, j = a % f, b % f

    def components(rows: Int[np.ndarray, " e"], columns: Int[np.ndarray, " e"], n: int) -> Int[np.ndarray, " n"]:
        graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(n, n))
        return connected_components(graph, directed=False)[1]

    sheet = components(i, j, f)
    sided = components(np.r_[i, i + f], np.r_[np.where(crossed, j + f, j), np.where(crossed, j, j + f)], 2 * f)
    _, lead = np.unique(sheet, return_index=True)
    agrees = sided[:f] == sided[lead[sheet]]
    most_agree = 2 * np.bincount(sheet, agrees) >= np.bincount(sheet)
    return sheet, agrees != most_agree[sheet]


def faces_in(neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], occluder: Occluder) -> bool:
    """Whether rays along the normals of these triangles are stopped more often than those against them."""
    some = triangles[np.unique(np.linspace(0, len(triangles) - 1, LOOKED_AT).astype(int))]
    cross = triangle_cross(neutral, some)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    n = (cross / np.where(length > 0, length, 1)).astype(np.float32)
    middle = (neutral[some].mean(axis=1) - occluder.centre).astype(np.float32)
    above, below = (
        occluder.blocked(middle + np.float32(sign * occluder.offset) * n, sign * n)[length[:, 0] > 0]
        for sign in (np.float32(1), np.float32(-1))
    )
    return bool(len(above) and above.mean() > below.mean() + FACES_IN)


def open_lips(anchors: Anchors) -> list[Finding]:
    """A neutral whose mouth stands open."""
    if "mouth" not in anchors.found or anchors.gape_mm < LIPS_APART * anchors.pupils:
        return []
    message = f"the mouth stands open in the neutral, its lips {anchors.gape_mm:.0f} mm apart"
    advice = "Export the neutral with closed lips: every movement is measured from it, and the actor's has them closed."
    return [Finding("geometry", (), message, advice, False, "rigger")]


def shut_lids(rig: Rig, anchors: Anchors) -> list[Finding]:
    """A neutral whose eyes are closed, both or one."""
    gaps = lid_gaps(rig.neutral, anchors.lids, anchors.midline)
    found = {side: gap[0] for side, gap in gaps.items() if shut(gap)}
    if not found:
        return []
    which = "the eyes are" if len(found) == 2 else f"the {next(iter(found))} eye is"
    message = f"{which} shut in the neutral, or nearly: the lids are {max(found.values()):.1f} mm apart"
    advice = "Export the neutral with open eyes: a blink is measured from it, and the actor's neutral looks ahead."
    return [Finding("geometry", (), message, advice, False, "rigger")]


def weak(rig: Rig, used: tuple[str, ...], unit: float) -> list[Finding]:
    """Jaws and blinks by name that move far less than any jaw that opens and any lid that closes."""
    channels, found = rig_channels(rig), []
    if not names_agree(channels):
        return []
    for kind, least in LEAST_MOVED.items():
        most = {rig.names[k]: float(rig.displacement[k, rig.skin].max()) for k in channels.of(kind)}
        most = {name: mm for name, mm in most.items() if name in used}
        if most and max(most.values()) < least * unit:
            listing = ", ".join(f"{name} ({mm:.1f} mm)" for name, mm in most.items())
            message = f"too little for the name: {listing}; on a face of this size {least * unit:.0f} mm or more"
            advice = "Export at full weight, in the unit of the neutral. Until then errors look too small."
            found.append(Finding("size", tuple(most), message, advice, False, "stop"))
    return found


def holes(rig: Rig, anchors: Anchors) -> list[Finding]:
    """Borders within the skin that belong to no opening of a face."""
    u = anchors.pupils
    border = boundary_vertices(rig.triangles)
    _, first, same = np.unique(rig.neutral[border].round(3), axis=0, return_index=True, return_inverse=True)
    weld = np.arange(len(rig.neutral))
    weld[border] = border[first[same.ravel()]]
    welded = weld[rig.triangles]
    loops = border_loops(welded[(welded[:, [0, 1, 2]] != welded[:, [1, 2, 0]]).all(axis=1)])
    loops = [loop for loop in loops if rig.skin[loop].all()]
    openings = np.concatenate([weld[anchors.lids], weld[anchors.lips]])
    piece = pieces(welded, len(rig.neutral))
    rims = {int(piece[loop[0]]): loop for loop in sorted(loops, key=lambda loop: np.ptp(rig.neutral[loop], 0).sum())}

    def is_face(loop: Int[np.ndarray, " b"]) -> bool:
        middle = rig.neutral[loop].mean(axis=0)
        nostril = bool(np.linalg.norm(middle - anchors.nose_tip) < NOSTRIL * u)
        return bool(np.isin(loop, openings).any()) or nostril or any(loop is rim for rim in rims.values())

    found = [loop for loop in loops if not is_face(loop)]
    if not found:
        return []
    regions = face_regions(rig)
    messages = [f"{regions.label(int(h[0]))} ({np.ptp(rig.neutral[h], axis=0).max():.0f} mm)" for h in found]
    more = f" and {len(messages) - 6} more" if len(messages) > 6 else ""
    message = f"{len(messages)} hole{'s' * (len(messages) > 1)} in the skin: {', '.join(messages[:6])}{more}"
    advice = "Close them if they are not meant: distances between markers go round a hole, and what is in it shows."
    return [Finding("geometry", (), message, advice, False, "rigger")]


def untidy(rig: Rig) -> list[Finding]:
    """Loose vertices, edges of three triangles, triangles without area or there twice."""
    v, f = len(rig.neutral), len(rig.triangles)
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    found = []
    loose = v - len(np.unique(rig.triangles))
    if loose:
        found.append((f"{loose:,} of {v:,} vertices belong to no face", "Nothing to do: they are never chosen."))
    all_edges, uses = counted_edges(skin)
    if (uses > 2).any():
        found.append((
            f"{(uses > 2).sum():,} of {len(all_edges):,} edges of the skin have more than two triangles",
            "Remove inner and doubled faces: distances along the skin may take a short cut there.",
        ))  # fmt: skip
    twice = f - len(np.unique(np.sort(rig.triangles, axis=1), axis=0))
    if twice:
        found.append((f"{twice:,} of {f:,} triangles are there twice", "Remove doubles; the plan is the same."))
    flat = int((triangle_areas(rig.neutral, rig.triangles) < 1e-9).sum())
    if flat:
        found.append((f"{flat:,} of {f:,} triangles have no area", "Nothing to do: they weigh nothing."))
    ask = "more than two triangles"
    return [
        Finding("geometry", (), message, advice, False, "rigger" if ask in message else "know")
        for message, advice in found
    ]


def is_fine(rig: Rig) -> bool:
    """Whether the skin has more vertices than there are places that can be distinguished."""
    return int(rig.skin.sum()) > FINE


def fine(rig: Rig) -> list[Finding]:
    """That not every vertex of a fine mesh is asked, so that nobody takes a proof for one about all of them."""
    if not is_fine(rig):
        return []
    message = f"the skin has {int(rig.skin.sum()):,} vertices, finer than dots can be placed"
    advice = (
        f"Landmarks are chosen among vertices {GRAIN_MM:g} mm apart, and what is proved of landmarks speaks of layouts "
        "of these. Pins may be any vertex."
    )
    return [Finding("fine", (), message, advice, False)]
