"""RGB variants: the diffracted power in daylight's colours, and directions drawn by brightness.

For the density of ωo per solid angle see `tables.colour_proposals`; (u, v) → ωo has the Jacobian
dωo = du dv / cosθo.
"""

from __future__ import annotations

import math
import weakref

import drjit as dr
import mitsuba as mi

from ..optics.colour import RGB_WAVELENGTHS
from ..optics.geometry import wavenumber
from ..tables.colour.proposals import BANDED, BANDS, LOBES, colour_proposals
from ..tables.colour.table import ColourTable
from ..tables.store.cache import cached_colours
from ..tables.table import DiffractionTable
from .crossing import Crossing
from .memory import index_between, read, upload
from .pair import Pair, Place
from .rgb_lookup import ColourLookup
from .roles import Buffer, Colour, Float, Index, Interaction, Vector2f
from .sampling import BELOW_ONE, invert, order_0_share

_models: weakref.WeakKeyDictionary[DiffractionTable, dict[str, RGBPower]] = (
    weakref.WeakKeyDictionary()
)


class RGBPower:
    """The `power.PowerModel` of variants without wavelengths, which are summed."""

    def __init__(self, table: ColourTable) -> None:
        self._lookup = ColourLookup(table)
        self._coordinates = self._lookup.coordinates
        self._z_max = table.z_max
        found = colour_proposals(table)
        self._rings, self._bins = found.rings.shape[1], table.grid.bins
        self._most = max(table.grid.counts)
        self._ring_sums = upload(mi.Float, found.rings)
        self._azimuth_sums = upload(mi.Float, found.azimuths)
        self._occupied = upload(mi.Float, found.occupied.astype("float32"))
        self._zs = len(found.order_0)
        self._order_0 = upload(mi.Float, found.order_0)
        self._wavenumbers = [mi.Float(k) for k in wavenumber(RGB_WAVELENGTHS).tolist()]
        # 1/(2·variance) of the lobes in (u, v)
        self._sharpness = [(2.0 * math.pi * table.sigma / lam) ** 2 for lam in LOBES]

    def power(self, pair: Pair | Place, height_scale: Float, si: Interaction) -> Colour:
        """See `PowerModel.power`."""
        return self._lookup.colour(pair.uv, pair.w * height_scale)

    def density(self, pair: Pair | Crossing, height_scale: Float, si: Interaction) -> Float:
        """See `PowerModel.density`."""
        strategy = self._strategy(pair.cos_i, dr.detach(height_scale))
        return self._density(pair.uv, *strategy) * pair.cos_o

    def both(
        self, pair: Pair, height_scale: Float, drawing_scale: Float, si: Interaction
    ) -> tuple[Colour, Float]:
        """See `PowerModel.both`."""
        density = self.density(pair.outer, drawing_scale, si)
        return self.power(pair, height_scale, si), density

    def wavenumbers(self, si: Interaction) -> list[Float]:
        """See `PowerModel.wavenumbers`; of the wavelength that is a channel's mean."""
        return self._wavenumbers

    def flat(self, pair: Pair | Place, si: Interaction) -> Colour:
        """See `PowerModel.flat`: of order 0 where no phase tells heights apart."""
        return self._lookup.zeroth(pair.uv, mi.Float(0.0))

    def zeroth(self, pair: Pair | Place, height_scale: Float, si: Interaction) -> Colour:
        """See `PowerModel.zeroth`."""
        return self._lookup.zeroth(pair.uv, pair.w * height_scale)

    def _density(self, uv: Vector2f, share: Float, band: Index) -> Float:
        """Density of `draw` per du dv."""
        squared_radius = dr.squared_norm(uv)
        glossy = mi.Float(0.0)
        for sharpness in self._sharpness:
            lobe = dr.exp(-sharpness * squared_radius) * (sharpness / dr.pi)
            glossy += lobe * (1.0 / len(self._sharpness))
        position = self._coordinates.ring(squared_radius)
        inside = (position >= 0.0) & (position < self._rings - 1.0)
        position = dr.select(inside, position, 0.0)
        ring = dr.minimum(mi.UInt32(position), self._rings - 2)
        start, count = self._ring(ring)
        azimuth = dr.minimum(mi.UInt32(self._coordinates.turn(uv) * mi.Float(count)), count - 1)
        cell = self._difference(self._ring_sums, band * self._rings + ring) * self._difference(
            self._azimuth_sums, band * self._bins + start + azimuth
        )
        # A cell is step·2π/count wide in ln r and φ, and r² d(ln r) dφ = du dv
        area = squared_radius * (self._coordinates.step * 2.0 * dr.pi)
        cell = dr.select(inside, cell * mi.Float(count) / dr.select(inside, area, 1.0), 0.0)
        return dr.lerp(cell, glossy, share)

    def draw(
        self, cos_i: Float, height_scale: Float, sample1: Float, sample2: Vector2f, si: Interaction
    ) -> Vector2f:
        """See `PowerModel.draw`."""
        share, band = self._strategy(cos_i, height_scale)
        lobe = dr.clip(sample1 / share * len(self._sharpness), 0, len(self._sharpness) - 1)
        lobe = mi.UInt32(lobe)
        sample2 = dr.minimum(sample2, BELOW_ONE)
        width = mi.Float(0.0)
        for n, sharpness in enumerate(self._sharpness):
            width = dr.select(lobe == n, math.sqrt(0.5 / sharpness), width)
        glossy = mi.warp.square_to_std_normal(sample2) * width
        ring, t = invert(
            self._ring_sums, band * self._rings, self._rings - 1, self._rings, sample2.y
        )
        start, count = self._ring(ring)
        azimuth, a = invert(
            self._azimuth_sums, band * self._bins + start, count, self._most, sample2.x
        )
        coordinates = self._coordinates
        radius = coordinates.smallest * dr.exp((mi.Float(ring) + t) * coordinates.step)
        sin, cos = dr.sincos((mi.Float(azimuth) + a) * (2.0 * dr.pi) / mi.Float(count))
        return dr.select(
            sample1 < share, mi.Vector2f(glossy), mi.Vector2f(radius * cos, radius * sin)
        )

    def _strategy(self, cos_i: Float, height_scale: Float) -> tuple[Float, Index]:
        """Share of the samples that order 0 gets, and the band of the other orders."""
        bands = BANDS / (BANDED * self._z_max)
        band = mi.UInt32(index_between(height_scale * (cos_i + 0.5) * bands, 0.0, BANDS - 1.0))
        position = 2.0 * height_scale * cos_i * ((self._zs - 1) / self._z_max)
        z = index_between(position, 0.0, self._zs - 1.0)
        brightness = read(mi.Float, self._order_0, mi.UInt32(z + 0.5))
        share = order_0_share(brightness, cos_i)
        return dr.select(read(mi.Float, self._occupied, band) > 0.0, share, 1.0), band

    def _ring(self, ring: Index) -> tuple[Index, Index]:
        """First bin of a ring, and its azimuths."""
        start = self._coordinates.start(ring)
        return start, self._coordinates.start(ring + 1) - start - 1

    def _difference(self, sums: Buffer, index: Index) -> Float:
        return read(mi.Float, sums, index + 1) - read(mi.Float, sums, index)


def rgb_power(table: DiffractionTable) -> RGBPower:
    """The colours in the current variant's memory, shared by all BSDFs of the table."""
    variants = _models.setdefault(table, {})
    if mi.variant() not in variants:
        variants[mi.variant()] = RGBPower(cached_colours(table))
    return variants[mi.variant()]
