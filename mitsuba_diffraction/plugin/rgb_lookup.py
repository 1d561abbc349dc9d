"""Reading a colour table inside a Dr.Jit kernel, or one number at a time in scalar variants.

The twin of `ColourTable.colour`, which says what is interpolated. One packet load fetches all terms
of all colours of a bin.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from ..tables.colour.table import PACKET, TERMS, ColourTable
from .memory import read, read_record, upload
from .roles import Colour, Float, Index, Vector2f
from .series import series_interval, series_weights


class PolarCoordinates:
    """Where (u, v) lies between the rings and azimuths of a colour table."""

    def __init__(self, table: ColourTable) -> None:
        grid = table.grid
        self.rings, self.step, self.smallest = grid.rings, grid.step, grid.smallest
        starts = [grid.start(n) for n in range(grid.rings)]
        self._starts = upload(mi.UInt32, np.array([*starts, grid.bins], np.uint32))

    def ring(self, squared_radius: Float) -> Float:
        """Position among the rings; below 0 inside the smallest."""
        smallest = self.smallest**2
        logarithm = dr.log(dr.maximum(squared_radius, 0.25 * smallest) * (1.0 / smallest))
        return logarithm * (0.5 / self.step)

    def turn(self, uv: Vector2f) -> Float:
        """Azimuth in turns, 0 … 1."""
        turn = dr.atan2(uv.y, uv.x) * (0.5 / dr.pi)
        return dr.select(turn < 0.0, turn + 1.0, turn)

    def start(self, ring: Index) -> Index:
        """Index of a ring's first bin."""
        return read(mi.UInt32, self._starts, ring)


class ColourLookup:
    """A colour table in the memory of the current variant."""

    def __init__(self, table: ColourTable) -> None:
        self.expansion = table.expansion
        self.coordinates = PolarCoordinates(table)
        self._bins = table.grid.bins
        self._inverse_scale = 1.0 / table.scale
        self._radius_end = table.radius_end
        self._radii, self._zs = table.order_0.shape[:2]
        self._coefficients = upload(mi.Float16, table.coefficients)
        self._order_0 = upload(mi.Float, table.order_0)

    def colour(self, uv: Vector2f, z: Float) -> Colour:
        """RGB in 1/µm², mi.Color3f, signed. z must not be beyond the table's."""
        others = self._other_orders(uv, dr.squared_norm(uv), z)
        return mi.Color3f(*others) + self.zeroth(uv, z)

    def zeroth(self, uv: Vector2f, z: Float) -> Colour:
        """That of order 0."""
        radius = dr.sqrt(dr.maximum(dr.squared_norm(uv), 1e-14))
        return mi.Color3f(*self._zeroth_order(radius, z))

    def _other_orders(self, uv: Vector2f, squared_radius: Float, z: Float) -> list[Float]:
        offset, interval = series_interval(self.expansion, z)
        weights = series_weights(self.expansion, TERMS, offset, interval, z)
        coordinates = self.coordinates
        ring, t = _split(coordinates.ring(squared_radius), coordinates.rings)
        turn = coordinates.turn(uv)
        starts = [coordinates.start(ring + n) for n in range(3)]
        total = [mi.Float(0.0)] * (3 * TERMS)
        for n, of_ring in ((0, 1.0 - t), (1, t)):
            count = starts[n + 1] - starts[n]  # one more than there are azimuths
            azimuth, a = _split(turn * (mi.Float(count) - 1.0), count)
            bin_ = interval * self._bins + starts[n] + azimuth
            for m, share in ((0, of_ring * (1.0 - a)), (1, of_ring * a)):
                packet = read_record(self._coefficients, bin_ + m, PACKET)
                total = [dr.fma(p, share, s) for p, s in zip(packet, total, strict=False)]
        colours = []
        for c in range(3):
            value = total[c * TERMS] * weights[0]
            for term in range(1, TERMS):
                value = dr.fma(total[c * TERMS + term], weights[term], value)
            colours.append(value * self._inverse_scale)
        return colours

    def _zeroth_order(self, radius: Float, z: Float) -> list[Float]:
        """Order 0's colour, 0 beyond its lobe."""
        inside = radius < self._radius_end
        at_radius = radius * ((self._radii - 1) / self._radius_end)
        row, s = _split(dr.select(inside, at_radius, 0.0), self._radii)
        column, t = _split(z * ((self._zs - 1) / self.expansion.kappa_max), self._zs)
        result = [mi.Float(0.0)] * 3
        for n, of_radius in ((0, 1.0 - s), (1, s)):
            for m, of_z in ((0, 1.0 - t), (1, t)):
                packet = read_record(self._order_0, (row + n) * self._zs + column + m, 4)
                share = dr.select(inside, of_radius * of_z, 0.0)
                result = [dr.fma(p, share, r) for p, r in zip(packet, result, strict=False)]
        return result


def _split(position: Float, count: Index | int) -> tuple[Index, Float]:
    """The lower of the two whole numbers around a position, at most count − 2, and the rest."""
    clipped = dr.maximum(position, 0.0)
    lower = dr.minimum(mi.UInt32(clipped), count - 2)
    return lower, dr.minimum(clipped - mi.Float(lower), 1.0)
