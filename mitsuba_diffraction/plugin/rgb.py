"""RGB variants: the diffracted power in daylight's colours, and directions drawn by brightness.

`RGBPower` is the twin of `ColourTable.colour`, which defines the interpolation: one packet
load fetches all terms of all colours of a bin. For the density of ωo per solid angle see
`tables.colour.proposals`; (u, v) → ωo has the Jacobian dωo = du dv / cosθo.
"""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from ..optics.colour import RGB_WAVELENGTHS
from ..optics.geometry import wavenumber
from ..tables import DiffractionTable
from ..tables.colour.proposals import LOBES, colour_proposals
from ..tables.colour.table import PACKET, TERMS, cached_colours
from .arithmetic import maximum, minimum
from .directions import Pair, PairThrough
from .memory import once_a_table, read, read_record, upload
from .sampling import BELOW_ONE, Strategies, invert
from .series import inner, series_weights
from .types import Buffer, Colour, Float, Index, Interaction, Powers, Vector2f


def _split(position: Float, count: Index | int) -> tuple[Index, Float]:
    """The lower of the two whole numbers around a position, at most count − 2, and the rest."""
    clipped = maximum(position, 0.0)
    lower = dr.minimum(mi.UInt32(clipped), count - 2)
    return lower, minimum(clipped - mi.Float(lower), 1.0)


#: Least power, 1/µm², whose root is taken; colours outside the display's gamut are negative.
_LEAST = 1e-18


class RGBPower:
    """The `power.SpectralPower` of variants without wavelengths, which are summed."""

    def __init__(self, summed: DiffractionTable) -> None:
        self._coherent, table = summed.grid.coherent, cached_colours(summed)
        self._expansion, self._grid, self._z_max = table.expansion, table.grid, table.z_max
        starts = [self._grid.start(n) for n in range(self._grid.rings)]
        self._starts = upload(mi.UInt32, np.array([*starts, self._grid.bins], np.uint32))
        # not `HalfFloats`: dark colours are sums of subnormal numbers
        self._coefficients = upload(mi.Float16, table.coefficients)
        self._inverse_scale = 1.0 / table.scale
        self._radius_end = table.radius_end
        self._radii, self._columns = table.order_0.shape[:2]
        self._order_0 = upload(mi.Float, table.order_0)
        proposals = colour_proposals(table)
        self._ring_sums = upload(mi.Float, proposals.rings)
        self._azimuth_sums = upload(mi.Float, proposals.azimuths)
        occupied = proposals.occupied.astype(np.float32)
        self._strategies = Strategies(occupied, proposals.order_0, table.z_max)
        self._wavenumbers = [mi.Float(k) for k in wavenumber(RGB_WAVELENGTHS).tolist()]
        # 1/(2·variance) of the lobes in (u, v)
        self._sharpness = [(2.0 * math.pi * table.sigma_0 / lam) ** 2 for lam in LOBES]

    def answers(
        self,
        pair: Pair | PairThrough,
        height_scale: Float,
        drawing_scale: Float,
        si: Interaction,
        kinds: str,
    ) -> tuple[Powers, Float]:
        """See `SpectralPower.answers`."""
        power, density = Powers(mi.Color3f(0.0), mi.Color3f(0.0)), mi.Float(0.0)
        if "d" in kinds:
            outer = pair.outer
            share, band, _ = self._strategies.at(dr.detach(drawing_scale), outer.cos_i)
            density = self._density(outer.uv, share, band) * outer.cos_o * outer.frame.area
        if "v" in kinds:
            power = self._power(*pair.place, height_scale)
        return power, density

    def _power(self, uv: Vector2f, w: Float, height_scale: Float) -> Powers:
        """Return the `Powers` of a place."""
        z = w * height_scale
        others, zeroth = self._others(uv, z), self._zeroth(uv, z)
        if not self._coherent:
            return Powers(others, zeroth)
        # the table has |o + c|² − |c|², with c of order 0: o is taken in phase with c, or opposite
        total = others + zeroth
        both = (total > _LEAST) & (zeroth > _LEAST)
        apart = dr.sqrt(dr.maximum(total, _LEAST)) - dr.sqrt(dr.maximum(zeroth, _LEAST))
        cosine = dr.select(both, dr.sign(apart), 0.0)
        outside = dr.clip(total, dr.minimum(zeroth, 0.0), dr.maximum(zeroth, 0.0))  # of the gamut
        others = dr.select(both, dr.square(apart), total - outside)
        return Powers(others, dr.select(both, zeroth, outside), cosine)

    def bounded(self, si: Interaction) -> Interaction:
        """See `SpectralPower.bounded`; colours have no bounds."""
        return si

    def wavenumbers(self, si: Interaction) -> list[Float]:
        """See `SpectralPower.wavenumbers`; of the wavelength that is a channel's mean."""
        return self._wavenumbers

    def flat(self, pair: Pair, si: Interaction) -> Colour:
        """See `SpectralPower.flat`: of order 0 where no phase tells heights apart."""
        return self._zeroth(pair.uv, mi.Float(0.0))

    def _ring_at(self, squared_radius: Float) -> Float:
        """Position among the rings; below 0 inside the smallest."""
        smallest = self._grid.smallest**2
        logarithm = dr.log(maximum(squared_radius, 0.25 * smallest) * (1.0 / smallest))
        return logarithm * (0.5 / self._grid.step)

    def _turn(self, uv: Vector2f) -> Float:
        """Azimuth in turns, 0 … 1."""
        turn = dr.atan2(uv.y, uv.x) * (0.5 / dr.pi)
        return dr.select(turn < 0.0, turn + 1.0, turn)

    def _start(self, ring: Index) -> Index:
        """Index of a ring's first bin."""
        return read(mi.UInt32, self._starts, ring)

    def _others(self, uv: Vector2f, z: Float) -> Colour:
        """Return the RGB of all orders but 0 in 1/µm², signed; z must not be beyond the table's."""
        interval, weights = series_weights(self._expansion, TERMS, z)
        ring, t = _split(self._ring_at(dr.squared_norm(uv)), self._grid.rings)
        turn = self._turn(uv)
        starts = [self._start(ring + n) for n in range(3)]
        total = [mi.Float(0.0)] * (3 * TERMS)
        for n, of_ring in ((0, 1.0 - t), (1, t)):
            count = starts[n + 1] - starts[n]  # one more than there are azimuths
            azimuth, a = _split(turn * (mi.Float(count) - 1.0), count)
            bin_ = interval * self._grid.bins + starts[n] + azimuth
            for m, share in ((0, of_ring * (1.0 - a)), (1, of_ring * a)):
                packet = read_record(self._coefficients, bin_ + m, PACKET)
                total = [dr.fma(p, share, s) for p, s in zip(packet, total, strict=False)]
        colours = (inner(total[c * TERMS : (c + 1) * TERMS], weights) for c in range(3))
        return mi.Color3f(*(colour * self._inverse_scale for colour in colours))

    def _zeroth(self, uv: Vector2f, z: Float) -> Colour:
        """Return the RGB of order 0, 0 beyond its lobe."""
        radius = dr.sqrt(maximum(dr.squared_norm(uv), 1e-14))
        inside = radius < self._radius_end
        at_radius = radius * ((self._radii - 1) / self._radius_end)
        row, s = _split(dr.select(inside, at_radius, 0.0), self._radii)
        column, t = _split(z * ((self._columns - 1) / self._z_max), self._columns)
        result = [mi.Float(0.0)] * 3
        for n, of_radius in ((0, 1.0 - s), (1, s)):
            for m, of_z in ((0, 1.0 - t), (1, t)):
                packet = read_record(self._order_0, (row + n) * self._columns + column + m, 4)
                share = dr.select(inside, of_radius * of_z, 0.0)
                result = [dr.fma(p, share, r) for p, r in zip(packet, result, strict=False)]
        return mi.Color3f(*result)

    def _density(self, uv: Vector2f, share: Float, band: Index) -> Float:
        """Density of `draw` per du dv."""
        squared_radius = dr.squared_norm(uv)
        glossy = mi.Float(0.0)
        for sharpness in self._sharpness:
            lobe = dr.exp(-sharpness * squared_radius) * (sharpness / dr.pi)
            glossy += lobe * (1.0 / len(self._sharpness))
        position = self._ring_at(squared_radius)
        inside = (position >= 0.0) & (position < self._grid.rings - 1.0)
        position = dr.select(inside, position, 0.0)
        ring = dr.minimum(mi.UInt32(position), self._grid.rings - 2)
        start, count = self._ring(ring)
        azimuth = dr.minimum(mi.UInt32(self._turn(uv) * mi.Float(count)), count - 1)
        cell = self._difference(self._ring_sums, band * self._grid.rings + ring)
        cell *= self._difference(self._azimuth_sums, band * self._grid.bins + start + azimuth)
        # A cell is step·2π/count wide in ln r and φ, and r² d(ln r) dφ = du dv
        area = squared_radius * (self._grid.step * 2.0 * dr.pi)
        cell = dr.select(inside, cell * mi.Float(count) / dr.select(inside, area, 1.0), 0.0)
        return dr.lerp(cell, glossy, share)

    def draw(
        self, cos_i: Float, height_scale: Float, sample1: Float, sample2: Vector2f, si: Interaction
    ) -> Vector2f:
        """See `SpectralPower.draw`."""
        share, band, _ = self._strategies.at(height_scale, cos_i)
        lobe = dr.clip(sample1 / share * len(self._sharpness), 0, len(self._sharpness) - 1)
        lobe = mi.UInt32(lobe)
        sample2 = minimum(sample2, BELOW_ONE)
        width = mi.Float(0.0)
        for n, sharpness in enumerate(self._sharpness):
            width = dr.select(lobe == n, math.sqrt(0.5 / sharpness), width)
        glossy = mi.warp.square_to_std_normal(sample2) * width
        grid = self._grid
        ring, t = invert(self._ring_sums, band * grid.rings, grid.rings - 1, grid.rings, sample2.y)
        start, count = self._ring(ring)
        first, most = band * grid.bins + start, max(grid.counts)
        azimuth, a = invert(self._azimuth_sums, first, count, most, sample2.x)
        radius = grid.smallest * dr.exp((mi.Float(ring) + t) * grid.step)
        sin, cos = dr.sincos((mi.Float(azimuth) + a) * (2.0 * dr.pi) / mi.Float(count))
        return dr.select(
            sample1 < share, mi.Vector2f(glossy), mi.Vector2f(radius * cos, radius * sin)
        )

    def _ring(self, ring: Index) -> tuple[Index, Index]:
        """First bin of a ring, and its azimuths."""
        start = self._start(ring)
        return start, self._start(ring + 1) - start - 1

    def _difference(self, sums: Buffer, index: Index) -> Float:
        return read(mi.Float, sums, index + 1) - read(mi.Float, sums, index)


#: The colours of a table in the current variant's memory.
rgb_power = once_a_table(RGBPower)
