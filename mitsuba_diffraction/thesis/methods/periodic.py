"""Methods of the thesis for periodic surfaces: `nmm`, `pq` and `rainbow`.

`nmm` evaluates only the wavelengths whose orders reach the view direction, `pq` repeats the patch
without any other window, and `rainbow` has colours from the period of a grating alone (NumPy only).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError, check_choice
from ...optics.colour import response
from ...optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from ...tables import GLOSSY_RADIUS, DiffractionTable
from ...tables.lookup import Kernel, order_0_sum, weighted_sum
from .method import SPECULAR_WAVELENGTH, FullSpectrum, Gain, Method, UniformMethod
from .periods import Period

#: Choices of `weights` in `OrdersOnly`, and of `interpolation` in `Repeated`.
WEIGHTS, INTERPOLATIONS = ("step", "lobe"), ("linear", "sinc")


class OrdersOnly(Method):
    """`nmm`: S of `flss`, at the wavelengths λₙ = d·|u|/n (and d·|v|/n) alone.

    For a direction pair with (u, v, w) = ωi + ωo (thesis, "NMM approach", d is the period):

    1. Where hypot(u, v) < ε the colour is white, as bright as at 555 nm: near the mirror direction
       n_min…n_max holds too few wavelengths or none. ε = 3/(σ k(λ_max)) by default, where order
       0's lobe ends at the longest wavelength.
    2. Elsewhere, for n from n_min = ⌈d|u|/λ_max⌉ (at least 1) to n_max = ⌊d|u|/λ_min⌋, every
       λₙ = d|u|/n adds f(λₙ)·s̄(λₙ)·Δλₙ, and so does every λₙ = d|v|/n if there is a period along
       y. A wavelength that both reach is added twice, as in the thesis.

    `weights` selects Δλₙ. "step", as in the thesis, is the step of the full sum (5 nm) for every
    wavelength. The shorter the λₙ, the closer together they lie and the narrower are their lobes,
    so the sum is too blue: the known purple shift. "lobe" is
    ∫exp(−σ²(k·u − 2πn/d)²)dλ = λₙ²/(2√π·σ·|u|), the width in wavelength of a perfect grating's
    lobe; it is exact where the lobes of neighbouring orders do not overlap.

    Light between orders, and light of a surface that is not periodic, is lost: `brdf` and
    `relative` equal `flss` within half a step of a λₙ and around the mirror direction, and
    are 0 elsewhere.

    Parameters
    ----------
    full : method whose table is sampled.
    periods : (dx, dy) in µm; at most one is `None`: no period along that axis.
    weights : "step" or "lobe".
    specular : ε, or `None` for the default.
    """

    name = "nmm"

    def __init__(
        self,
        full: FullSpectrum,
        periods: tuple[float | None, float | None],
        *,
        weights: str = "step",
        specular: float | None = None,
    ) -> None:
        check_choice("weights", weights, WEIGHTS)
        if periods[0] is None and periods[1] is None:
            raise DiffractionError("method 'nmm' needs a period along x or y; give one in µm")
        self.full, self.periods, self.weighting = full, periods, weights
        self.sigma, self.wavelength_range = full.sigma, full.wavelength_range
        longest = float(wavenumber(full.wavelength_range[1]))
        self.specular = GLOSSY_RADIUS / (full.sigma * longest) if specular is None else specular
        if not 0.0 <= self.specular < 2.0:
            raise DiffractionError(f"specular={self.specular:g} must be at least 0 and below 2")
        self._step = float(np.diff(full.wavelengths).max())

    def window_sum(self, wi: Real, wo: Real, wavelength: Real) -> Real:
        """Return S of `flss` at sampled wavelengths, and 0 at others."""
        sampled = self._sampled(wi, wo, wavelength)
        result = np.zeros(len(wi))
        result[sampled] = self.full.window_sum(wi[sampled], wo[sampled], wavelength[sampled])
        return result

    def white_pairs(self, wi: Real, wo: Real) -> NDArray[np.bool_]:
        """Return the pairs within ε of the mirror direction."""
        u, v, _ = diffraction_coordinates(wi, wo)
        return np.asarray(np.hypot(u, v) < self.specular)

    def samples(self, wi: Real, wo: Real) -> Iterator[tuple[Real, Real]]:
        """Yield λₙ and Δλₙ, order by order, first along x and then along y."""
        u, v, _ = diffraction_coordinates(wi, wo)
        for period, frequency in zip(self.periods, (u, v), strict=True):
            if period is not None:
                for _, lam, in_range in _orders(period, frequency, self.wavelength_range):
                    yield lam, np.where(in_range, self._width(lam, frequency), 0.0)

    def _sampled(self, wi: Real, wo: Real, wavelength: Real) -> NDArray[np.bool_]:
        """Return whether a λₙ is within half a step, or the pair is near the mirror direction."""
        u, v, _ = diffraction_coordinates(wi, wo)
        sampled = np.hypot(u, v) < self.specular
        for period, frequency in zip(self.periods, (u, v), strict=True):
            if period is not None:
                path = 1e3 * period * np.abs(frequency)
                nearest = np.maximum(np.round(path / wavelength), 1.0)
                sampled |= np.abs(path / nearest - wavelength) <= 0.5 * self._step
        return np.asarray(sampled)

    def _width(self, wavelength: Real, frequency: Real) -> Real:
        """Return Δλₙ in nm."""
        if self.weighting == "step":
            return np.full(len(wavelength), self._step)
        slope = np.maximum(np.abs(frequency), 1e-12)
        return 1e-3 * wavelength**2 / (2.0 * math.sqrt(math.pi) * self.sigma * slope)


def _orders(
    period: float, frequency: Real, wavelength_range: tuple[float, float]
) -> Iterator[tuple[int, Real, NDArray[np.bool_]]]:
    """Yield the orders of a period in µm at frequencies (n,).

    Each is the order n, its wavelengths λₙ (n,) in nm, and whether they are in the range.
    """
    low, high = wavelength_range
    path = 1e3 * period * np.abs(frequency)  # λ₁, nm
    for n in range(1, math.floor(path.max(initial=0.0) / low) + 1):
        wavelength = path / n
        in_range = (low <= wavelength) & (wavelength <= high)
        yield n, np.where(in_range, wavelength, high), in_range


class Repeated(UniformMethod):
    """`pq`: light is coherent over a rectangle of whole patches.

    With the patch's extents Lx, Ly and x = k·u·Lx/2π, y = k·v·Ly/2π in bins (thesis, "PQ
    factors"; the sum over copies is a geometric series):

        S = |B(x, y)|² · D(2πx; N₁)² · D(2πy; N₂)²,
        D(t; N) = |sin(N t/2) / (N sin(t/2))|, and 1 where t is a multiple of 2π,

    the stable form of the thesis' p + iq; N is the number of copies, N + 1 in the thesis. B is the
    Fourier transform of exp(iκh) over one patch, from the DFT a_j about the patch's centre (about
    its corner, neighbouring bins would cancel):

    - "sinc": B = Σ_j a_j sinc(x − j_x) sinc(y − j_y), exact if all bins are summed; the sum has the
      `taps` bins nearest to (x, y) along each axis, and order 0 always (the thesis has 3);
    - "linear": B = Σ_j a_j (1 − |x − j_x|)(1 − |y − j_y|) over the two nearest bins along each
      axis: inaccurate between bins, where B of a wide patch is not smooth.

    The coherent area is N₁Lx·N₂Ly: f = (1 + ωi·ωo)²·N₁N₂LxLy·S/(λ²w²cosθi cosθo). Lobes have the
    side lobes of a rectangle, and a patch of a surface that is not periodic gets false orders,
    2π/Lx apart. Colours are summed as in `flss`.

    Parameters
    ----------
    table : table with coherence="patch" and enough taps, of any series; the thesis has Taylor's.
    repeats : (N₁, N₂), at least 1 each.
    interpolation : "linear" or "sinc".
    taps : bins read along each axis for "sinc".
    wavelength_range, step : nm.
    """

    def __init__(
        self,
        table: DiffractionTable,
        repeats: tuple[int, int],
        *,
        interpolation: str = "linear",
        taps: int = 8,
        wavelength_range: tuple[float, float] = (380.0, 780.0),
        step: float = 5.0,
        name: str = "pq",
    ) -> None:
        check_choice("interpolation", interpolation, INTERPOLATIONS)
        if min(repeats) < 1 or max(repeats) > 10**6:
            raise DiffractionError(f"repeats={repeats} must be from 1 to 1000000 along each axis")
        if not table.grid.coherent:
            raise DiffractionError("method 'pq' adds amplitudes: its table needs coherence='patch'")
        self.name, self.table, self.repeats = name, table, repeats
        self._kernel: Kernel = np.sinc if interpolation == "sinc" else _tent
        bins = taps if interpolation == "sinc" else 2
        self._taps = (min(bins, table.grid.taps[0]), min(bins, table.grid.taps[1]))
        if interpolation == "linear" and min(self._taps) < 2:
            raise DiffractionError("method 'pq' needs a table of at least 2 taps")
        extents = [2.0 * np.pi / spacing for spacing in table.spacing]
        self.area = repeats[0] * extents[0] * repeats[1] * extents[1]
        self.sigma = float(np.sqrt(self.area / (4.0 * np.pi)))
        self._sum_over(wavelength_range, step)

    def window_sum(self, wi: Real, wo: Real, wavelength: Real) -> Real:
        """Return S = |B|²·D₁²·D₂²."""
        k = wavenumber(wavelength)
        u, v, w = diffraction_coordinates(wi, wo)
        at, kernels = (self.table, k * u, k * v, k * w), (self._kernel, self._kernel)
        amplitude = weighted_sum(*at, kernels, self._taps) + order_0_sum(*at, kernels)
        power: Real = np.abs(amplitude) ** 2
        for frequency, spacing, n in zip((u, v), self.table.spacing, self.repeats, strict=True):
            power = power * copies(k * frequency / spacing, n) ** 2
        return power


def copies(x: Real, n: int) -> Real:
    """Return D = |sin(πnx)/(n sin(πx))| at positions x in bins, 1 at whole numbers.

    x is reduced to the nearest whole number first, which keeps both sines exact.
    """
    fraction = x - np.round(x)
    below = n * np.sin(np.pi * fraction)
    small = np.abs(fraction) < 1e-9
    return np.where(small, 1.0, np.abs(np.sin(np.pi * n * fraction) / np.where(small, 1.0, below)))


def _tent(distance: Real) -> Real:
    """Return the weight 1 − |distance| of linear interpolation."""
    return np.maximum(0.0, 1.0 - np.abs(distance))


class Rainbow(Method):
    """`rainbow`: every order of the grating equation d·|u| = nλ is equally strong.

    Many shaders do this (after Guardado, GPU Gems 2004, chapter 8). It depends neither on heights,
    nor on the direction along the grooves, nor does it decrease towards grazing angles. The light
    of a Lambertian reflector, 1/π, is redistributed over the spectrum by a comb of lines of mean 1,

        f(λ) = 1/π · (2√π σ/d) Σ_n exp(−σ²(k|u| − 2πn/d)²),

    whose integral over wavelength, line by line, is

        XYZ = 1/π · [Σ_{n≥1} s̄(λₙ)·λₙ²/(d|u|) + (2√π σ/d)·exp(−σ²k₅₅₅²u²)·white],  λₙ = d|u|/n.

    The last summand is order 0, the white streak across the mirror direction.

    Parameters
    ----------
    period : period along x or y.
    coherence_width : 4σ in µm, which sets the width of the lines.
    wavelength_range : nm.
    """

    name = "rainbow"

    def __init__(
        self,
        period: Period,
        *,
        coherence_width: float = 65.0,
        wavelength_range: tuple[float, float] = (380.0, 780.0),
    ) -> None:
        self.period, self.sigma = period, sigma_of(coherence_width)
        self.wavelength_range = wavelength_range
        self._density = 2.0 * math.sqrt(math.pi) * self.sigma / period.length

    def window_sum(self, wi: Real, wo: Real, wavelength: Real) -> Real:
        """Return the comb (2√π σ/d) Σ_n exp(−σ²(k|u| − 2πn/d)²), of mean 1 over frequency."""
        line = self._frequency(wi, wo) * wavenumber(wavelength) * self.period.length / (2 * np.pi)
        sharpness = (2.0 * np.pi * self.sigma / self.period.length) ** 2
        # the nearest lines on either side; more only where the window is narrower than a period
        reach = max(1, math.ceil(3.0 / math.sqrt(sharpness)))
        offsets = np.round(line)[:, None] + np.arange(-reach, reach + 1)
        lines = np.exp(-sharpness * (line[:, None] - offsets) ** 2)
        return self._density * lines.sum(axis=1)

    def samples(self, wi: Real, wo: Real) -> Iterator[tuple[Real, Real]]:
        """Yield λₙ and the gaps between them, λₙ²/(d|u|)."""
        frequency = self._frequency(wi, wo)
        for n, lam, in_range in _orders(self.period.length, frequency, self.wavelength_range):
            yield lam, np.where(in_range, lam / n, 0.0)

    def _xyz(self, wi: Real, wo: Real, gain: Gain | None) -> Real:
        self._refuse(gain)
        total = np.zeros((len(wi), 3))
        for wavelength, gap in self.samples(wi, wo):
            total += gap[:, None] * response(wavelength)
        spread = self.sigma * float(wavenumber(SPECULAR_WAVELENGTH)) * self._frequency(wi, wo)
        total += (self._density * np.exp(-(spread**2)))[:, None] * self._white()
        return total / np.pi

    def _scaled(self, wi: Real, wo: Real, wavelength: Real, gain: Gain | None) -> Real:
        self._refuse(gain)
        return self.window_sum(wi, wo, wavelength) / np.pi

    def _frequency(self, wi: Real, wo: Real) -> NDArray[np.float64]:
        """Return |u| along x, or |v| along y, (n,)."""
        u, v, _ = diffraction_coordinates(wi, wo)
        return np.abs(u if self.period.axis == "x" else v)

    def _refuse(self, gain: Gain | None) -> None:
        """Refuse relative reflectance, which needs a mirror to compare with."""
        if gain is not None:
            raise DiffractionError(
                "method 'rainbow' has no relative reflectance, since it has no mirror to compare "
                "with; leave it out, or ask for the BRDF"
            )
