"""Surfaces in two dimensions, for comparisons with rigorous solutions, and their lights.

    python -m docs.make.validation.patches FILE    # cut the measured scale, see data/

Small periodic cells: conical mounts of a sinusoid, a crossed grating, and cuts
of scales and of a CD. A cut is made periodic, smoothed and scaled to a given slope, so that it can
be solved with a few hundred harmonics.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from docs.make.figures.pages import option, program
from mitsuba_diffraction import HeightField, gratings
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.atomic import atomic_path

from .cases import DATA, Case, Light, Media

KINDS = ("sinusoid", "crossed", "elaphe", "elaphe_like", "cd_pits")
#: Cuts of the measured patch; the project does not ship this patch.
_MEASURED = "measured_scale.npz"

#: Pixels along each side of a cut or a crossed grating, and along a sinusoid.
PIXELS = 64
_LINE = 256
#: Standard deviation (µm) of the Gaussian that cuts are smoothed by: what is finer than the light
#: is no matter for the model, and takes many harmonics.
_SMOOTHING = 0.05
#: Sinusoids have two rows, this far apart (µm): they are the same along y.
_ROW = 0.01


@dataclass(frozen=True)
class Cell:
    """Surface that tiles the plane.

    `kind` is one of `KINDS`. `size` is the period or the cut's
    side in µm, `place` its corner in pixels of what it is cut from. `slope` is the RMS of |∇h|,
    `wavelength` (nm) what it is solved at.
    """

    name: str
    kind: str
    size: float
    slope: float
    place: tuple[int, int] = (0, 0)
    wavelength: float = 550.0

    @property
    def field(self) -> HeightField:
        """Heights, mean 0."""
        return _field(self)

    def __str__(self) -> str:
        return self.name


class Cut(NamedTuple):
    """Heights of a cut and its side, both in µm."""

    heights: Real
    side: float


#: Slopes of the sinusoids are those of 2.5/0.05 and 1.6/0.1 µm.
CELLS = {
    cell.name: cell
    for cell in (
        Cell("sinusoid 2.5/0.05 µm", "sinusoid", 2.5, np.pi * 0.05 / 2.5 / np.sqrt(2)),
        Cell("sinusoid 1.6/0.1 µm", "sinusoid", 1.6, np.pi * 0.1 / 1.6 / np.sqrt(2)),
        Cell("crossed grating", "crossed", 1.5, 0.1),
        Cell("Elaphe, cut 1", "elaphe", 2.6, 0.2, (640, 500)),
        Cell("Elaphe, cut 2", "elaphe", 2.6, 0.2, (900, 850), 460.0),
        Cell("Elaphe, cut 3", "elaphe", 2.6, 0.2, (200, 1000)),
        Cell("Elaphe, cut 1, flattened", "elaphe", 2.6, 0.09, (640, 500)),
        Cell("look-alike of Elaphe", "elaphe_like", 2.6, 0.2, (100, 100)),
        Cell("CD's pits, flattened", "cd_pits", 3.2, 0.2, (600, 590)),
        Cell("Elaphe, cut 3, flattened", "elaphe", 2.6, 0.09, (200, 1000)),
        Cell("look-alike, flattened", "elaphe_like", 2.6, 0.09, (100, 100)),
        Cell("CD's pits, low", "cd_pits", 3.2, 0.06, (600, 590)),
    )
}

_OBLIQUE = ((0.0, 0.0), (30.0, 0.0), (30.0, 90.0), (60.0, 0.0), (60.0, 45.0), (60.0, 90.0))
_MANY = ("Elaphe, cut 1", "Elaphe, cut 3")  # the others are for comparison
_FEW = ((0.0, 0.0), (60.0, 0.0), (60.0, 45.0))


def cell_cases(material: str) -> Iterator[Case]:
    """All cells and lights of a material, in a fixed order."""
    for cell in CELLS.values():
        grating = cell.kind == "sinusoid"
        if material != "keratin" and not grating and cell.slope > 0.1:
            continue  # neither solver converges on a metal that is this steep
        wavelengths = (460.0, 610.0) if cell.name == "Elaphe, cut 1" else (cell.wavelength,)
        for wavelength in wavelengths:
            many = grating or (material == "keratin" and cell.name in _MANY)
            for direction in _OBLIQUE if many else _FEW:
                yield Case(cell, Light(wavelength, *direction), Media(material))


@cache
def _field(cell: Cell) -> HeightField:
    if cell.kind == "sinusoid":
        line = np.cos(2 * np.pi * np.arange(_LINE) / _LINE)[None, :]
        depth = cell.slope * cell.size * np.sqrt(2) / np.pi
        heights = np.repeat(0.5 * depth * line, 2, axis=0)
        return HeightField(heights, (cell.size / _LINE, _ROW), name=cell.name)
    if cell.kind == "crossed":
        line = np.cos(2 * np.pi * np.arange(PIXELS) / PIXELS)
        heights = line[None, :] + line[:, None]
        side = cell.size
    elif cell.kind == "elaphe":
        heights, side = _measured()[cell.name]
    else:
        heights, side = _cut(cell, _source(cell))
    heights = heights - heights.mean()
    heights *= cell.slope / _slope(heights, side)
    return HeightField(heights, side / PIXELS, name=cell.name)


def measured_cuts(patch: HeightField) -> dict[str, Cut]:
    """Cuts of the measured scale, by the names of their cells."""
    return {cell.name: _cut(cell, patch) for cell in CELLS.values() if cell.kind == "elaphe"}


def save_measured(cuts: dict[str, Cut], folder: Path) -> Path:
    """Write the cuts of the measured scale, and return the file."""
    path = folder / _MEASURED
    with atomic_path(path) as temporary:
        heights = np.array([cut.heights for cut in cuts.values()], np.float32)
        sides = [cut.side for cut in cuts.values()]
        np.savez_compressed(temporary, names=list(cuts), heights=heights, sides=sides)
    return path


@cache
def _measured() -> dict[str, Cut]:
    """Cuts of the measured scale, from the file that is kept."""
    with np.load(DATA / _MEASURED) as parts:
        columns = parts["names"].tolist(), parts["heights"].astype(float), parts["sides"].tolist()
        return {name: Cut(*cut) for name, *cut in zip(*columns, strict=True)}


def _cut(cell: Cell, patch: HeightField) -> Cut:
    """Heights (`PIXELS`, `PIXELS`) of a cut, periodic and smooth, and its side."""
    pixel = patch.pixel_size[0]
    count = 2 * round(cell.size / pixel / 2)
    row, column = cell.place
    piece = patch.heights[row : row + count, column : column + count]
    periodic = _periodic(HeightField(piece, patch.pixel_size))
    side = count * pixel
    return Cut(_smoothed(periodic.heights, side), side)


def _source(cell: Cell) -> HeightField:
    """The generated patch that a cell is cut from."""
    if cell.kind == "elaphe_like":
        return gratings.elaphe_like(extent=20.0, pixels=410, seed=1)
    return gratings.cd(extent=64.0, pixels=1312, seed=0)


def _periodic(field: HeightField) -> HeightField:
    """Heights whose opposite edges meet, which the solver needs.

    The periodic component of L. Moisan, Periodic plus smooth image decomposition, Journal of
    Mathematical Imaging and Vision 39, 161-179 (2011), eq. 11; pixels are square.
    """
    h = field.heights
    steps = np.zeros_like(h)
    steps[0], steps[-1] = h[-1] - h[0], h[0] - h[-1]
    steps[:, 0] += h[:, -1] - h[:, 0]
    steps[:, -1] -= h[:, -1] - h[:, 0]
    waves = [2 * np.cos(2 * np.pi * np.fft.fftfreq(count)) - 2 for count in h.shape]
    laplacian = waves[0][:, None] + waves[1]
    laplacian[0, 0] = 1.0  # the steps have mean 0
    spectrum = np.fft.fft2(steps) / laplacian
    spectrum[0, 0] = 0.0
    return HeightField(h - np.fft.ifft2(spectrum).real, field.pixel_size, name=field.name)


def _smoothed(heights: Real, side: float) -> Real:
    """Low frequencies at `PIXELS` samples a side, weighed by the Gaussian `_SMOOTHING`."""
    count = len(heights)
    harmonics = min(count, PIXELS) // 2 - 1  # harmonics either way, without Nyquist's
    few = np.arange(-harmonics, harmonics + 1)
    weight = np.exp(-0.5 * (2 * np.pi * few / side * _SMOOTHING) ** 2)
    spectrum = np.zeros((PIXELS, PIXELS), complex)
    low = np.fft.fft2(heights)[np.ix_(few, few)] * np.outer(weight, weight)
    spectrum[np.ix_(few, few)] = low * (PIXELS / count) ** 2
    return np.fft.ifft2(spectrum).real


def _slope(heights: Real, side: float) -> float:
    """RMS of |∇h| of the band-limited surface."""
    count = len(heights)
    q = 2 * np.pi * np.fft.fftfreq(count, side / count)
    power = np.abs(np.fft.fft2(heights) / heights.size) ** 2
    return float(np.sqrt(np.sum(power * (q[None, :] ** 2 + q[:, None] ** 2))))


@program(
    option("patch", type=Path, help="the measured scale, in an image"),
    option("--pixel-size", type=float, default=65 / 1332, metavar="MICROMETRES"),
    option("--max-height", type=float, default=0.375, metavar="MICROMETRES"),
    option("-o", "--output", metavar="FOLDER", type=Path, default=DATA),
)
def main(args: argparse.Namespace) -> None:
    """Cut the measured scale."""
    patch = HeightField.load(args.patch, pixel_size=args.pixel_size, max_height=args.max_height)
    print(f"wrote {save_measured(measured_cuts(patch), args.output)}")
