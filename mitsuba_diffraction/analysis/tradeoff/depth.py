"""Errors against depth: where Taylor's series breaks down in single precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...progress import Progress, silent
from ...tables.table import DiffractionTable, q_limit_of

#: Terms of the thesis' shaders.
TERMS = 37
#: Normal incidence and return at 380 nm: the largest κ of the visible.
KAPPA = q_limit_of((380.0, 780.0))

_SIDE, _PIXEL = 48, 0.1


@dataclass(frozen=True)
class Depths:
    """Errors over depth."""

    depth: NDArray[np.float64]  # (n,) µm, peak to valley
    # name of a series → (n,) Σ|power − exact| / Σ exact of all orders but order 0; NaN where it is
    # refused
    errors: dict[str, NDArray[np.float64]]
    intervals: NDArray[np.int64]  # (n,) of the default series


def measure_depths(count: int, progress: Progress = silent) -> Depths:
    """From 1 nm to 20 µm, `count` depths, on one rough patch of many slopes."""
    shape = _rough()
    depths = np.geomspace(1e-3, 20.0, count)
    names = (
        f"Taylor, {TERMS} terms, heights from 0",
        f"Taylor, {TERMS} terms, centred heights",
        "basis=taylor", "basis=chebyshev", "basis=svd",
    )  # fmt: skip
    errors = {name: np.full(count, np.nan) for name in names}
    intervals = np.zeros(count, np.int64)
    for n, depth in enumerate(depths):
        progress(n, count, f"{depth:.3g} µm deep")
        heights = depth * shape
        errors[names[0]][n] = taylor_error(heights, KAPPA, TERMS)
        errors[names[1]][n] = taylor_error(heights - 0.5 * depth, KAPPA, TERMS)
        for basis in ("taylor", "chebyshev", "svd"):
            try:
                table = DiffractionTable.build(
                    HeightField(heights, _PIXEL),
                    basis=basis,
                    coherence_width=_SIDE * _PIXEL,
                    wavelength_range=(380.0, 780.0),
                    height_scale_max=1.0,
                )
            except DiffractionError:
                continue
            errors[f"basis={basis}"][n] = table.largest_error
            if basis == "svd":
                intervals[n] = table.expansion.intervals
    progress(count, count, "depths")
    return Depths(depths, errors, intervals)


def taylor_error(heights: NDArray[np.float64], kappa: float, terms: int) -> float:
    """Error of the orders' powers by Σ (iκ)ⁿ/n! DFT[hⁿ], stored and summed in single precision.

    Parameters
    ----------
    heights : (ny, nx) µm.
    kappa : rad/µm.
    terms : n = 0 … terms − 1, as the thesis counts them.
    """
    exact = np.abs(np.fft.ifft2(np.exp(1j * kappa * heights))) ** 2
    total = np.zeros(heights.shape, np.complex64)
    weight = np.complex64(1.0)
    with np.errstate(all="ignore"):
        for n in range(terms):
            term = np.fft.ifft2(heights**n).astype(np.complex64)
            total += weight * term
            weight = np.complex64(weight * 1j * kappa / (n + 1))
        power = np.abs(total.astype(complex)) ** 2
    power[0, 0] = exact[0, 0] = 0.0
    error = float(np.abs(power - exact).sum() / exact.sum())
    return error if np.isfinite(error) else 1e30


def _rough() -> NDArray[np.float64]:
    """A random surface that tiles, from 0 to 1."""
    noise = np.fft.fft2(np.random.default_rng(1).normal(size=(_SIDE, _SIDE)))
    q = 2.0 * np.pi * np.fft.fftfreq(_SIDE, _PIXEL)
    heights = np.fft.ifft2(noise * np.exp(-0.05 * (q**2 + q[:, None] ** 2))).real
    return np.asarray((heights - heights.min()) / np.ptp(heights))
