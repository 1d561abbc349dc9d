"""Table of the shipped tables of orders, from their headers: docs/orders.md.

python -m docs.make.figures.solved
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mitsuba_diffraction import OrderTable

from . import pages
from .pages import option, program

_FOLDER = Path("precompute/orders")
_HEADER = (
    "table", "solver", "MB", "processor minutes", "error, mean", "in 95 %", "reciprocity",
)  # fmt: skip


def row(file: Path) -> tuple[str, ...]:
    """Return the facts of a table."""
    facts = OrderTable.load(file).header
    return (
        f"`{file.name}`",
        facts["solver"],
        f"{file.stat().st_size / 1e6:.2f}",
        f"{facts['processor_seconds'] / 60:.1f}",
        f"{facts['error_mean']:.2%}",
        f"{facts['error_worst']:.1%}",
        f"{facts['reciprocity_error']:.2%}",
    )


def table() -> str:
    """Return the part of the page."""
    return pages.table(_HEADER, [row(file) for file in sorted(_FOLDER.glob("*.nc"))])


@program(option("-o", "--output", type=Path, default=Path("docs"), help="of the page"))
def main(args: argparse.Namespace) -> None:
    """Write the table."""
    pages.update(args.output / "orders.md", {"solved": table()})
