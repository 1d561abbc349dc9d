"""Look-up of a table of orders, by one arithmetic in NumPy and in kernels.

A look-up has two steps: `row` finds the cell of some light, `share` and `elements` interpolate an
order of it. Tangential parts belong to wave vectors over 2π/λ; light comes from ωi.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..optics.arithmetic import Mask, Number, of
from ..optics.coat import face_transmittance, passage
from ..optics.orders import (
    cell_wavelengths,
    least_c,
    order_cell,
    order_direction,
    port_power,
    smooth_coordinate,
    wavelength_coordinate,
)
from .grid import OrderGrid
from .polarised import ODD
from .rows import kept
from .table import OrderTable

#: Against division by 0, in single precision.
_MIN_DIVISOR = 1e-7
#: Half floats round: sums are raised so that no order is left out where one is drawn.
RAISED = 1.0 + 2.0**-10

Index = Number


class Memory(Protocol):
    """Arrays of a grid where a look-up runs, and sums over ports there."""

    def read(self, name: str, index: Index, numbers: int, active: Mask) -> Sequence[Number]:
        """Return the numbers of a record of an array of the grid; 0 in inactive lanes."""

    def start(self, name: str, kind: Index) -> Index:
        """Return the first record of a kind."""

    def sum(self, count: Index, add: Callable[..., Number], inputs: Any, zero: Number) -> Number:
        """Return the sum over n < count of add(n, inputs, total)."""


class Arrays:
    """A grid in NumPy's memory."""

    def __init__(self, grid: OrderGrid) -> None:
        self._grid = grid

    def read(self, name: str, index: Index, numbers: int, active: Mask) -> Sequence[Number]:
        """See `Memory.read`."""
        records = getattr(self._grid, name).reshape(-1, numbers)
        values = records[np.where(active, index, 0)].astype(np.float64)
        return tuple(np.where(active, np.moveaxis(values, -1, 0), 0.0))

    def start(self, name: str, kind: Index) -> Index:
        """See `Memory.start`."""
        return getattr(self._grid, name)[kind].astype(np.int64)

    @staticmethod
    def sum(count: Index, add: Callable[..., Number], inputs: Any, zero: Number) -> Number:
        """See `Memory.sum`."""
        total = np.zeros(np.shape(count))
        for n in range(int(np.max(count, initial=0))):
            total = np.where(n < count, add(np.full(np.shape(count), n), inputs, total), total)
        return total


class Row(NamedTuple):
    """Light of one direction and wavelength, placed in the grid.

    Attributes
    ----------
    kind : of the band, and A or B.
    cell : number of the cell.
    start : record of port 0.
    channel : j of the incident light; entered : its port.
    channels : number of channels of a side.
    weights : of the eight corners of a cell, times the grid's scale.
    lit : whether the table has light of the wavelength.
    x, y, wavelength : tangential part of ωi, and the wavelength in nm.
    face : share of the light that the coat's face reflects, 0 without a coat.
    entering : `optics.coat.passage` of the rest.
    """

    kind: Index
    cell: Index
    start: Index
    channel: Index
    entered: Index
    channels: Index
    weights: list[Number]
    lit: Mask
    x: Number
    y: Number
    wavelength: Number
    face: Number
    entering: Number


class Share(NamedTuple):
    """Light of an order.

    Attributes
    ----------
    efficiency : share of the incident light, with the light of a coat's face.
    chance : probability of drawing, times `Lookup.total`; the efficiency, but under a coat.
    """

    efficiency: Number
    chance: Number


class Lookup:
    """Rows of efficiencies of a table; its superstrate is a coat with a flat face.

    Attributes
    ----------
    index : of the medium in which the cells' directions lie, over that of ωi.
    coated : whether a flat face lies above the grating.
    sides : 2 of a sheet or a block, else 1.
    numbers : number of elements of Mueller matrices, 0 without them.
    """

    def __init__(self, table: OrderTable, grid: OrderGrid, memory: Memory, *, coated: bool) -> None:
        self.memory, self.sides = memory, table.sides
        self._cells, self._parts = grid.cells, grid.parts
        self._scale = grid.scale
        self.numbers = 0 if grid.elements is None else grid.elements.shape[1]
        self.has_chances = grid.chances is not None
        self._period, self._last = 1e3 * table.optical_period, float(table.last_band)
        self._ends, self._reach = table.wavelengths, table.reach
        self._step = 1e-3 / table.period
        self.coated = coated and table.superstrate != 1.0
        self.index = table.superstrate if self.coated else 1.0
        self._kept = kept(table) if self.coated else 0.0
        self._least_c = least_c(self.index)
        if not self.coated:  # directions within the medium are given
            self._step /= table.superstrate

    def row(self, x: Number, y: Number, cos_i: Number, wavelength: Number) -> Any:
        """Return the row of light from ωi.

        x, y, cos_i : of ωi in the patch's frame; cos_i is below 0 for light from below a sheet.
        wavelength : in vacuum, nm.
        """
        xp = of(x, wavelength)
        vacuum, wavelength = wavelength, xp.maximum(wavelength, self._ends[0])
        inverse = self._period * xp.minimum(xp.reciprocal(vacuum), 1.0 / self._ends[0])
        inside = 1.0 / self.index
        place = order_cell(x * -inside, y * inside, inverse, self._last, _MIN_DIVISOR)
        w = 0.0 * wavelength
        if self._cells.w > 1:
            ends = cell_wavelengths(wavelength * xp.reciprocal(place.c), *self._ends, self._least_c)
            w = wavelength_coordinate(wavelength, *ends, 1e-3)
        places = (smooth_coordinate(place.t), smooth_coordinate(place.r), w)
        cell, weights = corner_weights(places, self._cells, self._scale)
        band, channel, is_a = xp.index(place.band), xp.index(place.channel), place.kind_a
        channels = band + xp.flag(is_a)
        kind = band * 2 + xp.where(is_a, 0 * band, 1)
        lit = (vacuum >= self._reach[0]) & (vacuum <= self._reach[1])
        ports, port = channels * self.sides, channel
        if self.sides == 2:
            port = port + xp.where(cos_i < 0.0, channels, 0)
        start = self.memory.start("starts", kind) + (cell * ports + port) * (ports + 1)
        face, entering = 0.0 * x, 1.0 + 0.0 * x
        if self.coated:
            through = self._through(cos_i)
            face, entering = 1.0 - through, passage(through, self._kept)
        cells = kind, cell, start, channel, port, channels, weights
        return Row(*cells, lit, x, y, vacuum, face, entering)

    def ports(self, row: Any) -> Index:
        """Return the number of a row's ports."""
        return row.channels * self.sides if self.sides == 2 else row.channels

    def order_at(self, row: Any, port: Index) -> tuple[Number, Mask]:
        """Return the order of a port, and whether it leaves on the second side."""
        xp = of(row.wavelength)
        below = port >= row.channels
        q = port - xp.where(below, row.channels, 0) if self.sides == 2 else port
        return xp.number(row.channel) - xp.number(q), below

    def port(
        self, row: Any, order: Any, active: Mask = True, below: Mask | None = None
    ) -> tuple[Index, Mask]:
        """Return an order's port, and whether it propagates."""
        xp = of(row.wavelength)
        q = xp.number(row.channel) - order
        propagates = active & (q >= 0.0) & (q < xp.number(row.channels))
        port = xp.index(xp.where(propagates, q, 0.0))
        if below is not None:
            port = port + xp.where(below, row.channels, 0)
        return port, propagates

    def share(self, row: Any, order: Any, active: Mask = True, below: Mask | None = None) -> Share:
        """Return the light of an order, a whole number; 0 if it does not propagate or inactive.

        below : whether it leaves below a sheet; None without a sheet.
        """
        xp = of(row.wavelength)
        port, propagates = self.port(row, order, active, below)
        if not self.coated:
            efficiency = xp.where(propagates, self.at_port(row, port, 0, propagates), 0.0)
            return Share(efficiency, efficiency)
        square = order_direction(row.x, row.y, order, self._step * row.wavelength).square
        leaves = propagates & (square > 0.0)
        through = self._through(xp.sqrt(xp.maximum(square, 0.0)))
        mirror = xp.where(order == 0.0, row.face, 0.0)
        shares = (
            self.at_port(row, port, 0, propagates) * passage(through, self._kept),
            self.at_port(row, port, 1, propagates),
        )
        return Share(*(xp.where(leaves, xp.fma(row.entering, s, mirror), 0.0) for s in shares))

    def repeated(self, row: Row, order: Number, active: Mask = True) -> Number:
        """Return an order's efficiency within the coat, with all reflections between its face."""
        xp = of(row.wavelength)
        port, propagates = self.port(row, order, active)
        square = order_direction(row.x, row.y, order, self._step * row.wavelength).square
        ends = 1.0 - row.face, self._through(xp.sqrt(xp.maximum(square, 0.0)))
        came, left = (1.0 - self._kept * (1.0 - end) for end in ends)
        return self.at_port(row, port, 0, propagates) * xp.reciprocal(xp.sqrt(came * left))

    def total(self, row: Any, active: Mask = True) -> Number:
        """Return the sum of all orders' chances, rounded up; meaningless where inactive.

        Of listed light with orders that do not propagate in this light.
        """
        value = self.at_port(row, self.ports(row), self._parts - 1, active)
        if self.coated:
            value = of(value).fma(row.entering, value, row.face)
        return value * RAISED

    def elements(
        self, row: Any, order: Any, y: Number, active: Mask = True, below: Mask | None = None
    ) -> list[Number]:
        """Return the first elements of the Mueller matrix of an order, row by row.

        y : direction cosine of the light along the grooves, of which odd elements are multiples.
        """
        port, active = self.port(row, order, active & row.lit, below)
        ports = self.ports(row)
        first = self.memory.start("element_starts", row.kind) + row.entered * ports + port
        totals = self.mixed(row, first, ports * ports, active)
        odd = ODD.ravel()[: self.numbers]
        return [x * y if is_odd else x for x, is_odd in zip(totals, odd, strict=True)]

    def mixed(self, row: Any, first: Index, stride: Index, active: Mask) -> list[Number]:
        """Interpolate elements; first : record of node 0, and stride records each."""
        xp = of(row.wavelength)
        totals: list[Number] = [0.0 * row.wavelength] * self.numbers
        for weight, node in zip(row.weights, self.nodes(row), strict=True):
            record = self.memory.read("elements", first + node * stride, self.numbers, active)
            totals = [xp.fma(weight, x, sum_) for x, sum_ in zip(record, totals, strict=True)]
        return totals

    def nodes(self, row: Any) -> list[Index]:
        """Return the numbers of the nodes at a cell's corners, 000, 001, 010 … 111."""
        n_rho, n_w = self._cells.rho, self._cells.w
        tau, rho, w = row.cell // (n_rho * n_w), (row.cell // n_w) % n_rho, row.cell % n_w
        first = (tau * (n_rho + 1) + rho) * (n_w + 1) + w
        corners = itertools.product((0, 1), repeat=3)
        return [first + (a * (n_rho + 1) + b) * (n_w + 1) + c for a, b, c in corners]

    def totals(self, row: Row) -> Sequence[Number]:
        """Return the sums of chances at the corners of a cell, over the grid's scale."""
        record = (row.start + self.ports(row)) * self._parts + self._parts - 1
        return self.memory.read("corners", record, 8, row.lit)

    def at_port(self, row: Any, port: Index, part: int, active: Mask) -> Number:
        """Interpolate a port between the corners of a cell; 0 where the table has no light."""
        record = (row.start + port) * self._parts + part
        corners = self.memory.read("corners", record, 8, active & row.lit)
        return weighted(row.weights, corners)

    def _through(self, cosine: Number) -> Number:
        return face_transmittance(cosine, self.index)


class BlockRow(NamedTuple):
    """Row of a block's face.

    Attributes
    ----------
    row : see `Row`.
    own : port of the mirror's order.
    entering : G of the incident light.
    flat : F of order 0 through the face.
    mirror : efficiency of order 0 of the reflection.
    scale : factor on all other orders, below 1 where they sum to more.
    """

    row: Row
    own: Index
    entering: Number
    flat: Number
    mirror: Number
    scale: Number

    def __getattr__(self, name: str) -> Any:
        return getattr(self.row, name)


class BlockLookup(Lookup):
    """Rows of a block's table, of reduced efficiencies; see `blocks`.

    Side 0 is within the block, so `row` takes a cosine below 0 for light from outside, and `below`
    means above the face.
    """

    def __init__(self, table: OrderTable, grid: OrderGrid, memory: Memory) -> None:
        super().__init__(table, grid, memory, coated=False)
        assert table.block is not None
        self.index, self._more = table.block, table.block**2 - 1.0

    def row(self, x: Number, y: Number, cos_i: Number, wavelength: Number) -> Any:
        """See `Lookup.row`."""
        row = super().row(x, y, cos_i, wavelength)
        xp = of(wavelength)
        outside, above = cos_i < 0.0, 1.0 - (x * x + y * y)
        entering = self._power(above, outside)
        flat = face_transmittance(xp.sqrt(xp.maximum(above, 0.0)), self.index + 0.0 * above)
        own = row.channel + xp.where(outside, row.channels, 0)

        def add(n: Index, inputs: tuple[Any, ...], total: Number) -> Number:
            parts, entering, flat, own = inputs
            light = self._other(Row(*parts), entering, flat, n, True)
            return total + xp.where(n == own, 0.0, light)

        inputs = tuple(row), entering, flat, own
        others = self.memory.sum(row.channels * 2, add, inputs, 0.0 * above)
        mirror = xp.where(row.lit, xp.maximum(1.0 - others, 0.0), 0.0)
        scale = xp.reciprocal(xp.maximum(others, 1.0))
        return BlockRow(row, own, entering, flat, mirror, scale)

    def share(
        self, row: Any, order: Number, active: Mask = True, below: Mask | None = None
    ) -> Share:
        """See `Lookup.share`."""
        xp = of(row.wavelength)
        port, propagates = self.port(row.row, order, active, below)
        other = self._other(row.row, row.entering, row.flat, port, propagates) * row.scale
        light = xp.where(propagates, xp.where(port == row.own, row.mirror, other), 0.0)
        return Share(light, light)

    def total(self, row: Any, active: Mask = True) -> Number:
        """See `Lookup.total`: a block loses no light."""
        return 1.0 + 0.0 * row.wavelength

    def _other(self, row: Row, entering: Number, flat: Number, port: Index, active: Mask) -> Number:
        """Return the efficiency of a port but for the mirror's, by its reduced efficiency."""
        xp = of(row.wavelength)
        above = port >= row.channels
        order = xp.number(row.channel) - xp.number(port - xp.where(above, row.channels, 0))
        stride = self._step * row.wavelength
        square = order_direction(row.x, row.y, order, stride).square
        factor = xp.where(order == 0.0, flat, entering * self._power(square, above))
        return self.at_port(row, port, 0, active) * factor

    def _power(self, square: Number, above: Mask) -> Number:
        """Return G; square : squared normal part above the face."""
        xp = of(square)
        within = square + self._more
        normal = xp.sqrt(xp.maximum(xp.where(above, square, within), 0.0))
        return port_power(normal, xp.where(above, within, square))


def corner_weights(
    places: Sequence[Number], cells: Sequence[int], scale: float
) -> tuple[Index, list[Number]]:
    """Return the cell of coordinates from 0 to 1 on an even grid, and its corners' weights.

    cells : numbers of cells along each coordinate, the first outermost.
    scale : factor on all weights.
    """
    xp = of(*places)
    cell, weights = None, [scale]
    for coordinate, count in zip(places, cells, strict=True):
        position = coordinate * float(count)
        lower = xp.bounded(xp.floor(position), 0.0, count - 1.0)
        share, index = position - lower, xp.index(lower)
        cell = index if cell is None else cell * count + index
        weights = [part for w in weights for part in (w - w * share, w * share)]
    return cell, weights


def weighted(weights: Sequence[Number], corners: Sequence[Number]) -> Number:
    """Return the sum of weights times corners."""
    xp = of(weights[0])
    value = weights[0] * corners[0]
    for weight, corner in zip(weights[1:], corners[1:], strict=True):
        value = xp.fma(weight, corner, value)
    return value
