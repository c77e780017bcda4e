"""Sphinx's settings: the pages of docs/, strictly, with equations as MathML and tables made from the code."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent)]

import build_math
import build_tables
import docstrings
from sphinx.application import Sphinx

project = "birdstrike"
author = "the birdstrike authors"
copyright = "the birdstrike authors, BSD-3-Clause"  # noqa: A001 (Sphinx's own name)

extensions = ["myst_parser", "sphinx.ext.autodoc"]
html_theme = "furo"
html_title = "birdstrike"
html_show_sphinx = False
html_copy_source = False
exclude_patterns = ["verification"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
html_math_renderer = "mathml"


def setup(app: Sphinx) -> None:
    """Connect what the build adds."""
    app.add_html_math_renderer("mathml", build_math.INLINE, build_math.BLOCK)
    app.connect("source-read", build_tables.fill)
    app.connect("autodoc-process-docstring", docstrings.as_restructured_text)
