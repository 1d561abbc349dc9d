"""Thin sheets with solved orders (Dr.Jit).

Both sides of a sheet have the same medium, so order m leaves with the same tangential part above
and below: lobes, look-ups and draws work as for a reflecting grating, with another column of the
table for light that leaves on the other side.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ..base import asked_sides
from ..directions import Pair, Site
from ..types import Context, Float, Mask, Spectrum, Vector2f, Vector3f
from .diffraction_orders import DiffractionOrders


class OrdersSheet(DiffractionOrders):
    """Reflection and transmission of a thin sheet with solved orders."""

    transmits = True

    def diffracted(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """See `SurfaceBSDF.diffracted`; of the requested components."""
        sides = mi.Frame3f.cos_theta(site.si.wi) * mi.Frame3f.cos_theta(wo)
        lit = active & (sides != 0.0) & requested(ctx, sides < 0.0)
        below = mi.Mask(wo.z < 0.0)
        above = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))
        pair = Pair(site.si, above, site.frame, lit)
        light = self._lobes.reflected(pair, site.si, below, ctx)
        return dr.select(lit, light.value, 0.0), dr.select(lit, light.density, 0.0)

    def draw(self, ctx: Context, site: Site, sample1: Float, sample2: Vector2f) -> Vector3f:
        """Draw a side and an order by power, and a direction in its lobe.

        A context for one component has no light where the other one is drawn.
        """
        wo, below = self._drawn(site, sample1, sample2)
        wo.z = dr.mulsign(dr.maximum(wo.z, 0.0), dr.select(below, mi.Float(-1.0), 1.0))
        return wo


def requested(ctx: Context, passed: Mask) -> Mask:
    """Mask of the lanes whose component a context asks for; passed : whether light goes through."""
    reflection, transmission = map(mi.Mask, asked_sides(ctx))
    return dr.select(passed, transmission, reflection)
