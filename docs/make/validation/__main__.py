"""Write the parts of the pages that compare the model with rigorous solutions.

python -m docs.make.validation -o docs
python -m docs.make.validation gratings      # one page of docs/validation/
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mitsuba_diffraction.cli import Bar, check_outputs
from mitsuba_diffraction.errors import DiffractionError

from ..figures.pages import option, program, progress_option
from .pages.measurements import Measurements
from .pages.report import PAGES, page_path, write


@program(
    option("pages", metavar="PAGE", nargs="*", help="all of them by default"),
    option("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs")),
    option("--quick", action="store_true", help="a small version, for tests"),
    progress_option(),
)
def main(args: argparse.Namespace) -> None:
    """Write into validation.md and docs/validation/."""
    names = args.pages or list(PAGES)
    for name in names:
        if name not in PAGES:
            raise DiffractionError(f"page '{name}' is unknown; choose from {', '.join(PAGES)}")
        check_outputs([page_path(args.output, name)])
    (args.output / "images").mkdir(exist_ok=True)
    measured, paths = Measurements(args.quick), []
    with Bar(args) as bar:
        for n, name in enumerate(names):
            bar(n, len(names), f"writing {name}")
            paths.append(write(args.output, name, measured))
        bar(len(names), len(names), "done")
    print("\n".join(f"wrote {path}" for path in paths))
