"""Faces of blocks with solved orders, and the plugin `diffraction_orders` (Dr.Jit).

Lobes, look-ups and draws work with tangential parts of wave vectors over 2π/λ, n ωi and n ωo, which
orders change alike on both sides.
"""

from __future__ import annotations

from functools import cached_property

import drjit as dr
import mitsuba as mi

from ..directions import Pair, Site
from ..types import Context, Float, Mask, Properties, Spectrum, Vector2f, Vector3f
from .diffraction_orders import DiffractionOrders
from .grating_parameters import read_parameters
from .orders_sheet import OrdersSheet, requested


class Passage(Pair):
    """Pair of directions on any sides of a face, in media of two indices, as `Lobes` take it.

    Attributes
    ----------
    uv, incident : n ωi + n ωo and n ωi, tangential, in the patch's frame.
    cos_i : cosine of ωi, above 0 within the block.
    cos_o : n² |cosθo|, by which densities over tangential parts become those per solid angle.
    """

    def __init__(self, site: Site, wo: Vector3f, lit: Mask, indices: tuple[Float, Float]) -> None:
        super().__init__(site.si, wo, site.frame, lit)
        self._came, left = indices
        self.uv = site.frame.to_table(self._came * site.si.wi + left * wo)
        self.cos_i = dr.select(lit, -mi.Frame3f.cos_theta(site.si.wi), 1.0)
        self.cos_o = dr.square(left) * dr.abs(mi.Frame3f.cos_theta(wo))

    @cached_property
    def incident(self) -> Vector2f:
        """See `Pair.incident`."""
        return self.frame.turned(self._came * self.wi)


class OrdersBlock(OrdersSheet):
    """Reflection and transmission of a block's face with solved orders, from outside and within."""

    media_differ = True

    def diffracted(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """See `OrdersSheet.diffracted`."""
        cos_i, cos_o = mi.Frame3f.cos_theta(site.si.wi), mi.Frame3f.cos_theta(wo)
        lit = active & (cos_i * cos_o != 0.0) & requested(ctx, cos_i * cos_o < 0.0)
        came, left = self._index(cos_i > 0.0), self._index(cos_o > 0.0)
        pair = Passage(site, wo, lit, (came, left))
        light = self._lobes.reflected(pair, site.si, mi.Mask(cos_o > 0.0), ctx)
        value = light.value
        if ctx.mode == mi.TransportMode.Radiance:  # radiance over n² is transmitted
            value = value * dr.square(came / left)
        return dr.select(lit, value, 0.0), dr.select(lit, light.density, 0.0)

    def _drawn(self, site: Site, sample1: Float, sample2: Vector2f) -> tuple[Vector3f, Mask]:
        """See `DiffractionOrders._drawn`."""
        wi, cos_i = site.si.wi, mi.Frame3f.cos_theta(site.si.wi)
        came = self._index(cos_i > 0.0)
        incident = dr.detach(site.frame.turned(came * wi))
        drawn = self._lobes.draw(incident, -cos_i, site.si, sample1, sample2)
        above = drawn.below  # side 1 of a block's table
        tangential = site.frame.from_table(drawn.uv) - came * mi.Vector2f(wi.x, wi.y)
        below = dr.select(above, mi.Mask(False), mi.Mask(True))
        return self._direction(tangential / self._index(above), drawn.valid), below

    def relative_index(self, cos_i: Float, cos_o: Float) -> Float:
        """See `SurfaceBSDF.relative_index`."""
        return self._index(cos_o > 0.0) / self._index(cos_i > 0.0)

    def _index(self, above: Mask) -> Float:
        return dr.select(above, mi.Float(1.0), mi.Float(self.table.block))


def diffraction_orders(props: Properties) -> DiffractionOrders:
    """Return the BSDF of the plugin, by the table: a sheet, a block's face or a reflecting grating.

    Raises a DiffractionError with the parameter, its value and the choices.
    """
    read = read_parameters(props)
    kind = OrdersBlock if read.table.block else DiffractionOrders
    return (OrdersSheet if read.table.thin else kind)(props, read)


mi.register_bsdf("diffraction_orders", diffraction_orders)
