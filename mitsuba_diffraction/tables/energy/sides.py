"""R + T of a dielectric surface: what both models gain, since first order keeps no energy.

Sums over the orders of a table as in `optics.through`, each at its own κ: a few strong ones, and a
density of all others. Light comes from above or from within.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics import boundary, fresnel, through
from ...optics.geometry import wavenumber
from ..sampling.order_mixture import OrderMixture, order_mixture
from ..table import DiffractionTable

Real = NDArray[np.float64]

#: Directions that sums are made for: polar angles in degrees, and azimuths of half a turn.
POLAR, AZIMUTHS = (0.0, 20.0, 40.0, 55.0, 65.0, 75.0), 4
#: rad/µm by which the density of weak orders is smoothed.
SMOOTHING = 2.0
REFLECTS = {"kirchhoff": boundary.kirchhoff, "small_slope": boundary.small_slope}
PASSES = {"kirchhoff": through.kirchhoff, "small_slope": through.small_slope}
# Cosines of orders that count as along the surface
_LEAST_COSINE = 1e-3
_FAINT = 1e-7


def largest_sum(
    table: DiffractionTable, height_scale: float, index: float, model: str, thin: bool
) -> float:
    """The largest R + T of light within 75° of the normal, from both sides; a second or so.

    Parameters
    ----------
    index : of the dielectric over that of the medium above.
    model : "kirchhoff", or "small_slope", whose first order alone is summed.
    thin : whether light beyond the critical angle is lost, as in a thin sheet.
    """
    orders = order_mixture(table, height_scale, SMOOTHING)
    others = _Others.of(orders)
    low, high = table.wavelength_range
    sums = [
        _sum(orders, others, float(wavenumber(one)), wi, model, media, thin)
        for one in (max(low, 420.0), min(high, 650.0))
        for media in ((1.0, index), (index, 1.0))
        for wi in _directions()
    ]
    return max(sums)


def _directions() -> Iterator[Real]:
    for polar in np.radians(POLAR):
        for azimuth in np.pi * np.arange(AZIMUTHS if polar > 0 else 1) / AZIMUTHS:
            sine = np.sin(polar)
            yield np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)])


def _sum(
    orders: OrderMixture,
    others: _Others,
    k: float,
    wi: Real,
    model: str,
    media: tuple[float, float],
    thin: bool,
) -> float:
    """R + T of light along −ωi in the first of two media, whose normal points to it."""
    here, there = media
    cosine = here * wi[2]
    beyond = np.sqrt(max(there**2 - here**2 + cosine**2, 0.0))
    flat = float(fresnel.reflectance(wi[2], there / here))
    total = flat * orders.order_0(np.array(2 * cosine * k))
    total += (1.0 - flat) * orders.order_0(np.array(abs(beyond - cosine) * k))
    tangential = others.frequency / k - here * wi[:2]
    for medium, sign in ((here, 1.0), (there, -1.0)):
        square = np.sum(tangential**2, axis=1) / medium**2
        limit = min(1.0 / medium, 1.0) if thin else 1.0
        keep = square < (limit * (1.0 - _LEAST_COSINE)) ** 2
        out = np.sqrt(1.0 - square[keep])
        # powers over κ² have a limit, which their first step tells
        w = np.maximum(np.abs(medium * out + sign * cosine), orders.kappa_step / k)
        wo = np.column_stack([tangential[keep] / medium, out])
        gain = _gains(np.broadcast_to(wi, wo.shape), wo, media, sign > 0, model)
        power = others.at(w * (k / orders.kappa_step), keep)
        total += float(np.sum(4.0 * cosine * medium * out * gain / w**2 * power))
    return float(total)


def _gains(wi: Real, wo: Real, media: tuple[float, float], reflected: bool, model: str) -> Real:
    """N of pairs whose directions are both as if above."""
    here, there = media
    if reflected:
        return boundary.unpolarised(REFLECTS[model](wi, wo, there / here))
    # n of `optics.through` is that of the denser side, wherever light comes from
    above, inside = (wi, wo) if there > here else (wo, wi)
    jones = PASSES[model](above, inside * [1, 1, -1], max(media))
    return boundary.unpolarised(jones)


@dataclass(frozen=True)
class _Others:
    """All orders but order 0.

    Attributes
    ----------
    frequency : (n, 2) rad/µm, of the strong ones, then of cells of the density.
    powers : (kappas, n).
    """

    frequency: Real
    powers: NDArray[np.float32]

    @classmethod
    def of(cls, orders: OrderMixture) -> _Others:
        """All that have power to speak of."""
        _, ny, nx = orders.density.shape
        x, y = (orders.pitch * (np.arange(n) - 0.5 * (n - 1)) for n in (nx, ny))
        cells = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        weak = orders.density.reshape(len(orders.density), -1) * np.float32(orders.pitch**2)
        kept = weak.max(axis=0) > _FAINT
        return cls(
            np.concatenate([orders.frequency, cells[kept]]),
            np.concatenate([orders.powers, weak[:, kept]], axis=1),
        )

    def at(self, position: Real, keep: NDArray[np.bool_]) -> Real:
        """Powers of those kept, each at its own κ in steps of the mixture's."""
        position = np.clip(position, 0.0, len(self.powers) - 1.001)
        lower = position.astype(int)
        share = position - lower
        column = np.flatnonzero(keep)
        low, high = self.powers[lower, column], self.powers[lower + 1, column]
        return np.asarray(low * (1.0 - share) + high * share)
