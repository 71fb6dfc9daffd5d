"""From a plan to paper: every sheet as one PDF of true size, and each of its pages as PNG.

The folder gets `sheets.pdf` and `pages/*.png` when all of them are made, and nothing before.
"""

import hashlib
import os
import shutil
import tempfile
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
import pypdfium2

from capture_plan.errors import PlanError
from capture_plan.plan.record import Plan
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.rig.regions import face_regions
from capture_plan.sheets.expression_page import Sizes, shoot
from capture_plan.sheets.furniture import Source, check_bar, foot_line, head_line, legend, sides
from capture_plan.sheets.head import make_head, pose
from capture_plan.sheets.marker_table import draw_table, rows_per_page
from capture_plan.sheets.markers import HEADER_MM, Face, draw_markers, place
from capture_plan.sheets.page import MARGIN_MM, Booklet, paper
from capture_plan.sheets.shot_list import draw_shot_list, paged
from capture_plan.sheets.shots import draw_expression, draw_overview, number, overview_grid, plates
from capture_plan.sheets.style import SOFT, region_looks
from capture_plan.sheets.view import FRONT, LEFT, MIRROR, RIGHT, View, pixels

TITLES = {
    FRONT: "MARKERS · FRONT",
    LEFT: "MARKERS · ACTOR'S LEFT",
    RIGHT: "MARKERS · ACTOR'S RIGHT",
    MIRROR: "MARKERS · IN THE MIRROR",
}
SLUGS = {FRONT: "markers-front", LEFT: "markers-left", RIGHT: "markers-right", MIRROR: "markers-mirror"}


def write_sheets(
    plan: Plan, rig: Rig, folder: Path | str, *, paper: Literal["a4", "letter"] = "a4", dpi: int = 300
) -> tuple[Path, ...]:
    """Write `sheets.pdf` and `pages/*.png` into `folder`, all or none; returns what was written, the PDF first.

    Raises:
        PlanError: the plan belongs to another rig, or the folder cannot be written.
        RenderError: this machine cannot draw.
    """
    folder = Path(folder)
    book = draw_sheets(plan, rig, sheet=paper, dpi=dpi)
    pdf = book.bytes()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".sheets-") as scratch:
            made = Path(scratch)
            (made / "sheets.pdf").write_bytes(pdf)
            (made / "pages").mkdir()
            names = _write_pages(pdf, book.titles, made / "pages", dpi)
            if (folder / "pages").exists():
                os.replace(folder / "pages", made / "old")
            os.replace(made / "pages", folder / "pages")
            os.replace(made / "sheets.pdf", folder / "sheets.pdf")
            shutil.rmtree(made / "old", ignore_errors=True)
    except OSError as error:
        raise PlanError(f"{folder} cannot be written ({error.strerror}): choose another folder") from error
    return (folder / "sheets.pdf", *(folder / "pages" / name for name in names))


def draw_sheets(plan: Plan, rig: Rig, *, sheet: str, dpi: int) -> Booklet:
    """All pages of a plan, drawn."""
    if plan.rig.fingerprint != rig.fingerprint:
        raise PlanError(
            f"the plan was made for rig {plan.rig.fingerprint}, this is {rig.fingerprint}: plan again or give that rig"
        )
    return _Drawing(plan, rig, Booklet(paper(sheet), f"{rig.name}: markers and expressions"), dpi).all()


def plan_fingerprint(plan: Plan) -> str:
    """16 hexadecimal digits of the SHA-256 of the plan: equal plans, equal fingerprints."""
    return hashlib.sha256(msgspec.json.encode(plan, order="deterministic")).hexdigest()[:16]


@dataclass
class _Drawing:
    plan: Plan
    rig: Rig
    book: Booklet
    dpi: int
    shown: set[str] = field(default_factory=set)

    def all(self) -> Booklet:
        plan, book = self.plan, self.book
        regions = face_regions(self.rig)
        landmarks = plan.layout.markers
        head = make_head(self.rig)
        face = Face(pose(head, self.rig.neutral), self.rig.skin, landmarks, region_looks(landmarks), regions.anchors)
        per_table = rows_per_page(book)
        tables = [landmarks[i : i + per_table] for i in range(0, len(landmarks), per_table)]
        expressions = plan.packing.expressions
        rows, columns = overview_grid(book, len(expressions))
        overviews = -(-len(expressions) // (rows * columns))
        shot_list = plan.session
        lists = paged(book, shot_list)
        pages = len(TITLES) + len(tables) + len(lists) + overviews + len(expressions)
        self.source = Source(self.rig.name, plan_fingerprint(plan), pages)
        for view in track(tuple(TITLES), "Drawing marker sheets"):
            self._marker_sheet(face, view)
        for i, some in enumerate(tables):
            self._page("marker-table" if i == 0 else f"marker-table-{i + 1}")
            draw_table(book, some, landmarks, face.looks, face.anchors, self._worth())
            unseen = ", ".join(m.name for m in some if m.name not in self.shown)
            if unseen:
                text = f"Seen on none of the sheets, place by the table: {unseen}"
                book.text(MARGIN_MM, book.paper.height - 12, text, 8, bold=True, fit=book.paper.width - 2 * MARGIN_MM)
        for i, items in enumerate(lists):
            self._page("shot-list" if i == 0 else f"shot-list-{i + 1}")
            draw_shot_list(book, shot_list, items)
        _, large, tall, small, short, narrow = plates(book)
        sizes = Sizes(
            *(pixels(wide, high, self.dpi) for wide, high in ((large, tall), (small, short), (narrow, short)))
        )
        mu = plan.settings.expressions.mu
        shots = [shoot(head, face.anchors, e, mu=mu, sizes=sizes) for e in track(expressions, "Drawing expressions")]
        line_of = {item.name: item for item in shot_list.items}
        first = 0
        for i in range(overviews):
            self._page("expressions" if i == 0 else f"expressions-{i + 1}")
            first = draw_overview(book, shots, first, len(shots), self._packed())
        for i, shot in enumerate(shots):
            self._page(f"{number(i)}")
            draw_expression(book, shot, line_of[shot.expression.name], i, len(shots))
        return book

    def _page(self, title: str) -> None:
        self.book.add_page(title)
        foot_line(self.book, self.source)

    def _marker_sheet(self, face: Face, view: View) -> None:
        book = self.book
        placed = place(face, view, book, dpi=self.dpi)
        self._page(SLUGS[view])
        draw_markers(book, placed, face.looks)
        head_line(book, TITLES[view], self._worth())
        sides(book, HEADER_MM - 0.5, left_on_right=not view.mirrored)
        y = book.paper.height - 27
        size = "LIFE SIZE 1:1" if placed.scale == 1 else f"SCALE 1:{placed.scale:g}"
        check_bar(book, MARGIN_MM, y)
        book.text(MARGIN_MM, y + 13.2, size, 15, bold=True)
        counts = {region: sum(m.region == region for m in face.landmarks) for region in face.looks}
        x = MARGIN_MM + 66
        legend(book, x, y + 1.2, book.paper.width - MARGIN_MM - x, face.looks, counts)
        self.shown |= {landmark.name for landmark in placed.landmarks}
        notes = ["hollow: a spare"] if any(m.role == "backup" for m in placed.landmarks) else []
        if any(m.role == "head" for m in placed.landmarks):
            notes.append("H: for the head's own motion")
        if len(placed.landmarks) < len(face.landmarks):
            notes.append(f"{len(placed.landmarks)} of {len(face.landmarks)} markers are seen from here")
        book.text(book.paper.width - MARGIN_MM, y + 13.2, "  ·  ".join(notes), 7.4, align="right", colour=SOFT)

    def _worth(self) -> str:
        worth, places = (
            self.plan.layout.worth,
            np.array([m.position for m in self.plan.layout.markers]).reshape(-1, 3),
        )
        apart = np.linalg.norm(places[:, None] - places[None], axis=2)[np.triu_indices(len(places), 1)]
        nearest = f" · nearest two {apart.min():.1f} mm" if len(apart) else ""
        return (
            f"{worth.landmarks} markers · rank {worth.rank} of {worth.full_rank} · predicted error "
            f"{worth.error_mm:.2f} mm at {worth.noise_mm:g} mm noise{nearest}"
        )

    def _packed(self) -> str:
        packing = self.plan.packing
        proof = " · proven fewest" if packing.proven_optimal and packing.objective == packing.bound else ""
        return f"{len(packing.expressions)} expressions{proof} · bars: share of all movement covered so far"


def _write_pages(pdf: bytes, titles: list[str], folder: Path, dpi: int) -> list[str]:
    document = pypdfium2.PdfDocument(pdf)
    names = [f"{i + 1:02}-{title}.png" for i, title in enumerate(titles)]
    with ThreadPoolExecutor(1) as pool:  # compresses the last page while the next is rasterised
        saved: list[Future[None]] = []
        for i, name in enumerate(track(names, "Writing pages")):
            image = document[i].render(scale=dpi / 72).to_pil()  # pyright: ignore[reportArgumentType]
            if saved:
                saved[-1].result()
            saved.append(pool.submit(image.save, folder / name, compress_level=1, dpi=(dpi, dpi)))
        for each in saved:
            each.result()
    document.close()
    return names
