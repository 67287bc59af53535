"""How Sphinx makes the documentation: `make docs`."""

from importlib.metadata import version as version_of

project = "tomoskin"
author = "the tomoskin developers"
version = release = version_of("tomoskin")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "tomoskin"
html_show_copyright = False

napoleon_google_docstring = False
napoleon_use_ivar = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "imported-members": True}
autoclass_content = "class"

# The same word may be an attribute of several classes; a type's name then links to none of them.
suppress_warnings = ["ref.python"]


def setup(app):
    """Absolute values in docstrings are no substitutions."""
    app.connect("autodoc-process-docstring", _escape_bars)


def _escape_bars(app, what, name, obj, options, lines):  # noqa: ARG001, PLR0917 - Sphinx calls it so
    lines[:] = [line.replace("|", r"\|") for line in lines]
