"""The figures of docs/benchmarks.md and docs/plan.md of a planned scene, from what `plan` measured.

mitsuba-diffraction plan scenes/snake.xml --json out/plan.json
python -m docs.make.figures.plan out/plan.json
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import markers
from .program import add_pages, exit_code, from_json

_PICTURE = "picture, planned against whole, same random numbers"


def tables(report: dict[str, Any]) -> dict[str, str]:
    """Markdown by the name of its markers: `planned` in a sentence, `plan` in full.

    Parameters
    ----------
    report : what `plan --json` wrote.
    """
    table, picture = report["tables"][0], report[_PICTURE]
    whole, planned = table["whole"], table["planned"]
    asked, needs = table["asked for"], table["needs"]
    frequency = asked["frequency (rad/µm)"]["light can probe"]
    kappa = asked["kappa (rad/µm)"]["the table has"]
    rows = [
        ("frequencies, rad/µm", f"up to {frequency:.1f}", _frequencies(needs)),
        ("κ, rad/µm", f"up to {kappa:.1f}", f"up to {needs['kappa (rad/µm)']:.1f}"),
        ("series in κ, terms", str(whole["terms"]), str(planned["terms"])),
        ("table", *(f"{one['memory_mb']:.2g} MB" for one in (whole, planned))),
        (
            "densities for sampling",
            *(f"{one['sampling_memory_mb']:.2g} MB" for one in (whole, planned)),
        ),
    ]
    shift, mean = picture["mean difference / mean (XYZ)"], picture["delta E 2000, mean"]
    change = (
        f"and the picture changes by {shift:.0e} of its mean (XYZ; ΔE2000 {mean:.2f}, 99 % "
        f"{picture['delta E 2000, 99 %']:.2f})"
    )
    less = table["times less memory"]
    return {
        "planned": f"The snake's table shrinks from {whole['memory_mb']:.1f} to "
        f"{planned['memory_mb']:.1f} MB, to 1/{less:.1f}, {change}.",
        "plan": f"{markers.table(('', 'whole table', 'planned'), rows)}\n\n"
        f"{less:.1f} times less memory, {change}.",
    }


def _frequencies(needs: dict[str, Any]) -> str:
    for name, value in needs.items():
        if name.startswith("frequency"):
            return f"up to {' and '.join(f'{v:.1f}' for v in value)} along x and y"
    raise KeyError("frequency")


def main(argv: Sequence[str] | None = None) -> int:
    """Replace the figures, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.plan")
    parser.add_argument("report", metavar="PLAN.json", type=Path, help="from plan --json")
    add_pages(parser, "docs/benchmarks.md", "docs/plan.md")
    args = parser.parse_args(argv)

    def work() -> None:
        found = from_json(args.report, tables, writer="plan --json", remedy="run make plan")
        for page in args.output:
            markers.update_present(page, found)

    return exit_code("plan", work)


if __name__ == "__main__":
    sys.exit(main())
