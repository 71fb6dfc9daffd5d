"""From a plan to paper: every sheet as one PDF of true size, and each of its pages as PNG.

The folder gets `sheets.pdf` and `pages/*.png` when all of them are made, and nothing before.
"""

import hashlib
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Literal

import msgspec
import pypdfium2

from capture_plan.anatomy.kinds import apart_lines
from capture_plan.errors import PlanError
from capture_plan.evaluation.fallen import falling
from capture_plan.evaluation.rings import rings_of
from capture_plan.expressions.record import Expression
from capture_plan.expressions.session import shot_note
from capture_plan.expressions.settings import MEASURED_BY
from capture_plan.layout.dot_contact import meeting_words
from capture_plan.layout.record import Layout
from capture_plan.output import write_whole, written_together
from capture_plan.plan.carry import as_worn, worn_words
from capture_plan.plan.consent import consent_lines
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.predicted import headline_words
from capture_plan.plan.record import Plan, cameras_of, head_words, number_of, whose_words
from capture_plan.plan.summary import expression_words
from capture_plan.progress import track, track_in_threads
from capture_plan.rig import Rig
from capture_plan.sheets.camera_pages import CameraPages
from capture_plan.sheets.camera_reads import CameraReads
from capture_plan.sheets.expression_page import Shot, Sizes, near, shoot
from capture_plan.sheets.furniture import HeadLine, SheetSource, foot_line
from capture_plan.sheets.head import Head, make_head
from capture_plan.sheets.marker_pages import (
    MarkerPages,
    marked_face,
    nearest_words,
    placing_words,
    take_words,
)
from capture_plan.sheets.marker_table import VERTEX, ring_column
from capture_plan.sheets.page import Booklet, paper
from capture_plan.sheets.shot_list import draw_shot_list, paged
from capture_plan.sheets.shots import (
    MAP_COLUMNS,
    MAP_MM,
    draw_expression,
    draw_maps,
    draw_overview,
    map_rows,
    overview_grid,
    plates,
)
from capture_plan.sheets.view import FRONT, pixels

Sheet = Literal["a4", "letter", "a3"]  # the names in `page.PAPERS`
WRITES = ("sheets.pdf", "pages")  # into a folder
RLE = 3  # runs of equal bytes: the quickest of zlib's ways, and on white paper the smallest
PORTRAIT_DPI = 200  # of pictures of expressions: clay has no detail that more would show
WORKERS = 2  # threads that compress pages


def write_sheets(
    plan: Plan, inputs: Rig | PlanInputs, folder: Path | str, *, paper: Sheet = "a4", dpi: int = 300
) -> tuple[Path, ...]:
    """Write `sheets.pdf` and `pages/*.png` into `folder`, all or none; returns what was written, the PDF first. A plan
    that was carried onto the actor's head is drawn on it.

    Raises:
        PlanError: the plan belongs to another rig, or the folder cannot be written.
        RenderError: this machine cannot draw.

    Example:
        >>> pdf, *pages = write_sheets(read_plan("hero.plan.json"), sample_rig(), "sheets", paper="a4", dpi=72)
        >>> pdf.name, pages[0].name
        ('sheets.pdf', '01-markers-front.png')
    """
    given = inputs if isinstance(inputs, PlanInputs) else PlanInputs(inputs)
    book = draw_sheets(plan, given, sheet=paper, dpi=dpi)
    return write_booklet(book, Path(folder), dpi, whose_words(plan), number_of(plan))


def write_marker_sheets(
    layout: Layout, rig: Rig, folder: Path | str, *, paper: Sheet = "a4", dpi: int = 300
) -> tuple[Path, ...]:
    """Write sheets of markers alone, for a take without blendshapes, on the `rig` that stands in for it."""
    return write_booklet(draw_marker_sheets(layout, rig, sheet=paper, dpi=dpi), Path(folder), dpi, rig.name)


def write_booklet(book: Booklet, folder: Path, dpi: int, of: str = "", number: str = "") -> tuple[Path, ...]:
    """`sheets.pdf` and `pages/*.png` of a head and the plan with a `number`, all or none.

    Raises:
        PlanError: the folder cannot be written.
    """
    pdf = book.bytes()
    with written_together(folder, of, number) as made:
        write_whole(made / "sheets.pdf", pdf)
        (made / "pages").mkdir()
        names = _write_pages(pdf, book.titles, made / "pages", dpi)
    return (folder / "sheets.pdf", *(folder / "pages" / name for name in names))


def draw_sheets(plan: Plan, inputs: PlanInputs, *, sheet: str, dpi: int) -> Booklet:
    """All pages of a plan, drawn: on the actor's own head where it was carried onto one."""
    rig = inputs.rig
    refuse_other_rig(plan, rig)
    book = Booklet(paper(sheet), f"{rig.name}: markers and expressions", rig.names, draft="; ".join(plan.draft))
    shown, worn = as_worn(plan, inputs)
    head, dot_mm = make_head(worn), plan.settings.landmarks.dot_mm
    rings = rings_of(rig, plan.audit.used, plan.settings.landmarks, plan.layout.landmarks, cameras_of(plan))
    face = marked_face(worn, head, shown.layout, rings.mm, dot_mm)
    actor = None if inputs.generic else plan.actor
    face = replace(face, own=actor is not None, off_mm=actor.error_mm if actor else 0.0)
    face = replace(face, strict=rings.strict, kept=rings.kept, nobodys=inputs.generic)
    placing = placing_words(plan.layout, dot_mm, face.rings)
    on_head = worn_words(plan, inputs)
    placed: HeadLine = (on_head, placing) if on_head else (placing,)
    chosen = plan.settings.landmarks
    says = {one.name: one.words for one in plan.audit.details}
    cared = falling(rig, plan.audit.used, chosen, plan.layout.landmarks, cameras_of(plan))
    markers = MarkerPages(
        book,
        face,
        placed,
        placed,
        ring_column(face),
        dpi,
        cared,
        says,
        agreed=consent_lines(plan.settings.consent),
        code=f"capture-plan: plan {number_of(plan)} of {head_words(plan, generic=inputs.generic)}",
    )
    lists, (rows, columns) = paged(book, plan.session), overview_grid(book, len(plan.packing.expressions))
    overviews = -(-len(plan.packing.expressions) // (rows * columns))
    count = len(plan.packing.expressions)
    maps = -(-count // (map_rows(book) * MAP_COLUMNS))
    reads = CameraReads(plan, worn, head, shown.layout.markers)
    cameras = CameraPages(reads, book) if plan.cameras else None
    technical = cameras.count() if cameras else 0
    pages = markers.count + len(lists) + overviews + count + maps + technical
    source = SheetSource(head_words(plan, generic=inputs.generic), f"plan {number_of(plan)}", pages)

    def add_page(title: str) -> None:
        book.add_page(title)
        foot_line(book, source)

    markers.draw(add_page)
    for i, items in enumerate(lists):
        add_page("shot-list" if i == 0 else f"shot-list-{i + 1}")
        near = meeting_words(plan.meetings, plan.settings.landmarks.dot_mm, plan.shots)
        draw_shot_list(book, plan.session, items, apart_lines(plan.audit.apart), near)
    draw_expressions(plan, head, markers, overviews, add_page)
    if cameras:
        cameras.draw(dpi, add_page)
    return book


def refuse_other_rig(plan: Plan, rig: Rig) -> None:
    """Raises PlanError where the plan was made for another rig."""
    if plan.rig.fingerprint != rig.fingerprint:
        raise PlanError(
            f"the plan was made for rig {plan.rig.fingerprint}, this is {rig.fingerprint}: plan again or give that rig"
        )


def draw_expressions(
    plan: Plan, head: Head, markers: MarkerPages, overviews: int, add_page: Callable[[str], None]
) -> None:
    """A page for each expression, behind so many pages of all of them."""
    book, expressions, mu = markers.book, plan.in_session, plan.settings.expressions.mu
    _, large, tall, small, short = plates(book)
    dpi = min(markers.dpi, PORTRAIT_DPI)
    sizes = Sizes(*(pixels(wide, high, dpi) for wide, high in ((large, tall), (small, short), MAP_MM)))
    relaxed = near(markers.face.posed, markers.anchors, FRONT, sizes.small)

    def one(expression: Expression) -> Shot:
        return shoot(head, markers.anchors, expression, mu=mu, sizes=sizes)

    shots = list(track_in_threads(one, expressions, "Drawing expressions"))  # one traces shade while another draws
    line_of = {item.name: item for item in plan.session.items}
    items, first = [line_of[shot.expression.name] for shot in shots], 0
    for i in range(overviews):
        add_page("expressions" if i == 0 else f"expressions-{i + 1}")
        first = draw_overview(book, shots, items, first, packed_words(plan))
    for shot, item in zip(shots, items, strict=True):
        add_page(f"shot-{item.slate}-{item.name}")
        draw_expression(book, shot, relaxed, item, shot_note(item, plan.session))
    first = 0
    while first < len(shots):
        add_page("maps" if first == 0 else f"maps-{first // (map_rows(book) * MAP_COLUMNS) + 1}")
        first = draw_maps(book, shots, items, first)


def draw_marker_sheets(layout: Layout, rig: Rig, *, sheet: str, dpi: int) -> Booklet:
    """The pages of markers for a take, drawn on the rig that stands in for it."""
    book = Booklet(paper(sheet), f"{rig.name}: markers for a take", rig.names)
    fit, count = layout.motion, f"{len(layout.markers)} markers for the take {rig.name}{nearest_words(layout, rig)}"
    words: HeadLine = (count, take_words(fit)) if fit else (count,)
    face = marked_face(rig, make_head(rig), layout)
    markers = MarkerPages(book, face, (placing_words(layout, face.dot_mm),), words, VERTEX, dpi)
    source = SheetSource(rig.name, f"markers {fingerprint(layout)}", markers.count)

    def add_page(title: str) -> None:
        book.add_page(title)
        foot_line(book, source)

    markers.draw(add_page)
    return book


def fingerprint(layout: Layout) -> str:
    """16 hexadecimal digits of the SHA-256 of a layout: equal ones, equal fingerprints."""
    return hashlib.sha256(msgspec.json.encode(layout, order="deterministic")).hexdigest()[:16]


def packed_words(plan: Plan) -> str:
    """What the expressions are worth."""
    packing, layout = plan.packing, plan.layout
    markers = headline_words(layout.information, layout.predictions)
    bars = f"bars: how much of {MEASURED_BY[plan.settings.expressions.importance]} is covered so far"
    return f"{expression_words(packing)} · {bars} · the markers' {markers}"


def _write_pages(pdf: bytes, titles: list[str], folder: Path, dpi: int) -> list[str]:
    document = pypdfium2.PdfDocument(pdf)
    names = [f"{i + 1:02}-{title}.png" for i, title in enumerate(titles)]
    with ThreadPoolExecutor(WORKERS) as pool:  # compress pages while the next is rasterised
        saved: list[Future[None]] = []
        for i, name in enumerate(track(names, "Writing pages")):
            image = document[i].render(scale=dpi / 72).to_pil()  # pyright: ignore[reportArgumentType]
            if len(saved) >= WORKERS:
                saved[-WORKERS].result()
            saved.append(pool.submit(image.save, folder / name, compress_level=1, compress_type=RLE, dpi=(dpi, dpi)))
        for each in saved:
            each.result()
    document.close()
    return names
