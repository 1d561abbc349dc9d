"""Mueller matrices of orders: from amplitudes, and between nodes.

A Stokes vector of light along d is (|E_e|² + |E_f|², |E_e|² − |E_f|², 2 Re E_e E_f*, 2 Im E_e E_f*)
as Mitsuba's, with e the direction of the grooves (y) made perpendicular to d, and f = d × e. These
axes are smooth over all directions but y itself. The elements `ODD` change their sign with y, the
direction cosine of the light along the grooves: what is smooth in the coordinates of `cells` is
their ratio to y.

An order is one plane wave for each incident one, so that its matrix is a Jones matrix', and
fully polarised light stays so. Interpolation between nodes breaks that slightly; `nearest_pure`
mends it, so that no matrix gains light or polarisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..optics.arithmetic import Number, of
from ..reference.boundary import mueller
from . import cells
from .cells import Array
from .response import CellResponse
from .table import OrderTable

#: Elements (4, 4) that are odd in y: those between intensities S₀, S₁ and phases S₂, S₃.
ODD = np.add.outer([0, 0, 1, 1], [0, 0, 1, 1]) == 1
#: Sine of the angle between axes of polarisation below which light is in a plane of symmetry.
IN_PLANE = 1e-7
#: Angle from the normal, degrees, that stands for 0 where the plane of incidence matters.
MIN_ANGLE = 1e-4
_MIN_AMPLITUDE = 1e-12
#: Sine of the angle from the normal below which a direction has no s of its own.
_NORMAL = 1e-9


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


def mueller_of(amplitudes: NDArray[np.complex128]) -> Array:
    """Return the Mueller matrices (…, j, q, 4, 4) of a solver's amplitudes (…, j, 2, q, 2)."""
    return mueller(np.moveaxis(amplitudes, -3, -1))


def smooth_elements(table: OrderTable, k: int, values: Array) -> Array:
    """Return elements (τ, ρ, w, j, q, 16) at nodes of a band, the odd ones over y."""
    assert isinstance(table.response, CellResponse)
    _, rho, w = table.response.nodes(k)
    big_k = (k + cells.sine_squared(rho))[:, None]
    lam = cells.wavelength_of(big_k, w, table.wavelengths, table.optical_period)
    c = big_k * lam / (2e3 * table.optical_period)
    y = np.sqrt(np.maximum(1.0 - c * c, cells.LEAST_ALONG**2))[:, :, None, None, None]
    return np.where(ODD.ravel(), 1.0 / y, 1.0) * values


def nearest_pure(matrices: Array, efficiency: Array) -> Array:
    """Return about the nearest Mueller matrices (…, 4, 4) of Jones matrices, of an efficiency (…).

    An error that `matrices` have out of the set of pure ones is squared.
    """
    vector = nearest_jones(matrices, efficiency).reshape(-1, 4)
    pairs = vector[:, :, None] * vector[:, None, :].conj()
    return np.asarray((pairs.reshape(-1, 16) @ _MATRIX).real.reshape(matrices.shape))


def nearest_jones(matrices: Array, efficiency: Array) -> NDArray[np.complex128]:
    """Return Jones matrices (…, 2, 2) about e and f of Mueller matrices (…, 4, 4); any phase.

    The Jones matrix is the largest eigenvector of the coherency matrix (Cloude 1986, Optik 75, 26),
    by one step of the power method from its largest column.

    efficiency : (…), ½ Σ|J|² of the result.
    """
    flat = matrices.reshape(-1, 16)
    coherency = (flat @ _COHERENCY).reshape(-1, 4, 4)
    lanes = np.arange(len(flat))
    largest = np.diagonal(coherency, axis1=1, axis2=2).real.argmax(axis=1)
    vector = np.einsum("nab,nb->na", coherency, coherency[lanes, :, largest])
    power = 0.5 * np.sum(np.abs(vector) ** 2, axis=1)
    scale = np.sqrt(np.maximum(efficiency.ravel(), 0.0) / np.maximum(power, _MIN_AMPLITUDE**2))
    return np.asarray((vector * scale[:, None]).reshape(*matrices.shape[:-2], 2, 2))


def s_and_p(jones: NDArray[np.complex128], incident: Array, leaving: Array) -> Any:
    """Return Jones matrices about s and p of those about e and f.

    s = ẑ × d/|ẑ × d| and p = d × s of each direction of propagation d; along the normal s is that
    of the other direction.

    incident, leaving : directions of propagation (…, 3).
    """

    def turned(direction: Array, other: Array) -> Array:
        """Return the matrix that takes components along e and f to those along s and p."""
        x, y = (np.where(_level(direction), other[..., k], direction[..., k]) for k in (0, 1))
        s = np.stack([-y, x, 0.0 * x], axis=-1) / np.maximum(np.hypot(x, y), 1e-300)[..., None]
        along = np.array([0.0, 1.0, 0.0]) - direction[..., 1:2] * direction
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        cosine = (s * along).sum(axis=-1)
        sine = (s * np.cross(direction, along)).sum(axis=-1)
        return np.stack([np.stack([cosine, sine], -1), np.stack([-sine, cosine], -1)], -2)

    back = turned(incident, leaving).swapaxes(-1, -2)
    return turned(leaving, incident) @ jones @ back


def _level(direction: Array) -> Any:
    return np.hypot(direction[..., 0], direction[..., 1]) < _NORMAL


def _coherency() -> NDArray[np.complex128]:
    """Return the map (16, 16) of flat Mueller matrices to J_ik J_jl* at row ik and column jl."""
    stokes = np.array([[1, 0, 0, 1], [1, 0, 0, -1], [0, 1, 1, 0], [0, -1j, 1j, 0]])
    products = np.linalg.inv(stokes) @ np.eye(16).reshape(16, 4, 4) @ stokes  # ij and kl
    return products.reshape(16, 2, 2, 2, 2).swapaxes(2, 3).reshape(16, 16)


_COHERENCY = _coherency()
_MATRIX = np.linalg.inv(_COHERENCY)
