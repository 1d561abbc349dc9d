"""Collect the figures that README claims into one page, with the commands that measure them.

python -m docs.make.report -o out/report.html

A claim is refused if README does not state it, or if its page does not have the figure.
"""

from __future__ import annotations

import argparse
import html
import platform
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import drjit
import mitsuba
import numpy

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.validity import GENTLE_SLOPE, STEEP_SLOPE

from .figures.pages import exit_code

ROOT = Path(__file__).parents[2]


class Claim(NamedTuple):
    """Figure that README claims, with the measurement behind it.

    Attributes
    ----------
    quantity : name of the quantity.
    stated : text of README.
    page : path of the page with the measurement.
    measured : function that returns the line of a page with the figure.
    command : command that measures the figure again.
    """

    quantity: str
    stated: str
    page: str
    measured: Callable[[str], str]
    command: str


def line(*words: str) -> Callable[[str], str]:
    """Return a function that finds the first line of a page with all of these words."""

    def found(page: str) -> str:
        paragraphs = (" ".join(block.split()) for block in page.split("\n\n"))
        lines = [*page.splitlines(), *paragraphs]
        for text in lines:
            if all(word in text for word in words):
                return text.strip()
        raise DiffractionError(f"no line has {' and '.join(map(repr, words))}")

    return found


VALIDATION = "make validation"
CLAIMS = (
    Claim(
        "deviation of colours on gentle slopes, light up to 60°",
        f"less than 5 % in the mean up to an RMS slope of {GENTLE_SLOPE:g}",
        "docs/validation.md",
        line("less than 5 %", f"{GENTLE_SLOPE:g}"),
        VALIDATION,
    ),
    Claim(
        "deviation of colours on medium slopes, light up to 60°",
        f"less than 20 % up to {STEEP_SLOPE:g}",
        "docs/validation.md",
        line("less than 20 %", f"{STEEP_SLOPE:g}"),
        VALIDATION,
    ),
    Claim(
        "cuts of a snake's scale, slope 0.2, light from 60°: mean deviation",
        "7.3 %",
        "docs/validation.md",
        line("keratin, cuts of scales, slope 0.2 ", "| 7.3 %,"),
        VALIDATION,
    ),
    Claim(
        "vertical walls deeper than 0.08 of the period, light from 0°: least mean deviation",
        "22 to 73 % in the mean",
        "docs/validation.md",
        line("keratin, walls, depth/period above 0.08 ", "| 22 %"),
        VALIDATION,
    ),
    Claim(
        "the same walls, light from 60°: largest mean deviation",
        "22 to 73 % in the mean",
        "docs/validation.md",
        line("aluminium, walls, depth/period above 0.08 ", "| 73 %,"),
        VALIDATION,
    ),
    Claim(
        "colours of solved tables against independent solutions",
        "0.8 %",
        "docs/orders.md",
        line("within 0.8 %"),
        "make validation  # validation/orders.md",
    ),
)


def rows() -> list[tuple[str, str, str, str, str]]:
    """Return quantity, stated and measured figure, page and command of each claim."""
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    table = []
    for claim in CLAIMS:
        if claim.stated not in readme:
            raise DiffractionError(f"README.md does not state '{claim.stated}' ({claim.quantity})")
        try:
            measured = claim.measured((ROOT / claim.page).read_text("utf-8"))
        except (DiffractionError, OSError) as error:
            raise DiffractionError(f"'{claim.page}', {claim.quantity}: {error}") from error
        table.append((claim.quantity, claim.stated, measured, claim.page, claim.command))
    return table


def page() -> str:
    """Return the report as HTML."""
    head = "quantity", "README", "measured", "page", "command"
    body = "\n".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
        for row in rows()
    )
    made = (
        f"mitsuba_diffraction {version('mitsuba_diffraction')}, Mitsuba {mitsuba.__version__}, "
        f"Dr.Jit {drjit.__version__}, NumPy {numpy.__version__}, Python "
        f"{platform.python_version()}, {platform.system()} {platform.machine()}"
    )
    return f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>Validation report of mitsuba_diffraction {version("mitsuba_diffraction")}</title>
<style>body {{ font: 15px sans-serif; margin: 2em }} td, th {{ border: 1px solid #bbb;
padding: 4px 8px; text-align: left; vertical-align: top }} table {{ border-collapse: collapse }}
</style>
<h1>Validation report</h1>
<p>{html.escape(made)}</p>
<p>Figures that README claims, the line of the page that holds the measurement, and the command that
measures it again and writes that page.</p>
<table>
<tr>{"".join(f"<th>{name}</th>" for name in head)}</tr>
{body}
</table>
</html>
"""


def main() -> int:
    """Write the report, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.report", description=__doc__)
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, required=True)
    output: Path = parser.parse_args().output

    def write() -> None:
        with atomic_path(output) as path:
            path.write_text(page(), encoding="utf-8")

    return exit_code("report", write)


if __name__ == "__main__":
    sys.exit(main())
