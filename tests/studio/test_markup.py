"""Text and tables of the window: what comes from files is text, never markup."""

from __future__ import annotations

import ast
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import flexcal.studio
from flexcal.studio.window import command_text, error_course, facts, paragraph, picked_rows, table
from flexcal.studio.window.markup import step_links

HOSTILE = [
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "'><svg onload=alert(1)>",
    "</td></table><iframe src='//evil'>",
    "javascript:alert(1)",
]


class Elements(HTMLParser):
    """Elements and attributes of an HTML text."""

    def __init__(self, text: str):
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: list[tuple[str, str | None]] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.words += data


@pytest.mark.parametrize("name", HOSTILE)
def test_names_are_text(name: str) -> None:
    texts = [
        paragraph(name, "bad"),
        command_text(name),
        facts({name: name}),
        table([name], [[name]]),
        picked_rows([name], {name: [name]}, name),
        error_course([name], np.array([0.1]), name, word=name),
        step_links([name], name, name),
    ]
    for text in texts:
        seen = Elements(text)
        assert seen.tags.isdisjoint({"script", "img", "iframe"})
        assert not any(key.startswith("on") for key, _ in seen.attributes)
        links = [value or "" for key, value in seen.attributes if key == "href"]
        assert all(link.startswith(("pick/", "step/")) for link in links)
        assert name in seen.words + str(seen.attributes)


def test_the_points_of_a_course_are_in_order_and_at_their_heights() -> None:
    errors = np.array([0.1, 0.4, 0.2])
    text = error_course(["1", "2", "3"], errors, "2", word="error")
    circles = [dict(a) for a in _elements(text, "circle") if dict(a)["r"] == "4.0"]
    x, y = (np.array([float(circle[key]) for circle in circles]) for key in ("cx", "cy"))
    assert (np.diff(x) > 0).all()
    np.testing.assert_allclose(np.diff(y) / np.diff(y)[0], np.diff(errors) / np.diff(errors)[0], atol=0.01)
    ring = next(dict(a) for a in _elements(text, "circle") if dict(a)["fill"] == "none")
    assert (ring["cx"], ring["cy"]) == (circles[1]["cx"], circles[1]["cy"])


def _elements(text: str, tag: str) -> list[list[tuple[str, str | None]]]:
    found: list[list[tuple[str, str | None]]] = []

    class Finder(HTMLParser):
        def handle_starttag(self, name: str, attrs: list[tuple[str, str | None]]) -> None:
            if name == tag:
                found.append(attrs)

    Finder().feed(text)
    return found


def test_no_page_uses_markdown() -> None:
    """viser's Markdown takes raw HTML, and reads images from any path."""
    root = Path(flexcal.studio.__file__).parent
    for file in root.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Attribute)]
        assert not [node for node in calls if node.attr in ("add_markdown", "add_image")], file
