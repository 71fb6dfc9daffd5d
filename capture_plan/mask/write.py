"""The files of a mask: every piece as STL as it stands on the printer's bed, all pieces in one 3MF, a picture to judge
by; and what a person who prints it must know.

Files are in millimetres. `mask.stl` is one piece; of several, `mask-1.stl` and so on, by their numbers.
"""

import hashlib
import io
import re
import uuid
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import cast

import numpy as np
from scipy.spatial import KDTree

from capture_plan.exports.delivery import dots_mm, head_of
from capture_plan.exports.kinds import DRAFT, either
from capture_plan.mask.make import Mask, make_mask
from capture_plan.mask.parts import Part
from capture_plan.mask.record import LEAST_WALL_MM, Dot, MaskSettings, Mesh
from capture_plan.output import write_whole, written_together
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan, number_of, whose_words, words_of
from capture_plan.prose import in_series
from capture_plan.reader.head_scan import MASK_BEGINS, PIECE
from capture_plan.sheets.solid import solid_picture

UUID = re.compile(rb"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
PIECES = 40  # names that the folder's guard knows
WRITES = (
    *either("mask.stl", "mask.3mf", "mask.png"),
    *(name for i in range(1, PIECES + 1) for name in either(f"mask-{i}.stl")),
)
MARKER = "M"  # what names of markers begin with: the number alone is engraved
STL_HEADER = 80  # bytes
BETWEEN_MM = 10.0  # pieces in the 3MF
REACH_MM, MIDDLE_MM, SHOWN = 5.0, 10.0, 3  # of a piece from the dots it holds; of one on neither side; names in a line


def write_mask(
    plan: Plan, inputs: PlanInputs, folder: Path | str, *, settings: MaskSettings | None = None
) -> tuple[Mask, tuple[Path, ...]]:
    """Make the mask of a plan and write it into `folder`, all of its files or none; the pieces of a mask that was
    written there before go.

    Raises:
        PlanError: no dot can have a hole, a library is missing, or the folder cannot be written.
        RenderError: this machine cannot draw.
    """
    head, folder = head_of(inputs), Path(folder)
    made = make_mask(head, dots_of(plan, inputs), dot_mm=plan.settings.landmarks.dot_mm, settings=settings)
    stem = f"mask{DRAFT if plan.draft else ''}"
    names = {f"{stem}.stl": made.parts[0]} if len(made.parts) == 1 else numbered(made.parts, plan)
    with written_together(folder, whose_words(plan), number_of(plan), whole=WRITES) as new:
        for name, part in names.items():
            write_whole(new / name, stl_bytes(part.printed, title_of(plan)))
        write_whole(new / f"{stem}.3mf", threemf_bytes(made.parts))
        write_whole(new / f"{stem}.png", solid_picture(made.mesh.vertices, made.mesh.triangles, title_of(plan)))
    return made, tuple(folder / name for name in (*names, f"{stem}.3mf", f"{stem}.png"))


def title_of(plan: Plan) -> str:
    """What the picture is of, and for a carried plan how exactly places are known."""
    off = f"; places off by about {plan.actor.error_mm:.1f} mm" if plan.actor else ""
    return f"{MASK_BEGINS}{words_of(plan)}{off}"


def numbered(parts: tuple[Part, ...], plan: Plan) -> dict[str, Part]:
    """The names of several pieces."""
    return {f"mask-{i + 1}{DRAFT if plan.draft else ''}.stl": part for i, part in enumerate(parts)}


def dots_of(plan: Plan, inputs: PlanInputs) -> tuple[Dot, ...]:
    """Every marker of the plan on the head that the mask is made for; M07 is engraved as 7."""
    return tuple(
        Dot(m.name, str(int(m.name[1:])) if m.name.startswith(MARKER) else m.name, at, m.region == "neck")
        for m, at in zip(plan.layout.markers, dots_mm(plan, inputs), strict=True)
    )


def stl_bytes(mesh: Mesh, said: str) -> bytes:
    """A closed surface as the bytes of a binary STL file, millimetres; its header holds what is `said` of it."""
    import trimesh

    data = cast("bytes", trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(file_type="stl"))
    head = said.encode("ascii", "replace")[:STL_HEADER]  # begins with `MASK_BEGINS`, which must not begin with 'solid'
    return head.ljust(STL_HEADER, b"\0") + data[STL_HEADER:]


def threemf_bytes(parts: tuple[Part, ...]) -> bytes:
    """3MF in millimetres, each piece an object on the bed, side by side; equal pieces, equal bytes."""
    import trimesh

    scene, x = trimesh.Scene(), 0.0
    for i, part in enumerate(parts):
        mesh = trimesh.Trimesh(part.printed.vertices, part.printed.triangles, process=False)
        mesh.units = "millimeter"
        move = np.eye(4)
        move[0, 3] = x + part.size_mm[0] / 2
        x += part.size_mm[0] + BETWEEN_MM
        scene.add_geometry(mesh, node_name=f"{PIECE}{i + 1}", geom_name=f"{PIECE}{i + 1}", transform=move)
    scene.units = "millimeter"
    return with_own_identifiers(cast("bytes", scene.export(file_type="3mf")))


def with_own_identifiers(archive: bytes) -> bytes:
    """A 3MF file whose UUIDs follow from what it holds, in place of random ones."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(archive)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.infolist():
            content = old.read(entry)
            bare = hashlib.sha256(UUID.sub(b"", content)).hexdigest()
            for number, random in enumerate(dict.fromkeys(UUID.findall(content))):
                own = str(uuid.uuid5(uuid.NAMESPACE_OID, f"{bare} {number}")).encode()
                content = content.replace(random, own)
            new.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return out.getvalue()


def mask_lines(mask: Mask) -> Iterator[str]:
    """What the mask measures, how it is printed, and which dots have no hole."""
    size = " x ".join(f"{side:.0f}" for side in np.ptp(mask.mesh.vertices, axis=0))
    low, middle, high = mask.gap_mm
    thin = f" near {_nearest(mask, np.array(mask.wall.least_at))} ({mask.wall.thin:,} rays below {LEAST_WALL_MM:g} mm)"
    yield (
        f"Mask of {size} mm (wide, high, deep) with {len(mask.holes)} holes of {2 * mask.holes[0].radius_mm:.1f} mm; "
        f"{len(mask.parts)} piece{'s' * (len(mask.parts) > 1)}."
    )
    yield (
        f"Wall measured by {mask.wall.rays:,} rays: {mask.wall.median_mm:.2f} mm, 1 % below "
        f"{mask.wall.percentile_mm:.2f} mm, {mask.wall.least_mm:.2f} mm at least"
        f"{thin if mask.wall.thin else ''}."
    )
    yield (
        f"Gap to the skin: {middle:.2f} mm, 9 of 10 places {low:.2f} to {high:.2f} mm; on the bridge of the nose the "
        "mask sits on the skin."
    )
    if mask.wall.thin:
        thicker = "smooth the scan there, or print with a thicker wall (--wall-mm)"
        yield f"Look at that place in the slicer before you print: plastic so thin may break; {thicker}."
    for i, part in enumerate(mask.parts):
        yield _printing(part, f"piece {i + 1} ({part_words(part, mask)})" if len(mask.parts) > 1 else "it", mask)
    if len(mask.parts) > 1:
        yield "Pieces meet around whole eyelets: lay them on the face edge to edge and tape them from outside."
    numbered = {label.name for label in mask.labels}
    bare = [hole.dot.name for hole in mask.holes if hole.dot.name not in numbered]
    if bare:
        yield f"No room for a number beside {in_series(bare)}: see the sheets."
    for name, why in mask.without.items():
        yield f"No hole for {name}: {why}."
    yield from (f"Note: {note}." for note in mask.notes)


def _printing(part: Part, what: str, mask: Mask) -> str:
    x, y, z = part.size_mm
    near = _nearest(mask, part.largest_at)
    hangs = (
        f"{part.overhang_mm2 / 100:.1f} cm² hang over by more than 45° and want support, "
        f"{part.largest_mm2 / 100:.1f} cm² of it in one place near {near}"
        if part.overhang_mm2 >= 5
        else "nothing hangs over by more than 45°"
    )
    bed = f"{x:.0f} x {y:.0f} mm on the bed, {z:.0f} mm high"
    return f"Print {what} as the file has it, {_standing(part)}: {bed}; {hangs}."


def _nearest(mask: Mask, place: np.ndarray) -> str:
    """The name of the dot whose hole is nearest to a place."""
    return min(mask.holes, key=lambda hole: float(np.linalg.norm(hole.dot.position - place))).dot.name


def part_words(part: Part, mask: Mask) -> str:
    """Which of several pieces it is: "the actor's left, with M02, M04 and 12 more"."""
    tree = KDTree(part.mesh.vertices)
    held = [hole.dot.name for hole in mask.holes if tree.query(hole.dot.position)[0] < REACH_MM]
    aside = float(part.mesh.vertices[:, 0].mean() - mask.mesh.vertices[:, 0].mean())
    side = "the actor's left, " if aside > MIDDLE_MM else "the actor's right, " if aside < -MIDDLE_MM else ""
    names = [*held[:SHOWN], *([f"{len(held) - SHOWN} more"] if len(held) > SHOWN else [])]
    return f"{side}with {in_series(names)}" if names else f"{side}without a hole"


def _standing(part: Part) -> str:
    """Which side of the face is up."""
    words = {"forehead": (0, 1, 0), "chin": (0, -1, 0), "nose": (0, 0, 1), "inside": (0, 0, -1)}
    words |= {"left side": (1, 0, 0), "right side": (-1, 0, 0)}
    along = {word: float(part.up @ np.array(direction)) for word, direction in words.items()}
    first, second = sorted(along, key=lambda word: -along[word])[:2]
    tilt = np.degrees(np.arctan2(along[second], along[first]))
    return f"{first} up" + (f", tilted {tilt:.0f}° towards the {second}" if tilt > 5 else "")
