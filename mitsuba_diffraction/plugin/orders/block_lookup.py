"""Efficiencies of a block's face inside a kernel: twin of `tables.orders.blocks` (Dr.Jit)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...optics.coat import face_transmittance
from ...optics.orders import order_direction, port_power
from ...tables.orders import OrderTable
from ..arithmetic import float_of, maximum
from ..loops import sum_of
from ..types import Float, Index, Mask, Vector2f
from .order_lookup import OrderLookup, Row, Share


@dataclass(frozen=True)
class BlockRow(Row):
    """Efficiencies of all orders for one direction and wavelength.

    Attributes
    ----------
    own : port of the mirror's order.
    entering : G of the incident light.
    flat : F of order 0 through the face.
    mirror : efficiency of order 0 of the reflection.
    scale : factor on all other orders, below 1 where they sum to more.
    """

    own: Index
    entering: Float
    flat: Float
    mirror: Float
    scale: Float


class BlockLookup(OrderLookup):
    """Rows of a block's table; tangential parts belong to wave vectors over 2π/λ.

    Side 0 is within the block, so `row` takes a cosine below 0 for light from outside, and `below`
    means above the face.
    """

    def __init__(self, table: OrderTable) -> None:
        super().__init__(table)
        assert table.block is not None
        self.index, self._least_c = table.block, 0.0
        self._more = table.block**2 - 1.0

    @property
    def coated(self) -> bool:
        """See `OrderLookup.coated`."""
        return False

    def row(self, incident: Vector2f, cos_i: Float, wavelength: Float) -> BlockRow:
        """See `OrderLookup.row`."""
        row = super().row(incident, cos_i, wavelength)
        outside = cos_i < 0.0
        above = 1.0 - dr.squared_norm(incident)
        entering = self._power(above, outside)
        flat = face_transmittance(dr.safe_sqrt(above), mi.Float(self.index))
        own = row.channel + dr.select(outside, row.channels, 0)

        def add(n: Index, inputs: tuple[tuple[Any, ...], Float, Float], total: Float) -> Float:
            parts, entering, flat = inputs
            other = self._other(Row(*parts), entering, flat, n)
            return total + dr.select(n == own, 0.0, other)

        ports = row.channels * 2
        inputs = tuple(vars(row).values()), entering, flat
        others = sum_of(ports, add, inputs, mi.Float(0.0))
        mirror = dr.select(row.lit, maximum(1.0 - others, 0.0), 0.0)
        scale = dr.rcp(maximum(others, 1.0))
        return BlockRow(**vars(row), own=own, entering=entering, flat=flat, mirror=mirror,
                        scale=scale)  # fmt: skip

    def order(
        self, row: Row, order: Float, active: Mask = True, below: Mask | None = None
    ) -> Share:
        """See `OrderLookup.order`."""
        assert isinstance(row, BlockRow)
        port, propagates = self.port(row, order, active, below)
        other = self._other(row, row.entering, row.flat, port, propagates) * row.scale
        light = dr.select(port == row.own, row.mirror, other)
        light = dr.select(propagates, light, 0.0)
        return Share(light, light)

    def total(self, row: Row, active: Mask = True) -> Float:
        """See `OrderLookup.total`: a block loses no light."""
        return mi.Float(1.0)

    def _other(
        self, row: Row, entering: Float, flat: Float, port: Index, active: Mask = True
    ) -> Float:
        """Return the efficiency of a port but for the mirror's, by its reduced efficiency."""
        above = port >= row.channels
        order = float_of(row.channel) - float_of(port - dr.select(above, row.channels, 0))
        stride = self._steps * row.wavelength
        square = order_direction(row.incident.x, row.incident.y, order, stride).square
        factor = dr.select(order == 0.0, flat, entering * self._power(square, above))
        return self._between(row, port, 0, active) * factor

    def _power(self, square: Float, above: Mask) -> Float:
        """Return G; square : squared normal part above the face."""
        within = square + self._more
        normal = dr.safe_sqrt(dr.select(above, square, within))
        return port_power(normal, dr.select(above, within, square))
