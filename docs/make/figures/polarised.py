"""Degree of polarisation of a blazed grating's orders, and the cost of its table: docs/orders.md.

python -m docs.make.figures.polarised
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from mitsuba_diffraction import OrderTable

from . import pages
from .pages import option, program

#: The command of the page.
COMMAND = (
    "solve", "blazed", "--period", "0.8333", "--depth", "0.25", "--tolerance", "0.02",
    "--wavelength-range", "400:700",
)  # fmt: skip
_THETA = 30.0
_NAME = "polarised"


def figure(table: OrderTable) -> Figure:
    """Draw the efficiency and the degree of polarisation of two orders over the wavelength."""
    wavelength = np.linspace(*table.wavelengths, 301)
    x = np.sin(np.radians(_THETA))
    drawn = Figure(figsize=(8.0, 3.2), layout="constrained")
    left, right = drawn.subplots(1, 2)
    for order, colour in ((0, "tab:gray"), (-1, "tab:blue")):
        matrices = table.mueller(x, 0.0, wavelength, order)
        power = matrices[:, 0, 0]
        left.plot(wavelength, power, color=colour, label=f"order {order}")
        lit = power > 1e-3
        polarised = np.where(lit, matrices[:, 1, 0] / np.where(lit, power, 1.0), np.nan)
        right.plot(wavelength, polarised, color=colour)
    left.set(xlabel="wavelength, nm", ylabel="efficiency", ylim=(0.0, 0.5))
    left.legend(frameon=False)
    right.axhline(0.0, color="black", linewidth=0.5)
    right.set(xlabel="wavelength, nm", ylabel="S₁/S₀", ylim=(-1.0, 1.0))
    return drawn


def costs(files: dict[str, Path]) -> str:
    """Return the table of sizes and times."""
    rows = []
    for name, file in files.items():
        table = OrderTable.load(file)
        error = table.header.get("error_polarised", table.header["error_mean"])
        rows.append(
            (name, f"{file.stat().st_size / 1e6:.2f} MB",
             f"{table.header['processor_seconds']:.0f}", f"{error:.1%}")
        )  # fmt: skip
    return pages.table(("table", "size", "processor seconds", "error, mean"), rows)


@program(option("-o", "--output", type=Path, default=Path("docs"), help="default: docs"))
def main(args: argparse.Namespace) -> None:
    """Solve, draw, and write the page's part."""
    picture = args.output / f"images/orders/{_NAME}.jpg"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = {kind: folder / f"{kind}.nc" for kind in ("efficiencies", "Mueller matrices")}
        for (_, file), option in zip(files.items(), ([], ["--polarised"]), strict=True):
            pages.run(*COMMAND, *option, "-o", file)
        table = OrderTable.load(files["Mueller matrices"])
        pages.write_figure(picture, figure(table), 110)
        parts = {_NAME: costs(files), "light": f"{_THETA:g}°"}
    pages.update(args.output / "orders.md", parts)
