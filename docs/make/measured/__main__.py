"""Write docs/validation/measured.md: measured gratings beside the model and solved orders.

python -m docs.make.measured -o docs                  # two minutes; extra `solve`
python -m docs.make.measured --fit                    # fits the grooves anew; ten minutes
python -m docs.make.measured -o docs --kaist FOLDER   # with the maps of another renderer's clone
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Sequence
from pathlib import Path

from docs.make.figures.long_tables import write_page
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.cli import check_outputs, say_error
from mitsuba_diffraction.errors import DiffractionError


def main(argv: Sequence[str] | None = None) -> int:
    """Write the page and its figure, and return the exit code: 0, 1 (failed) or 2 (usage)."""
    parser = argparse.ArgumentParser(
        prog="python -m docs.make.measured", description=__doc__.split("\n")[0]
    )
    parser.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs"))
    parser.add_argument("--kaist", metavar="FOLDER", type=Path, help="clone of another renderer")
    parser.add_argument("--fit", action="store_true", help="fit the stored grooves anew")
    parser.add_argument("--quick", action="store_true", help="a small version, for tests")
    args = parser.parse_args(argv)
    from . import cases, outside, page

    written = args.output / "validation" / "measured.md"
    picture = args.output / "images" / "measured_gratings.png"
    try:
        if args.kaist and not (args.kaist / "output").is_dir():
            raise DiffractionError(
                f"--kaist: '{args.kaist}' has no folder 'output'; clone {outside.REPOSITORY}"
            )
        for path in (written, picture):
            check_outputs([path], make_folder=True)
            path.parent.mkdir(parents=True, exist_ok=True)
        if args.fit:
            cases.write_fits()
        found = page.Comparisons(args.kaist, quick=args.quick)
        buffer = io.BytesIO()
        page.figure(found).savefig(buffer, format="png", dpi=100, metadata={"Software": None})
        text = page.write(found) + "\n"
        with atomic_path(picture) as temporary:
            temporary.write_bytes(buffer.getvalue())
        write_page(written, text)
    except DiffractionError as error:
        say_error(str(error))
        return 1
    print(f"wrote {written}\nREADME: {page.summary(found)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
