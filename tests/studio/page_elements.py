"""Elements of the page, found as a person finds them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from waiting import PATIENCE

WAIT = 1000 * PATIENCE
"""Milliseconds until an element is there, at most."""


def press(page: Any, name: str) -> None:
    """Press a button."""
    page.get_by_role("button", name=name, exact=True).click(timeout=WAIT)


def choose(page: Any, label: str, value: str) -> None:
    """Choose in the drop-down list of a label."""
    field(page, label).click(timeout=WAIT)
    page.get_by_role("option", name=value, exact=True).click(timeout=WAIT)


def field(page: Any, label: str) -> Any:
    """The field after a label, which viser does not always tie to it."""
    return page.get_by_text(label, exact=True).locator("xpath=following::input[1]")


def fill(page: Any, label: str, value: str) -> None:
    """Type into the field of a label, and leave it."""
    field(page, label).fill(value, timeout=WAIT)
    field(page, label).press("Tab")


def go_to(page: Any, title: str) -> None:
    """Open a step by its link."""
    page.get_by_role("navigation", name="Steps").get_by_role("link", name=title).click(timeout=WAIT)
    page.locator("nav [aria-current=step]", has_text=title).wait_for(timeout=WAIT)


def open_step(page: Any) -> str:
    """Title of the step that is open."""
    return page.locator("nav [aria-current=step]").inner_text(timeout=WAIT).split(maxsplit=1)[1]


def see(page: Any, text: str) -> None:
    """Wait until a text is on the page."""
    page.get_by_text(text).first.wait_for(timeout=WAIT)


def count_rows(path: Path) -> int:
    """Lines of a table after its header; 0 where there is none."""
    return path.read_text().count("\n") - 1 if path.exists() else 0
