"""A scan of 16,384² points as a table, whole and by windows: memory, time, and how they agree.

python -m docs.make.figures.wide -o docs/cluster.md

A look-alike of 2,048² points is interpolated to so many, and saved in single precision (1 GB). Both
commands run in processes of their own, whose largest resident memory the kernel tells (VmHWM).
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import zoom

from mitsuba_diffraction import DiffractionTable, gratings
from mitsuba_diffraction.tables import GLOSSY_RADIUS

from . import pages
from .pages import option, program

EXTENT, MADE = 328.0, 2048  # µm and points a side of the look-alike
#: Coherence windows of 40 µm: the whole scan is eight of them wide, which tables just read.
SETTINGS = ("--coherence-width", "40", "--tolerance", "5e-3", "--wavelength-range", "400:700")
WAVELENGTH = 0.55  # µm
DIRECTIONS = 97  # a side


@dataclass(frozen=True)
class Run:
    """A table that a command has built, with its seconds and most bytes of memory."""

    table: DiffractionTable
    seconds: float
    peak: int


def field(file: Path, pixels: int) -> None:
    """Write the scan."""
    whole = gratings.elaphe_like(EXTENT, MADE, seed=5, bending=0.0)
    heights = whole.heights.astype(np.float32)
    if pixels != MADE:
        heights = zoom(heights, pixels / MADE, order=3, mode="grid-wrap", grid_mode=True)
    np.save(file, heights)


def built(scan: Path, pixels: int, more: Sequence[str] = ()) -> Run:
    """Run `precompute` in a process of its own."""
    file = scan.with_suffix(".exr")
    words = ["precompute", scan, "--pixel-size", EXTENT / pixels, "-o", file, *SETTINGS, *more]
    seconds, peak = pages.timed(words)
    return Run(DiffractionTable.load(file), seconds.clock, peak)


def agreement(
    windowed: DiffractionTable, whole: DiffractionTable
) -> dict[str, tuple[float, float]]:
    """Σ |windowed − whole| / Σ whole, and the windows' standard error of it, by part.

    At normal incidence and reflection, near order 0 and in the directions of visible light.
    """
    kappa = 4 * np.pi / WAVELENGTH
    axis = np.linspace(-0.7, 0.7, DIRECTIONS) * kappa
    close = np.linspace(-GLOSSY_RADIUS, GLOSSY_RADIUS, DIRECTIONS) / whole.sigma
    error = windowed.source["windows"]["standard_error"]
    result = {}
    for name, along in (("glossy", close), ("colours", axis)):
        qx, qy = np.meshgrid(along, along)
        distance = np.hypot(qx, qy)
        inside = distance * whole.sigma <= GLOSSY_RADIUS
        part = inside if name == "glossy" else ~inside & (distance <= kappa)
        windows, exact = (
            t.window_sum(qx[part], qy[part], kappa) * t.sigma**2 for t in (windowed, whole)
        )
        result[name] = float(np.abs(windows - exact).sum() / exact.sum()), error[name]
    return result


def report(whole: Run, windowed: Run, pixels: int) -> str:
    """Return a paragraph with the measurements."""
    windows = windowed.table.source["windows"]
    parts = agreement(windowed.table, whole.table)
    (near, near_error), (far, far_error) = parts["glossy"], parts["colours"]
    return (
        f"A look-alike of {pixels:,}² points, {EXTENT:.0f} µm wide, coherence width 40 µm: the "
        f"whole scan needs {whole.seconds:.0f} s and {whole.peak / 1e9:.2g} GB, "
        f"{windows['number']} windows need {windowed.seconds:.0f} s and "
        f"{windowed.peak / 1e9:.2g} GB. The diffracted orders of the tables differ by {far:.1%} "
        f"(standard error of the windows: {far_error:.1%}), light near order 0 by {near:.2%} "
        f"({near_error:.2%})."
    )


@program(
    option("--pixels", type=int, default=16384),
    option("-o", "--output", type=Path, help="the page; default: print only"),
    option("--folder", type=Path, help="for files; default: a temporary one"),
)
def main(args: argparse.Namespace) -> None:
    """Measure, and write the paragraph between the markers `wide` of a page."""
    with tempfile.TemporaryDirectory(dir=args.folder) as folder:
        scan = Path(folder) / "scan.npy"
        field(scan, args.pixels)
        windowed = built(scan, args.pixels)
        whole = built(scan, args.pixels, ["--periodic", "exact"])
    text = report(whole, windowed, args.pixels)
    print(text, json.dumps(agreement(windowed.table, whole.table)), sep="\n")
    if args.output:
        pages.update(args.output, {"wide": text})
