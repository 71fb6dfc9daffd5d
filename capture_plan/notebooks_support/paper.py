"""What leaves a notebook: pictures of the printed pages, the PDF, the HTML plan and `plan.json`."""

import base64
import html
import tempfile
from pathlib import Path

import marimo as mo

from capture_plan.plan.files import plan_bytes
from capture_plan.plan.record import Plan
from capture_plan.report.page import page_html
from capture_plan.rig import Rig
from capture_plan.sheets import write_sheets
from capture_plan.sheets.write import Sheet

PREVIEW_DPI, PRINT_DPI = 72, 300


def sheet_pages(plan: Plan, rig: Rig, paper: Sheet) -> dict[str, bytes]:
    """Pictures of all pages for the screen: PNG by title."""
    with tempfile.TemporaryDirectory() as folder:
        _, *pages = write_sheets(plan, rig, Path(folder), paper=paper, dpi=PREVIEW_DPI)
        return {page.stem.split("-", 1)[1].replace("-", " "): page.read_bytes() for page in pages}


def page_gallery(pages: dict[str, bytes]) -> mo.Html:
    """All pages side by side."""
    cells = "".join(
        f'<figure><img alt="{html.escape(title)}" src="data:image/png;base64,{base64.b64encode(page).decode()}">'
        f"<figcaption>{number}. {html.escape(title)}</figcaption></figure>"
        for number, (title, page) in enumerate(pages.items(), start=1)
    )
    return mo.Html(f'<div class="pages">{cells}</div>')


def sheet_download(plan: Plan, rig: Rig, paper: Sheet) -> mo.Html:
    """The sheets as a PDF of true size; drawn when asked for."""

    def pdf() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            return write_sheets(plan, rig, Path(folder), paper=paper, dpi=PRINT_DPI)[0].read_bytes()

    return mo.download(pdf, filename="sheets.pdf", mimetype="application/pdf", label="Sheets for print (PDF)")


def downloads(plan: Plan, rig: Rig, paper: Sheet) -> mo.Html:
    """The plan for programs, for people and for print."""
    return mo.hstack(
        [
            mo.download(plan_bytes(plan), filename="plan.json", mimetype="application/json", label="plan.json"),
            mo.download(
                lambda: page_html(plan, rig).encode(), filename="plan.html", mimetype="text/html", label="HTML plan"
            ),
            sheet_download(plan, rig, paper),
        ],
        justify="start",
        wrap=True,
    )
