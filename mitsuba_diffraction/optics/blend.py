"""Blend of Kirchhoff's matrix K and small slope's B, J = (1−s) K + s B: roughness and weights.

B is right at any angle for surfaces that are smooth against the wavelength. K is right for rough
and gentle surfaces, where facets reflect. The share s of B depends on the roughness at the scales
that make the order q. Waves much longer than 2π/q tilt and shift the structure that makes the
order; much finer roughness dims the order. Eq. (9) of docs/theory.md:

    s = exp(−R₀(κσ_q)²/2 − (κσ_q)⁴/3),
    σ_q² = Σ_q' |h_q'|² (1 − exp(−(4q'/q)⁴)) exp(−(q'/2q)⁴),

where σ_q² is the height variance of the components q' from about a fifth to twice the order's
frequency, and R₀ = |(n−1)/(n+1)|² the reflectance of a flat surface along its normal. s is ½ at
κσ_q = 1.2 on a dielectric and at 0.95 on a metal. s is symmetric in ωi and ωo, and smooth in both
and in the wavelength.

The term with R₀ is the first correction to B, of order (κσ)², in the local curvature approximation
(Elfouhaily, Guignard, Awadallah and Thompson 2003, Waves in Random Media 13, 321): s = 1 − (κσ)²/2
for a sinusoid's first order. On a metal K and B differ by the facet's tilt alone, and the
correction halves the errors of either polarisation on gentle aluminium at normal incidence. On a
dielectric K and B also differ by Brewster's angle: in oblique light K is so far off that even a
small share of K increases the error. R₀ makes the correction small there. The band and the fourth
power are chosen by rigorous solutions (docs/validation.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Real
from .arithmetic import Number, one_minus_exp

#: Frequencies within this part of an octave share a bin, at the mean frequency of their power.
_BINS_PER_OCTAVE = 256
#: Nodes of a `RoughnessTable`: linear interpolation is then within 5e-4 of the largest.
NODES_PER_OCTAVE = 32


@dataclass(frozen=True, eq=False)
class ScaleRoughness:
    """Height variance of a periodic surface by the length of the spatial frequency.

    Attributes
    ----------
    frequency : (n,) |q'| in rad/µm, ascending, without 0.
    variance : (n,) Σ|h_q'|² of the components there, µm².
    """

    frequency: Real
    variance: Real

    @classmethod
    def from_heights(cls, heights: ArrayLike, pixel_size: tuple[float, float]) -> ScaleRoughness:
        """Return the roughness of heights (ny, nx) in µm; pixel_size is (dx, dy) in µm."""
        surface = np.asarray(heights, np.float64)
        ny, nx = surface.shape
        power = np.abs(np.fft.fft2(surface) / surface.size) ** 2
        qx = 2 * np.pi * np.fft.fftfreq(nx, pixel_size[0])
        qy = 2 * np.pi * np.fft.fftfreq(ny, pixel_size[1])
        length = np.hypot(qx[None, :], qy[:, None]).ravel()[1:]
        weight = power.ravel()[1:]
        bins = np.floor(_BINS_PER_OCTAVE * np.log2(length)).astype(int)
        which = bins - bins.min()  # some are empty
        total = np.bincount(which, weight).astype(np.float64)
        # the mean over the power in a bin; a bin without any may lie anywhere
        moment = np.bincount(which, weight * length).astype(np.float64)
        filled = total > 0
        return cls(moment[filled] / total[filled], total[filled])

    @classmethod
    def mean(cls, patches: Sequence[ScaleRoughness]) -> ScaleRoughness:
        """Average the variances of several patches of one surface."""
        frequency = np.concatenate([patch.frequency for patch in patches])
        variance = np.concatenate([patch.variance for patch in patches]) / len(patches)
        order = np.argsort(frequency, kind="stable")
        return cls(frequency[order], variance[order])

    def at(self, q: ArrayLike) -> Real:
        """σ_q² in µm², shaped as q, the length of an order's spatial frequency in rad/µm."""
        return np.asarray(shares(self.frequency, q) @ self.variance, np.float64)

    def table(self, q_max: float) -> RoughnessTable:
        """σ_q² at nodes, up to q_max (rad/µm) or just above."""
        if not len(self.frequency):
            return RoughnessTable(0.0, np.zeros(2))
        # Below an eighth of the lowest frequency σ_q² is 0
        first = float(np.log2(self.frequency[0] / 8))
        count = max(1, int(np.ceil((np.log2(q_max) - first) * NODES_PER_OCTAVE)))
        nodes = self.at(2.0 ** (first + np.arange(count + 1) / NODES_PER_OCTAVE))
        return RoughnessTable(first, nodes)


def shares(frequency: ArrayLike, q: ArrayLike) -> Real:
    """Weights of components of these frequencies (n,) in the σ_q² of an order's q, (..., n)."""
    order = np.abs(np.asarray(q, np.float64))
    with np.errstate(divide="ignore", over="ignore", under="ignore"):
        ratio = (np.asarray(frequency) / order[..., None]) ** 4  # infinite at q = 0: no component
        return np.asarray(-np.expm1(-256.0 * ratio) * np.exp(-ratio / 16.0), np.float64)


@dataclass(frozen=True, eq=False)
class RoughnessTable:
    """σ_q² at log2 q = first + n/`NODES_PER_OCTAVE`, linear in between.

    Attributes
    ----------
    first : log2 of the lowest node's q in rad/µm; below it σ_q² is the first node's.
    nodes : (n,) µm², at least two; beyond the last σ_q² is the last node's.
    """

    first: float
    nodes: Real

    @property
    def frequencies(self) -> Real:
        """q of the nodes, rad/µm."""
        return np.asarray(2.0 ** (self.first + np.arange(len(self.nodes)) / NODES_PER_OCTAVE))

    def at(self, q: ArrayLike) -> Real:
        """σ_q² in µm², shaped as q, in rad/µm."""
        order = np.maximum(np.abs(np.asarray(q, np.float64)), np.finfo(np.float64).tiny)
        place = (np.log2(order) - self.first) * NODES_PER_OCTAVE
        return np.asarray(np.interp(place, np.arange(len(self.nodes)), self.nodes), np.float64)


def kirchhoff_weight(kappa: Number, variance: Number, normal_reflectance: Number) -> Number:
    """Return 1 − s, the weight of Kirchhoff's matrix, eq. 9.

    Not s: near the horizon K is so large beside B that the last digit of 1 − s counts.

    Parameters
    ----------
    kappa : κ, rad/µm.
    variance : σ_q², µm² (`ScaleRoughness.at`).
    normal_reflectance : R₀, of a film with the film (`fresnel.normal_reflectance`).
    """
    roughness = kappa * kappa * variance  # (κσ_q)²
    return one_minus_exp(roughness * (0.5 * normal_reflectance + roughness * (1.0 / 3.0)))
