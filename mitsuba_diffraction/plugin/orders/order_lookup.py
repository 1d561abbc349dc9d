"""A table of solved orders inside a kernel: twin of `tables.orders.grids` (Dr.Jit)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ...optics.coat import face_transmittance
from ...optics.orders import (
    cell_wavelengths,
    least_c,
    order_cell,
    order_direction,
    smooth_coordinate,
    wavelength_coordinate,
)
from ...tables.orders import OrderTable
from ...tables.orders.grids import corners
from ..arithmetic import float_of, index_of, maximum
from ..memory import index_between, once_a_table, read, read_record, upload
from ..types import Buffer, Float, Index, Mask, Vector2f

# Against division by 0, in single precision
_MIN_DIVISOR = 1e-7
#: Distance of a coordinate from its ends, 0 and 1, from which on it has derivatives.
_LEAST_T = 1e-6
#: Half floats round: sums are raised so that no order is left out where one is drawn.
RAISED = 1.0 + 2.0**-10


@dataclass(frozen=True)
class Row:
    """Efficiencies of all orders for one direction and wavelength.

    Attributes
    ----------
    kind : of the band, and A or B; see `tables.orders.grids.Corners`.
    cell : number of the cell.
    start : record of port 0.
    channel : j of the incident light.
    channels : number of channels of a side.
    weights : of the eight corners of a cell.
    lit : whether the table has light of the wavelength.
    incident, wavelength : tangential part of ωi, and the wavelength in nm.
    face : share of the light that the coat's face reflects, 0 without a coat.
    """

    kind: Index
    cell: Index
    start: Index
    channel: Index
    channels: Index
    weights: list[Float]
    lit: Mask
    incident: Vector2f
    wavelength: Float
    face: Float


class Share(NamedTuple):
    """Light of an order.

    Attributes
    ----------
    efficiency : share of the incident light.
    chance : probability of drawing, times `OrderLookup.total`; the efficiency, but under a coat.
    """

    efficiency: Float
    chance: Float


class Drawn(NamedTuple):
    """Order that is drawn; whether it leaves below a sheet; and whether there is any."""

    order: Any
    below: Mask
    valid: Mask


class OrderLookup:
    """Rows of efficiencies for directions in the patch's frame and wavelengths.

    table : the table; its superstrate is a coat with a flat face.

    index : of the superstrate.
    """

    def __init__(self, table: OrderTable) -> None:
        records = corners(table)
        self._cells = records.cells
        self._starts = upload(mi.UInt32, records.starts)
        self._values = upload(mi.Float16, records.values)
        self._period = 1e3 * table.optical_period
        self._last = float(table.last_band)
        self._ends, self._reach = table.wavelengths, table.reach
        self._steps = 1e-3 / table.period
        self.index, self._least_c = table.superstrate, least_c(table.superstrate)
        self._parts = records.values.shape[1] // 8
        self._sides = table.sides

    @property
    def coated(self) -> bool:
        """Whether a flat face lies above the grating."""
        return self.index != 1.0

    def row(self, incident: Vector2f, cos_i: Float, wavelength: Float) -> Row:
        """Return the row of light from ωi.

        incident, cos_i : tangential part of ωi in the patch's frame, and its cosine, below 0 for
            light from below a sheet.
        wavelength : in vacuum, nm.
        """
        vacuum, wavelength = wavelength, maximum(wavelength, self._ends[0])
        x, y = (incident.x * (-1.0 / self.index), incident.y * (1.0 / self.index))
        inverse = self._period * dr.rcp(wavelength)
        place = order_cell(x, y, inverse, self._last, _MIN_DIVISOR)
        band, channel, is_a = place.band, place.channel, place.kind_a
        places = [
            _smooth(place.t), _smooth(place.r),
            self._w(wavelength, place.k_continuous),
        ]  # fmt: skip
        kind = index_of(band) * 2 + dr.select(is_a, mi.UInt32(0), mi.UInt32(1))
        channels = index_of(band) + dr.select(is_a, mi.UInt32(1), mi.UInt32(0))
        lit = (vacuum >= self._reach[0]) & (vacuum <= self._reach[1])
        cell, weights = corner_weights(places, self._cells)
        ports, port = channels * self._sides, index_of(channel)
        if self._sides == 2:
            port += dr.select(cos_i < 0.0, channels, 0)
        start = read(mi.UInt32, self._starts, kind) + (cell * ports + port) * (ports + 1)
        face = mi.Float(0.0)
        if self.coated:
            face = 1.0 - self._through(cos_i)
        light = index_of(channel), channels, weights, lit, incident, vacuum, face
        return Row(kind, cell, start, *light)

    @staticmethod
    def port(
        row: Row, order: Float, active: Mask = True, below: Mask | None = None
    ) -> tuple[Index, Mask]:
        """Return an order's port and its validity; evanescent orders have port 0 or a lower one."""
        q = float_of(row.channel) - order
        propagates = active & (q >= 0.0) & (q < float_of(row.channels))
        q = index_of(dr.select(propagates, q, 0.0))
        if below is not None:
            q += dr.select(below, row.channels, 0)
        return q, propagates

    def order(
        self, row: Row, order: Float, active: Mask = True, below: Mask | None = None
    ) -> Share:
        """Return the light of an order, a whole number; 0 if it does not propagate or inactive.

        below : whether it leaves below a sheet; None without a sheet.
        """
        q, propagates = self.port(row, order, active, below)
        if not self.coated:
            efficiency = dr.select(propagates, self._between(row, q, 0, propagates), 0.0)
            return Share(efficiency, efficiency)
        stride = self._steps * row.wavelength
        square = order_direction(row.incident.x, row.incident.y, order, stride).square
        leaves = propagates & (square > 0.0)
        through = self._through(dr.safe_sqrt(square))
        mirror = dr.select(order == 0.0, row.face, 0.0)
        shares = (
            self._between(row, q, 0, propagates) * through,
            self._between(row, q, 1, propagates),
        )
        return Share(*(dr.select(leaves, self._outside(row, s, mirror), 0.0) for s in shares))

    def total(self, row: Row, active: Mask = True) -> Float:
        """Return the sum of all orders' chances, rounded up; meaningless where inactive."""
        value = self._between(row, row.channels * self._sides, self._parts - 1, active)
        if self.coated:
            value = self._outside(row, value, row.face)
        return value * RAISED

    def draw(self, row: Row, sample: Float) -> Drawn:
        """Return an order drawn by its efficiency over `total`."""
        target, ports = sample * self.total(row), mi.UInt32(row.channels) * self._sides

        def at(port: Index) -> tuple[Float, Mask]:
            below = port >= row.channels
            q = port if self._sides == 1 else port - dr.select(below, row.channels, 0)
            return float_of(row.channel) - float_of(q), below

        def body(port: Index, reached: Float) -> tuple[Index, Float]:
            order, below = at(port)
            share = self.order(row, order, True, below if self._sides == 2 else None)
            return port + 1, reached + share.chance

        def further(port: Index, reached: Float) -> Mask:
            return (reached <= target) & (port < ports)

        port, reached = dr.while_loop((mi.UInt32(0), mi.Float(0.0)), further, body)
        return Drawn(*at(port - 1), reached > target)

    def _between(self, row: Row, q: Index, part: int, active: Mask) -> Float:
        """Interpolate a channel between the corners of a cell; 0 where the table has no light.

        part : of a record, see `tables.orders.grids.Corners`.
        """
        record = (row.start + q) * self._parts + part
        return between_corners(self._values, record, row.weights, active & row.lit)

    @staticmethod
    def _outside(row: Row, within: Float, mirror: Float) -> Float:
        """Return light that enters through the coat's face, and adds to the face's light."""
        return dr.fma(1.0 - row.face, within, mirror)

    def _through(self, cosine: Float) -> Float:
        """Return the unpolarised transmittance of the coat's face, for the cosine outside."""
        return face_transmittance(cosine, mi.Float(self.index))

    def _w(self, wavelength: Float, big_k: Float) -> Float:
        if self._cells.w == 1:
            return mi.Float(0.0)
        low, high = cell_wavelengths(big_k, self._period, *self._ends, self._least_c)
        return wavelength_coordinate(wavelength, low, high, 1e-3)


def corner_weights(places: Sequence[Float], cells: Sequence[int]) -> tuple[Index, list[Float]]:
    """Return the cell of coordinates from 0 to 1 on an even grid, and its corners' weights.

    cells : numbers of cells along each coordinate, the first outermost.
    """
    cell, weights = mi.UInt32(0), [mi.Float(1.0)]
    for coordinate, count in zip(places, cells, strict=True):
        position = coordinate * float(count)
        lower = index_between(dr.floor(position), 0.0, count - 1.0)
        share = position - lower
        cell = cell * count + index_of(lower)
        weights = [part for w in weights for part in (w - w * share, w * share)]
    return cell, weights


def between_corners(values: Buffer, record: Index, weights: list[Float], active: Mask) -> Float:
    """Interpolate a record of eight corners; 0 in inactive lanes."""
    corners = read_record(values, record, 8, active)
    value = weights[0] * mi.Float(corners[0])
    for weight, corner in zip(weights[1:], corners[1:], strict=True):
        value = dr.fma(weight, mi.Float(corner), value)
    return value


@once_a_table
def order_lookup(table: OrderTable, kind: type[OrderLookup]) -> OrderLookup:
    """Return the table in the current variant's memory.

    kind : of the look-up, which table and variant decide.
    """
    return kind(table)


def _smooth(t: Float) -> Float:
    """Return `smooth_coordinate`, whose slope at its ends, infinite, is taken as 0."""
    within = (t > _LEAST_T) & (t < 1.0 - _LEAST_T)
    return smooth_coordinate(dr.select(within, t, dr.detach(t)))
