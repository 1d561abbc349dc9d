"""Efficiencies between the nodes of a table, by its polynomials."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import DiffractionError, warn
from . import blocks, cells
from .cells import Array
from .polarised import ODD, nearest_pure, smooth_elements
from .table import GROOVES, S_AND_P, Band, OrderTable

#: Sine of the angle between axes of polarisation below which light is in a plane of symmetry.
_IN_PLANE = 1e-7
#: Angle from the normal, degrees, that stands for 0 where the plane of incidence matters.
MIN_ANGLE = 1e-4

_OfKind = Callable[[Band, int], NDArray[Any]]
_Finish = Callable[..., Array]


class _Light(NamedTuple):
    """Light and the order that is looked up, as the parameters of `efficiency`."""

    table: OrderTable
    x: ArrayLike
    y: ArrayLike
    wavelength: ArrayLike
    order: ArrayLike
    from_below: bool = False
    transmitted: bool = False


def efficiency(
    table: OrderTable,
    x: ArrayLike,
    y: ArrayLike,
    wavelength: ArrayLike,
    order: ArrayLike,
    *,
    from_below: bool = False,
    transmitted: bool = False,
) -> Array:
    """Return the efficiency of an order for unpolarised light, from the table's polynomials.

    Raises a DiffractionError if light below is asked for, and the table is of reflected light.

    Parameters
    ----------
    x, y : direction cosines within the superstrate of the mirror direction of the incident
        light, −(ωi)_x and −(ωi)_y; times the index for light within a block.
    wavelength : in vacuum, nm. Beyond the table's by more than `table.MARGIN` octaves the table is
        dark, with a warning; within that margin, the nearest wavelength's.
    order : m; order m leaves at x + m λ/(n d) and y.
    from_below : whether the light comes from below a thin sheet, or from within a block.
    transmitted : whether the order leaves on the other side of a thin sheet or a block's face.

    Returns
    -------
    (…) share of the incident light, 0 for orders that do not propagate.
    """
    light = _Light(table, x, y, wavelength, order, from_below, transmitted)
    return np.asarray(_values(light, *_ways(table)).mean(axis=-1))


def polarised_efficiency(
    table: OrderTable,
    x: ArrayLike,
    y: ArrayLike,
    wavelength: ArrayLike,
    order: ArrayLike,
    *,
    from_below: bool = False,
    transmitted: bool = False,
) -> Array:
    """Return the efficiencies for incident light of s and of p polarisation, (…, 2).

    s light has its E across the plane of incidence. Other arguments as for `efficiency`.

    Raises a DiffractionError off the planes across and along the grooves, where s and p are
    coherent sums of the table's components, if a solved table has no Mueller matrices; or as
    `efficiency` does.
    """
    light = _Light(table, x, y, wavelength, order, from_below, transmitted)
    mean, difference, sine = _split(light, S_AND_P)
    if np.any((np.abs(sine) > _IN_PLANE) & (mean > 0.0)):
        if not table.polarised:
            raise DiffractionError(
                "s and p of light off the plane across the grooves need Mueller matrices; solve "
                "the profile with polarised=True, or take groove_efficiency: E or B along the "
                "grooves"
            )
        difference = difference + sine * mueller(table, x, y, wavelength, order)[..., 0, 2]
    difference = np.clip(difference, -mean, mean)
    return np.stack([mean + difference, mean - difference], axis=-1)


def groove_efficiency(
    table: OrderTable,
    x: ArrayLike,
    y: ArrayLike,
    wavelength: ArrayLike,
    order: ArrayLike,
    *,
    from_below: bool = False,
    transmitted: bool = False,
) -> Array:
    """Return the efficiencies of light whose E, or B, lies along the grooves, (…, 2).

    As far as it can: see the axes of `polarised`. In the plane across the grooves they are s and p
    (TE and TM). Other arguments as for `efficiency`.

    Raises a DiffractionError for conical light, if the table is imported from efficiencies of s and
    p; or as for `efficiency`.
    """
    light = _Light(table, x, y, wavelength, order, from_below, transmitted)
    mean, difference, sine = _split(light, GROOVES)
    if np.any((np.abs(sine) > _IN_PLANE) & (mean > 0.0)):
        raise DiffractionError(
            "this table is imported, with s and p; of conical light it lacks the phases from which "
            "E and B along the grooves would follow"
        )
    return np.stack([mean + difference, mean - difference], axis=-1)


class TurnedAxes(NamedTuple):
    """Cosine and sine of 2ψ, with ψ from the table's axis e to the axis of s polarisation."""

    cosine: Array
    sine: Array


def turned_axes(x: ArrayLike, y: ArrayLike) -> TurnedAxes:
    """Return the angle between the axes of incident light by its mirror direction.

    With d = (x, y, −z), s = ẑ × d/ρ, e = (ŷ − y d)/c and f = d × e, ρ² = x² + y², c² = 1 − y²:
    e·s = x/(ρ c) and f·s = −y z/(ρ c). Along the normal s is along the grooves.
    """
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    along, across = x, -y * np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    squared = along**2 + across**2
    level = squared < _IN_PLANE**2
    cosine = np.where(level, 1.0, along**2 - across**2) / np.where(level, 1.0, squared)
    return TurnedAxes(cosine, 2.0 * along * across / np.where(level, 1.0, squared))


def _split(light: _Light, components: str) -> tuple[Array, Array, Array]:
    """Return mean and half difference of an order's efficiencies for two components of the light.

    The difference lacks what phases would add, in proportion to the sine of 2ψ, the last result.

    components : `GROOVES` or `S_AND_P`.
    """
    table = light.table
    if table.block:
        raise DiffractionError("a table of a block has unpolarised efficiencies; take efficiency")
    stored = _values(light, *_ways(table))
    mean, half = stored.mean(axis=-1), 0.5 * (stored[..., 0] - stored[..., 1])
    if table.components == components:
        return mean, half, np.zeros(())
    turned = turned_axes(light.x, light.y)
    return mean, half * turned.cosine, turned.sine


def mueller(
    table: OrderTable, x: ArrayLike, y: ArrayLike, wavelength: ArrayLike, order: ArrayLike
) -> Array:
    """Return the Mueller matrices of an order, (…, 4, 4), about the axes of `polarised`.

    M₀₀ is `efficiency`. Arguments as for `efficiency`.

    Raises a DiffractionError if the table has no Mueller matrices.
    """
    if not table.polarised:
        raise DiffractionError(
            "this table has efficiencies alone; solve the profile with polarised=True for Mueller "
            "matrices"
        )
    light = _Light(table, x, y, wavelength, order)
    elements = _values(light, functools.partial(smooth_elements, table), lambda rows, *_: rows)
    factors = np.where(ODD.ravel(), np.asarray(y)[..., None], 1.0)
    matrices = (elements * factors).reshape(*elements.shape[:-1], 4, 4)
    return nearest_pure(matrices, efficiency(table, x, y, wavelength, order))


def _ways(table: OrderTable) -> tuple[_OfKind, _Finish]:
    """Return how efficiencies are interpolated, as `_values` takes it."""
    if table.block:
        reduced = functools.partial(blocks.reduced, table)
        return lambda *of: reduced(*of)[..., None], functools.partial(blocks.restored, table)
    return Band.kind, lambda rows, *_: clamped(rows)


def _values(light: _Light, of_kind: _OfKind, finish: _Finish) -> Array:
    """Interpolate values of an order, (…, n), 0 where it does not propagate.

    of_kind : values (τ, ρ, w, j, q, n) of a band's kind.
    finish : applied to the rows (lanes, q, n) of all ports; takes their x, y, wavelength, channel
        and port of incidence, too.
    """
    table, x, y, wavelength, order, from_below, transmitted = light
    if (from_below or transmitted) and table.sides == 1:
        raise DiffractionError(
            "this table has reflected light alone; solve the profile with thin for that below"
        )
    x, y, lam, m = np.broadcast_arrays(*(np.asarray(value) for value in (x, y, wavelength, order)))
    shape = x.shape
    x, y, lam = (part.astype(np.float64).ravel() for part in (x, y, lam))
    lit = _lit(table, lam)
    lam = np.maximum(lam, table.wavelengths[0])  # shorter light may have orders beyond all bands
    index = table.block or 1.0
    cell = cells.to_cell(x / index, y / index, lam, table.optical_period)
    w = cells.w_of(cell.k_continuous, lam, table.wavelengths, table.optical_period)
    q = cell.channel - m.ravel().astype(np.int64)
    propagates = lit & (cell.channel >= 0) & (q >= 0) & (q < cell.channels)
    if table.block and not from_below:
        propagates &= x * x + y * y < 1.0
    second = from_below != bool(table.block)  # whether the light's ports are the second half
    result = np.zeros((len(x), of_kind(table.bands[0], cells.A).shape[-1]))
    weights_of = blocks.linear if table.block else cells.interpolation
    kinds = zip(cell.band[propagates].tolist(), cell.kind[propagates].tolist(), strict=True)
    for k, kind in sorted({*kinds}):
        here = np.flatnonzero(propagates & (cell.band == k) & (cell.kind == kind))
        channels = k + 1 - kind
        came = cell.channel[here] + channels * second
        nodes, places = of_kind(table.bands[k], kind), (cell.tau[here], cell.rho[here], w[here])
        weights = [weights_of(*pair) for pair in zip(nodes.shape, places, strict=False)]
        rows = _between(nodes, weights, came)
        rows = finish(rows, x[here], y[here], lam[here], cell.channel[here], came)
        left = q[here] + channels * (second != transmitted)
        result[here] = rows[np.arange(len(here)), left]
    return result.reshape(*shape, result.shape[-1])


def _lit(table: OrderTable, wavelength: Array) -> NDArray[np.bool_]:
    """Whether wavelengths are close enough to the table's; warn of the others."""
    least, most = table.reach
    lit = (wavelength >= least) & (wavelength <= most)
    if not lit.all():
        low, high = table.wavelengths
        warn(
            f"light of {wavelength[~lit][0]:g} nm meets a table of orders of {low:g} to {high:g} "
            f"nm, which has none below {least:.0f} and above {most:.0f} nm; solve it with a wider "
            "range of wavelengths"
        )
    return np.asarray(lit)


def _between(nodes: NDArray[Any], weights: list[Array], came: NDArray[np.int64]) -> Array:
    """Return the rows of all ports (lanes, q, n) for light that came through a port each."""
    rows = np.empty((len(came), *nodes.shape[4:]))
    for port in np.unique(came):
        lanes = np.flatnonzero(came == port)
        of_lanes = [matrix[lanes] for matrix in weights]
        values = nodes[:, :, :, port].astype(np.float64)
        rows[lanes] = np.einsum("na,nb,nc,abcqs->nqs", *of_lanes, values, optimize=True)
    return rows


def clamped(values: Array) -> Array:
    """Clamp efficiencies (…, q, 2) to at least 0, and their sums over q to at most 1."""
    positive = np.maximum(values, 0.0)
    total = positive.sum(axis=-2, keepdims=True)
    return np.asarray(positive / np.maximum(total, 1.0))
