"""Sphinx configuration."""

import re
from importlib.metadata import version as installed_version

from sphinx.application import Sphinx

project = "flexcal"
author = "The flexcal developers"
copyright = "The flexcal developers, Apache-2.0"
version = release = installed_version("flexcal")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3

autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_class_signature = "mixed"
autodoc_inherit_docstrings = False

CODE = re.compile(r"`+([^`]+)`+")
MARKUP = re.compile(r"([\\*`|_<>:\[\]]|^[^\w\s])")

html_theme = "furo"
html_title = "flexcal"
exclude_patterns = ["README.md"]


def as_plain_text(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Docstrings are plain text with `code` in it: keep their paragraphs and let no other character act as markup."""
    plain: list[str] = []
    for line in lines:
        pieces = CODE.split(line.strip())  # text, code, text, code, ..., text
        text = "".join(
            rf"\ ``{piece}``\ " if k % 2 else MARKUP.sub(r"\\\1", piece) for k, piece in enumerate(pieces)
        )
        indented = line.startswith(" ") and bool(text)
        if plain and plain[-1] and indented != plain[-1].startswith("| "):
            plain.append("")
        plain.append(f"| {text}" if indented else text)  # an indented line stays a line of its own
    lines[:] = [*plain, ""]


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", as_plain_text)
