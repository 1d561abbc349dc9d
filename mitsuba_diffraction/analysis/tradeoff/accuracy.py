"""Errors of tables where a patch sends light, of sums over the spectrum, and over depth (NumPy).

`Sample` has the exact answer at pairs of directions, `measure_wavelengths` the error of a sum by
its step and the noise by the number of wavelengths per ray, `measure_depths` the depth at which
Taylor's series diverges in single precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from ...heights import HeightField
from ...optics.colour import delta_e, linear_srgb, response
from ...optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from ...progress import Progress, silent
from ...reference import window_power
from ...reference.arguments import sigmas_of
from ...tables import DiffractionTable
from ...tables.table import q_limit_of

#: Steps of a sum over wavelengths, nm.
STEPS = (2.0, 5.0, 10.0, 20.0, 40.0)
#: Numbers of wavelengths per ray.
COUNTS = (1, 2, 4, 8, 16)
_FIRST, _LAST, _FINEST = 380.0, 780.0, 0.5  # range and step of the exact sum, nm
_DRAWS = 256  # rays for each pair
#: Number of terms in the thesis' shaders.
TERMS = 37
#: Largest κ of visible light: normal incidence and return at 380 nm, rad/µm.
KAPPA = q_limit_of((380.0, 780.0))
_SIDE, _PIXEL = 48, 0.1  # pixels a side of the patch whose depth varies, and their size, µm


def uniform_directions(n: int, rng: np.random.Generator, lowest: float = 0.1) -> Real:
    """Draw unit vectors (n, 3), uniform above cosθ = lowest, exact in single precision."""
    z = rng.uniform(lowest, 1.0, n)
    phi = rng.uniform(0.0, 2 * np.pi, n)
    r = np.sqrt(1.0 - z * z)
    return as_single(np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1))


def as_single(values: Real) -> Real:
    """Round values to single precision, so that NumPy and Dr.Jit get the same input."""
    return values.astype(np.float32).astype(np.float64)


class LitPairs(NamedTuple):
    """Pairs of directions and wavelengths, exact in single precision."""

    wi: Real  # (n, 3)
    wo: Real  # (n, 3)
    wavelength: Real  # (n,) nm
    near: NDArray[np.bool_]  # (n,) whether the pair lies within 3/σ of order 0


def lit_pairs(field: HeightField, sigma: float, n: int, seed: int) -> LitPairs:
    """Draw pairs of directions and wavelengths, most of them where the patch sends light.

    A quarter lies within the lobe of order 0, a quarter is uniform over the hemisphere, and half
    lies in the lobes of orders drawn by their power: a grating is dark nearly everywhere else.

    Raises a DiffractionError if the patch is flat, and has no such orders.
    """
    rng = np.random.default_rng(seed)
    lx, ly = field.extent
    ny, nx = field.shape
    screen = np.exp(1j * 4 * np.pi / 0.55 * field.heights)  # 550 nm at normal incidence
    power = np.abs(np.fft.ifft2(screen)) ** 2
    power[0, 0] = 0.0
    if field.range == 0.0:
        raise DiffractionError(f"{field.name} is flat and diffracts no light; give another patch")
    bins = rng.choice(power.size, 50 * n, p=power.ravel() / power.sum())
    orders = np.stack(
        [
            2 * np.pi / lx * (np.fft.fftfreq(nx) * nx)[bins % nx],
            2 * np.pi / ly * (np.fft.fftfreq(ny) * ny)[bins // nx],
        ],
        axis=1,
    )
    jitter = rng.normal(0.0, 1.0 / (np.sqrt(2.0) * sigma), (50 * n, 2))
    incident = uniform_directions(50 * n, rng)
    lam = as_single(rng.uniform(380.0, 780.0, 50 * n))
    k = 2e3 * np.pi / lam
    uniform = uniform_directions(50 * n, rng)
    kinds = np.arange(50 * n) % 4
    q = np.where((kinds == 0)[:, None], 0.0, orders) + jitter
    tangential = q / k[:, None] - incident[:, :2]
    z2 = 1.0 - np.sum(tangential**2, axis=1)
    aimed = np.concatenate([tangential, np.sqrt(np.maximum(z2, 0.0))[:, None]], axis=1)
    outgoing = as_single(np.where((kinds == 1)[:, None], uniform, aimed))
    # evanescent and grazing orders are replaced by the next ones of the same kind, or of any
    good = (kinds == 1) | (z2 > 0.01)
    chosen = np.concatenate([np.flatnonzero(good & (kinds == c))[: n // 4] for c in range(4)])
    others = np.setdiff1d(np.flatnonzero(good), chosen)
    chosen = np.concatenate([chosen, others[: n - len(chosen)]])
    wi, wo, lam = incident[chosen], outgoing[chosen], lam[chosen]
    near = np.hypot(*(wi + wo)[:, :2].T) * 2e3 * np.pi / lam * sigma <= 3.0
    return LitPairs(wi, wo, lam, near)


class Sample(NamedTuple):
    """Pairs of directions and wavelengths, and ⟨|P|²⟩ / 4π²σ⁴ of each by `reference`, (n,)."""

    pairs: LitPairs
    exact: Real  # in double precision

    @classmethod
    def draw(
        cls,
        field: HeightField,
        coherence_width: float,
        coherence: str,
        n: int,
        progress: Progress,
    ) -> Sample:
        """Draw n pairs of directions, and compute exact window sums from all pixels."""
        sigmas = sigmas_of(coherence_width, field, coherence)
        pairs = lit_pairs(field, sigma_of(coherence_width), n, seed=20140113)
        exact = np.empty(n)
        for i in range(n):
            wi, wo, wavelength = (values[i : i + 1] for values in pairs[:3])
            exact[i] = window_power(field, wi, wo, wavelength, sigmas, coherence)[0]
            progress(i + 1, n, f"the exact answer, {coherence}")
        return cls(pairs, exact / (4.0 * np.pi**2 * sigmas.orders**4))

    def error(self, sums: Real) -> tuple[float, float]:
        """Return Σ|sums − exact| / Σ exact, near order 0 and elsewhere."""
        difference = np.abs(sums - self.exact)
        parts = self.pairs.near, ~self.pairs.near
        near, far = (float(difference[p].sum() / self.exact[p].sum()) for p in parts)
        return near, far


def window_sums(table: DiffractionTable, wi: Real, wo: Real, wavelength: Real) -> Real:
    """Return window sums of pairs (…, 3) at wavelengths that their shape is broadcast with."""
    k, (u, v, w) = wavenumber(wavelength), diffraction_coordinates(wi, wo)
    return table.window_sum(k * u, k * v, k * w)


@dataclass(frozen=True)
class Spectral:
    """Colour error of sums over wavelengths, and noise of rays."""

    steps: dict[float, float]  # step, nm → mean ΔE2000 from the sum in steps of 0.5 nm
    counts: dict[int, float]  # wavelengths per ray → relative standard deviation of luminance


def measure_wavelengths(
    table: DiffractionTable, wi: NDArray[np.float64], wo: NDArray[np.float64]
) -> Spectral:
    """Measure sums and rays with a table, at pairs (n, 3) of directions."""
    lam = np.arange(_FIRST, _LAST, _FINEST) + 0.5 * _FINEST
    # window sums over λ², up to a factor, (pairs, wavelengths)
    k = wavenumber(lam)
    spectrum = window_sums(table, wi[:, None], wo[:, None], lam) * (k / k.mean()) ** 2
    weights = linear_srgb(response(lam))
    exact = spectrum @ weights * _FINEST
    lit = exact.max(axis=1) > 1e-4 * exact.max()
    steps = {}
    for step in STEPS:
        every = round(step / _FINEST)
        chosen = slice(every // 2, None, every)
        sums = spectrum[:, chosen] @ weights[chosen] * step
        steps[step] = float(np.nanmean(delta_e(exact[lit], sums[lit])))
    luminance = spectrum[lit] * response(lam)[:, 1]
    total = luminance.sum(axis=1) * _FINEST
    rng = np.random.default_rng(0)
    counts = {}
    for count in COUNTS:
        # like Mitsuba: one random number, shifted by 1/count for each further wavelength
        shifted = (rng.random((_DRAWS, 1)) + np.arange(count) / count) % 1.0
        wavelength, density = _draw_wavelengths(shifted)
        values = np.stack(
            [np.interp(wavelength, lam, row, left=0.0, right=0.0) for row in luminance]
        )
        estimate = (values / density).mean(axis=2)
        noise = estimate.std(axis=1) / total
        counts[count] = float(np.sqrt(np.mean(noise**2)))
    return Spectral(steps, counts)


def _draw_wavelengths(u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Map uniform numbers to Mitsuba's wavelengths (nm) and densities: Radziszewski et al. 2009."""
    lam = 538.0 - np.arctanh(0.8569106254698279 - 1.8275019724092267 * u) * 138.88888888888889
    return lam, 0.003939804229326285 / np.cosh(0.0072 * (lam - 538.0)) ** 2


@dataclass(frozen=True)
class Depths:
    """Errors of each series over depth."""

    depth: NDArray[np.float64]  # (n,) µm, peak to valley
    # name of a series → (n,) Σ|power − exact| / Σ exact of all orders but order 0; NaN where the
    # table is refused
    errors: dict[str, NDArray[np.float64]]
    intervals: NDArray[np.int64]  # (n,) intervals of κ in the default series


def measure_depths(count: int, progress: Progress = silent, deepest: float = 20.0) -> Depths:
    """Measure each series' error on a rough patch with `count` depths, 1 nm to `deepest` µm."""
    shape = _rough()
    depths = np.geomspace(1e-3, deepest, count)
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
    """Return the error of orders' powers by Σ (iκ)ⁿ/n! DFT[hⁿ] in single precision.

    Parameters
    ----------
    heights : (ny, nx) µm.
    kappa : rad/µm.
    terms : number of terms, n = 0 … terms − 1.
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
    """Return a random periodic surface with heights from 0 to 1."""
    noise = np.fft.fft2(np.random.default_rng(1).normal(size=(_SIDE, _SIDE)))
    q = 2.0 * np.pi * np.fft.fftfreq(_SIDE, _PIXEL)
    heights = np.fft.ifft2(noise * np.exp(-0.05 * (q**2 + q[:, None] ** 2))).real
    return np.asarray((heights - heights.min()) / np.ptp(heights))
