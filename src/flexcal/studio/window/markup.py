"""HTML of texts and tables; whatever comes from files is escaped here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Literal

Tone = Literal["plain", "good", "warning", "bad", "faint"]
_STYLE: dict[Tone, str] = {
    "plain": "",
    "good": "border-left:3px solid #2b8a3e;padding-left:0.5em;",
    "warning": "border-left:3px solid #e67700;padding-left:0.5em;",
    "bad": "border-left:3px solid #c92a2a;padding-left:0.5em;",
    "faint": "opacity:0.75;",
}
_WORD: dict[Tone, str] = {"good": "✓ ", "warning": "! ", "bad": "✗ ", "plain": "", "faint": ""}
"""Colour is never the only sign."""
_TEXT = "font-size:0.85em;line-height:1.4;margin:0.2em 0.5em 0.4em;overflow-wrap:anywhere;"


def paragraph(text: str, tone: Tone = "plain") -> str:
    """A paragraph of plain text."""
    role = ' role="alert"' if tone == "bad" else ""
    return f'<div{role} style="{_TEXT}{_STYLE[tone]}">{_WORD[tone]}{escape(text)}</div>'


def step_links(titles: Sequence[str], current: str, project: str) -> str:
    """The steps as links to `step/TITLE`, the current one marked, below the project's name."""
    links = []
    for number, title in enumerate(titles, 1):
        mark = "font-weight:700;border-bottom:3px solid #228be6;" if title == current else "opacity:0.8;"
        here = ' aria-current="step"' if title == current else ""
        links.append(
            f'<a href="step/{escape(title, quote=True)}"{here} title="key {number}" style="color:inherit;text-decoration:none;'
            f'padding:0.3em 0.15em;{mark}">{number} {escape(title)}</a>'
        )
    return (
        f'<div style="font-size:0.8em;opacity:0.8;margin:0 0.6em;">{escape(project)}</div><nav aria-label="Steps" '
        f'style="display:flex;flex-wrap:wrap;gap:0.1em 0.7em;font-size:0.85em;margin:0.1em 0.5em 0.5em;">{"".join(links)}</nav>'
    )


def command_text(line: str) -> str:
    """A command line to copy, in a box that a click selects as a whole."""
    return (
        '<code style="display:block;font-size:0.78em;margin:0.2em 0.5em 0.4em;padding:0.4em;overflow-wrap:anywhere;'
        f'border:1px solid rgba(128,128,128,0.4);border-radius:3px;user-select:all;">{escape(line)}</code>'
    )


def facts(values: Mapping[str, str]) -> str:
    """Names and values in two columns."""
    rows = "".join(
        f'<tr><th scope="row" style="text-align:left;font-weight:400;padding-right:1em;opacity:0.8;">{escape(name)}</th>'
        f"<td>{escape(value)}</td></tr>"
        for name, value in values.items()
    )
    return f'<table style="{_TEXT}border-spacing:0 0.1em;">{rows}</table>'


def folded(title: str, content: str) -> str:
    """HTML below a title that opens it."""
    return (
        '<details style="margin:0.2em 0.5em;border:1px solid rgba(128,128,128,0.35);border-radius:3px;">'
        f'<summary style="cursor:pointer;padding:0.25em 0.5em;font-size:0.85em;">{escape(title)}</summary>{content}</details>'
    )


def table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, height: str = "16em") -> str:
    """A table of texts that scrolls past `height`."""
    return _scrolled(columns, "".join(f"<tr>{_cells(row)}</tr>" for row in rows), height)


def picked_rows(
    columns: Sequence[str],
    rows: Mapping[str, Sequence[str]],
    chosen: str | None,
    *,
    height: str = "16em",
) -> str:
    """A table whose rows can be picked, by key, with mouse and keyboard: their first cell is a link to `pick/KEY`."""
    lines = []
    for key, row in rows.items():
        mark = "background:rgba(77,171,247,0.3);" if key == chosen else ""
        current = ' aria-current="true"' if key == chosen else ""
        link = (
            f'<a href="pick/{escape(key, quote=True)}"{current} style="color:inherit;">{escape(row[0])}</a>'
        )
        lines.append(f'<tr style="{mark}"><td style="{_CELL}">{link}</td>{_cells(row[1:])}</tr>')
    return _scrolled(columns, "".join(lines), height)


_CELL = "padding:0.1em 0.6em 0.1em 0;text-align:left;white-space:nowrap;"


def _cells(row: Sequence[str]) -> str:
    return "".join(f'<td style="{_CELL}">{escape(cell)}</td>' for cell in row)


def _scrolled(columns: Sequence[str], body: str, height: str) -> str:
    heads = "".join(
        f'<th scope="col" style="{_CELL}font-weight:600;">{escape(name)}</th>' for name in columns
    )
    return (
        f'<div tabindex="0" style="max-height:{height};overflow:auto;{_TEXT}">'
        f'<table style="border-spacing:0;"><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>'
    )
