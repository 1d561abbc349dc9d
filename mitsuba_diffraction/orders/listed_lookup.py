"""Look-up of listed light, in NumPy and in kernels; see `lookup`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..arrays import Real
from ..optics.arithmetic import Mask, Number, of
from ..optics.orders import crossed_square, order_factor
from .grid import OrderGrid
from .lookup import RAISED, Index, Lookup, Memory, Share, corner_weights
from .polarised import ODD, about_s, turned_axes
from .response import LARGEST_SUM, ListedResponse
from .table import OrderTable

_DEGREE = 180.0 / np.pi
#: Against division by 0 along the grooves.
_LEAST_C = 1e-4
#: Squared distance from a listed direction, square degrees, within which rounding places light.
_LISTED = 1e-6


class ListedRow(NamedTuple):
    """Light placed among the listed lights; names as of `lookup.Row`.

    Attributes
    ----------
    second : 1 for light that comes from the second side, else 0.
    away : squared distance of ωi from the nearest listed direction, square degrees.
    total, scale : sum of all orders' light, and the factor that brings it to `LARGEST_SUM` at
        most, of a list with gaps; else 0 and 1.
    """

    cell: Index
    start: Index
    second: Index
    weights: list[Number]
    lit: Mask
    x: Number
    y: Number
    wavelength: Number
    face: Number
    away: Number
    total: Number
    scale: Number


class ListedLookup(Lookup):
    """Rows of a table of listed light, without a coat.

    Orders are whole numbers, or pairs (m_x, m_y) on crossed gratings. Where directions are missing,
    an order has the efficiency of ωi or of the reversed light from ωo, which is reciprocal to it:
    the nearer to a listed direction counts. Mueller matrices belong to ωi.

    Attributes
    ----------
    index, coated, sides, numbers : as of `lookup.Lookup`.
    count : number of orders.
    """

    def __init__(self, table: OrderTable, grid: OrderGrid, memory: Memory) -> None:
        response = table.response
        assert isinstance(response, ListedResponse)
        super().__init__(table, grid, memory, coated=False)
        self._material = response.index
        self._axes = [_Axis(nodes) for nodes in response.axes]
        self._in_plane, self._crossed = response.in_plane, table.crossed
        self._gaps = response.index is None and response.lacks_directions(table.crossed)
        self.index = table.block or 1.0
        self._steps = [1e-3 / (period * table.superstrate) for period in table.periods]
        self._first = response.orders[0].tolist()
        self._size = (response.orders[-1] - response.orders[0] + 1).tolist()
        self.count = len(response.orders)

    def row(self, x: Number, y: Number, cos_i: Number, wavelength: Number) -> Any:
        """See `lookup.Lookup.row`; x and y belong to wave vectors over 2π/λ."""
        row = self._row(x, y, cos_i, wavelength)
        if not self._gaps:
            return row

        def add(n: Index, inputs: tuple[Any, ...], total: Number) -> Number:
            order, below = self.order_at(row := ListedRow(*inputs), n)
            return total + self._either(row, order, True, below if self.sides == 2 else None)

        total = self.memory.sum(self.ports(row), add, tuple(row), row.total)
        scale = LARGEST_SUM / of(total).maximum(total, LARGEST_SUM)
        return row._replace(total=total * scale, scale=scale)

    def _row(self, x: Number, y: Number, cos_i: Number, wavelength: Number) -> ListedRow:
        xp = of(x, wavelength)
        second = xp.flag(cos_i < 0.0) if self.sides == 2 else xp.index(0.0 * x)
        light = self._angles(x, y, cos_i, wavelength)
        places = [axis.place(value) for axis, value in zip(self._axes, light, strict=True)]
        cell, weights = corner_weights(places, self._cells, self._scale)
        lit = (wavelength >= self._reach[0]) & (wavelength <= self._reach[1])
        start = (cell * self.sides + second) * (self.count * self.sides + 1)
        zero = 0.0 * x
        away = zero
        if self._gaps:
            aside = self._axes[2].distance(light[2]) * xp.sin(light[1] / _DEGREE)
            distance = self._axes[1].distance(light[1])
            away = distance * distance + aside * aside
        return ListedRow(
            cell, start, second, weights, lit, x, y, wavelength, zero, away, zero, 1.0 + zero
        )

    def _angles(
        self, x: Number, y: Number, cos_i: Number, wavelength: Number
    ) -> tuple[Number, Number, Number]:
        """Return the wavelength, θ and φ of ωi, degrees (`ListedResponse.in_plane`)."""
        xp = of(x, wavelength)
        if self.index != 1.0:  # side 0 of a block lies within, tangential parts are n sinθ
            inverse = xp.where(cos_i < 0.0, 1.0, 1.0 / self.index)
            x, y = x * inverse, y * inverse
        if self._in_plane:
            c = xp.sqrt(xp.maximum(1.0 - y * y, _LEAST_C**2))
            x, y = x * xp.reciprocal(c), 0.0 * y
            wavelength = wavelength * xp.reciprocal(c)
        sine = xp.sqrt(xp.minimum(x * x + y * y, 1.0))
        # mirror images of grooves are alike
        phi = xp.arctan2(y if self._crossed else xp.absolute(y), x) * _DEGREE
        if self._crossed:
            phi = phi + xp.where(phi < 0.0, 360.0, 0.0)
        return wavelength, xp.arcsin(sine) * _DEGREE, phi

    def ports(self, row: Any) -> Index:
        """See `lookup.Lookup.ports`."""
        return self.count * self.sides + 0 * row.start

    def order_at(self, row: Any, port: Index) -> tuple[Any, Mask]:
        """See `lookup.Lookup.order_at`."""
        below = port >= self.count
        place = port
        if self.sides == 2:
            place = port - of(row.wavelength).where(below, self.count + 0 * port, 0 * port)
        order = self.order_of_port(place, of(row.wavelength))
        return (order if self._crossed else order[0]), below

    def order_of_port(self, place: Index, xp: Any = None) -> tuple[Number, Number]:
        """Return m_x and m_y of a place among the orders of a side."""
        xp = xp or of(place)
        along = place // self._size[0]
        m_x = xp.number(place - along * self._size[0]) + float(self._first[0])
        return m_x, xp.number(along) + float(self._first[1])

    def port(
        self, row: Any, order: Any, active: Mask = True, below: Mask | None = None
    ) -> tuple[Index, Mask]:
        """See `lookup.Lookup.port`."""
        xp = of(row.wavelength)
        m_x, m_y = order if self._crossed else (order, 0.0 * row.wavelength)
        square = self._square(row, m_x, m_y)
        if self.index != 1.0:
            square = square + xp.where(below, 0.0, self.index**2 - 1.0)
        leaves = active & (square > 0.0)
        places = [m - float(first) for m, first in zip((m_x, m_y), self._first, strict=True)]
        for place, size in zip(places, self._size, strict=True):
            leaves = leaves & (place >= 0.0) & (place < float(size))
        place = places[1] * float(self._size[0]) + places[0]
        port = xp.index(xp.where(leaves, place, 0.0))
        if below is not None:
            port = port + xp.where(below, self.count + 0 * port, 0 * port)
        return port, leaves

    def share(self, row: Any, order: Any, active: Mask = True, below: Mask | None = None) -> Share:
        """See `lookup.Lookup.share`."""
        xp = of(row.wavelength)
        if self._gaps:
            light = self._either(row, order, active, below) * row.scale
            return Share(light, light)
        port, leaves = self.port(row, order, active, below)
        chance = xp.where(leaves, self.at_port(row, port, self._parts - 1, leaves), 0.0)
        if self._material is None:
            return Share(chance, chance)
        light = self.at_port(row, port, 0, leaves) * self._factor(row, *order)
        return Share(xp.where(leaves, light, 0.0), chance)

    def total(self, row: Any, active: Mask = True) -> Number:
        """See `lookup.Lookup.total`."""
        return row.total * RAISED if self._gaps else super().total(row, active)

    def _either(self, row: Any, order: Any, active: Mask, below: Mask | None) -> Number:
        """Return an order's efficiency between that of ωi and that of the reversed light from ωo.

        Each has the weight of the other's squared distance from a listed direction.
        """
        xp = of(row.wavelength)
        port, leaves = self.port(row, order, active, below)
        m_x, m_y = order if self._crossed else (order, 0.0 * row.wavelength)
        x, y = (
            m * row.wavelength * step - part
            for m, step, part in zip((m_x, m_y), self._steps, (row.x, row.y), strict=True)
        )
        up = 1.0 + 0.0 * row.x
        back = self._row(x, y, up if below is None else xp.where(below, -up, up), row.wavelength)
        came = None if below is None else row.second > 0
        backwards, _ = self.port(back, order, leaves, came)
        forth, reverse = (
            self.at_port(light, at, 0, leaves) for light, at in ((row, port), (back, backwards))
        )
        share = row.away / (row.away + back.away + _LISTED)
        return xp.where(leaves, forth + (reverse - forth) * share, 0.0)

    def elements(
        self, row: Any, order: Any, y: Number, active: Mask = True,
        below: Mask | None = None,
    ) -> list[Number]:  # fmt: skip
        """See `lookup.Lookup.elements`; only the sign of y is used, on grooves."""
        xp = of(row.wavelength)
        port, active = self.port(row, order, active & row.lit, below)
        ports = self.ports(row)
        totals = self.mixed(row, row.second * ports + port, self.sides * ports, active)
        if self._material is not None:
            factor = self._factor(row, *order)
            return about_s([x * factor for x in totals], turned_axes(-row.x, -row.y), -1.0)
        if self._crossed:
            return totals
        sign = xp.where(y < 0.0, -1.0 + 0.0 * y, 1.0 + 0.0 * y)
        odd = ODD.ravel()[: self.numbers]
        return [x * sign if is_odd else x for x, is_odd in zip(totals, odd, strict=True)]

    def _square(self, row: Any, m_x: Number, m_y: Number) -> Number:
        """Return the squared cosine of an order above."""
        shift_x, shift_y = (
            m * row.wavelength * step for m, step in zip((m_x, m_y), self._steps, strict=True)
        )
        return crossed_square(-row.x, -row.y, shift_x, shift_y)

    def _factor(self, row: Any, m_x: Number, m_y: Number) -> Number:
        """Return `optics.orders.order_factor` of an order."""
        assert self._material is not None
        came = 1.0 - row.x * row.x - row.y * row.y
        zeroth = (m_x == 0.0) & (m_y == 0.0)
        return order_factor(came, self._square(row, m_x, m_y), zeroth, self._material)


class _Axis:
    """Ascending nodes, and the place of a value among them, from 0 to 1."""

    def __init__(self, nodes: Real) -> None:
        self._nodes = nodes
        steps = np.diff(nodes)
        self._even = len(nodes) < 3 or np.ptp(steps) <= 1e-6 * steps.max()
        self._span = max(float(np.ptp(nodes)), 1e-12)

    def place(self, value: Number) -> Number:
        """Return the place; values outside are at the nearest end."""
        xp = of(value)
        first = float(self._nodes[0])
        if self._even:
            return xp.clip((value - first) * (1.0 / self._span), 0.0, 1.0)
        # piecewise linear: a sum over kinks, of which a list has few
        count, place = len(self._nodes) - 1, 0.0 * value
        for low, high in zip(self._nodes[:-1].tolist(), self._nodes[1:].tolist(), strict=True):
            place = place + xp.clip((value - low) * (1.0 / (high - low)), 0.0, 1.0)
        return place * (1.0 / count)

    def distance(self, value: Number) -> Number:
        """Return the distance from the nearest node."""
        xp = of(value)
        nearest = xp.absolute(value - float(self._nodes[0]))
        for node in self._nodes[1:].tolist():
            nearest = xp.minimum(nearest, xp.absolute(value - node))
        return nearest
