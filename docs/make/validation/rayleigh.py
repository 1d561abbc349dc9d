"""Rigorous solutions of shallow smooth surfaces in two dimensions, by Rayleigh's expansion.

The field above the surface is taken for outgoing plane waves down to the surface itself, which
holds for sinusoids up to a steepest slope of 0.448 (Petit and Cadilhac 1966, C. R. Acad. Sci. B
262, 468; Hill and Celli 1978, Physical Review B 17, 2478) and is close for a while beyond. Light in
the material is eliminated, as in the reduced equations of Brown, Celli, Haller and Marvin 1984
(Surface Science 136, 381): a metal's short waves are never expanded, which is where coupled waves
in layers fail.

With (E, H) the field above and (E', H') a plane wave that goes down in the material, of Bloch
vector −u, reciprocity says ∫ (E×H' − E'×H)·n dS = 0 over a period: light in the material goes down,
too. Between waves exp(iκ·r) and exp(iκ'·r), κ = (k, ±q), κ' = (−u, −q'), ∇h is integrated by parts,

    ∫ (−∇h, 1) exp(i(κ+κ')·r) dx dy = (κ+κ')/γ · I(γ),   γ = ±q − q',
    I(γ) = ∫ exp(iγh) exp(i(k−u)·r) dx dy,

and I(γ)/γ is summed as a series of the spectra of hⁿ. Time exp(−iωt), lengths over 2π/λ.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import resample

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.arrays import Complex, Real, Whole
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.reference import boundary
from mitsuba_diffraction.reference.fresnel import decaying_root

from .cases import Case
from .crossed import HORIZON, is_crossed, lowest_orders
from .solutions import Orders

# Terms of the series of exp(iγh) end where they are below this
_PRECISION = 1e-14
# |γh| beyond which the series would cancel to fewer than eight digits
_LARGEST = 18.0


def name() -> str:
    """Name of the solver."""
    return "Rayleigh's expansion, reduced (docs/make/validation/rayleigh.py)"


def resolutions(case: Case) -> tuple[int, int]:
    """Numbers of spatial frequencies that the field is expanded in, first and finally."""
    return (709, 999) if is_crossed(case.field) else (41, 61)


def solve(case: Case, harmonics: int) -> Orders:
    """Amplitudes of every reflected order, or of every order that goes through a dielectric.

    Those that go through have equations of their own: with test waves that go up in the air, whose
    product with all that is reflected carries nothing. That both powers add up to 1 is thus no
    matter of course.

    Parameters
    ----------
    harmonics : as `resolutions`.

    Raises
    ------
    DiffractionError
        If heights are beyond what the series of exp(iγh) can sum.
    """
    assert case.index is not None
    waves, index = Waves(case, harmonics), case.index
    into = waves.incident
    if not case.media.through:
        down = waves.below * [-1, -1, -1]
        tests = axes(down, index)
        reflected = waves.coupling(tests, down, axes(waves.above, 1.0), waves.above)
        incident = waves.coupling(tests, down, axes(into, 1.0), into)
        out = waves.above
        travels = np.where(out[:, 2].imag == 0, out[:, 2].real, 0.0)
        return _orders(waves, case, _solved(reflected, -incident), out, travels)
    up, down = waves.above * [-1, -1, 1], waves.below * [1, 1, -1]
    tests = axes(up, 1.0)
    matrix = waves.coupling(tests, up, axes(down, index), down)
    # the light meets its own test wave alone: γ is 0, and the flux that of a level plane
    right = np.zeros((2 * len(up), 2), complex)
    zeroth = waves.zeroth
    for row, test in enumerate(tests[:, zeroth]):
        for column, e in enumerate(axes(into, 1.0)[:, 0]):
            flux = np.cross(e, np.cross(up[zeroth], test)) - np.cross(test, np.cross(into[0], e))
            right[row * len(up) + zeroth, column] = flux[2]
    return _orders(waves, case, _solved(matrix, right), down / index, waves.below[:, 2].real)


def axes(vector: Complex, index: complex) -> Complex:
    """Electric fields s and p of plane waves κ (..., 3) in a medium, (2, ..., 3).

    s = ẑ×κ̂, p = κ̂×s.
    """
    x, y = vector[..., 0].real, vector[..., 1].real
    length = np.hypot(x, y)
    slanted = length > 1e-12
    safe = np.where(slanted, length, 1.0)
    sine, cosine = np.where(slanted, -y / safe, 0.0), np.where(slanted, x / safe, 1.0)
    fields = np.zeros((2, *vector.shape), complex)
    fields[0, ..., 0], fields[0, ..., 1] = sine, cosine
    z = vector[..., 2] / index
    fields[1, ..., 0], fields[1, ..., 1] = -z * cosine, z * sine
    fields[1, ..., 2] = (x * cosine - y * sine) / index
    return fields


class Waves:
    """The plane waves of a period, κ in units of 2π/λ, in vacuum (above) and the material (below).

    Both go up; `incident` (1, 3) goes down.
    """

    def __init__(self, case: Case, harmonics: int) -> None:
        field, wavelength = case.field, case.light.wavelength
        self.k = float(wavenumber(wavelength))
        crossed = is_crossed(field)
        self.orders = lowest_orders(-case.wi, wavelength / 1000, field.extent, crossed, harmonics)
        tangential = -case.wi[:2] + self.orders * (2 * np.pi / self.k / np.array(field.extent))
        square = np.sum(tangential**2, axis=1)
        above, below = (decaying_root(n**2 - square) for n in (1.0 + 0j, complex(case.index)))
        self.above = np.column_stack([tangential, above])
        self.below = np.column_stack([tangential, below])
        self.zeroth = int(np.flatnonzero((self.orders == 0).all(axis=1))[0])
        self.incident = self.above[self.zeroth : self.zeroth + 1] * [1, 1, -1]
        self._spectra = _Spectra(field, self.k)

    def coupling(self, tests: Complex, to: Complex, fields: Complex, waves: Complex) -> Complex:
        """(κ+κ')·(e×(κ'×e') − e'×(κ×e)) I(γ)/γ of test waves and waves, (2 rows, 2 columns).

        tests, fields : (2, n, 3) s and p fields of test waves `to` (n, 3), and of all waves or the
        incident one.
        """
        columns = self.orders if len(waves) > 1 else self.orders[self.zeroth : self.zeroth + 1]
        weight = self._spectra.over_gamma(
            waves[:, 2] + to[:, None, 2], columns[None, :, :] - self.orders[:, None, :]
        )
        # (rows, columns, 2, 2), in blocks of s and p
        blocks = weight[..., None, None] * _fluxes(
            tests[:, :, None], to[:, None], fields[:, None], waves[None]
        )
        shape = 2 * len(to), 2 * len(waves)
        return np.asarray(blocks.transpose(2, 0, 3, 1).reshape(shape))


def _fluxes(tests: Complex, to: Complex, fields: Complex, waves: Complex) -> Complex:
    """(κ+κ')·(e×(κ'×e') − e'×(κ×e)) of test waves κ' and waves κ, (..., 2, 2): tests first.

    tests, fields : (2, ..., 3) their s and p fields; to, waves : (..., 3); all of them broadcast.
    """
    total = waves + to
    fluxes = [
        np.sum(
            total * (np.cross(e, np.cross(to, e_test)) - np.cross(e_test, np.cross(waves, e))), -1
        )
        for e_test in tests
        for e in fields
    ]
    return np.stack(fluxes, axis=-1).reshape(*fluxes[0].shape, 2, 2)


def _solved(matrix: Complex, right: Complex) -> Complex:
    """The solution, rows scaled first: those of evanescent waves are far smaller."""
    scale = 1.0 / np.abs(matrix).max(axis=1, keepdims=True)
    scaled = np.linalg.solve(matrix * scale, right * scale)
    return np.asarray(scaled)


class _Spectra:
    """Fourier coefficients of the powers of the heights, in units of 1/k."""

    def __init__(self, field: HeightField, k: float) -> None:
        heights = (field.heights - field.heights.mean()) * k
        if is_crossed(field):  # powers of the heights hold higher frequencies than these
            ny, nx = field.shape
            heights = resample(resample(heights, 2 * nx, axis=1), 2 * ny, axis=0)
        self._heights, self._largest = heights, float(np.abs(heights).max())

    def over_gamma(self, gamma: Complex, difference: Whole) -> Complex:
        """I(γ)/γ for orders that differ by (mx, my); mean over the period of exp(iγh + iQ·r)."""
        reach = float(np.abs(gamma).max()) * self._largest
        if reach > _LARGEST:
            raise DiffractionError(f"heights of |γh| = {reach:.3g} are beyond {_LARGEST:g}")
        ny, nx = self._heights.shape
        place = difference[..., 1] % ny, difference[..., 0] % nx
        inside = (np.abs(difference[..., 0]) < nx / 2) & (np.abs(difference[..., 1]) < ny / 2)
        same = (difference == 0).all(axis=2)
        terms = np.where(same, 1.0 / np.where(same, gamma, 1.0), 0.0)
        power, factor = np.ones_like(self._heights), np.ones_like(gamma)
        n, bound = 0, 1.0
        while n <= reach or bound > _PRECISION:
            n += 1
            power = power * self._heights
            # exp(+iQ·r): the inverse transform
            spectrum = np.fft.ifft2(power)
            factor = factor * (1j / n) if n == 1 else factor * (1j * gamma / n)
            terms = terms + factor * np.where(inside, spectrum[place], 0.0)
            bound *= reach / n
        return terms


def _orders(waves: Waves, case: Case, amplitudes: Complex, out: Complex, travels: Real) -> Orders:
    """Return the propagating orders of the amplitudes (2n, 2), by `boundary.polarisation_axes`.

    The amplitudes' phases are from the mean height. out : (n, 3) unit vectors; travels : (n,) their
    cosines, 0 of those that fade.
    """
    wi, propagating = case.wi, travels > HORIZON
    wo = out[propagating].real
    pairs = np.moveaxis(amplitudes.reshape(2, len(out), 2), 1, 0)[propagating]
    s_solved = axes(out[propagating], 1.0)[0].real
    basis = axes(waves.incident, 1.0)[0].real[0]
    s_in, s_out = boundary.polarisation_axes(wi, wo)
    turned = boundary.turn(s_out, s_solved, wo) @ pairs @ boundary.turn(basis, s_in, -wi)
    mean = waves.k * float(case.field.heights.mean())
    phase = np.exp(-1j * mean * (wi[2] + travels[propagating] * np.sign(wo[:, 2])))
    jones = phase[:, None, None] * turned
    return Orders.of_amplitudes(case, waves.orders[propagating], jones)
