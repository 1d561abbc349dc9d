"""LaTeX of pages to MathML, which browsers show without scripts."""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert

# what pymdownx.arithmatex makes of $…$ and $$…$$
_MARKED = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.S)
_TAG = re.compile(r"\\tag\{([^}]*)\}")


def typeset(page: str) -> str:
    """Return the HTML of a page with its formulas as MathML."""
    return _MARKED.sub(_formula, page)


def _formula(match: re.Match[str]) -> str:
    latex = html.unescape(match[3]).strip()
    number = _TAG.search(latex)
    latex = _TAG.sub("", latex).replace("{aligned}", "{split}")
    if match[2] == "(":
        return convert(latex)
    label = f'<span class="number">({number[1]})</span>' if number else ""
    return f'<div class="formula">{convert(latex, display="block")}{label}</div>'
