"""Write docs/validation/measured.md: measured gratings beside the model and solved orders.

python -m docs.make.measured -o docs                  # two minutes; extra `solve`
python -m docs.make.measured --fit                    # fits the grooves anew; ten minutes
python -m docs.make.measured -o docs --kaist FOLDER   # with the maps of another renderer's clone
"""

from __future__ import annotations

import argparse
from pathlib import Path

from docs.make.figures.long_tables import update
from docs.make.figures.pages import option, program, write_figure
from mitsuba_diffraction.cli import check_outputs
from mitsuba_diffraction.errors import DiffractionError

from . import cases, outside, page


@program(
    option("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs")),
    option("--kaist", metavar="FOLDER", type=Path, help="clone of another renderer"),
    option("--fit", action="store_true", help="fit the stored grooves anew"),
    option("--quick", action="store_true", help="a small version, for tests"),
)
def main(args: argparse.Namespace) -> None:
    """Write the page and its figure."""
    written = args.output / "validation" / "measured.md"
    picture = args.output / "images" / "measured_gratings.png"
    if args.kaist and not (args.kaist / "output").is_dir():
        raise DiffractionError(
            f"--kaist: '{args.kaist}' has no folder 'output'; clone {outside.REPOSITORY}"
        )
    check_outputs([written, picture])
    if args.fit:
        cases.write_fits()
    found = page.Comparisons(args.kaist, quick=args.quick)
    write_figure(picture, page.figure(found), 100)
    update(written, page.parts(found))
    print(f"wrote {written}\nREADME: {page.summary(found)}")
