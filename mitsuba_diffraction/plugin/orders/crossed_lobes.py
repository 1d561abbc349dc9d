"""Lobes of crossed gratings, whose orders have a number along x and another along y (Dr.Jit)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ...optics.geometry import sigma_of
from ...optics.orders import crossed_square, order_lobe, wavelength_coordinate
from ...tables.orders import CrossedTable
from ...tables.orders.daylight import CHANNELS
from ..arithmetic import float_of, index_of, maximum
from ..loops import sum_of
from ..memory import once_a_table, upload
from ..types import Float, Index, Mask, Vector2f
from .lobes import REACH, Below, DaylightLobes, Incidence, OrderLobe, added, nearest
from .order_lookup import RAISED, Drawn, Share, between_corners, corner_weights


class CrossedRow(NamedTuple):
    """Efficiencies of all orders for one direction and wavelength.

    Attributes
    ----------
    start : first record of the cell.
    weights : of the eight corners of a cell.
    lit : whether the table has light of the wavelength.
    mirror : tangential part of the mirror direction, in the patch's frame.
    wavelength : in vacuum, nm.
    """

    start: Index
    weights: list[Float]
    lit: Mask
    mirror: Vector2f
    wavelength: Float


class CrossedLookup:
    """Efficiencies of a crossed table for directions in the patch's frame, and wavelengths."""

    index = 1.0
    coated = False

    def __init__(self, table: CrossedTable) -> None:
        records = table.records()
        self._cells = records.cells
        self._values = upload(mi.Float16, records.values)
        self._ends, self._reach = table.wavelengths, table.reach
        self._steps = tuple(1e-3 / period for period in table.periods)
        self.last = table.last_orders
        self._rows = 2 * self.last[0] + 1
        self.count = self._rows * (2 * self.last[1] + 1)

    def row(self, incident: Vector2f, cos_i: Float, wavelength: Float) -> CrossedRow:
        """Return the row of light from ωi; see `OrderLookup.row`."""
        mirror = mi.Vector2f(-incident.x, -incident.y)
        places = (
            wavelength_coordinate(wavelength, *self._ends, 1e-3),
            0.5 * (mirror.y + 1.0),
            0.5 * (mirror.x + 1.0),
        )
        cell, weights = corner_weights(places, self._cells)
        lit = (wavelength >= self._reach[0]) & (wavelength <= self._reach[1])
        return CrossedRow(cell * (self.count + 1), weights, lit, mirror, wavelength)

    def order(
        self, row: CrossedRow, order: Vector2f, active: Mask = True, below: Below = None
    ) -> Share:
        """Return the light of an order of whole numbers; 0 if it does not propagate or inactive."""
        m_x, m_y = self.last
        shift_x, shift_y = (
            m * row.wavelength * step for m, step in zip(order, self._steps, strict=True)
        )
        leaves = active & (crossed_square(row.mirror.x, row.mirror.y, shift_x, shift_y) > 0.0)
        leaves &= (dr.abs(order.x) <= float(m_x)) & (dr.abs(order.y) <= float(m_y))
        place = (order.y + float(m_y)) * float(self._rows) + order.x + float(m_x)
        efficiency = self._between(row, index_of(dr.select(leaves, place, 0.0)), leaves)
        return Share(efficiency, efficiency)

    def total(self, row: CrossedRow, active: Mask = True) -> Float:
        """Return the sum of all orders in the table, of some that do not propagate as well.

        Where one of these is drawn, the sample is invalid.
        """
        return self._between(row, mi.UInt32(self.count), active) * RAISED

    def draw(self, row: CrossedRow, sample: Float) -> Drawn:
        """Return an order drawn by its efficiency over `total`."""
        target = sample * self.total(row)

        def body(place: Index, reached: Float) -> tuple[Index, Float]:
            return place + 1, reached + self._between(row, place, mi.Mask(True))

        def further(place: Index, reached: Float) -> Mask:
            return (reached <= target) & (place < self.count)

        place, reached = dr.while_loop((mi.UInt32(0), mi.Float(0.0)), further, body)
        order = self.order_at(dr.select(place > 0, place - 1, 0))
        propagates = self.order(row, order).efficiency > 0.0
        return Drawn(order, mi.Mask(False), (reached > target) & propagates)

    def order_at(self, place: Index) -> Vector2f:
        """Return the order of a record of a cell."""
        m_x, m_y = self.last
        row = place // self._rows
        return mi.Vector2f(
            float_of(place - row * self._rows) - float(m_x), float_of(row) - float(m_y)
        )

    def _between(self, row: CrossedRow, place: Index, active: Mask) -> Float:
        """Interpolate an order, or the sum, between the corners of a cell."""
        return between_corners(self._values, row.start + place, row.weights, active & row.lit)


@once_a_table
def _crossed_lookup(table: CrossedTable) -> CrossedLookup:
    """Return the table in the current variant's memory."""
    return CrossedLookup(table)


class CrossedWindow(OrderLobe):
    """Lobes in the plane of orders."""

    def __init__(self, table: CrossedTable, coherence_width: float) -> None:
        self.sigma, self.period = sigma_of(coherence_width), table.period
        self.lookup = _crossed_lookup(table)
        self.periods = table.periods

    def position(self, uv: Vector2f, wavelength: Float) -> Vector2f:
        """See `OrderLobe.position`."""
        d_x, d_y = self.periods
        return mi.Vector2f(uv.x * d_x, uv.y * d_y) * (1e3 * dr.rcp(wavelength))

    def orders(self, position: Vector2f) -> list[Any]:
        """See `OrderLobe.orders`."""
        along = [
            nearest(part, 0.25 * (2.0 * math.pi * self.sigma / period) ** 2 < REACH)
            for part, period in zip(position, self.periods, strict=True)
        ]
        return [mi.Vector2f(m, n) for m in along[0] for n in along[1]]

    def lobe(self, position: Vector2f, order: Any) -> Float:
        """See `OrderLobe.lobe`."""
        d_x, d_y = self.periods
        across, along = position.x - order.x, (position.y - order.y) * (d_x / d_y)
        return order_lobe(across, along, (2.0 * math.pi * self.sigma / d_x) ** 2)

    def centre(self, order: Any, wavelength: Float) -> Vector2f:
        """See `OrderLobe.centre`."""
        d_x, d_y = self.periods
        return mi.Vector2f(order.x / d_x, order.y / d_y) * (1e-3 * wavelength)

    def mirrored(self) -> Any:
        """See `OrderLobe.mirrored`."""
        return mi.Vector2f(0.0, 0.0)


class CrossedDaylightLobes(DaylightLobes):
    """Lobes of RGB variants."""

    def __init__(self, window: CrossedWindow) -> None:
        super().__init__(window)
        self._periods = window.periods

    def others(self, light: Incidence, below: Below, uv: Vector2f, radius: Float) -> list[Float]:
        """See `DaylightLobes.others`: order by order, each where it is largest.

        With q_m = 2π (m_x/d_x, m_y/d_y): k_m = q_m·(u, v)/ρ², and the lobe is smaller by
        exp(−σ² (q_m × (u, v))²/ρ²).
        """
        square = maximum(radius, 1e-8)
        row, upper_share, scale = self.smoothing(square)
        units = [2.0 * math.pi / period for period in self._periods]
        first, last = self.waves

        def add(n: Index, inputs: tuple[Incidence, list[Float]], sums: list[Float]) -> list[Float]:
            light, (u, v, square, upper_share, scale) = inputs
            order = self.lookup.order_at(n)
            q_x, q_y = order.x * units[0], order.y * units[1]
            k = (q_x * u + q_y * v) * dr.rcp(square)
            aside = dr.square(self.sigma * (q_x * v - q_y * u)) * dr.rcp(square)
            lit = (k > first) & (k < last) & (aside < REACH)
            k = dr.select(lit, k, last)
            weights = self.weights(k, row, upper_share)
            value, share = self.shares(light, below, 2e3 * math.pi * dr.rcp(k), order)
            lobe = dr.select(lit, scale * dr.exp(-aside), 0.0)
            return added(sums, weights, lobe, value, share)

        inputs = light, [uv.x, uv.y, square, upper_share, scale]
        return sum_of(self.lookup.count, add, inputs, [mi.Float(0.0)] * CHANNELS)
