"""Sphinx configuration."""

import hashlib
import logging
import os
import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

import plotly
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from mathml import FONT  # noqa: E402

project = "flexcal"
author = "The flexcal developers"
copyright = "The flexcal developers, Apache-2.0"
version = release = installed_version("flexcal")

extensions = ["myst_nb", "sphinx.ext.autodoc", "mathml"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3


def fingerprint() -> str:
    """Of everything that the notebooks run, so that none keeps numbers of an older flexcal."""
    digest = hashlib.sha256((HERE / "figures.py").read_bytes())
    for folder in ("src", "kernels", "examples"):
        for file in sorted((HERE.parent / folder).rglob("*")):
            if file.is_file() and "__pycache__" not in file.parts:
                digest.update(str(file).encode() + file.read_bytes())
    return digest.hexdigest()[:16]


nb_execution_mode = "cache"
nb_execution_cache_path = str(HERE.parent / "build" / "notebooks" / fingerprint())
nb_execution_timeout = 300  # seconds a cell, on a busy machine
nb_execution_raise_on_error = True
nb_merge_streams = True

# Kernels inherit these: nothing of the user's own Jupyter is read or written, and figures find their way into the page.
KERNELS = HERE.parent / "build" / "kernels"
(KERNELS / "profile_default").mkdir(parents=True, exist_ok=True)
(KERNELS / "profile_default" / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 40\n")
os.environ["IPYTHONDIR"] = os.environ["JUPYTER_DATA_DIR"] = str(KERNELS)
os.environ["PYTHONSTARTUP"] = str(HERE / "figures.py")
logging.getLogger("traitlets").setLevel(logging.WARNING)

autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_class_signature = "mixed"
autodoc_inherit_docstrings = False

CODE = re.compile(r"`+([^`]+)`+")
MARKUP = re.compile(r"([\\*`|_<>:\[\]]|^[^\w\s])")

html_theme = "furo"
html_title = "flexcal"
html_static_path = [
    "_static",
    str(Path(plotly.__file__).parent / "package_data" / "plotly.min.js"),
    str(FONT),
]
html_js_files = ["figures.js"]
html_css_files = ["notebooks.css", "equations.css"]
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


class Verbs(SphinxDirective):
    """A table of the verbs of the command line: an example of each, and what it does."""

    def run(self) -> list[nodes.Node]:
        from flexcal.cli.arguments.verb_table import VERBS

        rows = [f"| `{verb.example}` | {verb.summary} |" for verb in VERBS]
        return self.parse_text_to_nodes("\n".join(["| verb | what it does |", "| --- | --- |", *rows]))


def setup(app: Sphinx) -> None:
    app.add_directive("verbs", Verbs)
    app.connect("autodoc-process-docstring", as_plain_text)
