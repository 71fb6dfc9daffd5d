"""The lessons and the reference of the package as pages that need no network and no server.

Lesson     each cell's code, unless the notebook hides it, and what it shows; knobs are named, and work in the notebook
Reference  everything that `capture_plan` exports: parameters, and the docstring as it stands
"""

import ast
import html
import inspect
import re
import runpy
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import marimo as mo
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer

import capture_plan
from capture_plan.notebooks_support.lessons import parameters
from capture_plan.output import write_whole
from capture_plan.progress import track

LESSONS = (
    "lesson_1_first_plan",
    "lesson_2_which_method",
    "lesson_3_reading_the_numbers",
    "lesson_4_where_we_differ",
    "lesson_5_three_papers",
    "lesson_6_cheat_sheet",
)
WRITES = ("index.html", "reference.html", *(f"{name}.html" for name in LESSONS))
COLOURS = HtmlFormatter(style="default", nowrap=False)
STYLE = """
:root { --border: #dcdad5; --card: #ffffff; --foreground: #1b1b1f; --muted-foreground: #5c5d66; }
body { max-width: 60rem; margin: 0 auto; padding: 2.5rem 1.25rem 5rem; background: #f7f6f4; color: var(--foreground);
  font: 16px/1.6 system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif; }
nav { display: flex; flex-wrap: wrap; gap: .3rem 1.2rem; margin-bottom: 2rem; font-size: .92rem; }
nav a { color: #1f5fd0; text-decoration: none; }
nav a[aria-current] { color: inherit; font-weight: 650; }
h1 { letter-spacing: -.02em; line-height: 1.15; }
h2 { margin-top: 2.5rem; }
code { font-size: .92em; }
.code { margin: 1.25rem 0 .5rem; border-left: 3px solid var(--border); padding: .1rem 0 .1rem 1rem; overflow-x: auto; }
.code pre { margin: 0; font-size: .84rem; line-height: 1.5; }
.output { margin: .5rem 0 1.5rem; }
.knob { color: var(--muted-foreground); }
iframe { width: 100%; }
.rows { max-height: none; }
section.entry { margin: 2rem 0; padding-top: 1rem; border-top: 1px solid var(--border); }
"""


@dataclass(frozen=True)
class Cell:
    """One cell of a lesson: its code, nothing where the notebook hides it, and what it shows."""

    code: str
    output: Any


def write_site(notebooks: Path, folder: Path) -> list[Path]:
    """Write the lessons in `notebooks/learn` and the reference into `folder`, each page whole or not at all.

    Raises:
        PlanError: the place cannot be written.
    """
    style = (notebooks / "notebook.css").read_text(encoding="utf-8") + STYLE + COLOURS.get_style_defs(".highlight")
    lessons = {name: notebooks / "learn" / f"{name}.py" for name in LESSONS}
    titles = {name: title_of(path) for name, path in lessons.items()} | {"reference": "Reference"}
    pages = {"reference": reference_page()}
    for name, path in track(list(lessons.items()), "Running the lessons"):
        pages[name] = "".join(cell_html(cell) for cell in run_cells(path))
    pages["index"] = front_page(titles)
    for name, body in pages.items():
        links = "".join(
            f'<a href="{other}.html"{" aria-current" if other == name else ""}>{html.escape(title)}</a>'
            for other, title in titles.items()
        )
        page = document(titles.get(name, "Learning capture_plan"), style, f"<nav>{links}</nav>{body}")
        write_whole(folder / f"{name}.html", page.encode())
    return [folder / name for name in WRITES]


def title_of(path: Path) -> str:
    """The title that a notebook gives its application."""
    found = re.search(r'app_title="([^"]+)"', path.read_text(encoding="utf-8"))
    return found[1] if found else path.stem


def run_cells(path: Path) -> list[Cell]:
    """Every cell of a notebook after it was run, in the order of the file."""
    source = path.read_text(encoding="utf-8")
    outputs, _ = runpy.run_path(str(path))["app"].run()
    cells = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    return [Cell(code_of(cell, source), output) for cell, output in zip(cells, outputs, strict=True)]


def code_of(cell: ast.FunctionDef, source: str) -> str:
    """What a person wrote in a cell: its body without marimo's `return`; nothing where the cell hides its code."""
    called = cell.decorator_list[0]
    if isinstance(called, ast.Call) and any(word.arg == "hide_code" for word in called.keywords):
        return ""
    lines = source.splitlines()[cell.body[0].lineno - 1 : cell.body[-1].lineno - 1]
    return textwrap.dedent("\n".join(lines)).strip()


def cell_html(cell: Cell) -> str:
    """A cell as a page shows it."""
    code = f'<div class="code">{highlight(cell.code, PythonLexer(), COLOURS)}</div>' if cell.code else ""
    return code + (f'<div class="output">{shown(cell.output)}</div>' if cell.output is not None else "")


def shown(output: Any) -> str:
    """An output as HTML. A knob of marimo works in the notebook alone: here its label stands for it."""
    text = mo.as_html(output).text
    knobs = re.findall(r"data-label='([^']*)'", text) if "<marimo-" in text else []
    if not knobs:
        return text
    labels = [html.escape(re.sub(r"<[^>]+>", "", html.unescape(knob)).strip('"')) for knob in knobs]
    return f'<p class="knob">To be turned in the notebook: {"; ".join(labels)}.</p>'


def front_page(titles: dict[str, str]) -> str:
    """The first page: what there is to learn."""
    lines = "".join(f'<li><a href="{name}.html">{html.escape(title)}</a></li>' for name, title in titles.items())
    return (
        "<h1>Learning capture_plan</h1><p>Six lessons from a rig to a printed page, and a reference. Each lesson is a "
        "notebook: <code>capture-plan learn</code> opens them to be turned and changed.</p>"
        f"<ul>{lines}</ul>"
    )


def reference_page() -> str:
    """Everything that the package exports, with its docstring."""
    entries = []
    for name in capture_plan.__all__:
        exported = getattr(capture_plan, name)
        head = f'<h2 id="{name}"><code>{html.escape(name + parameters(exported))}</code></h2>'
        documented = f'<pre class="text">{html.escape(inspect.getdoc(exported) or "")}</pre>'
        entries.append(f'<section class="entry">{head}{documented}</section>')
    return "<h1>Reference</h1><p>Lengths are in millimetres unless a name says otherwise.</p>" + "".join(entries)


def document(title: str, style: str, body: str) -> str:
    """A whole page around its body."""
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{style}</style></head><body>{body}</body></html>"
    )
