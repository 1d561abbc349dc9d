"""Exact second order of the small-slope approximation on periodic surfaces.

Voronovich 1994 (Waves in Random Media 4, 337) adds to the first order's boundary matrix B what the
second term of perturbation lacks. With B₂ that term's kernel, ĥ and a spectra of the heights and of
exp(−iQh), Q = q + q0, and u all waves in between, evanescent ones too, an order has the amplitude

    R(k) = 2 q0/Q · [B (a(k−k0) + iQ/2 (ha)(k−k0))
                     + i/4 Σ_u B₂(k,k0;u) (ĥ(k−u) a(u−k0) + a(k−u) ĥ(u−k0))].

Its mean over the phases of Gaussian heights would be cheap, a factor of two directions:

    R(k) = 2 q0/Q · a(k−k0) [B (1 + Q²σ²/2) + Q/4 Σ_u B₂(k,k0;u) (|ĥ(k−u)|² + |ĥ(u−k0)|²)].

B and B₂ are from `rayleigh`'s equations: R = −2i q0 B ĥ + q0 Σ_u B₂ ĥ ĥ. Lengths over 2π/λ.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.optics.second_order import Perturbation

from .cases import index_of
from .compare import GRAZING, scans_of
from .crossed import is_crossed
from .model import in_plane
from .patch_solutions import solved
from .patches import KINDS, cell, patch_index
from .rayleigh import Complex, Real, Waves
from .solutions import shipped

#: The first order, with the mean of the second, and with all of it.
MODELS = ("first", "mean", "second")

#: Waves in between, of gratings and of cells.
_HARMONICS = (201, 1999)
#: Steepest gratings, depth over period.
DEEPEST = 0.13
GROUPS = {
    "sinusoid": "sinusoids in any mount",
    "crossed": "crossed grating",
    "elaphe": "cuts of scales",
    "elaphe_like": "cuts of scales",
    "cd_pits": "CD's pits",
}


def amplitudes(
    field: HeightField,
    index: complex,
    wavelength: float,
    wi: Real,
    wo: Real,
    orders: NDArray[np.int64],
) -> dict[str, Complex]:
    """Amplitudes (n, 2, 2) of orders (n, 2) along wo, by each of `MODELS`; columns are s and p."""
    waves = Waves(field, index, wavelength, wi, _HARMONICS[int(is_crossed(field))])
    first, second = coefficients(waves, index, orders)
    heights = (field.heights - field.heights.mean()) * waves.k
    into, out = waves.orders, orders[:, None] - waves.orders
    before, after = at(heights, into), at(heights, out)
    by_model = {name: np.empty_like(first) for name in MODELS}
    for n, kappa in enumerate(wi[2] + wo[:, 2]):
        screen = 2 * wi[2] / kappa * np.exp(-1j * kappa * heights)
        amplitude, moment = (at(part, orders[n]) for part in (screen, heights * screen))
        variances = np.abs(after[n]) ** 2 + np.abs(before) ** 2
        pairs = after[n] * at(screen, into) + before * at(screen, out[n])
        mean, whole = (np.tensordot(part, second[n], axes=1) for part in (variances, pairs))
        mean += 2 * kappa * np.mean(heights**2) * first[n]
        by_model["first"][n] = amplitude * first[n]
        by_model["mean"][n] = amplitude * (first[n] + 0.25 * kappa * mean)
        by_model["second"][n] = (amplitude + 0.5j * kappa * moment) * first[n] + 0.25j * whole
    return by_model


def coefficients(
    waves: Waves, index: complex, orders: NDArray[np.int64]
) -> tuple[Complex, Complex]:
    """B (n, 2, 2) and B₂ (n, waves, 2, 2) of orders (n, 2), between `second_order.axes`."""
    rows = [int((waves.orders == order).all(axis=1).argmax()) for order in orders]
    tangential = waves.above[:, :2].real
    light = Perturbation(-waves.incident[0].real, index)
    return light.first(tangential[rows]), light.second(tangential[rows][:, None], tangential)


def at(function: NDArray[np.inexact], orders: NDArray[np.int64]) -> Complex:
    """Fourier coefficients of orders (..., 2) of a function on pixels (ny, nx)."""
    ny, nx = function.shape
    inside = (2 * np.abs(orders) < [nx, ny]).all(axis=-1)
    spectrum = np.fft.fft2(function) / function.size
    return np.where(inside, spectrum[orders[..., 1] % ny, orders[..., 0] % nx], 0.0)


@dataclass(frozen=True)
class Case:
    """Deviation of colours by each model on one solution, and all light over the rigorous."""

    group: str
    deviation: dict[str, float]
    light: dict[str, float]


def cases_of_cells(material: str, kinds: Sequence[str] = KINDS) -> Iterator[Case]:
    """Compare the stored solutions of cells of these kinds."""
    for solution in solved(material)[0]:
        surface = solution.case.surface
        if surface.kind in kinds:
            field, index = cell(surface), patch_index(material, solution.case.wavelength)
            orders = np.stack([solution.rows["mx"], solution.rows["my"]], axis=1).astype(np.int64)
            light = field, index, solution.case.wavelength, solution.wi, solution.wo(field), orders
            group = f"{material}, {GROUPS[surface.kind]}, slope {surface.slope:.2g}"
            yield _case(group, light, solution.efficiency(field))


def cases_of_gratings(material: str) -> Iterator[Case]:
    """Compare the stored solutions of gratings."""
    solutions = shipped(material).trusted()
    for grating, theta, wavelength, members in scans_of(solutions.rows):
        if grating.depth <= DEEPEST * grating.period:
            numbers = solutions.rows["order"][members].astype(np.int64)
            sine = np.sin(np.radians(theta))
            wi, wo = in_plane(sine), in_plane(numbers * wavelength / 1e3 / grating.period - sine)
            orders = np.stack([numbers, 0 * numbers], axis=1)
            light = grating.heights(), index_of(material, wavelength), wavelength, wi, wo, orders
            yield _case(f"{material}, {grating.profile}", light, solutions.mean[members])


def _case(
    group: str,
    light: tuple[HeightField, complex, float, Real, Real, NDArray[np.int64]],
    truth: Real,
) -> Case:
    wi, wo, orders = light[3:]
    powers = {
        name: 0.5 * np.sum(np.abs(amplitude) ** 2, axis=(1, 2)) * wo[:, 2] / wi[2]
        for name, amplitude in amplitudes(*light).items()
    }
    return scored(group, powers, truth, wo, orders)


def scored(
    group: str, powers: dict[str, Real], truth: Real, wo: Real, orders: NDArray[np.int64]
) -> Case:
    """Efficiencies (n,) of orders (n, 2) along wo, by several models, beside the rigorous."""
    keep = orders.any(axis=1) & (wo[:, 2] >= np.cos(np.radians(GRAZING)))
    return Case(
        group,
        {
            name: float(np.abs(p - truth)[keep].sum() / truth[keep].sum())
            for name, p in powers.items()
        },
        {name: float(p.sum() / truth.sum()) for name, p in powers.items()},
    )
