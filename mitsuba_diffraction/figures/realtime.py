"""The README's sheet and table of the shaders, from what `compare` measured.

mitsuba-diffraction compare scenes/snake.xml --method all -o out/compare
python -m mitsuba_diffraction.figures.realtime out/compare -o README.md
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from ..comparison.table import markdown
from ..errors import DiffractionError
from . import markers
from .jpeg import write_jpeg
from .program import exit_code

#: Beside the README; the sheet that it shows is that of the default method.
SHEET = Path("docs", "images", "realtime.jpg")

_METHOD, _WIDTH = "lut", 1600


def main(argv: Sequence[str] | None = None) -> int:
    """Replace both, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m mitsuba_diffraction.figures.realtime")
    parser.add_argument("compared", metavar="FOLDER", type=Path, help="written by compare")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, default=Path("README.md"))
    args = parser.parse_args(argv)

    def work() -> None:
        text = _table(args.compared / "compare.json")
        sheet = args.output.parent / SHEET
        write_jpeg(args.compared / f"{_METHOD}.png", sheet, width=_WIDTH)
        markers.update(args.output, {"realtime": text})

    return exit_code("realtime", work)


def _table(file: Path) -> str:
    try:
        return markdown(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, StopIteration) as error:
        raise DiffractionError(
            f"'{file}' is not what compare writes ({error}); run compare --method all"
        ) from error


if __name__ == "__main__":
    sys.exit(main())
