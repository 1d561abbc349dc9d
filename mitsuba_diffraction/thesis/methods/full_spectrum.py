"""Uniform sampling of the whole spectrum: `flss`, and the package's own look-up, `default`.

Both sum the same integral over the same wavelengths; they differ in the series that gives S.
"""

from __future__ import annotations

from ...errors import DiffractionError
from ...optics.geometry import diffraction_coordinates, wavenumber
from ...tables.table import DiffractionTable
from .method import Array, UniformMethod


class FullSpectrum(UniformMethod):
    """S from a table at every wavelength of a uniform grid, summed by the trapezoidal rule.

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
       in the middle; bin 0's own series is `table.order_0`, and its lobe is added wherever the
       taps are.
    3. S = |P|² (`coherence="patch"`), or Σ_j g_j²·|a_j|² (`ensemble`). The terms are summed
       before they are squared.
    4. XYZ = Σ_k step·(½ at both ends)·f(λ_k)·s̄(λ_k), where
       f = (1 + ωi·ωo)²·4πσ²·S/(λ_k² w² cosθi cosθo), or C·S for relative reflectance.

    `default` reads |a_j|² (or a_j) from the table's own series instead (`tables.expansion`).

    Parameters
    ----------
    name : for messages.
    table : series of S, over at least the wavelength range.
    wavelength_range, step : nm.

    Raises
    ------
    DiffractionError
        If range and step do not fit each other or the table.
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
                f"shortest wavelength, {table.wavelength_range[0]:g} nm; build one for it"
            )

    def window_sum(self, wi: Array, wo: Array, wavelength: Array) -> Array:
        """S from the table."""
        k = wavenumber(wavelength)
        u, v, w = diffraction_coordinates(wi, wo)
        return self.table.window_sum(k * u, k * v, k * w)
