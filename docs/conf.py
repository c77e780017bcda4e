"""Sphinx's settings: the pages of docs/, strictly, with equations as MathML and tables made from the code."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent)]

project = "birdstrike"
author = "the birdstrike authors"
copyright = "the birdstrike authors, BSD-3-Clause"  # noqa: A001 (Sphinx's own name)

extensions = ["myst_parser", "sphinx.ext.autodoc", "build_math", "build_pages", "docstrings"]
html_theme = "furo"
html_title = "birdstrike"
html_show_sphinx = False
html_copy_source = False
exclude_patterns = ["verification"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]

smartquotes = False  # they would turn --set into a dash

autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
html_math_renderer = "mathml"
