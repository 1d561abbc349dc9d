"""The table of docs/energy.md, from what `info --energy` found of each surface.

mitsuba-diffraction info --energy --json out/energy/cd.json out/energy/cd.exr
python -m docs.make.figures.energy out/energy/*.json
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import markers
from .program import add_pages, exit_code, from_json

_HEADER = (
    "table", "material", "albedo", "conserved", "taken at 0, 45, 60, 75°", "kept", "within 1 %",
    "where above 1", "0.97–1.001", "reciprocal",
)  # fmt: skip


def rows(name: str, report: dict[str, Any]) -> list[tuple[str, ...]]:
    """A row for each material, from what `info --energy --json` wrote of one table."""
    return [_row(name, material, found) for material, found in report["energy"].items()]


def _row(name: str, material: str, found: dict[str, Any]) -> tuple[str, ...]:
    above = found.get("conserved where raw is above 1")
    within = found.get("between 0.97 and 1.001 there")
    most = found.get("reciprocity lets be kept")
    taken = ", ".join(f"{100 * max(share, 0.0):.1f}" for share in found["taken at"].values())
    return (
        name,
        material,
        _range(found["albedo"]),
        _range(found["albedo, conserved"]),
        f"{taken} %",
        _range(found["conserved over raw where that is at most 1"]),
        f"{100 * found['within 1 % there']:.0f} %",
        "–" if above is None else _range(above),
        "–" if within is None else f"{100 * within:.0f} %",
        "–" if most is None else f"{most:.3f}",
    )


def _range(ends: Sequence[float]) -> str:
    return f"{ends[0]:.3f}–{ends[1]:.3f}"


def main(argv: Sequence[str] | None = None) -> int:
    """Write the table into the pages that have its markers, and return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m docs.make.figures.energy", description=__doc__.split("\n")[0]
    )
    parser.add_argument("reports", metavar="JSON", type=Path, nargs="+", help="one of each table")
    add_pages(parser, "docs/energy.md")
    args = parser.parse_args(argv)

    def work() -> None:
        found = [
            row
            for file in args.reports
            for row in from_json(
                file,
                lambda report, name=file.stem: rows(name, report),
                writer="info --energy --json",
                remedy="make it with `make energy`",
            )
        ]
        for page in args.output:
            markers.update_present(page, {"energy": markers.table(_HEADER, found)})
            print(f"updated {page}")

    return exit_code(parser.prog, work)


if __name__ == "__main__":
    sys.exit(main())
