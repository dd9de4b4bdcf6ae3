"""Rendering of a page to one self-contained HTML file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.files.formats import json_values
from flexcal.files.transaction import write_text
from flexcal.report.layout.blocks import FigureBlock, Page
from flexcal.report.layout.error_axis import place_ranges
from flexcal.report.layout.palette import DARK, LIGHT, dark_colours

if TYPE_CHECKING:
    from jinja2 import Environment

_SCRIPTS = ("numbers.js", "flat.js", "report.js")
_MARKS = {"good": "✓", "care": "!", "bad": "✗", "unknown": "?"}
_WORDS = {"good": "good", "care": "take care", "bad": "not good", "unknown": "not known"}


def write_page(path: str | Path, page: Page) -> None:
    """Write `page` atomically; raises `InputError` where it cannot be written."""
    write_text(path, _parts(page))


def page_html(page: Page) -> str:
    """The whole document. Nothing in it is loaded from elsewhere."""
    return "".join(_parts(page))


def _parts(page: Page) -> Iterator[str]:
    """The document in parts: that of Plotly's script, 5 MB, is copied into no other."""
    from plotly.offline import get_plotlyjs

    folder = files("flexcal.report") / "templates"
    used = bool(page.figures)
    return (
        templates()
        .get_template("report.html.j2")
        .generate(
            page=page,
            error_axis=place_ranges(page.verdict.error_ranges),
            marks=_MARKS,
            words=_WORDS,
            light=LIGHT,
            dark=DARK,
            style=(folder / "report.css").read_text("utf-8"),
            script="\n".join((folder / name).read_text("utf-8") for name in _SCRIPTS),
            specifications={block.id: figure_json(block) for block in page.figures},
            dark_colours=script_json(dark_colours()),
            document=script_json(json_values(page.document)),
            plotly=get_plotlyjs() if used else "",
        )
    )


@cache
def templates() -> Environment:
    """The templates of pages, compiled once in a process; a name that is not given to one is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("flexcal.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )


def figure_json(block: FigureBlock) -> str:
    """Data and layout of a figure, arrays in base64, safe inside a script element."""
    specification = block.figure.specification()
    selectors = {selector.key: selector.options[0] for selector in block.selectors}
    if block.slider is not None:
        specification |= {"stretched_by": block.slider.key, "factors": dict(block.slider.start)}
    return script_json(specification | {"selected": selectors})


def script_json(value: Any) -> str:
    """Compact JSON that cannot end the script element around it."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
