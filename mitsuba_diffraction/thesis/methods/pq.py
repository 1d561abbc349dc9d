"""The thesis' PQ method: the patch repeated N₁ × N₂ times, without any other window."""

from __future__ import annotations

import numpy as np

from ...errors import DiffractionError
from ...optics.geometry import diffraction_coordinates, wavenumber
from ...tables.lookup import Kernel, weighted_sum
from ...tables.table import DiffractionTable
from .method import Array, UniformMethod

INTERPOLATIONS = ("linear", "sinc")


class Repeated(UniformMethod):
    """`pq`: light is coherent over a rectangle of whole patches.

    With the patch's extents Lx, Ly and x = k·u·Lx/2π, y = k·v·Ly/2π in bins (thesis, "PQ
    factors"; the sum over copies is a geometric series):

        S = |B(x, y)|² · D(2πx; N₁)² · D(2πy; N₂)²,
        D(t; N) = |sin(N t/2) / (N sin(t/2))|, and 1 where t is a multiple of 2π,

    the stable form of the thesis' p + iq, with their N + 1 copies called N here. B is the
    Fourier transform of exp(iκh) over one patch, from its DFT a_j about the patch's centre (without
    that phase neighbours would cancel):

    - "sinc": B = Σ_j a_j sinc(x − j_x) sinc(y − j_y), exact if all bins are summed; `taps` of them
      nearest to (x, y) are, and order 0 always (the thesis takes 3);
    - "linear": the same with (1 − |x − j_x|)(1 − |y − j_y|) for the two nearest bins along each
      axis: wrong between bins, where a wide patch's B is not smooth.

    The coherent area is N₁Lx·N₂Ly: f = (1 + ωi·ωo)²·N₁N₂LxLy·S/(λ²w²cosθi cosθo). Its lobes have
    the side lobes of a rectangle, and a patch that does not tile the surface in truth gets false
    orders, 2π/Lx apart. Colours are summed as in `flss`.

    Parameters
    ----------
    table : of any series, with coherence="patch" and enough taps; the thesis' is Taylor's.
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
        if interpolation not in INTERPOLATIONS:
            raise DiffractionError(
                f"interpolation='{interpolation}' is unknown; choose one of "
                f"{', '.join(INTERPOLATIONS)}"
            )
        if min(repeats) < 1 or max(repeats) > 10**6:
            raise DiffractionError(f"repeats={repeats} must be from 1 to 1000000 along each axis")
        if not table.grid.coherent:
            raise DiffractionError("method 'pq' adds amplitudes: its table needs coherence='patch'")
        self.name, self.table, self.repeats = name, table, repeats
        self._kernel: Kernel = np.sinc if interpolation == "sinc" else _tent
        wanted = taps if interpolation == "sinc" else 2
        self._taps = (min(wanted, table.grid.taps[0]), min(wanted, table.grid.taps[1]))
        if interpolation == "linear" and min(self._taps) < 2:
            raise DiffractionError("method 'pq' needs a table of at least 2 taps")
        extents = [2.0 * np.pi / spacing for spacing in table.spacing]
        self.area = repeats[0] * extents[0] * repeats[1] * extents[1]
        self.sigma = float(np.sqrt(self.area / (4.0 * np.pi)))
        self._sum_over(wavelength_range, step)

    def window_sum(self, wi: Array, wo: Array, wavelength: Array) -> Array:
        """|B|²·D₁²·D₂²."""
        k = wavenumber(wavelength)
        u, v, w = diffraction_coordinates(wi, wo)
        amplitude = weighted_sum(
            self.table, k * u, k * v, k * w, (self._kernel, self._kernel), self._taps
        )
        power = np.sum(amplitude**2, axis=1)
        for frequency, spacing, n in zip((u, v), self.table.spacing, self.repeats, strict=True):
            power = power * copies(k * frequency / spacing, n) ** 2
        return power


def copies(x: Array, n: int) -> Array:
    """D = |sin(πnx)/(n sin(πx))| for positions x in bins, 1 at whole numbers.

    x is reduced to the nearest whole number first, which keeps both sines exact.
    """
    fraction = x - np.round(x)
    below = n * np.sin(np.pi * fraction)
    small = np.abs(fraction) < 1e-9
    return np.where(small, 1.0, np.abs(np.sin(np.pi * n * fraction) / np.where(small, 1.0, below)))


def _tent(distance: Array) -> Array:
    return np.maximum(0.0, 1.0 - np.abs(distance))
