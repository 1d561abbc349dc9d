"""Surfaces in two dimensions, for comparisons with rigorous solutions.

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
from numpy.typing import NDArray

from docs.make.figures.pages import option, program
from mitsuba_diffraction import HeightField, gratings
from mitsuba_diffraction.atomic import atomic_path

from .solutions import DATA

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
class Surface:
    """Cell that tiles the plane.

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


@dataclass(frozen=True)
class PatchCase:
    """A surface of a material in light from (theta, phi), degrees, at one wavelength, nm."""

    surface: Surface
    material: str
    wavelength: float
    theta: float
    phi: float


class Cut(NamedTuple):
    """Heights of a cut and its side, both in µm."""

    heights: NDArray[np.float64]
    side: float


#: Slopes of the sinusoids are those of 2.5/0.05 and 1.6/0.1 µm.
SURFACES = {
    surface.name: surface
    for surface in (
        Surface("sinusoid 2.5/0.05 µm", "sinusoid", 2.5, np.pi * 0.05 / 2.5 / np.sqrt(2)),
        Surface("sinusoid 1.6/0.1 µm", "sinusoid", 1.6, np.pi * 0.1 / 1.6 / np.sqrt(2)),
        Surface("crossed grating", "crossed", 1.5, 0.1),
        Surface("Elaphe, cut 1", "elaphe", 2.6, 0.2, (640, 500)),
        Surface("Elaphe, cut 2", "elaphe", 2.6, 0.2, (900, 850), 460.0),
        Surface("Elaphe, cut 3", "elaphe", 2.6, 0.2, (200, 1000)),
        Surface("Elaphe, cut 1, flattened", "elaphe", 2.6, 0.09, (640, 500)),
        Surface("look-alike of Elaphe", "elaphe_like", 2.6, 0.2, (100, 100)),
        Surface("CD's pits, flattened", "cd_pits", 3.2, 0.2, (600, 590)),
        Surface("Elaphe, cut 3, flattened", "elaphe", 2.6, 0.09, (200, 1000)),
        Surface("look-alike, flattened", "elaphe_like", 2.6, 0.09, (100, 100)),
        Surface("CD's pits, low", "cd_pits", 3.2, 0.06, (600, 590)),
    )
}

_OBLIQUE = ((0.0, 0.0), (30.0, 0.0), (30.0, 90.0), (60.0, 0.0), (60.0, 45.0), (60.0, 90.0))
_MANY = ("Elaphe, cut 1", "Elaphe, cut 3")  # the others are for comparison
_FEW = ((0.0, 0.0), (60.0, 0.0), (60.0, 45.0))


def patch_cases(material: str) -> Iterator[PatchCase]:
    """All cases of a material, in a fixed order."""
    for surface in SURFACES.values():
        grating = surface.kind == "sinusoid"
        if material != "keratin" and not grating and surface.slope > 0.1:
            continue  # neither solver converges on a metal that is this steep
        wavelengths = (460.0, 610.0) if surface.name == "Elaphe, cut 1" else (surface.wavelength,)
        for wavelength in wavelengths:
            many = grating or (material == "keratin" and surface.name in _MANY)
            for theta, phi in _OBLIQUE if many else _FEW:
                yield PatchCase(surface, material, wavelength, theta, phi)


@cache
def cell(surface: Surface) -> HeightField:
    """Heights of a surface, mean 0."""
    if surface.kind == "sinusoid":
        line = np.cos(2 * np.pi * np.arange(_LINE) / _LINE)[None, :]
        depth = surface.slope * surface.size * np.sqrt(2) / np.pi
        heights = np.repeat(0.5 * depth * line, 2, axis=0)
        return HeightField(heights, (surface.size / _LINE, _ROW), name=surface.name)
    if surface.kind == "crossed":
        line = np.cos(2 * np.pi * np.arange(PIXELS) / PIXELS)
        heights = line[None, :] + line[:, None]
        side = surface.size
    elif surface.kind == "elaphe":
        heights, side = _measured()[surface.name]
    else:
        heights, side = _cut(surface, _source(surface))
    heights = heights - heights.mean()
    heights *= surface.slope / _slope(heights, side)
    return HeightField(heights, side / PIXELS, name=surface.name)


def measured_cuts(patch: HeightField) -> dict[str, Cut]:
    """Cuts of the measured scale, by the names of their surfaces."""
    return {
        surface.name: _cut(surface, patch)
        for surface in SURFACES.values()
        if surface.kind == "elaphe"
    }


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


def _cut(surface: Surface, patch: HeightField) -> Cut:
    """Heights (`PIXELS`, `PIXELS`) of a cut, periodic and smooth, and its side."""
    pixel = patch.pixel_size[0]
    count = 2 * round(surface.size / pixel / 2)
    row, column = surface.place
    piece = patch.heights[row : row + count, column : column + count]
    periodic = _periodic(HeightField(piece, patch.pixel_size))
    side = count * pixel
    return Cut(_smoothed(periodic.heights, side), side)


def _source(surface: Surface) -> HeightField:
    """The generated patch that a surface is cut from."""
    if surface.kind == "elaphe_like":
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


def _smoothed(heights: NDArray[np.float64], side: float) -> NDArray[np.float64]:
    """Low frequencies at `PIXELS` samples a side, weighed by the Gaussian `_SMOOTHING`."""
    count = len(heights)
    harmonics = min(count, PIXELS) // 2 - 1  # harmonics either way, without Nyquist's
    few = np.arange(-harmonics, harmonics + 1)
    weight = np.exp(-0.5 * (2 * np.pi * few / side * _SMOOTHING) ** 2)
    spectrum = np.zeros((PIXELS, PIXELS), complex)
    low = np.fft.fft2(heights)[np.ix_(few, few)] * np.outer(weight, weight)
    spectrum[np.ix_(few, few)] = low * (PIXELS / count) ** 2
    return np.fft.ifft2(spectrum).real


def _slope(heights: NDArray[np.float64], side: float) -> float:
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
