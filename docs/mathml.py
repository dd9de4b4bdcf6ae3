"""Sphinx extension: equations as MathML, which browsers draw by themselves, with neither script nor network."""

import re
from pathlib import Path

import ziamath
from docutils import nodes
from math_core import LatexError, LatexToMathML
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

FONT = Path(ziamath.__file__).parent / "fonts" / "STIXTwoMath-Regular.ttf"  # browsers have none for sure
TAG = re.compile(r"\\tag\{(.*?)\}")

converter = LatexToMathML(annotation=True, fancy_error=False)
logger = logging.getLogger(__name__)


def converted(latex: str, node: nodes.Element, display: bool) -> str:
    try:
        return converter.convert_with_local_state(latex, displaystyle=display)
    except LatexError as error:
        logger.warning("equation cannot be drawn: %s", error, location=node)
        return ""


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    translator.body.append(converted(node.astext(), node, display=False))
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    latex, number = TAG.sub("", node.astext()), TAG.search(node.astext())
    translator.body.append(translator.starttag(node, "div", CLASS="math"))
    if number:
        translator.body.append(f'<span class="eqno">({number[1]})</span>')
    translator.body.append(converted(latex, node, display=True) + "</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
