"""Thin sheets with solved orders, and the plugin `diffraction_orders` (Dr.Jit).

Both sides of a sheet have the same medium, so order m leaves with the same tangential part above
and below: lobes, look-ups and draws are those of a reflecting grating, with another column of the
table for light that leaves on the other side.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ..directions import Pair
from ..types import (
    Context,
    Float,
    Interaction,
    Mask,
    Properties,
    Sample,
    Spectrum,
    Vector2f,
    Vector3f,
)
from .diffraction_orders import DiffractionOrders
from .grating_parameters import Parameters, read_parameters


class OrdersSheet(DiffractionOrders):
    """Reflection and transmission of a thin sheet with solved orders."""

    def __init__(self, props: Properties, read: Parameters) -> None:
        super().__init__(props, read)
        flags = mi.BSDFFlags
        sides = flags.FrontSide | flags.BackSide | flags.Anisotropic
        components = [flags.GlossyReflection | sides, flags.GlossyTransmission | sides]
        self.m_components = components
        self.m_flags = components[0] | components[1]

    # ------------------------------------------------------------------ Mitsuba's interface

    def eval(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Spectrum:
        """Return f |cosθo| per wavelength."""
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Float:
        """Return the density of `sample` per solid angle, of the requested components."""
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
    ) -> tuple[Spectrum, Float]:
        """Return `eval` and `pdf` at once."""
        sides = mi.Frame3f.cos_theta(si.wi) * mi.Frame3f.cos_theta(wo)
        lit = mi.Mask(active) & (sides != 0.0) & _requested(ctx, sides < 0.0)
        below = mi.Mask(wo.z < 0.0)
        above = mi.Vector3f(wo.x, wo.y, dr.abs(wo.z))
        pair = Pair(si, above, self._frame(si, lit), lit)
        light = self._lobes.reflected(pair, si, below, ctx)
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
        wo, below = self._drawn(si, sample1, sample2, active)
        wo.z = dr.mulsign(dr.maximum(wo.z, 0.0), dr.select(below, mi.Float(-1.0), 1.0))
        value, density = self.eval_pdf(ctx, si, wo, active)
        lit = density > 0.0
        passed = mi.Frame3f.cos_theta(si.wi) * wo.z < 0.0
        kinds = mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission
        result = dr.zeros(mi.BSDFSample3f)
        result.wo, result.eta, result.pdf = wo, 1.0, density
        result.sampled_type = dr.select(passed, mi.UInt32(+kinds[1]), mi.UInt32(+kinds[0]))
        result.sampled_component = dr.select(passed, mi.UInt32(1), mi.UInt32(0))
        return result, dr.select(lit, value / dr.select(lit, density, 1.0), 0.0)


def _requested(ctx: Context, passed: Mask) -> Mask:
    """Mask of the lanes whose component a context asks for; passed : whether light goes through."""
    reflection = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
    transmission = ctx.is_enabled(mi.BSDFFlags.GlossyTransmission, 1)
    return dr.select(passed, mi.Mask(transmission), mi.Mask(reflection))


def diffraction_orders(props: Properties) -> DiffractionOrders:
    """Return the BSDF of the plugin: a sheet if the table is that of one.

    Raises
    ------
    DiffractionError
        With the parameter, its value and the choices.
    """
    read = read_parameters(props)
    return (OrdersSheet if read.table.thin else DiffractionOrders)(props, read)


mi.register_bsdf("diffraction_orders", diffraction_orders)
