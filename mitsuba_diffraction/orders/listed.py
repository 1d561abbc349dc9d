"""Tables of listed light: solutions in some directions, or a file's efficiencies (`imported`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from ..arrays import Complex, Real
from ..errors import warn
from .polarised import nearest_jones
from .response import (
    DIGITS,
    ListedResponse,
    canonical,
    orders_between,
)
from .table import OrderTable

#: Differences of directions (twice `polarised.MIN_ANGLE`), and relative ones of wavelengths, within
#: which light is the listed one.
_SAME, _SAME_WAVELENGTH = 4e-6, 1e-6

#: Steps of θ, degrees, up to which light between listed directions is not warned of.
WIDEST_STEP = 10.0


class Lights(NamedTuple):
    """Response of a regular grid of lights.

    Attributes
    ----------
    wavelengths, theta, phi : (a,), (b,), (c,) nm in vacuum, and degrees within the medium of the
        light; θ below 0 is light from the other side, φ + 180°.
    orders : (m, 2), m_x and m_y; m_y is 0 of grooves.
    values : (a, b, c, sides in, sides out, m, n) elements of Mueller matrices, as of
        `ListedResponse.values`; NaN where an order does not propagate.
    crossed : whether the grating repeats along y, too.
    jones : (a, b, c, sides in, sides out, m, 4) Jones matrices of all 16 elements, times any
        positive number: their phases are stored; None where phases are not known.
    """

    wavelengths: Real
    theta: Real
    phi: Real
    orders: NDArray[np.int64]
    values: Real
    crossed: bool
    jones: Complex | None = None

    def light(self, number: int) -> str:
        """Return the name of a light, by its place in the grid of wavelengths, θ and φ."""
        a, b, c = np.unravel_index(number, self.values.shape[:3])
        return f"{self.wavelengths[a]:g} nm, theta {self.theta[b]:g}°, phi {self.phi[c]:g}°"

    def order(self, number: int) -> str:
        """Return the name of an order, by its place among them."""
        order = tuple(self.orders[number].tolist())
        return str(order if self.crossed else order[0])


def mirror_of(theta: ArrayLike, phi: ArrayLike) -> tuple[Real, Real]:
    """Return x and y of the mirror direction of light from θ and φ, degrees."""
    sine, turn = np.sin(np.radians(theta)), np.radians(phi)
    return np.asarray(-sine * np.cos(turn)), np.asarray(-sine * np.sin(turn))


def listed_response(
    lights: Lights, periods: tuple[float, float], superstrate: float, block: float | None = None
) -> ListedResponse:
    """Return the lights on a grid without gaps."""
    crossed = lights.crossed
    theta, phi = canonical(lights.theta, lights.phi, crossed)
    polar = np.unique(theta)
    azimuths = np.unique(phi[theta > 0.0]) if (theta > 0.0).any() else np.zeros(1)
    first, last = lights.orders.min(axis=0), lights.orders.max(axis=0)
    orders = orders_between(first.tolist(), last.tolist())
    width = last[0] - first[0] + 1
    places = (lights.orders[:, 1] - first[1]) * width + lights.orders[:, 0] - first[0]
    content = lights.values
    if lights.jones is not None:
        content = np.concatenate([content, lights.jones.view(np.float64)], axis=-1)
    a, b, c, came, left, _, n = content.shape
    # directions (θ, φ) of the list at nodes of the grid; several at one node are mirror images
    sums = np.zeros((a, len(polar), len(azimuths), came, left, len(orders), n))
    found = np.zeros((len(polar), len(azimuths)), np.int64)
    spread = np.zeros((a, b, c, came, left, len(orders), n))
    spread[:] = np.nan
    spread[..., places, :] = content
    for i, j in np.ndindex(b, c):
        row = int(np.searchsorted(polar, theta[i, j]))
        columns: Any = slice(None)
        if theta[i, j] > 0.0:
            columns = int(np.searchsorted(azimuths, phi[i, j]))
        found[row, columns] += 1
        value = spread[:, i, j]
        sums[:, row, columns] += value if isinstance(columns, int) else value[:, None]
    values = sums / np.maximum(found, 1)[:, :, None, None, None, None]
    values = _of_nearest_directions(values, found > 0, polar, azimuths)
    n = lights.values.shape[-1]
    values[:, found == 0, ..., n:] = np.nan
    if crossed:  # a circle: nodes beyond 0 and 360°
        azimuths = np.concatenate([azimuths[-1:] - 360.0, azimuths, azimuths[:1] + 360.0])
        values = np.concatenate([values[:, :, -1:], values, values[:, :, :1]], axis=2)
    index = block or superstrate
    optical = [1e-3 / (period * (1.0 if block else superstrate)) for period in periods]
    axes = np.asarray(lights.wavelengths, np.float64), polar, azimuths
    stored = np.empty((*values.shape[:4], left * len(orders), n), np.float32)
    values, matrices = values[..., :n], np.ascontiguousarray(values[..., n:])
    for side in range(came):
        factor = index if block and side == 0 else 1.0
        light = values[:, :, :, side].reshape(*values.shape[:3], left * len(orders), n)
        stored[:, :, :, side] = _filled(light, axes, np.tile(orders, (left, 1)), optical, factor)
    phases = None
    if lights.jones is not None:
        entries = matrices.view(np.complex128).reshape(*stored.shape[:-1], 4)
        angles = np.angle((_pure(stored).conj() * entries).sum(axis=-1))
        phases = np.where(np.isnan(angles), np.float32(np.nan), angles.astype(np.float32))
    return ListedResponse(axes, orders, stored, phases=phases)


def _pure(elements: NDArray[np.float32]) -> Complex:
    """Return Jones matrices (…, 4) of elements, whose largest entry is real and positive.

    Sums of single precision in double precision are exact, so that which one is the largest is the
    same where phases are made and where they are read.
    """
    parts = list(np.moveaxis(elements.astype(np.float64), -1, 0))
    entries = np.stack(nearest_jones(parts), axis=-1)
    return np.asarray(np.sqrt(elements[..., :1]) * entries, np.complex128)


def listed_jones(table: OrderTable, *light: ArrayLike) -> Complex:
    """Return Jones matrices (…, 2, 2) about the axes of `polarised`, with their phases.

    NaN of light that the table does not list, or has no phases of.

    light : x, y, wavelength and order, order_y, as for `efficiency.efficiency`.
    """
    x, y, lam, m_x, m_y = np.broadcast_arrays(*(np.asarray(part, np.float64) for part in light))
    response = table.response
    if not isinstance(response, ListedResponse) or response.phases is None:
        return np.full((*x.shape, 2, 2), np.nan, np.complex128)
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    along = y if table.crossed else -np.abs(y)
    theta, phi = np.arctan2(np.hypot(x, y), z), np.arctan2(-along, -x) % (2.0 * np.pi)
    values = lam, np.degrees(theta), np.degrees(phi)
    nodes = [
        np.searchsorted(0.5 * (axis[1:] + axis[:-1]), value)
        for axis, value in zip(response.axes, values, strict=True)
    ]
    wave, polar, azimuth = (axis[n] for axis, n in zip(response.axes, nodes, strict=True))
    there = *mirror_of(polar, azimuth), np.cos(np.radians(polar))
    known = np.abs(wave - lam) <= _SAME_WAVELENGTH * lam
    for part, listed in zip((x, along, z), there, strict=True):
        known &= np.abs(part - listed) <= _SAME
    first, last = response.orders[0], response.orders[-1]
    for m, low, high in zip((m_x, m_y), first, last, strict=True):
        known &= (m >= low) & (m <= high)
    port = (m_y - first[1]) * (last[0] - first[0] + 1) + m_x - first[0]
    place = (*nodes, 0, np.where(known, port, 0).astype(np.int64))
    phases = np.where(known, response.phases[place], np.nan)
    entries = _pure(response.values[place]) * np.exp(1j * phases)[..., None]
    if not table.crossed:  # of the mirror image, J_ef and J_fe have the other sign
        entries[..., 1:3] *= np.where(y < 0.0, -1.0, 1.0)[..., None]
    return entries.reshape(*x.shape, 2, 2)


def _of_nearest_directions(
    values: Real, known: NDArray[np.bool_], polar: Real, azimuths: Real
) -> Real:
    """Give nodes (θ, φ) that the list lacks the light of the nearest direction in it."""
    if known.all():
        return values
    theta, phi = np.meshgrid(np.radians(polar), np.radians(azimuths), indexing="ij")
    places = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)], axis=-1)
    nearest = KDTree(places[known]).query(places[~known])[1]
    values = values.copy()
    values[:, ~known] = values[:, known][:, nearest]
    return values


def _filled(
    values: Real, axes: tuple[Real, Real, Real], orders: NDArray[np.int64],
    steps: list[float], index: float,
) -> Real:  # fmt: skip
    """Give orders (λ, θ, φ, m, n) that do not propagate their nearest light in which they do.

    Interpolation between the two sides of a Rayleigh anomaly would halve the light on one side.
    These additions bring the sum of a light to 1 at most, so that sums between lights keep it, too.

    steps : 1e-3 over the optical periods, 1/µm; index : of the medium that the angles belong to.
    """
    lam, theta, phi = np.meshgrid(axes[0], *map(np.radians, axes[1:]), indexing="ij")
    x, y = (-index * np.sin(theta) * part for part in (np.cos(phi), np.sin(phi)))
    places = np.stack([x, y, lam * steps[0]], axis=-1).reshape(-1, 3)
    flat = values.reshape(len(places), len(orders), -1).copy()
    for n in range(len(orders)):
        lit = np.isfinite(flat[:, n, 0])
        if lit.any() and not lit.all():
            nearest = KDTree(places[lit]).query(places[~lit])[1]
            flat[~lit, n] = flat[np.flatnonzero(lit)[nearest], n]
    dark = ~np.isfinite(values[..., :1]).reshape(len(places), -1)
    flat = np.nan_to_num(flat)
    listed, added = ((flat[..., 0] * mask).sum(axis=1, keepdims=True) for mask in (~dark, dark))
    room = np.clip((1.0 - listed) / np.maximum(added, 1e-12), 0.0, 1.0)
    flat *= np.where(dark, room, 1.0)[..., None]
    return flat.reshape(values.shape)


def warn_of_gaps(table: OrderTable, shown: str) -> None:
    """Warn of directions that a list lacks."""
    response = table.response
    assert isinstance(response, ListedResponse)
    if len(table.directions) == 1 or response.lacks_directions(table.crossed):
        azimuths = ", and phi from 0 to 345 in steps of 15," if table.crossed else ""
        warn(
            f"{shown} has no light from some directions, which get the efficiencies of the nearest "
            f"direction in it; list theta from -85 to 85 in steps of 5 or 10{azimuths} to have all "
            "of them"
        )
    elif response.in_plane:
        warn(
            f"{shown} has light across the grooves only (phi = 0): other light gets the same "
            "efficiencies, which is exact for perfect conductors alone"
        )


def warn_of_other_directions(table: OrderTable, theta: Real, phi: Real) -> None:
    """Warn of light, from θ (b,) and φ (c,), degrees, beyond a list's directions or in its gaps."""
    response = table.response
    if not isinstance(response, ListedResponse):
        return
    _, polar, azimuths = response.axes
    asked = np.stack(canonical(theta, phi, table.crossed), axis=-1).reshape(-1, 2)
    steep, turned = asked.T
    near = 10.0**-DIGITS
    within = (turned >= azimuths[0] - near) & (turned <= azimuths[-1] + near)
    if table.crossed and len(azimuths) == 3:  # one azimuth
        within = turned == azimuths[1]
    if response.in_plane:
        within &= np.isin(turned, (0.0, 180.0))
    within = (within | (steep == 0.0)) & (steep >= polar[0] - near) & (steep <= polar[-1] + near)
    listed = table.directions
    if within.all():
        apart = _gaps(polar, steep)
        if (apart > WIDEST_STEP + near).any():
            n = int(apart.argmax())
            warn(
                f"theta {steep[n]:g}° is between the table's directions, {apart[n]:g}° apart: such "
                f"light gets efficiencies in between; list theta in steps of {WIDEST_STEP:g}° or "
                "less"
            )
        return
    places = [np.concatenate(canonical([t], [p], table.crossed), axis=-1)[0] for t, p in listed]
    nearest = KDTree(_unit(np.array(places))).query(_unit(asked[~within]))[1]
    named = ["theta {:g}°, phi {:g}°".format(*listed[n]) for n in np.unique(nearest)]
    first = np.argmin(within)
    t, p = (axis.ravel()[first] for axis in np.meshgrid(theta, phi, indexing="ij"))
    warn(
        f"theta {t:g}°, phi {p:g}° is outside the table's directions: such light gets the "
        f"efficiencies of the nearest, {' or '.join(named[:3])}{' …' if named[3:] else ''}"
    )


def _gaps(axis: Real, asked: Real) -> Real:
    """Return the distances of the nodes of an axis (n,) around each angle (m,); 0 at a node."""
    near = 10.0**-DIGITS
    below, above = np.searchsorted(axis + near, asked), np.searchsorted(axis - near, asked)
    nodes = np.pad(axis, 1, mode="edge")
    return np.where(below < above, 0.0, nodes[above + 1] - nodes[below])


def _unit(directions: Real) -> Real:
    """Return unit vectors (n, 3) of θ and φ (n, 2), degrees."""
    x, y = mirror_of(*directions.T)
    return np.column_stack([x, y, np.cos(np.radians(directions[:, 0]))])
