"""Directions where a patch sends light, and the exact answer there (NumPy only)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...heights.field import HeightField
from ...optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from ...progress import Progress
from ...reference import window_power
from ...tables.table import DiffractionTable

Array = NDArray[np.float64]


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
