"""Interface of methods: a spectrum for direction pairs, and the rule that sums it to colours.

`flss` and the package's `default` sum one integral over the same wavelengths (`FullSpectrum`); they
differ in the series that approximates S.

Relative reflectance, as the thesis defines it, divides the reflected radiance by the radiance of a
flat mirror of the same material lit and seen along the normal. With S(ωi, ωo; λ) = ⟨|P|²⟩ under the
window, normalised to 1 for that mirror, the BRDF (Stam 1999, eq. 7) becomes

    ρ(λ) = C(ωi, ωo)·S,   C = F²(ωi, ωo)/F²(ω0, ω0) · (1 + ωi·ωo)²/(w² cosθo) · G,

with w = cosθi + cosθo and Schlick's F. So ρ has neither 1/λ² nor the window's area: blue is weaker
against red, by up to (λ_blue/λ_red)², than in the BRDF f(λ) = (1 + ωi·ωo)² 4πσ²·S /
(λ² w² cosθi cosθo). The thesis has F², although Schlick's F already is a power, and the shadowing G
of V-shaped grooves. `Gain` has both, to reproduce the thesis' pictures; the BRDF has neither.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...arrays import Real
from ...errors import DiffractionError, check_choice
from ...optics.colour import linear_srgb, response
from ...optics.geometry import diffraction_coordinates, kirchhoff_factor, wavenumber
from ...progress import Progress
from ...tables import DiffractionTable

SHADOWINGS = ("none", "vcavity")

#: Wavelength whose value sets the brightness of white around the mirror direction, nm: the eye's
#: sensitivity is largest there.
SPECULAR_WAVELENGTH = 555.0
_FINEST_STEP = 0.1  # least step between wavelengths, nm
_PAIRS = 4096  # direction pairs that a thread evaluates at a time


@dataclass(frozen=True)
class Gain:
    """Gain factor C of the thesis' relative reflectance.

    Raises a DiffractionError if a parameter is out of range.

    Parameters
    ----------
    int_ior : index of refraction of the material against air, above 1; 1.5 for shed snake skin.
    shadowing : "vcavity", as in the thesis, or "none".
    """

    int_ior: float = 1.5
    shadowing: str = "vcavity"

    def __post_init__(self) -> None:
        if not 1.0 < self.int_ior < 100.0:
            raise DiffractionError(
                f"int_ior={self.int_ior:g} must be above 1 and below 100 for relative reflectance, "
                "which is relative to a mirror of that index"
            )
        check_choice("shadowing", self.shadowing, SHADOWINGS)

    def factor(self, wi: NDArray[np.float64], wo: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return C, dimensionless, shape (n,), of unit vectors (n, 3); 0 below the surface.

        G = min(1, 2(n·h)(n·ωi)/(ωo·h), 2(n·h)(n·ωo)/(ωo·h)) (Blinn 1977; Stam 1999, appendix), and
        F = F0 + (1 − F0)(1 − h·ωo)⁵ with F0 = ((n − 1)/(n + 1))² (Schlick 1994).
        """
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        cos_i, cos_o = (np.where(above, d[:, 2], 1.0) for d in (wi, wo))
        w = cos_i + cos_o
        length = np.sqrt(np.sum((wi + wo)[:, :2] ** 2, axis=1) + w * w)  # |ωi + ωo| = 2 h·ωo
        one_plus_dot = 0.5 * length**2
        f0 = ((self.int_ior - 1.0) / (self.int_ior + 1.0)) ** 2
        fresnel = f0 + (1.0 - f0) * (1.0 - np.minimum(0.5 * length, 1.0)) ** 5
        gain = (fresnel / f0) ** 2 * one_plus_dot**2 / (w * w * cos_o)
        if self.shadowing == "vcavity":
            gain *= np.minimum(1.0, 2.0 * w * np.minimum(cos_i, cos_o) / one_plus_dot)
        return np.where(above, gain, 0.0)


class Method(ABC):
    """BRDF at single wavelengths, and its sum over wavelengths to colours.

    Directions are unit vectors (n, 3) or (3,) in the patch's frame, both pointing away from the
    surface. The surface reflects everything (R = 1) above the horizon, and nothing below it.

    Attributes
    ----------
    name : one of `NAMES`.
    sigma : σ of the Gaussian window, µm; 4πσ² is the coherent area.
    wavelength_range : range of the sum to colours, nm.
    """

    name: str
    sigma: float
    wavelength_range: tuple[float, float]

    @abstractmethod
    def window_sum(self, wi: Real, wo: Real, wavelength: Real) -> Real:
        """Return S = ⟨|P|²⟩/(2πσ²)², shape (n,), dimensionless: 1 in a flat mirror's direction.

        Parameters
        ----------
        wi, wo : (n, 3), above the surface.
        wavelength : (n,), nm.
        """

    @abstractmethod
    def samples(self, wi: Real, wo: Real) -> Iterator[tuple[Real, Real]]:
        """Yield wavelengths (n,) and their weights (n,), both nm; weight 0 excludes a pair."""

    def white_pairs(self, wi: Real, wo: Real) -> NDArray[np.bool_]:
        """Return the pairs (n,) whose colour is white, as bright as at `SPECULAR_WAVELENGTH`."""
        return np.zeros(len(wi), bool)

    def brdf(self, wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike) -> Real:
        """Return the BRDF f = (1 + ωi·ωo)²·4πσ²·S / (λ² w² cosθi cosθo) in 1/sr, shape (n,).

        `FullSpectrum` has the mirror's lobe as order 0 (`tables.lookup.brdf`).

        wavelength : (n,) or scalar, nm.
        """
        return self._value(wi, wo, wavelength, None)

    def relative(
        self, wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike, gain: Gain | None = None
    ) -> Real:
        """Return the thesis' relative reflectance ρ = C·S (see `Gain`), shape (n,)."""
        return self._value(wi, wo, wavelength, gain or Gain())

    def xyz(
        self,
        wi: ArrayLike,
        wo: ArrayLike,
        *,
        gain: Gain | None = None,
        progress: Progress | None = None,
    ) -> Real:
        """Return X, Y, Z under D65, (n, 3): Σ value·s̄(λ)·weight over the method's wavelengths.

        s̄ = S_D65·(x̄, ȳ, z̄)/∫S_D65·ȳ dλ (`colour.response`), so that a value that does not depend on
        the wavelength has the white of D65 and Y equal to the value.

        Parameters
        ----------
        gain : sum the relative reflectance with this gain factor instead of the BRDF.
        progress : called as progress(done, total, text).
        """
        incident, outgoing = self._pairs(wi, wo)
        result = np.zeros((len(incident), 3))
        starts = range(0, len(incident), _PAIRS)

        def chunk(start: int) -> None:
            """Evaluate the pairs above the surface from index `start` on."""
            part = slice(start, start + _PAIRS)
            above = (incident[part, 2] > 0) & (outgoing[part, 2] > 0)
            rows = np.flatnonzero(above) + start
            result[rows] = self._xyz(incident[rows], outgoing[rows], gain)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            for done, _ in enumerate(pool.map(chunk, starts)):
                if progress is not None:
                    progress(done + 1, len(starts), f"evaluating {self.name}")
        return result

    def linear_srgb(self, wi: ArrayLike, wo: ArrayLike, **options: Any) -> Real:
        """Return `xyz` in linear sRGB, (n, 3); components outside the gamut are negative.

        options : of `xyz`.
        """
        return np.asarray(linear_srgb(self.xyz(wi, wo, **options)), np.float64)

    def _xyz(self, wi: Real, wo: Real, gain: Gain | None) -> Real:
        """Return X, Y, Z of pairs above the surface."""
        total = np.zeros((len(wi), 3))
        white = self.white_pairs(wi, wo)
        if white.any():
            wavelength = np.full(white.sum(), SPECULAR_WAVELENGTH)
            value = self._scaled(wi[white], wo[white], wavelength, gain)
            total[white] = value[:, None] * self._white()
        for wavelengths, weights in self.samples(wi, wo):
            on = (weights > 0) & ~white
            if not on.any():
                continue
            lam = wavelengths[on]
            value = self._scaled(wi[on], wo[on], lam, gain) * weights[on]
            total[on] += value[:, None] * response(lam)
        return total

    def _white(self) -> Real:
        """Return X, Y, Z (3,) of a reflectance of 1 over the method's range."""
        lam = np.arange(self.wavelength_range[0], self.wavelength_range[1] + 0.5)
        return np.asarray(scipy.integrate.trapezoid(response(lam), lam, axis=0))

    def _value(
        self, wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike, gain: Gain | None
    ) -> Real:
        """Check directions and wavelengths; return f, or ρ with a gain factor, (n,)."""
        incident, outgoing = self._pairs(wi, wo)
        lam = np.broadcast_to(np.asarray(wavelength, float), len(incident))
        if not np.all(lam > 0):
            raise DiffractionError("wavelength must be positive, in nm")
        above = (incident[:, 2] > 0) & (outgoing[:, 2] > 0)
        result = np.zeros(len(incident))
        result[above] = self._scaled(incident[above], outgoing[above], lam[above], gain)
        return result

    def _scaled(self, wi: Real, wo: Real, wavelength: Real, gain: Gain | None) -> Real:
        """Return f, or ρ with a gain factor, (n,), of pairs above the surface."""
        s = self.window_sum(wi, wo, wavelength)
        if gain is not None:
            return gain.factor(wi, wo) * s
        area = 4.0 * np.pi * self.sigma**2
        return kirchhoff_factor(wi, wo, wavelength, self.sigma) * (np.pi * self.sigma**2 * area) * s

    @staticmethod
    def _pairs(wi: ArrayLike, wo: ArrayLike) -> tuple[Real, Real]:
        """Check directions and broadcast them to (n, 3)."""
        incident, outgoing = (np.atleast_2d(np.asarray(d, float)) for d in (wi, wo))
        try:
            incident, outgoing = np.broadcast_arrays(incident, outgoing)
        except ValueError:
            incident = incident[:0, :2]
        if incident.ndim != 2 or incident.shape[-1] != 3:
            raise DiffractionError(
                f"wi has shape {np.shape(wi)} and wo {np.shape(wo)}; both must be (n, 3) or (3,)"
            )
        return incident, outgoing


class UniformMethod(Method):
    """Method that sums over one uniform grid of wavelengths for all pairs.

    wavelengths, weights : nodes and weights of the trapezoidal rule, (n,), nm.
    """

    wavelengths: Real
    weights: Real

    def _sum_over(self, wavelength_range: tuple[float, float], step: float) -> None:
        """Set the grid of wavelengths."""
        self.wavelength_range = wavelength_range
        self.wavelengths, self.weights = trapezoid_rule(wavelength_range, step)

    def samples(self, wi: Real, wo: Real) -> Iterator[tuple[Real, Real]]:
        """Yield every wavelength of the grid for all pairs."""
        ones = np.ones(len(wi))
        for wavelength, weight in zip(self.wavelengths, self.weights, strict=True):
            yield wavelength * ones, weight * ones


def trapezoid_rule(
    wavelength_range: tuple[float, float], step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return wavelengths λ_min, λ_min + step, … and their weights, nm.

    The last interval may be shorter than `step`.

    Raises a DiffractionError if the range is empty or the step is too small or longer than the
    range.
    """
    low, high = wavelength_range
    if not (0.0 < low < high < np.inf):
        raise DiffractionError(
            f"wavelength_range={low:g}, {high:g} nm is empty; give the shortest first, both above "
            "0, e.g. 380 to 780"
        )
    if not _FINEST_STEP <= step <= (high - low) * (1.0 + 1e-12):
        raise DiffractionError(
            f"step={step:g} nm does not fit the range of {low:g} to {high:g} nm; it must be from "
            f"{_FINEST_STEP:g} to {high - low:g} nm"
        )
    count = int((high - low) / step * (1.0 + 1e-12))
    nodes = low + step * np.arange(count + 1, dtype=np.float64)
    if high - nodes[-1] > 1e-9 * high:
        nodes = np.append(nodes, high)
    ends = np.concatenate([nodes[:1], nodes, nodes[-1:]])
    return nodes, 0.5 * (ends[2:] - ends[:-2])


class FullSpectrum(UniformMethod):
    """`default` and `flss`: S from a table on a uniform grid of wavelengths, trapezoidal rule.

    For a direction pair with (u, v, w) = ωi + ωo and each λ_k = λ_min + k·step up to λ_max
    (thesis, fragment shader, lines 4–26; Stam 1999, eq. 7–12):

    1. k = 2π/λ_k with λ in µm; the look-up position in bins is x = k·u·Lx/2π, y = k·v·Ly/2π, with
       the patch's extents Lx, Ly in µm (thesis, eq. for s(u) = u·N·dH/λ).
    2. `flss`: P = Σ_j exp(−(s_x²(x − j_x)² + s_y²(y − j_y)²)/2) · a_j, s_x = σ·2π/Lx, over the
       `taps` bins j nearest to (x, y) (counted from floor(x) for even, round(x) for odd `taps`,
       `tables.window`), with the Taylor series
       a_j = δ_j0 + Σ_{n=1..N} (kwH/2)ⁿ/n! · t_nj,
       t_nj = iⁿ·(−1)^(j_x + j_y) · mean over pixels of (2h/H)ⁿ·exp(+i q_j·r),
       where heights are centred, h ∈ ±H/2, and (−1)^(j_x + j_y) moves the window to the patch's
       centre. t_nj is `table.coefficients[0, row, column, :, n − 1]` (real, imaginary), bin (0, 0)
       in the middle; the series of bin 0 is `table.order_0`, and its lobe is added whichever bins
       are read.
    3. S = |P|² (`coherence="patch"`), or Σ_j g_j²·|a_j|² (`ensemble`). The terms are summed
       before they are squared.
    4. XYZ = Σ_k step·(½ at both ends)·f(λ_k)·s̄(λ_k), where
       f = (1 + ωi·ωo)²·4πσ²·S/(λ_k² w² cosθi cosθo), or C·S for relative reflectance. Order 0
       of f is the mirror's lobe of the model instead (`tables.lookup.brdf`).

    `default` reads |a_j|² (or a_j) from the series in κ of `tables.expansion` instead.

    Raises a DiffractionError if the step is longer than the range, or the range begins below the
    table's.

    Parameters
    ----------
    name : name in messages.
    table : series of S, over at least the wavelength range.
    wavelength_range, step : nm.
    """

    def __init__(
        self,
        name: str,
        table: DiffractionTable,
        wavelength_range: tuple[float, float] = (380.0, 780.0),
        step: float = 5.0,
    ) -> None:
        self.name, self.table = name, table
        self.sigma = table.sigma
        self._sum_over(wavelength_range, step)
        if wavelength_range[0] < table.wavelength_range[0] * (1.0 - 1e-9):
            raise DiffractionError(
                f"wavelength_range begins at {wavelength_range[0]:g} nm, below the table's "
                f"shortest wavelength, {table.wavelength_range[0]:g} nm; build a table for it"
            )

    def window_sum(self, wi: Real, wo: Real, wavelength: Real) -> Real:
        """Return S from the table."""
        k = wavenumber(wavelength)
        u, v, w = diffraction_coordinates(wi, wo)
        return self.table.window_sum(k * u, k * v, k * w)

    def _scaled(self, wi: Real, wo: Real, wavelength: Real, gain: Gain | None) -> Real:
        """Return f of the table, or ρ with a gain factor."""
        if gain is None:
            return self.table.brdf(wi, wo, wavelength)
        return super()._scaled(wi, wo, wavelength, gain)
