"""Look-ups that paths make in one table: how far they go, with how much of the light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import delta_e, linear_srgb
from ...optics.geometry import wavenumber

#: Factor on the frequency of the last look-up: a path not traced may go a little farther.
ROOM = 1.02


@dataclass(frozen=True)
class Lookups:
    """Look-ups in one table, of all surfaces that share it."""

    # u, v, w: (n,) ωi + ωo in the patch's frame, w times height_scale
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    w: NDArray[np.float64]
    wavelength: NDArray[np.float64]  # (n,) nm
    # (n, 3) light of the picture that each look-up adds, the whole picture's being 1
    xyz: NDArray[np.float64]
    total: float  # light of all paths that meet the surfaces, nested BSDFs included

    @property
    def light(self) -> NDArray[np.float64]:
        """(n,) relative to all light of the surfaces."""
        return np.asarray(self.xyz.sum(axis=1) / self.total)

    @property
    def wavenumber(self) -> NDArray[np.float64]:
        """(n,) k in rad/µm: u and v times it are α and β."""
        return np.asarray(wavenumber(self.wavelength))

    @property
    def along(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n,), (n,) |α| and |β| in rad/µm."""
        return np.abs(self.wavenumber * self.u), np.abs(self.wavenumber * self.v)

    @property
    def frequency(self) -> NDArray[np.float64]:
        """(n,) |q| in rad/µm."""
        return np.hypot(*self.along)

    @property
    def kappa(self) -> NDArray[np.float64]:
        """(n,) rad/µm."""
        return np.asarray(self.wavenumber * self.w)

    def outside(self, limit: tuple[float, float]) -> float:
        """Share of the surfaces' light that is looked up outside of an ellipse.

        limit : half axes along x and y, rad/µm.
        """
        x, y = (q / half for q, half in zip(self.along, limit, strict=True))
        return float(self.light[np.hypot(x, y) > 1.0].sum())

    def frequency_limit(self, share: float, largest: float) -> tuple[float, float]:
        """Half axes of the smallest ellipse that leaves at most a share of the light outside.

        share : of all light of the surfaces.
        largest : frequency that light can probe, rad/µm.
        """
        x, y = self.along
        # Fingers and tracks spread light across themselves much farther than along
        ratios = 2.0 ** np.arange(-3.0, 3.01, 0.25)
        halves = [(_reach(np.hypot(x, y / ratio), self.light, share), ratio) for ratio in ratios]
        half, ratio = min(halves, key=lambda axes: axes[0] ** 2 * axes[1])
        return min(half * ROOM, largest), min(float(half * ratio) * ROOM, largest)


def _reach(values: NDArray[np.float64], light: NDArray[np.float64], share: float) -> float:
    """The smallest limit that leaves at most this much of the light above it."""
    order = np.argsort(values)[::-1]
    above = np.cumsum(light[order])
    first = int(np.searchsorted(above, share, side="right"))
    return float(values[order][min(first, len(order) - 1)])


def quantiles(
    values: NDArray[np.float64], light: NDArray[np.float64], shares: list[float]
) -> list[float]:
    """Values below which these shares of the light lie."""
    return list(map(float, np.quantile(values, shares, weights=light, method="inverted_cdf")))


def lobes_in_a_pixel(turn: float, sigma: float) -> float:
    """Return how many lobes of the window a pixel sees at once, at 550 nm, on a bent surface.

    Where ωi turns by δ in the surface's frame, so does ωo: (u, v) moves by up to 2δ, and a lobe is
    1/(kσ) wide.

    turn : δ between two places in a pixel, in direction cosines.
    sigma : of the window, µm.
    """
    return float((2.0 * turn * float(wavenumber(550.0)) * sigma) ** 2)


def wavelengths_needed(lookups: Lookups, share: float = 1e-3) -> dict[str, Any]:
    """The band that all but a share of the diffracted light lies in, half of it on either side.

    Returns range_nm, and lost_colour: ΔE2000 between the mean colours of all light and of the band
    alone.
    """
    low, high = quantiles(lookups.wavelength, lookups.light, [0.5 * share, 1.0 - 0.5 * share])
    inside = (lookups.wavelength >= low) & (lookups.wavelength <= high)
    colours = [linear_srgb(lookups.xyz[part].sum(axis=0)) for part in (slice(None), inside)]
    largest = max(float(np.abs(colours[0]).max()), 1e-30)
    lost = delta_e(colours[0][None] / largest, colours[1][None] / largest, exposure=1.0)
    return {"range_nm": [low, high], "lost_colour": float(lost[0])}
