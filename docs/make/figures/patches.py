"""Patches side by side: heights, their distribution and spectrum, and the light that they scatter.

    python -m docs.make.figures.patches -o docs/images/patches.png \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mitsuba_diffraction.analysis.pictures import patches_figure
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.heights.gratings import cd, dvd, elaphe_like, xenopeltis_like

from .program import add_measured, exit_code, measured_patch

LOOKALIKES = (elaphe_like, xenopeltis_like, cd, dvd)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the figure of all look-alikes, below a measured patch where one is given."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.patches")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images/patches.png"))
    add_measured(parser, "height field to compare with, drawn first")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(argv)

    def work() -> None:
        fields = [make(seed=args.seed) for make in LOOKALIKES]
        measured = measured_patch(args)
        if measured is not None:
            fields.insert(0, measured)
        with atomic_path(args.output) as path:
            patches_figure(fields).savefig(path, dpi=80)

    return exit_code("patches", work)


if __name__ == "__main__":
    sys.exit(main())
