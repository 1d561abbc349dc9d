"""Thin sheets with solved orders (Dr.Jit).

Both sides of a sheet have the same medium, so order m leaves with the same tangential part above
and below: lobes, look-ups and draws work as for a reflecting grating, with another column of the
table for light that leaves on the other side.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ..directions import Pair, Site
from ..lifecycle import asked_sides, both_sides, sample_of
from ..types import (
    Context,
    Float,
    Interaction,
    Mask,
    Sample,
    Spectrum,
    Vector2f,
    Vector3f,
)
from .diffraction_orders import DiffractionOrders


class OrdersSheet(DiffractionOrders):
    """Reflection and transmission of a thin sheet with solved orders."""

    def components(self) -> list[int]:
        """See `PluginBSDF.components`."""
        return both_sides()

    def evaluated(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """See `NestingBSDF.evaluated`; of the requested components."""
        sides = mi.Frame3f.cos_theta(site.si.wi) * mi.Frame3f.cos_theta(wo)
        lit = active & (sides != 0.0) & requested(ctx, sides < 0.0)
        below = mi.Mask(wo.z < 0.0)
        above = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))
        pair = Pair(site.si, above, site.frame, lit)
        light = self._lobes.reflected(pair, site.si, below, ctx)
        return dr.select(lit, light.value, 0.0), dr.select(lit, light.density, 0.0)

    def sample(
        self,
        ctx: Context,
        si: Interaction,
        sample1: Float,
        sample2: Vector2f,
        active: Mask = True,
    ) -> tuple[Sample, Spectrum]:
        """Draw a side and an order by power, and a direction in its lobe.

        A context for one component has no light where the other one is drawn.
        """
        active = mi.Mask(active)
        site = self.site_at(si, active)
        wo, below = self._drawn(site, sample1, sample2)
        wo.z = dr.mulsign(dr.maximum(wo.z, 0.0), dr.select(below, mi.Float(-1.0), 1.0))
        value, density = self.evaluated(ctx, site, wo, active, "vd")
        lit = density > 0.0
        cos_i = mi.Frame3f.cos_theta(si.wi)
        result = sample_of(wo, density, cos_i * wo.z < 0.0, self.relative_index(cos_i, wo.z))
        return result, dr.select(lit, value / dr.select(lit, density, 1.0), 0.0)

    def relative_index(self, cos_i: Float, cos_o: Float) -> Float:
        """Return the index of the medium of ωo over that of ωi, by their cosines."""
        return mi.Float(1.0)


def requested(ctx: Context, passed: Mask) -> Mask:
    """Mask of the lanes whose component a context asks for; passed : whether light goes through."""
    reflection, transmission = map(mi.Mask, asked_sides(ctx))
    return dr.select(passed, transmission, reflection)
