"""The page of sweeps: contact sheets of BRDF maps, and how far each is from the best.

    python -m docs.make.figures.sweeps -o docs/sweeps.md \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375

Sheets go to `images/sweep-KIND.png` beside the page, the numbers between its markers.
"""

from __future__ import annotations

import argparse
import math
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from mitsuba_diffraction.analysis.maps.picture import contact_sheet
from mitsuba_diffraction.analysis.maps.result import Light
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionWarning
from mitsuba_diffraction.heights.gratings import blazed, elaphe_like
from mitsuba_diffraction.thesis.sweeps import SWEEPS, Sweep, sweep

from . import pages
from .pages import SHOWN, add_measured, exit_code, measured_patch

_LIGHT = Light(30.0)


def numbers(result: Sweep) -> str:
    """ΔE of every step, and its time where that is the point, as a Markdown table."""
    timed = result.kind == "wavelength-step"
    rows: list[tuple[str, ...]] = []
    for step in result.steps:
        cells = ["", ""]
        if step.label == result.reference:
            cells = ["reference", ""]
        elif math.isfinite(step.mean):
            cells = [f"{step.mean:.2g}", f"{step.high:.2g}"]
        time = [f"{step.seconds / result.steps[0].seconds:.2g}"] if timed else []
        rows.append((SHOWN.get(step.label, step.label), *cells, *time))
    header = ("value", "mean ΔE", "95th percentile")
    return pages.table((*header, "time (first = 1)") if timed else header, rows)


def main(argv: Sequence[str] | None = None) -> int:
    """Make all sheets and tables."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.sweeps")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/sweeps.md"))
    add_measured(parser, "scale to sweep over; default: elaphe_like")
    parser.add_argument("--only", metavar="KIND", action="append", choices=tuple(SWEEPS))
    parser.add_argument("--resolution", type=int, default=160)
    parser.add_argument("--small", action="store_true", help="a small grating: a check")
    args = parser.parse_args(argv)

    def work() -> None:
        patch = measured_patch(args)
        if patch is None:
            patch = blazed(2.0, 0.2, periods=6, rows=8) if args.small else elaphe_like()
        parts = {}
        for kind in args.only or SWEEPS:
            print(f"sweeping {kind}", flush=True)
            with warnings.catch_warnings():
                # how far the model holds is not the question here
                warnings.simplefilter("ignore", DiffractionWarning)
                result = sweep(kind, patch, _LIGHT, resolution=args.resolution)
            parts[kind] = numbers(result)
            best = next((s for s in result.steps if s.label == result.reference), None)
            sheet = contact_sheet(
                [step.map for step in result.steps],
                [SHOWN.get(step.label, step.label) for step in result.steps],
                title=f"{patch.name}: {kind}",
                exposure=None if best is None else best.map.exposure(),
            )
            with atomic_path(args.output.parent / "images" / f"sweep-{kind}.png") as path:
                sheet.savefig(path, format="png")
        pages.update(args.output, parts)

    return exit_code("sweeps", work)


if __name__ == "__main__":
    sys.exit(main())
