"""Flat stacks of layers: reflection by transfer matrices, and its mean over a spread of thickness.

Waves are summed from the material upwards (Rouard's recursion, which no absorbing layer makes
overflow; Born and Wolf, Principles of Optics, section 1.6). Time exp(−iωt): indices are n + ik.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Complex, Real
from .arithmetic import Number

#: Standard deviations of thickness that a mean covers, and its steps: of the phase, rad, at most.
_REACH, _STEP, _FEWEST = 3.0, 1.0, 13
#: Least cosine: at the horizon itself, gaps between layers of the index above make 0/0.
_HORIZON = 1e-6
#: Nodes of a fringe: linear interpolation is within 0.004 of the reflectance.
_PER_FRINGE, _FEWEST_NODES = 24, 24


def amplitudes(
    cosine: Real, wavelengths: Real, indices: Complex, thicknesses: Real
) -> tuple[Complex, Complex]:
    """Return r_s and r_p (n, m), with the signs of `fresnel.amplitudes`.

    Parameters
    ----------
    cosine : (m,) of the angle of incidence.
    wavelengths : (n,) in the unit of the thicknesses, in the medium in which indices are relative.
    indices : (layers + 1, n) of the material, then of the layers upwards, over the medium above.
    thicknesses : (layers,) from the material upwards.
    """
    square, wavenumber = np.maximum(cosine, _HORIZON) ** 2, 2.0 * np.pi / wavelengths[:, None]
    epsilons = [*(indices[:, :, None].astype(np.complex128) ** 2), np.ones((1, 1), complex)]
    normals = [np.sqrt(epsilon - 1.0 + square) for epsilon in epsilons]
    r_s = r_p = np.zeros((1, 1), complex)
    for layer in range(len(epsilons) - 1):
        (below, q), (above, up) = ((epsilons[n], normals[n]) for n in (layer, layer + 1))
        face_s, face_p = _face(up, q), _face(below * up, above * q)
        if layer:
            there = np.exp(2j * wavenumber * thicknesses[layer - 1] * q)
            r_s, r_p = r_s * there, r_p * there
        r_s, r_p = (face_s + r_s) / (1.0 + face_s * r_s), (face_p + r_p) / (1.0 + face_p * r_p)
    return r_s, r_p


def _face(first: Complex, second: Complex) -> Complex:
    """Return (a − b)/(a + b), a face's amplitude; 0 where nothing changes, though both are 0."""
    total = first + second
    none = total == 0.0
    return np.asarray(np.where(none, 0.0, (first - second) / np.where(none, 1.0, total)))


def mean_powers(
    cosine: Real, wavelengths: Real, indices: Complex, thicknesses: Real, spread: float
) -> Complex:
    """Return the means (n, m, 3) of |r_s|², |r_p|² and r_p r_s* over thicknesses.

    spread : standard deviation of a common factor on all thicknesses, whose density is Gaussian.
        Other arguments as for `amplitudes`.
    """
    count = 1
    if spread:
        phase = 4.0 * np.pi * float((indices[1:].real.max(axis=1) * thicknesses).sum())
        phase *= 2.0 * _REACH * spread / float(wavelengths.min())
        count = max(math.ceil(phase / _STEP), _FEWEST)
    places = np.linspace(-_REACH, _REACH, count) if count > 1 else np.zeros(1)
    weights = np.exp(-0.5 * places**2)
    total = np.zeros((len(wavelengths), len(cosine), 3), complex)
    for place, weight in zip(places, weights / weights.sum(), strict=True):
        r_s, r_p = amplitudes(cosine, wavelengths, indices, (1.0 + spread * place) * thicknesses)
        total += weight * np.stack([np.abs(r_s) ** 2, np.abs(r_p) ** 2, r_p * r_s.conj()], axis=-1)
    return total


def nodes(path: float, wavelengths: tuple[float, float]) -> tuple[int, int]:
    """Return numbers of nodes, evenly in 1/λ and in cosθ, for fringes of a path 2 Σ n d.

    wavelengths : first and last, in the unit of the path.
    """
    first, last = wavelengths
    fringes = path * (1.0 / first - 1.0 / last), path / first
    over_angle = 1.0 - math.sqrt(1.0 - 1.0 / 1.3**2)  # of the least index that is usual
    return (
        _FEWEST_NODES + math.ceil(_PER_FRINGE * fringes[0]),
        _FEWEST_NODES + math.ceil(_PER_FRINGE * over_angle * fringes[1]),
    )


@dataclass(frozen=True, eq=False)
class Stacked:
    """Index of a stack, accepted where Kirchhoff's model takes an index.

    Attributes
    ----------
    table : `packed` (..., m, 3) at m even cosines from 0 to 1.
    phase : largest phase (rad) of light there and back.
    """

    table: Any = field(repr=False)
    phase: float = 0.0

    def amplitudes(self, cosine: Number) -> tuple[Number, Number]:
        """Return r_s and r_p of the mean powers; of a spread without its loss of polarisation."""
        place = np.clip(np.asarray(cosine), 0.0, 1.0) * (self.table.shape[-2] - 1)
        lower = np.minimum(place.astype(int), self.table.shape[-2] - 2)
        share = (place - lower)[..., None]
        rows = self.table[..., lower, :] * (1.0 - share) + self.table[..., lower + 1, :] * share
        return rows[..., 0] + 0j, rows[..., 1] + 1j * rows[..., 2]

    def __getitem__(self, key: int | tuple[slice, None]) -> Stacked:
        """Select a wavelength; `[:, None]`, for arrays of cosines, selects all."""
        return self if isinstance(key, tuple) else Stacked(self.table[key], self.phase)


def packed(powers: Complex) -> Real:
    """Return −√|r_s|², and real and imaginary part of r_p of the mean phase, from `mean_powers`."""
    s, p = (np.sqrt(np.clip(powers[..., n].real, 0.0, 1.0)) for n in (0, 1))
    both = powers[..., 2]
    size = np.abs(both)
    p = -p * np.where(size > 0.0, both / np.where(size > 0.0, size, 1.0), -1.0)
    return np.stack([-s, p.real, p.imag], axis=-1)


def path_of(indices: Sequence[float], thicknesses: Sequence[float]) -> float:
    """Return 2 Σ n d."""
    return 2.0 * sum(n * d for n, d in zip(indices, thicknesses, strict=True))
