"""Formulas as MathML, which browsers draw without a script or a font from the network."""

from typing import Any

from docutils import nodes
from math_core import LatexError, LatexToMathML
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.typing import ExtensionMetadata

LOGGER = logging.getLogger(__name__)
CONVERTER = LatexToMathML(fancy_error=False)


def mathml(node: nodes.math | nodes.math_block, block: bool) -> str:
    """Return a formula as MathML, or warn of a command that has no translation."""
    latex = node.astext()
    if r"\tag{" in latex:
        latex = rf"\begin{{equation*}}{latex}\end{{equation*}}"
    markup = ""
    try:
        markup = CONVERTER.convert_with_local_state(latex, displaystyle=block)
    except LatexError as error:
        LOGGER.warning("no MathML for %s: %s", latex, error, location=node)
    return markup


def visit_inline(writer: Any, node: nodes.math) -> None:
    """Write a formula in a line."""
    writer.body.append(mathml(node, False))
    raise nodes.SkipNode


def visit_block(writer: Any, node: nodes.math_block) -> None:
    """Write a displayed formula, in a frame that scrolls sideways on a narrow screen."""
    writer.body.append(f'<div class="formula">{mathml(node, True)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> ExtensionMetadata:
    """Register the writer of formulas, which conf.py chooses."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {}
