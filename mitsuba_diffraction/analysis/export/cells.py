"""Means of f and of f cosθo around nodes of directions, and over bands of wavelengths."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...llvm import require_loaded_llvm
from ...optics.geometry import wavenumber
from ...plugin.description import VARYING, Consumer, Feature
from ...plugin.loops import sum_of
from ...plugin.memory import read_record, upload
from ...plugin.types import Buffer, Float, Index, Spectrum, Vector3f
from ...progress import Progress
from ..maps.evaluate import opaque
from ..maps.hemisphere import flat_interaction, sub_samples

Reals = NDArray[np.float64]

#: Files hold the reflected light of one place.
FILES = Consumer(
    "a file of a BRDF",
    frozenset(Feature) - VARYING - {Feature.TRANSMISSION},
    "give a surface that only reflects, with numbers in place of textures",
)
#: Values in a file at most, about a gigabyte.
MOST = 1 << 28
#: Cells of a kernel launch, and samples of a cell at most.
_LAUNCH, _MOST_SAMPLES = 1 << 18, 64
#: Steepest light, degrees.
STEEPEST = 89.0


class ExportGrid(NamedTuple):
    """Directions to the light, and wavelengths, of a file.

    Attributes
    ----------
    theta, phi : degrees from the normal, and from x towards y; rising.
    wavelengths : nm, rising, evenly spaced if there are several.
    resolution : number of nodes of outgoing directions, as each format has them.
    """

    theta: Reals
    phi: Reals
    wavelengths: Reals
    resolution: int

    def checked(self, values: int) -> ExportGrid:
        """Return the grid; refuse angles that are out of range, and too large files.

        values : in the file, for each direction to the light and wavelength.
        """
        for name, axis, low, high in (
            ("theta", self.theta, 0.0, STEEPEST), ("phi", self.phi, -360.0, 360.0),
            ("wavelength", self.wavelengths, 100.0, 20_000.0),
        ):  # fmt: skip
            rises = axis.size > 0 and bool(np.all(np.diff(axis) > 0.0))
            if not (rises and low <= axis[0] and axis[-1] <= high):
                raise DiffractionError(
                    f"{name}: expected rising numbers from {low:g} to {high:g}, got "
                    f"{', '.join(f'{value:g}' for value in axis[:5]) or 'none'}"
                )
        total = self.theta.size * self.phi.size * self.wavelengths.size * values
        if total > MOST:
            raise DiffractionError(
                f"{total:.2g} values are over {MOST:.2g}; lower the resolution, or take fewer "
                "directions or wavelengths"
            )
        return self


class CellSample(NamedTuple):
    """Directions at one place in each cell, arrays of Dr.Jit.

    Attributes
    ----------
    wi, wo : to the light and to the eye.
    weight : solid angle of that part of the cell, in any unit.
    """

    wi: Vector3f
    wo: Vector3f
    weight: Float


class Cells(NamedTuple):
    """Cells of directions around nodes.

    Attributes
    ----------
    nodes : coordinates (n,) of the nodes.
    sample : of these coordinates, as arrays of Dr.Jit, and of a place: distances from the node, −1
        to 1 steps along both axes.
    """

    nodes: Sequence[Reals]
    sample: Callable[..., CellSample]

    def part(self, first: int, last: int) -> list[Float]:
        """Return the coordinates of some nodes."""
        return [upload(mi.Float, axis[first:last].astype(np.float32)) for axis in self.nodes]

    def middle(self) -> CellSample:
        """Return the sample at all nodes."""
        return self.sample(*self.part(0, len(self.nodes[0])), 0.0, 0.0)


def means(
    bsdf: Any,
    cells: Cells,
    wavelengths: Reals,
    size: float,
    cosine: bool,
    progress: Progress,
) -> NDArray[np.float32]:
    """Return the mean of f cosθo, or of f above the horizon, in each cell, (n, wavelengths).

    Each sample has another wavelength of the band around each wavelength.

    Raises a DiffractionError if the variant cannot be evaluated, or the surface transmits or
    varies.

    Parameters
    ----------
    bsdf : a BSDF of the current variant, spectral and vectorised.
    size : of the largest cell, in direction cosines, by which the number of samples is chosen.
    cosine : whether f is multiplied by cosθo; the mean is then over the whole cell.
    """
    if not mi.is_spectral or mi.is_polarized or "scalar" in mi.variant():
        raise DiffractionError(
            f"variant '{mi.variant()}' does not support files of a BRDF; use llvm_ad_spectral or "
            "cuda_ad_spectral"
        )
    require_loaded_llvm()
    sigma = FILES.described(bsdf).sigma
    lobe = 1.0 / (math.sqrt(2.0) * sigma * float(wavenumber(wavelengths[0])))
    x, y, band = sub_samples(min(max(math.ceil(0.5 * (size / lobe) ** 2), 1), _MOST_SAMPLES)).T
    step = float(wavelengths[1] - wavelengths[0]) if len(wavelengths) > 1 else 0.0
    # a fourth number, so that one packet load fetches a place
    pattern = np.stack([_tent(x), _tent(y), (band - 0.5) * step, np.zeros(len(x))], axis=1)
    places, packet = upload(mi.Float, pattern.astype(np.float32)), len(mi.UnpolarizedSpectrum())
    count = len(cells.nodes[0])
    result = np.empty((count, len(wavelengths)), np.float32)
    for first in range(0, count, _LAUNCH):
        nodes = cells.part(first, first + _LAUNCH)
        for wave in range(0, len(wavelengths), packet):
            done = first + (min(_LAUNCH, count - first) * wave) // len(wavelengths)
            progress(done, count, "evaluating")
            light = wavelengths[wave : wave + packet]
            spectrum = mi.UnpolarizedSpectrum(opaque(np.resize(light, packet)))
            total = _total(bsdf, cells.sample, nodes, places, len(pattern), spectrum, cosine)
            for column, channel in zip(range(len(light)), total, strict=False):
                result[first : first + _LAUNCH, wave + column] = np.array(channel)
    progress(1, 1, "evaluating")
    return result


def _total(
    bsdf: Any,
    sample: Callable[..., CellSample],
    nodes: list[Float],
    places: Buffer,
    count: int,
    wavelengths: Spectrum,
    cosine: bool,
) -> Spectrum:
    """Return the mean of f cosθo or f in cells, over so many places, in one kernel."""

    def add(n: Index, _: Any, sums: tuple[Spectrum, Float]) -> tuple[Spectrum, Float]:
        a, b, shift, _ = read_record(places, n, 4)
        wi, wo, weight = sample(*nodes, a, b)
        lit = wo.z > 0.0
        si = flat_interaction(wi, 1)
        si.wavelengths = wavelengths + shift
        f = bsdf.eval(mi.BSDFContext(), si, dr.select(lit, wo, mi.Vector3f(0.0, 0.0, 1.0)))
        if not cosine:
            f, weight = f * dr.rcp(dr.select(lit, wo.z, 1.0)), dr.select(lit, weight, 0.0)
        return sums[0] + dr.select(lit, f * weight, 0.0), sums[1] + weight

    sums = sum_of(count, add, (), (mi.UnpolarizedSpectrum(0.0), mi.Float(0.0)))
    return sums[0] * dr.rcp(dr.maximum(sums[1], 1e-30))


def _tent(share: Reals) -> Reals:
    """Return places of −1 to 1 by even shares of 0 to 1, of density 1 − |place|.

    Programs interpolate between nodes linearly: means of that density keep the power of any lobe.
    """
    return np.asarray(np.sign(share - 0.5) * (1.0 - np.sqrt(1.0 - np.abs(2.0 * share - 1.0))))


def unit_vector(theta: Float, phi: Float) -> Vector3f:
    """Return a unit vector, at angles in rad from the normal, and from x towards y."""
    sine, cosine = dr.sincos(theta)
    return mi.Vector3f(sine * dr.cos(phi), sine * dr.sin(phi), cosine)
