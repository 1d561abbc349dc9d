"""Errors: of tables at directions where a patch sends light, of sums over the spectrum, over depth.

The exact answer at those directions (NumPy only); how fine a sum over the spectrum has to be, and
how many wavelengths a ray should carry; where Taylor's series breaks down in single precision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...optics.colour import delta_e, linear_srgb, response
from ...optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from ...progress import Progress, silent
from ...reference import window_power
from ...tables.table import DiffractionTable, q_limit_of

Array = NDArray[np.float64]

#: nm between the samples of a sum.
STEPS = (2.0, 5.0, 10.0, 20.0, 40.0)
#: Wavelengths of one ray.
COUNTS = (1, 2, 4, 8, 16)
_FIRST, _LAST, _FINEST = 380.0, 780.0, 0.5  # nm
_DRAWS = 256  # rays for each pair
#: Terms of the thesis' shaders.
TERMS = 37
#: Normal incidence and return at 380 nm: the largest κ of the visible.
KAPPA = q_limit_of((380.0, 780.0))
_SIDE, _PIXEL = 48, 0.1  # of the patch that is made deeper: pixels, µm


@dataclass(frozen=True, eq=False)
class Sample:
    """Pairs of directions with the exact window sum for each."""

    # wi, wo: (n, 3), exact in single precision
    wi: Array
    wo: Array
    wavelength: Array  # (n,) nm, likewise
    near: NDArray[np.bool_]  # (n,) whether the pair lies within 3/σ of order 0
    exact: Array  # (n,) ⟨|P|²⟩ / 4π²σ⁴ by `reference`, in double precision

    @classmethod
    def of(
        cls,
        field: HeightField,
        coherence_width: float,
        coherence: str,
        n: int,
        progress: Progress,
    ) -> Sample:
        """n pairs for a patch, by Riemann sums over all of its pixels: slow, and plain."""
        sigma = sigma_of(coherence_width)
        wi, wo, wavelength, near = lit_pairs(field, sigma, n, seed=20140113)
        exact = np.empty(n)
        for i in range(n):
            one = slice(i, i + 1)
            power = window_power(field, wi[one], wo[one], wavelength[one], sigma, coherence)
            exact[i] = power[0]
            progress(i + 1, n, f"the exact answer, {coherence}")
        return cls(wi, wo, wavelength, near, exact / (4.0 * np.pi**2 * sigma**4))

    def error(self, found: Array) -> tuple[float, float]:
        """Σ|found − exact| / Σ exact, near order 0 and elsewhere."""
        difference = np.abs(found - self.exact)
        parts = self.near, ~self.near
        near, far = (float(difference[p].sum() / self.exact[p].sum()) for p in parts)
        return near, far

    def looked_up(self, table: DiffractionTable) -> Array:
        """A table's answer (n,), by its twin in double precision."""
        k, (u, v, w) = wavenumber(self.wavelength), diffraction_coordinates(self.wi, self.wo)
        return table.window_sum(k * u, k * v, k * w)


def uniform_directions(n: int, rng: np.random.Generator, lowest: float = 0.1) -> Array:
    """Unit vectors (n, 3), uniform over the hemisphere above cosθ = lowest, exact in float32."""
    z = rng.uniform(lowest, 1.0, n)
    phi = rng.uniform(0.0, 2 * np.pi, n)
    r = np.sqrt(1.0 - z * z)
    return as_single(np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1))


def as_single(values: Array) -> Array:
    """The values that single precision can hold: then both sides get the same input."""
    return values.astype(np.float32).astype(np.float64)


def lit_pairs(
    field: HeightField, sigma: float, n: int, seed: int
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Direction pairs and wavelengths where the patch sends light, and some where it may not.

    A quarter lies within the lobe of order 0, a quarter is uniform over the hemisphere, and half
    lies in the lobes of orders drawn by their power: a grating is dark nearly everywhere else.

    Returns
    -------
    wi, wo (n, 3), wavelength (n,) in nm, all exact in float32, and (n,) whether the pair lies
    within 3/σ of order 0.
    """
    rng = np.random.default_rng(seed)
    lx, ly = field.extent
    ny, nx = field.shape
    screen = np.exp(1j * 4 * np.pi / 0.55 * field.heights)  # 550 nm, straight down and up again
    power = np.abs(np.fft.ifft2(screen)) ** 2
    power[0, 0] = 0.0
    drawn = rng.choice(power.size, 50 * n, p=power.ravel() / power.sum())
    orders = np.stack(
        [
            2 * np.pi / lx * (np.fft.fftfreq(nx) * nx)[drawn % nx],
            2 * np.pi / ly * (np.fft.fftfreq(ny) * ny)[drawn // nx],
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
    # Orders that do not propagate, or only along the surface, give way to others of their kind
    good = (kinds == 1) | (z2 > 0.01)
    chosen = np.concatenate([np.flatnonzero(good & (kinds == c))[: n // 4] for c in range(4)])
    wi, wo, lam = incident[chosen], outgoing[chosen], lam[chosen]
    near = np.hypot(*(wi + wo)[:, :2].T) * 2e3 * np.pi / lam * sigma <= 3.0
    return wi, wo, lam, near


@dataclass(frozen=True)
class Spectral:
    """Errors of sums, and noise of rays."""

    steps: dict[float, float]  # nm → mean ΔE2000 of a sum with such steps from one of 0.5 nm
    counts: dict[int, float]  # wavelengths of a ray → relative standard deviation of its luminance


def measure_wavelengths(
    table: DiffractionTable, wi: NDArray[np.float64], wo: NDArray[np.float64]
) -> Spectral:
    """From a table, at pairs (n, 3) of directions that it sends light to."""
    lam = np.arange(_FIRST, _LAST, _FINEST) + 0.5 * _FINEST
    spectrum = _spectrum(table, wi, wo, lam)  # (pairs, wavelengths)
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
        # as Mitsuba draws them: one number, shifted by 1/count for each further wavelength
        drawn = (rng.random((_DRAWS, 1)) + np.arange(count) / count) % 1.0
        wavelength, density = _important(drawn)
        found = np.stack(
            [np.interp(wavelength, lam, row, left=0.0, right=0.0) for row in luminance]
        )
        estimate = (found / density).mean(axis=2)
        noise = estimate.std(axis=1) / total
        counts[count] = float(np.sqrt(np.mean(noise**2)))
    return Spectral(steps, counts)


def _spectrum(
    table: DiffractionTable,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    lam: NDArray[np.float64],
) -> NDArray[np.float64]:
    k, (u, v, w) = wavenumber(lam), diffraction_coordinates(wi, wo)
    sums = table.window_sum(k * u[:, None], k * v[:, None], k * w[:, None])
    return sums * (k / k.mean()) ** 2


def _important(u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mitsuba's wavelengths (nm) and their density: after Radziszewski et al. 2009."""
    lam = 538.0 - np.arctanh(0.8569106254698279 - 1.8275019724092267 * u) * 138.88888888888889
    return lam, 0.003939804229326285 / np.cosh(0.0072 * (lam - 538.0)) ** 2


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
