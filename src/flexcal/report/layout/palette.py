"""Colours of figures and page, on light and dark ground."""

from __future__ import annotations

LIGHT = {
    "page": "#ffffff",
    "ink": "#1b1f24",
    "quiet": "#5b6470",
    "grid": "#e3e6ea",
    "axis": "#aab2bb",
    "elastic": "#1f6fd0",
    "rigid": "#d9541e",
    "nominal": "#7d8690",
    "links": "#c3cad2",
}
DARK = {
    "page": "#14181d",
    "ink": "#e8ebef",
    "quiet": "#a3adb8",
    "grid": "#2b323a",
    "axis": "#5b6672",
    "elastic": "#5a9df0",
    "rigid": "#f0804f",
    "nominal": "#949ea9",
    "links": "#6f7985",
}

PAGE, INK, QUIET, GRID, AXIS = (LIGHT[k] for k in ("page", "ink", "quiet", "grid", "axis"))
ELASTIC, RIGID, NOMINAL, LINKS = (LIGHT[k] for k in ("elastic", "rigid", "nominal", "links"))


def dark_colours() -> dict[str, str]:
    """Light colour → dark colour, for the page's script."""
    return {LIGHT[name]: DARK[name] for name in LIGHT}
