"""Means of f and of f cosθo around nodes of directions, and over bands of wavelengths."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.geometry import wavenumber
from ...plugin.description import VARYING, Consumer, Feature
from ...plugin.llvm import require_loaded_llvm
from ...plugin.memory import upload
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
#: Directions of a kernel launch, and samples of a cell at most.
_LAUNCH, _MOST_SAMPLES = 1 << 18, 64
#: Steepest light, degrees.
STEEPEST = 89.0


class Grid(NamedTuple):
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

    def checked(self, values: int) -> Grid:
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


class Sample(NamedTuple):
    """Directions at one place in each cell: to the light (n, 3), to the eye (n, 3).

    weight : (n,) solid angle of that part of the cell, in any unit.
    """

    wi: Reals
    wo: Reals
    weight: Reals


#: Sample of each cell at a place: distances from its node, −1 to 1 steps along both axes.
Samples = Callable[[float, float], Sample]


def means(
    bsdf: Any,
    samples: Samples,
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
    pattern = sub_samples(min(max(math.ceil(0.5 * (size / lobe) ** 2), 1), _MOST_SAMPLES))
    band = float(wavelengths[1] - wavelengths[0]) if len(wavelengths) > 1 else 0.0
    sums: Reals | float = 0.0
    weights: Reals | float = 0.0
    for n, (a, b, c) in enumerate(pattern):
        wi, wo, weight = samples(_tent(a), _tent(b))
        lit = wo[:, 2] > 0.0
        weights = weights + (weight if cosine else weight * lit)
        values = np.zeros((len(wo), len(wavelengths)))
        for first in range(0, len(wo), _LAUNCH):
            progress(n * len(wo) + first, len(pattern) * len(wo), "evaluating")
            part = slice(first, first + _LAUNCH)
            shifted = wavelengths + (c - 0.5) * band
            values[part] = _values(bsdf, wi[part], wo[part], lit[part], shifted, cosine)
        sums = sums + values * weight[:, None]
    progress(1, 1, "evaluating")
    return np.asarray(sums / np.maximum(weights, 1e-30)[:, None], np.float32)


def _tent(share: float) -> float:
    """Return a place of −1 to 1 by an even share of 0 to 1, of density 1 − |place|.

    Programs interpolate between nodes linearly: means of that density keep the power of any lobe.
    """
    return float(np.sign(share - 0.5) * (1.0 - math.sqrt(1.0 - abs(2.0 * share - 1.0))))


def _values(
    bsdf: Any, wi: Reals, wo: Reals, lit: NDArray[np.bool_], wavelengths: Reals, cosine: bool
) -> Reals:
    """Return f cosθo or f (n, wavelengths), 0 below the horizon."""
    wo = np.where(lit[:, None], wo, [0.0, 0.0, 1.0])
    towards, out = (
        mi.Vector3f(*(upload(mi.Float, column) for column in each.T.astype(np.float32)))
        for each in (wi, wo)
    )
    si = flat_interaction(towards, len(wo))
    context, packet = mi.BSDFContext(), len(mi.UnpolarizedSpectrum())
    result = np.zeros((len(wo), len(wavelengths)))
    for first in range(0, len(wavelengths), packet):
        index = np.minimum(np.arange(first, first + packet), len(wavelengths) - 1)
        si.wavelengths = mi.UnpolarizedSpectrum(opaque(wavelengths[index]))
        f = bsdf.eval(context, si, out)
        used = min(packet, len(wavelengths) - first)
        found = np.stack([np.array(channel) for channel in f][:used], axis=1)
        result[:, first : first + used] = found if cosine else found / wo[:, 2:]
    return result * lit[:, None]
