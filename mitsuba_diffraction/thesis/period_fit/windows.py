"""Periods of single coherence windows spread over a patch, and the thesis' procedure.

`thesis_fit` is the procedure behind the thesis' published periods. It differs from the model in
three ways: the phase is exp(ikh) instead of exp(ikwh), the one window is centred on the patch's
first pixel, and the ridge is that window's brightest speckle, in relative reflectance. None of the
three changes the period of an exact grating.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...arrays import Real
from ...errors import DiffractionError
from ...optics.geometry import diffraction_coordinates, wavenumber
from ...progress import Progress
from ...tables import DiffractionTable
from ..methods.method import Gain
from .ridge import Beam, Fit, fit_period, measure, ridge_of

#: Largest number of windows: each costs a whole response.
MOST_WINDOWS = 4096

_SEED = 20140113


@dataclass(frozen=True, eq=False)
class WindowFits:
    """Fits of single coherence windows."""

    centres: Real  # (n, 2), centres of the windows on the patch, µm
    fits: tuple[Fit | None, ...]  # one for each window; `None` with too few maxima
    independent: float  # number of windows on the patch that do not overlap, at least 1

    @property
    def periods(self) -> Real:
        """Periods of the windows that have a fit, µm."""
        return np.array([fit.period for fit in self.fits if fit is not None])

    @property
    def mean(self) -> float:
        """Mean of `periods`, µm."""
        return float(self.periods.mean())

    @property
    def spread(self) -> float:
        """Standard deviation between windows, µm; 0 for a single one."""
        return float(self.periods.std(ddof=1)) if self.periods.size > 1 else 0.0

    @property
    def total(self) -> float:
        """Standard deviation of one window's period, µm: between windows, and of each fit."""
        of_fits = [fit.error for fit in self.fits if fit is not None]
        return math.hypot(self.spread, sum(of_fits) / len(of_fits))

    @property
    def error(self) -> float:
        """Standard error of the patch's mean period, from the spread between windows, µm."""
        return self.spread / math.sqrt(self.independent)


def window_fits(
    table: DiffractionTable,
    beam: Beam,
    wavelengths: Real,
    angles: Real,
    *,
    count: int,
    order: int = 1,
    period: float | None = None,
    progress: Progress | None = None,
) -> WindowFits:
    """Fit a period to each of `count` windows, spread over the patch with one offset (fixed seed).

    Raises a DiffractionError if `count` is out of range, or no window gives a period.

    Parameters
    ----------
    table : table with coherence="patch", of lengths times the index of the beam's medium.
    period : µm; ridges are searched at periods up to 1.5 times larger or smaller.
    """
    if not 1 <= count <= MOST_WINDOWS:
        raise DiffractionError(f"positions={count} must be from 1 to {MOST_WINDOWS}")
    extent = 2.0 * np.pi / np.array(table.spacing)
    centres = _lattice(count) * extent
    fits: list[Fit | None] = []
    for n, centre in enumerate(centres):
        brdf = partial(table.brdf, place=centre)
        response = measure(
            brdf, beam, wavelengths, angles, sigma=table.sigma, label=f"window {n + 1}"
        )
        try:
            fits.append(fit_period(ridge_of(response, order, period=period, within=1.5)))
        except DiffractionError:
            fits.append(None)  # this window shows too few maxima; counted below
        if progress is not None:
            progress(n + 1, count, "moving the window")
    if all(fit is None for fit in fits):
        raise DiffractionError(
            f"none of {count} windows shows order {order} at enough wavelengths to fit a period to"
        )
    # powers of two windows at a distance r are correlated by exp(−r²/2σ²), whose area is 2πσ²
    independent = max(1.0, float(np.prod(extent)) / (2.0 * math.pi * table.sigma**2))
    return WindowFits(centres / beam.index, tuple(fits), independent)


def _lattice(count: int) -> Real:
    """Return points (count, 2) in [0, 1)²: a rank-1 lattice by the plastic number, shifted."""
    plastic = 1.32471795724474602596
    steps = np.arange(count)[:, None] * np.array([1.0 / plastic, 1.0 / plastic**2])
    return np.asarray((steps + np.random.default_rng(_SEED).random(2)) % 1.0)


def thesis_fit(
    table: DiffractionTable, beam: Beam, wavelengths: Real, angles: Real, order: int = 1,
    period: float | None = None,
) -> Fit:  # fmt: skip
    """Fit a period by the thesis' procedure, at viewing angles across the normal, from 0.

    An order beyond the first is searched at up to 1.5 times larger or smaller periods than `period`
    in µm: the first order is brighter.

    On the light's side, the response of the procedure grows towards the horizon. The response is
    C·S at κ = k, with the window on the patch's corner, of a table with coherence="patch".
    """
    gain, across = Gain(), angles[angles >= 0.0]

    def relative(wi: Real, wo: Real, wavelength: Real) -> Real:
        """Return the relative reflectance C·S with the phase exp(ikh)."""
        k = wavenumber(wavelength)
        u, v, _ = diffraction_coordinates(wi, wo)
        return gain.factor(wi, wo) * table.window_sum(k * u, k * v, k, (0.0, 0.0))

    label = "thesis' procedure"
    response = measure(relative, beam, wavelengths, across, sigma=table.sigma, label=label)
    near = period if abs(order) > 1 else None
    return fit_period(ridge_of(response, order, period=near, within=1.5))
