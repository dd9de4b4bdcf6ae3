"""Tables whose cells are printed as they are: names from files are neither markup nor escape sequences."""

from __future__ import annotations

from typing import IO, Any

from rich.console import Console
from rich.text import Text

from flexcal.printable import printable


class SafeConsole(Console):
    """A console on which texts stand for themselves; titles, headings and cells come through `render_str`."""

    def __init__(self, file: IO[str], width: int | None):
        super().__init__(file=file, width=width, markup=False, emoji=False, highlight=False)

    def render_str(self, text: str, **options: Any) -> Text:  # pyright: ignore[reportIncompatibleMethodOverride]
        return super().render_str(printable(text), **options)
