"""Efficiencies and Mueller matrices of a table, in NumPy: the numbers that the renderer reads."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Real
from ..errors import DiffractionError, warn
from ..reference.boundary import mueller as mueller_matrices
from ..reference.boundary import polarisation_axes, turn
from .grid import OrderGrid, grid_of
from .listed import listed_jones
from .listed_lookup import ListedLookup
from .lookup import Arrays, BlockLookup, Lookup, Memory
from .polarised import IN_PLANE, TurnedAxes, nearest_jones, turned_axes
from .response import ALONG, LINEAR, UNPOLARISED, ListedResponse
from .table import OrderTable


def efficiency(
    table: OrderTable,
    x: ArrayLike,
    y: ArrayLike,
    wavelength: ArrayLike,
    order: ArrayLike,
    order_y: ArrayLike = 0,
    *,
    from_below: bool = False,
    transmitted: bool = False,
) -> Real:
    """Return the efficiency of an order for unpolarised light, as the renderer interpolates it.

    Raises a DiffractionError if light below is asked for, and the table is of reflected light.

    Parameters
    ----------
    x, y : direction cosines within the superstrate of the mirror direction of the incident
        light, −(ωi)_x and −(ωi)_y; times the index for light within a block.
    wavelength : in vacuum, nm. Beyond the table's by more than `table.MARGIN` octaves the table is
        dark, with a warning; within that margin, the nearest wavelength's.
    order, order_y : m_x and m_y; an order leaves at x + m_x λ/(n d_x) and y + m_y λ/(n d_y). m_y
        is 0 for grooves.
    from_below : whether the light comes from below a thin sheet, or from within a block.
    transmitted : whether the order leaves on the other side of a thin sheet or a block's face.

    Returns
    -------
    (…) share of the incident light, 0 for orders that do not propagate.
    """
    light, sides = (x, y, wavelength, order, order_y), (from_below, transmitted)
    return _answer(table, *light, *sides, matrices=False)[..., 0]


def polarised_efficiency(table: OrderTable, *light: Any, **sides: bool) -> Real:
    """Return the efficiencies for incident light of s and of p polarisation, (…, 2).

    s light has its E across the plane of incidence. Other arguments as for `efficiency`.

    Raises a DiffractionError off the planes across and along the grooves, where s and p are
    coherent sums of the table's components, if a solved table has no Mueller matrices; or as
    `efficiency` does.
    """
    mean, cosine, sine = _linear(table, *light, **sides)
    turned = _turned(*light)
    difference = cosine * turned.cosine
    if sine is None:
        if np.any((np.abs(turned.sine) > IN_PLANE) & (mean > 0.0)):
            raise DiffractionError(
                "s and p of light off the plane across the grooves need Mueller matrices; solve "
                "the profile with polarised=True, or take groove_efficiency: E or B along the "
                "grooves"
            )
    else:
        difference = difference + turned.sine * sine
    return _both(mean, difference)


def groove_efficiency(table: OrderTable, *light: Any, **sides: bool) -> Real:
    """Return the efficiencies of light whose E, or B, lies along the grooves, (…, 2).

    As far as it can: see the axes of `polarised`. In the plane across the grooves they are s and p
    (TE and TM). Other arguments as for `efficiency`.

    Raises a DiffractionError for conical light, if the table is imported from efficiencies of s and
    p; or as for `efficiency`.
    """
    mean = _linear(table, *light, **sides)[0]
    turned = np.abs(_turned(*light).sine) > IN_PLANE
    if table.response.elements == LINEAR and np.any(turned & (mean > 0.0)):
        raise DiffractionError(
            "this table is imported, with s and p; of conical light it lacks the phases from which "
            "E and B along the grooves would follow"
        )
    return shares_along(table, *light, **sides)


def shares_along(table: OrderTable, *light: Any, **sides: bool) -> Real:
    """Return `groove_efficiency` of any table; (…, 1) of a table of unpolarised light."""
    if table.response.elements == UNPOLARISED:
        return efficiency(table, *light, **sides)[..., None]
    return _both(*_linear(table, *light, **sides)[:2])


def _both(mean: Real, difference: Real) -> Real:
    """Return the shares (…, 2) of two polarisations by their mean, and half of their difference."""
    difference = np.clip(difference, -mean, mean)
    return np.stack([mean + difference, mean - difference], axis=-1)


def _turned(x: ArrayLike, y: ArrayLike, *_: Any) -> TurnedAxes:
    return turned_axes(np.asarray(x, np.float64), np.asarray(y, np.float64))


def _linear(table: OrderTable, *light: Any, **sides: bool) -> tuple[Real, Real, Real | None]:
    """Return M₀₀, M₀₁ and M₀₂ of an order; None for the last one where it is not known."""
    if table.response.elements == UNPOLARISED:
        raise DiffractionError(
            "this table has efficiencies of unpolarised light alone; take efficiency"
        )
    parts = np.moveaxis(_answer(table, *light, **sides)[..., :LINEAR], -1, 0)
    return parts[0], parts[1], parts[2] if len(parts) > ALONG else None


def mueller(table: OrderTable, *light: Any) -> Real:
    """Return the Mueller matrices of an order, (…, 4, 4), about the axes of `polarised`.

    M₀₀ is `efficiency`, but for light far from all directions of a list. Arguments as for
    `efficiency`.

    Raises a DiffractionError if the table has no Mueller matrices.
    """
    return mueller_matrices(_jones(table, *light))


def jones(table: OrderTable, *light: Any) -> NDArray[np.complex128]:
    """Return `jones_matrices` alone."""
    return jones_matrices(table, *light)[0]


def jones_matrices(
    table: OrderTable, *light: Any
) -> tuple[NDArray[np.complex128], NDArray[np.bool_]]:
    """Return the Jones matrices of an order about s and p, as ray tracers take them.

    (…, 2, 2), and whether the table has their common phase (…).

    E_leaving = J E_incident times the root of the ratio of cosines: |J|² are shares of the light.
    s = ẑ × d/|ẑ × d| and p = d × s of each direction of propagation d. Time is exp(−iωt), and
    fields are those at the profile's origin; of crossed gratings it is the first of the heights, at
    their lowest level. Light that was solved itself, at one of the listed directions and
    wavelengths, has its phases; of other light J_ss is real, or J_pp where there is no J_ss.
    Arguments as for `efficiency`.

    Raises a DiffractionError if the table has no Mueller matrices.
    """
    at = np.broadcast_arrays(*(np.asarray(part, np.float64) for part in (*light, 0.0)[:5]))
    exact = listed_jones(table, *at)
    with_phase = np.isfinite(exact[..., 0, 0])
    of_grooves = np.where(with_phase[..., None, None], exact, _jones(table, *at))
    x, y, lam, m_x, m_y = at
    steps = (1e-3 * lam / (period * table.superstrate) for period in table.periods)
    shifts = (m * step for m, step in zip((m_x, m_y), steps, strict=True))
    leaving = tuple(part + shift for part, shift in zip((x, y), shifts, strict=True))
    towards, away = (
        np.stack([a, b, side * np.sqrt(np.maximum(1.0 - a * a - b * b, 0.0))], axis=-1)
        for (a, b), side in (((x, y), -1.0), (leaving, 1.0))
    )
    s_in, s_out = polarisation_axes(-towards, away)
    e_in, e_out = (np.array([0.0, 1.0, 0.0]) - d[..., 1:2] * d for d in (towards, away))
    e_in, e_out = (e / np.linalg.norm(e, axis=-1, keepdims=True) for e in (e_in, e_out))
    found = turn(s_out, e_out, away) @ of_grooves @ turn(e_in, s_in, towards)
    size = np.abs(found[..., 0, 0])
    reference = np.where(size > 1e-9, found[..., 0, 0], found[..., 1, 1])
    phase = np.where(with_phase, 1.0, np.exp(-1j * np.angle(reference)))
    return np.asarray(found * phase[..., None, None]), with_phase


def _jones(table: OrderTable, *light: Any) -> NDArray[np.complex128]:
    """Return the Jones matrices (…, 2, 2) of an order about e and f; any phase."""
    if not table.polarised:
        raise DiffractionError(
            "this table has efficiencies alone; solve the profile with polarised=True for Mueller "
            "matrices"
        )
    entries = nearest_jones(list(np.moveaxis(_answer(table, *light), -1, 0)))
    scaled = np.stack(entries, axis=-1) * np.sqrt(efficiency(table, *light))[..., None]
    return scaled.reshape(*scaled.shape[:-1], 2, 2)


def _answer(
    table: OrderTable, x: ArrayLike, y: ArrayLike, wavelength: ArrayLike, order: ArrayLike,
    order_y: ArrayLike = 0, from_below: bool = False, transmitted: bool = False, *,
    matrices: bool = True,
) -> Real:  # fmt: skip
    """Return the first elements of the Mueller matrices of an order, (…, n), or the efficiency."""
    if (from_below or transmitted) and table.sides == 1:
        raise DiffractionError(
            "this table has reflected light alone; solve the profile with thin for that below"
        )
    light = x, y, wavelength, order, order_y
    parts = np.broadcast_arrays(*(np.asarray(part, np.float64) for part in light))
    shape = parts[0].shape
    x, y, lam, m_x, m_y = (part.ravel() for part in parts)
    second = from_below != bool(table.block)  # whether the light's ports are the second half
    sine = x * x + y * y
    active = _lit(table, lam) & (sine <= (table.block or 1.0) ** 2)
    if table.block and not from_below:
        active &= sine < 1.0
    if not table.crossed:
        active &= m_y == 0
    lookup = lookup_of(table)
    row = lookup.row(-x, -y, np.where(second, -1.0, 1.0) + 0.0 * x, np.maximum(lam, 1.0))
    below = np.full(len(x), second != transmitted) if lookup.sides == 2 else None
    order = (m_x, m_y) if table.crossed else m_x
    if matrices:
        answer = lookup.elements(row, order, y, active, below)
    else:
        answer = [lookup.share(row, order, active, below).efficiency]
    return np.stack(answer, axis=-1).reshape(*shape, len(answer))


def lookup_in(
    table: OrderTable, memory: Callable[[OrderGrid], Memory], *, coated: bool, elements: bool,
    chances: bool = False,
) -> Lookup:  # fmt: skip
    """Return the look-up of a table, with its grid in a memory.

    coated, elements, chances : as for `grid.grid_of`.
    """
    grid = grid_of(table, coated=coated, elements=elements, chances=chances)
    held = memory(grid)
    coated = coated and table.superstrate != 1.0
    if isinstance(table.response, ListedResponse) and not coated:
        return ListedLookup(table, grid, held)
    if table.block:
        return BlockLookup(table, grid, held)
    return Lookup(table, grid, held, coated=coated)


_lookups: weakref.WeakKeyDictionary[OrderTable, Lookup] = weakref.WeakKeyDictionary()


def lookup_of(table: OrderTable) -> Lookup:
    """Return the look-up of the grating alone, without its coat, in NumPy's memory."""
    if table not in _lookups:
        _lookups[table] = lookup_in(table, Arrays, coated=False, elements=True)
    return _lookups[table]


def _lit(table: OrderTable, wavelength: Real) -> NDArray[np.bool_]:
    """Whether wavelengths are close enough to the table's; warn of the others."""
    least, most = table.reach
    lit = (wavelength >= least) & (wavelength <= most)
    if not lit.all():
        low, high = table.wavelengths
        warn(
            f"wavelength {wavelength[~lit][0]:g} nm is outside the table of orders ({low:g} to "
            f"{high:g} nm); its efficiencies are 0 below {least:.0f} and above {most:.0f} nm; "
            "solve it with a wider range of wavelengths"
        )
    return np.asarray(lit)
