"""How Sphinx makes the documentation: `make docs`."""

import importlib
import typing
from importlib.metadata import version as version_of

from docutils.nodes import SkipNode
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.errors import ExtensionError

from tomoskin import core

# Some names of core are loaded on demand; the reference has them all.
for later in core._LATER:
    importlib.import_module(f"tomoskin.core.{later}")
typing.TYPE_CHECKING = True
importlib.reload(core)
typing.TYPE_CHECKING = False

project = "tomoskin"
author = "the tomoskin developers"
version = release = version_of("tomoskin")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "tomoskin"
html_show_copyright = False
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["math.css"]

napoleon_google_docstring = False
napoleon_use_ivar = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "imported-members": True}
autoclass_content = "class"

# The same word may be an attribute of several classes; a type's name then links to none of them.
suppress_warnings = ["ref.python"]


def setup(app):
    """Absolute values in docstrings are no substitutions; formulae need no script, no network."""
    app.connect("autodoc-process-docstring", _escape_bars)
    app.connect("autodoc-skip-member", _skip_foreign)
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))


def _inline(writer, node):
    _write(writer, node, display=False)


def _display(writer, node):
    _write(writer, node, display=True)


def _write(writer, node, *, display):
    """MathML by docutils, which browsers draw by themselves."""
    try:
        writer.body.append(tex2mathml(node.astext(), as_block=display))
    except MathError as error:
        raise ExtensionError(f"{node.source}: {node.astext()}: {error}") from error
    raise SkipNode


def _escape_bars(app, what, name, obj, options, lines):  # noqa: ARG001, PLR0917 - Sphinx calls it so
    lines[:] = [line.replace("|", r"\|") for line in lines]


def _skip_foreign(app, what, name, obj, skip, options):  # noqa: ARG001, PLR0917 - Sphinx calls it so
    """A package's own imports are no part of what it offers."""
    return skip or not str(getattr(obj, "__module__", "tomoskin")).startswith("tomoskin")
