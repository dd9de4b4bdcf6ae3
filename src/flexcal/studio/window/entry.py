"""A form of HTML whose fields travel with its button."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

_FIELD = (
    "flex:1 1 0;min-width:0;box-sizing:border-box;height:1.9em;padding:0 0.5em;font:inherit;text-align:right;color:inherit;"
    "background:transparent;border:1px solid rgba(128,128,128,0.6);border-radius:4px;"
)
_BUTTON = (
    "width:100%;height:2.1em;margin-top:0.2em;font:inherit;font-weight:600;color:#fff;background:#1971c2;border:0;border-radius:4px;"
    "cursor:pointer;"
)


def entry_form(labels: Sequence[str], button: str) -> str:
    """Empty fields for numbers, named by their labels, and the button, or Enter, that sends them to `Step.enter` of the open step.

    They arrive together, as texts, or not at all; a field of viser's arrives by itself, and cannot be empty.
    """
    fields = "".join(
        '<label style="display:flex;align-items:center;gap:0.5em;margin-bottom:0.35em;">'
        f'<span style="width:6.5em;opacity:0.75;">{escape(label)}</span>'
        f'<input name="{escape(label, quote=True)}" inputmode="decimal" autocomplete="off" spellcheck="false" style="{_FIELD}"></label>'
        for label in labels
    )
    return (
        '<form data-entry autocomplete="off" style="margin:0 0.7em 0.5em;font-size:0.85em;">'
        f'{fields}<button type="submit" style="{_BUTTON}">{escape(button)}</button></form>'
    )
