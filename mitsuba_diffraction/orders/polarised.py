"""Mueller matrices of orders: from amplitudes, and between nodes.

A Stokes vector of light along d is (|E_e|² + |E_f|², |E_e|² − |E_f|², 2 Re E_e E_f*, 2 Im E_e E_f*)
as Mitsuba's, with e the direction of the grooves (y) made perpendicular to d, and f = d × e. These
axes are smooth over all directions but y itself. The elements `ODD` change their sign with y, the
direction cosine of the light along the grooves: what is smooth in the coordinates of `cells` is
their ratio to y.

An order is one plane wave for each incident one, so that its matrix is a Jones matrix', and
fully polarised light stays so. Interpolation between nodes breaks that slightly; `nearest_jones`
mends it, so that no matrix gains light or polarisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..optics.arithmetic import Number, of, squared
from ..optics.boundary import Jones
from ..reference.boundary import mueller
from . import cells
from .response import CellResponse
from .table import OrderTable

#: Elements (4, 4) that are odd in y: those between intensities S₀, S₁ and phases S₂, S₃.
ODD = np.add.outer([0, 0, 1, 1], [0, 0, 1, 1]) == 1
#: Sine of the angle between axes of polarisation below which light is in a plane of symmetry.
IN_PLANE = 1e-7
#: Angle from the normal, degrees, that stands for 0 where the plane of incidence matters.
MIN_ANGLE = 1e-4
_MIN_AMPLITUDE = 1e-12


class TurnedAxes(NamedTuple):
    """Cosine and sine of 2ψ, with ψ from the table's axis e to the axis of s polarisation."""

    cosine: Number
    sine: Number


def turned_axes(x: Number, y: Number) -> TurnedAxes:
    """Return the angle between the axes of incident light by its mirror direction.

    With d = (x, y, −z), s = ẑ × d/ρ, e = (ŷ − y d)/c and f = d × e, ρ² = x² + y², c² = 1 − y²:
    e·s = x/(ρ c) and f·s = −y z/(ρ c). Along the normal s is along the grooves.
    """
    xp = of(x, y)
    across = -y * xp.sqrt(xp.maximum(1.0 - x * x - y * y, 0.0))
    square = x * x + across * across
    level = square < IN_PLANE**2
    inverse = xp.reciprocal(xp.where(level, 1.0 + 0.0 * square, square))
    cosine = xp.where(level, 1.0 + 0.0 * square, (x * x - across * across) * inverse)
    return TurnedAxes(cosine, 2.0 * x * across * inverse)


def about_s(elements: Sequence[Number], axes: TurnedAxes, sign: float = 1.0) -> list[Number]:
    """Return elements of Mueller matrices, row by row, for incident light about s, not e.

    sign : −1 turns back, from s to e.
    """
    turned, sine = list(elements), sign * axes.sine
    for n in range(0, len(turned) - 2, 4):
        along, oblique = turned[n + 1 : n + 3]
        turned[n + 1] = axes.cosine * along + sine * oblique
        turned[n + 2] = axes.cosine * oblique - sine * along
    return turned


def mueller_of(amplitudes: NDArray[np.complex128]) -> Real:
    """Return the Mueller matrices (…, j, q, 4, 4) of a solver's amplitudes (…, j, 2, q, 2)."""
    return mueller(np.moveaxis(amplitudes, -3, -1))


def smooth_elements(table: OrderTable, k: int, values: Real) -> Real:
    """Return elements (τ, ρ, w, j, q, 16) at nodes of a band, the odd ones over y."""
    assert isinstance(table.response, CellResponse)
    _, rho, w = table.response.nodes(k)
    big_k = (k + cells.sine_squared(rho))[:, None]
    lam = cells.wavelength_of(big_k, w, table.wavelengths, table.optical_period)
    c = big_k * lam / (2e3 * table.optical_period)
    y = np.sqrt(np.maximum(1.0 - c * c, cells.LEAST_ALONG**2))[:, :, None, None, None]
    return np.where(ODD.ravel(), 1.0 / y, 1.0) * values


def nearest_jones(m: Sequence[Number]) -> Jones:
    """Return a Jones matrix, ½ Σ|J|² = 1, near to a Mueller matrix (16 elements, row by row).

    It is the largest eigenvector of the coherency matrix J ⊗ J* (Cloude 1986, Optik 75, 26), by one
    step of the power method from its largest column: an error that elements have out of the set of
    pure matrices is squared. The phase is any.
    """
    xp = of(m[0])

    def half(real: Number, imag: Number) -> Number:
        return xp.complex(0.5 * real, 0.5 * imag)

    def conj(z: Number) -> Number:
        return xp.complex(z.real, -z.imag)

    # `reference.boundary.mueller` turned round
    ss_sp, ps_pp = half(m[2] + m[6], -m[3] - m[7]), half(m[2] - m[6], m[7] - m[3])
    ss_ps, sp_pp = half(m[8] + m[9], m[12] + m[13]), half(m[8] - m[9], m[12] - m[13])
    ss_pp, sp_ps = half(m[10] + m[15], m[14] - m[11]), half(m[10] - m[15], m[14] + m[11])
    signs = (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)
    powers = [half(m[0] + a * m[1] + b * m[4] + a * b * m[5], 0.0 * m[0]) for a, b in signs]
    columns = [
        [powers[0], conj(ss_sp), conj(ss_ps), conj(ss_pp)],
        [ss_sp, powers[1], conj(sp_ps), conj(sp_pp)],
        [ss_ps, sp_ps, powers[2], conj(ps_pp)],
        [ss_pp, sp_pp, ps_pp, powers[3]],
    ]
    largest, most = columns[0], powers[0].real
    for column, power in zip(columns[1:], powers[1:], strict=True):
        larger = power.real > most
        most = xp.maximum(most, power.real)
        largest = [xp.where(larger, a, b) for a, b in zip(column, largest, strict=True)]
    vector = [
        sum((columns[n][row] * largest[n] for n in range(1, 4)), columns[0][row] * largest[0])
        for row in range(4)
    ]
    power = xp.maximum(0.5 * sum(map(squared, vector)), _MIN_AMPLITUDE**2)
    inverse = xp.reciprocal(xp.sqrt(power))
    ss, sp, ps, pp = (entry * inverse for entry in vector)
    return ss, sp, ps, pp
