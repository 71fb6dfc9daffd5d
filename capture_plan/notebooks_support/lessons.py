"""What lessons show beside what every notebook does: printed text, words of the glossary, every command and call."""

import html
import inspect
import re
from collections.abc import Iterable, Sequence
from importlib.resources import files
from typing import Any

import marimo as mo

import capture_plan
from capture_plan.glossary import explained, glossary
from capture_plan.notebooks_support.figures import show_table


def printed(lines: str) -> mo.Html:
    """Text as the command line prints it."""
    return mo.Html(f'<pre class="text">{html.escape(lines)}</pre>')


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> mo.Html:
    """A table of texts under a head, a row each."""
    return show_table([dict(zip(head, row, strict=True)) for row in rows])


def word_list(asked: Iterable[str] = ()) -> mo.Html:
    """What words mean, those asked for or all of the glossary."""
    rows = [
        f"<dt>{html.escape(word)}</dt><dd>{html.escape(says)}</dd>" for word, says in explained(asked or glossary())
    ]
    return mo.Html(f'<dl class="words">{"".join(rows)}</dl>')


def every_command(app: Any) -> list[tuple[str, str]]:
    """Every command of a Typer application and what it does."""
    return [(f"capture-plan {one.callback.__name__}", first_sentence(one.callback)) for one in app.registered_commands]


def every_call() -> list[tuple[str, str]]:
    """Everything that the package exports, functions with their parameters, and what it is."""
    exported = ((name, getattr(capture_plan, name)) for name in capture_plan.__all__)
    return [(f"{name}{parameters(one)}", first_sentence(one)) for name, one in exported]


def parameters(exported: Any) -> str:
    """The names of a function's parameters in brackets, those with a default value with it; nothing of a record."""
    if not inspect.isfunction(exported):
        return ""
    given = inspect.signature(exported).parameters.values()
    return f"({', '.join(one.name if one.default is one.empty else f'{one.name}=…' for one in given)})"


def first_sentence(documented: Any) -> str:
    """The first sentence of a docstring, in one line."""
    paragraph = " ".join((inspect.getdoc(documented) or "").split("\n\n")[0].split())
    return re.split(r"(?<! al)\. ", paragraph)[0].rstrip(".") + "."


def settings_file() -> str:
    """The settings file with every key, as `capture-plan settings` writes it."""
    return files("capture_plan.plan").joinpath("data", "settings.toml").read_text(encoding="utf-8")
