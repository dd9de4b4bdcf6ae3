"""Headings, and links to files of the project and to other steps."""

from __future__ import annotations

from html import escape
from urllib.parse import quote

_STYLE = "margin:0 0.5em 0.4em;font-size:0.85em;"


def heading(text: str) -> str:
    """The title of a part."""
    return f'<h2 style="margin:0.3em 0.5em 0.2em;font-size:1em;font-weight:600;">{escape(text)}</h2>'


def file_link(name: str, text: str) -> str:
    """A link that opens a file of the project, by its name, in another tab."""
    return (
        f'<div style="{_STYLE}"><a href="files/{escape(quote(name), quote=True)}" target="_blank" rel="noopener">'
        f"{escape(text)}</a></div>"
    )


def step_link(title: str, text: str) -> str:
    """A link that opens another step of the window."""
    return f'<div style="{_STYLE}"><a href="step/{escape(quote(title), quote=True)}">{escape(text)}</a></div>'
