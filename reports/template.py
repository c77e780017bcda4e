"""How the templates of all pages are read."""

from __future__ import annotations

import re

from jinja2 import Environment, PackageLoader, StrictUndefined, Template


def page_template(package: str, folder: str, name: str) -> Template:
    """A template of a page, in a folder of a package: what it is filled with is escaped, what is lacking an error."""
    environment = Environment(
        loader=PackageLoader(package, folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["typographic"] = typographic
    return environment.get_template(name)


_PERCENT = re.compile(r"(?<=\d)%(?![\w%])")
_SIGN = re.compile(r"(--[\w-]+ -(?=\d))|(?<![^\s(\[])-(?=\d)")


def typographic(text: str) -> str:
    """Numbers of a sentence or cell with one minus sign, as in the figures, ± for +-, and a space before per cent.

    What is to be typed keeps its hyphens.

    A cell of a hyphen alone, which stands for what does not exist, is a dash.
    """
    if text == "-":
        return "–"
    text = text.replace("+-", "±")
    return _PERCENT.sub(" %", _SIGN.sub(lambda found: found[0] if found[1] else "−", text))
