"""Light on both sides of a dielectric, or of a thin sheet with one structured side (Dr.Jit).

The twin of `optics.through`, which has the formulas. From below, a dielectric reflects like a
surface of index 1/n in light of λ/n, and a thin sheet like such a surface under a coat of index n,
its flat side (`optics.coat`). What the flat side sends back to light from above passes the
structure twice, at places that have nothing to do with each other: to first order in κ² that is one
passage of κ = √(κi² + κo²), exact for order 0 of a Gaussian surface, with the power that two
mirrors leave it. Light that the structure sends beyond the sheet's critical angle is lost.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ..boundary import Boundary, Jones, Kirchhoff, SmallSlope, mueller
from ..directions import Pair, Place, from_patch
from ..fresnel import Dielectric, Inside, squared
from ..layers import CoatedPair, transmittances
from ..sampling import EVEN, direction_of, with_even_share
from ..types import (
    BSDF,
    Colour,
    Context,
    Float,
    Interaction,
    Mask,
    Rotation,
    Sample,
    Spectrum,
    Vector2f,
    Vector3f,
)
from .crossing import (
    Crossing,
    Sides,
    Turned,
    crossing_axes,
    first_order,
    order_0,
    out_of_sheet,
    tangent_plane,
)
from .energy import SidesModel

_LEAST_SHARE = 0.1
#: Of a dielectric over the medium above it.
LEAST_INDEX = 1.01


class Through:
    """Both sides of a BSDF without anything nested.

    Parameters
    ----------
    material : of the surface.
    boundary : of light from above; the one of light from within follows.
    thin : whether below is beyond the flat side of a sheet.
    balance : what makes both sides add up to 1, if anything.
    """

    def __init__(
        self,
        material: Dielectric,
        boundary: Boundary,
        thin: bool,
        balance: SidesModel | None,
    ) -> None:
        self.material, self.thin, self.balance = material, thin, balance
        self.boundary = boundary
        within = Inside(material, thin)
        self.below: Boundary = (
            boundary.of(within) if isinstance(boundary, SmallSlope) else Kirchhoff(within)
        )
        self.mirror = Kirchhoff(material)

    def flags(self) -> list[int]:
        """Of reflection and of transmission."""
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide | mi.BSDFFlags.Anisotropic
        through = mi.BSDFFlags.GlossyTransmission | sides
        if not self.thin:
            through = through | mi.BSDFFlags.NonSymmetric
        return [mi.BSDFFlags.GlossyReflection | sides, through]

    def eval_pdf(
        self, bsdf: BSDF, ctx: Context, si: Interaction, wo: Vector3f, active: Mask
    ) -> tuple[Spectrum, Float]:
        """`eval` and `pdf` of the BSDF."""
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        reflects, passes = _asked(ctx)
        share = self._share(cos_i, reflects, passes)
        rotation = bsdf.orientation.rotation(si, active)
        value, density = mi.Spectrum(0.0), mi.Float(0.0)
        change = None
        if self.balance is not None and self.balance.takes:
            k, scale = bsdf.power.wavenumbers(si), bsdf.scale_at(si, active)
            change = self.balance.product((si.wi, wo), rotation, k, scale)
        if reflects:
            for front in (True, False):
                lit = active & ((cos_i > 0.0) == front) & (cos_i * cos_o > 0.0)
                side, orders = self._reflected(bsdf, ctx, si, wo, rotation, lit, front, change)
                value = dr.select(lit, side, value)
                density = dr.select(lit, share * with_even_share(orders), density)
        if passes:
            lit = active & (cos_i * cos_o < 0.0)
            crossing = Crossing(si, wo, rotation, lit, self.material.eta, self.thin)
            passed = self._passed(bsdf, ctx, si, crossing, change) * dr.abs(cos_o)
            value = dr.select(lit, passed, value)
            out = Sides.of(self.material.eta, self.thin, cos_i > 0.0).out
            scale = bsdf.scale_at(si, active)
            orders = bsdf.power.density(crossing, scale, si) * dr.square(out)
            density = dr.select(lit, (1.0 - share) * with_even_share(orders), density)
        return value, density

    def sample(
        self,
        bsdf: BSDF,
        ctx: Context,
        si: Interaction,
        sample1: Float,
        sample2: Vector2f,
        active: Mask,
    ) -> tuple[Sample, Spectrum]:
        """`sample` of the BSDF: one of the sides by its flat reflectance, then by the orders."""
        cos_i = mi.Frame3f.cos_theta(si.wi)
        active = mi.Mask(active) & (cos_i != 0.0)
        share = self._share(cos_i, *_asked(ctx))
        reflected = sample1 < share
        sample1 = dr.select(
            reflected, sample1 / dr.maximum(share, 1e-6), (sample1 - share) / (1.0 - share + 1e-6)
        )
        down, n = cos_i > 0.0, dr.detach(self.material.eta)
        sides = Sides.of(n, self.thin, down)
        inner = mi.Float(1.0) if self.thin else n
        into = dr.select(reflected, dr.select(down, 1.0, inner), sides.into)
        out = dr.select(reflected, into, sides.out)
        sign = dr.select(reflected & down, 1.0, -1.0)
        cosine = dr.abs(cos_i)
        drawn = bsdf.power.draw(
            dr.select(reflected, cosine, sides.cosine(cosine, n, down, self.thin)),
            dr.detach(bsdf.scale_at(si, active) * dr.select(reflected & (cos_i < 0.0), n, 1.0)),
            dr.maximum((sample1 - EVEN) * (1.0 / (1.0 - EVEN)), 0.0),
            sample2,
            si,
        )
        rotation = bsdf.orientation.rotation(si, active)
        total = sign * from_patch(drawn, rotation) - into * mi.Vector2f(si.wi.x, si.wi.y)
        wo = dr.select(
            sample1 < EVEN, mi.warp.square_to_uniform_hemisphere(sample2), direction_of(total / out)
        )
        active &= wo.z > 0.0
        wo.z = dr.select(reflected == down, wo.z, -wo.z)
        value, density = self.eval_pdf(bsdf, ctx, si, wo, active)
        active &= density > 0.0
        result = dr.zeros(mi.BSDFSample3f)
        result.wo = wo
        result.pdf = dr.select(active, density, 0.0)
        result.eta = dr.select(reflected, 1.0, out / into)
        kinds = mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission
        result.sampled_type = dr.select(reflected, mi.UInt32(+kinds[0]), mi.UInt32(+kinds[1]))
        result.sampled_component = dr.select(reflected, mi.UInt32(0), mi.UInt32(1))
        return result, dr.select(active, value / dr.select(active, density, 1.0), 0.0)

    def _reflected(
        self,
        bsdf: BSDF,
        ctx: Context,
        si: Interaction,
        wo: Vector3f,
        rotation: Rotation,
        lit: Mask,
        front: bool,
        change: Colour | None,
    ) -> tuple[Spectrum, Float]:
        """Value and density of light that stays on one side."""
        n, scale = self.material.eta, bsdf.scale_at(si, lit)
        if front:
            pair = Pair(si, wo, rotation, lit)
            power = _changed(bsdf, si, pair, scale, change)
            value = bsdf.lobe(ctx, si, pair, self.boundary, lit, power)
            if self.thin:
                value += self._returned(bsdf, si, pair, scale, change)
            density = bsdf.power.density(pair, scale, si)
            return value, density
        if self.thin:
            outer = Turned(si, wo, rotation, lit, mi.Float(1.0))
            pair = CoatedPair(outer, n)
            power = _changed(bsdf, si, pair, scale, change)
            value = bsdf.lobe(ctx, si, pair, self.below, lit, power)
            face = bsdf.face(ctx, si, outer, self.mirror, lit)
            value += face if change is None else mi.Spectrum(change) * face
            density = bsdf.power.density(outer, scale * n, si)
            return value, density
        inner = Turned(si, wo, rotation, lit, n)
        power = _changed(bsdf, si, inner.place, scale, change)
        # not in place: tables do not reach farther
        lit = lit & inner.reached
        value = bsdf.lobe(ctx, si, inner, self.below, lit, power) * dr.square(n)
        density = bsdf.power.density(inner, scale * n, si) * dr.square(n)
        return value, density

    def _returned(
        self, bsdf: BSDF, si: Interaction, pair: Pair, scale: Float, change: Colour | None
    ) -> Spectrum:
        """f·cosθo of what the flat side of a sheet sends back through the structure."""
        n = self.material.eta
        ends, kept = [], []
        for cosine in (pair.cos_i, pair.cos_o):
            ends.append(dr.sqrt(dr.fma(cosine, cosine, n * n - 1.0)) - cosine)
            passed = transmittances(cosine, n)
            # T² R/(1 − R²) of each polarisation
            kept.append(0.5 * sum(t * (1.0 - t) * dr.rcp(2.0 - t) for t in passed))
        place = Place(pair.uv, dr.sqrt(dr.fma(ends[0], ends[0], dr.square(ends[1]))))
        power = _changed(bsdf, si, place, scale, change)
        factor = bsdf.area_factor * dr.safe_sqrt(kept[0] * kept[1]) * pair.cos_o
        return mi.depolarizer(power * factor)

    def _passed(
        self,
        bsdf: BSDF,
        ctx: Context,
        si: Interaction,
        crossing: Crossing,
        change: Colour | None,
    ) -> Spectrum:
        """BSDF of light that goes through, as the mode of transport has it.

        Order 0 has what the flat surface transmits, and is finite where w → 0, as all others are.
        """
        place, scale = crossing.place, bsdf.scale_at(si, crossing.active)
        power, zeroth = bsdf.power.power(place, scale, si), bsdf.power.zeroth(place, scale, si)
        zeroth = dr.minimum(zeroth, power)  # speckle may be dark
        axes = crossing_axes(-crossing.above, crossing.inside)
        per_w = crossing.n * dr.rcp(dr.square(place.w) * crossing.q0 * -crossing.inside.z)
        others = self._factor(ctx, si, crossing, axes, self._matrices(bsdf, si, crossing, axes))
        flat = self._factor(ctx, si, crossing, axes, [order_0(crossing, axes, self.thin)])
        value = mi.Spectrum((power - zeroth) * per_w) * others
        value += mi.Spectrum(zeroth if change is None else zeroth * change) * flat
        outside = mi.Float(bsdf.area_factor)
        if not self.thin:
            # Radiance over n² is transmitted; light along ωi or ωo
            down = mi.Frame3f.cos_theta(si.wi) > 0.0
            scales = mi.Float(1.0), dr.square(crossing.n)
            if ctx.mode == mi.TransportMode.Importance:
                scales = scales[::-1]
            outside *= dr.select(down, *scales)
        return dr.select(crossing.active, value * outside, 0.0)

    def _matrices(
        self,
        bsdf: BSDF,
        si: Interaction,
        crossing: Crossing,
        axes: tuple[Vector3f, Vector3f],
    ) -> list[Jones]:
        """2 cosθi cosθt times the Jones matrices of light from above, of each channel or of all."""
        tangent = tangent_plane(crossing, axes)
        if not isinstance(self.boundary, SmallSlope):
            return [out_of_sheet(tangent, crossing)] if self.thin else [tangent]
        first = first_order(crossing, axes, self.thin)
        shares = self.boundary.shares(
            crossing.place,
            bsdf.scale_at(si, crossing.active),
            bsdf.power.wavenumbers(si),
            [crossing.n],
        )
        blended = [
            tuple(b + (k - b) * share for k, b in zip(tangent, first, strict=True))
            for share in shares
        ]
        return [out_of_sheet(jones, crossing) for jones in blended] if self.thin else blended

    def _factor(
        self,
        ctx: Context,
        si: Interaction,
        crossing: Crossing,
        axes: tuple[Vector3f, Vector3f],
        matrices: list[Jones],
    ) -> Spectrum:
        """½ Σ|J|², or Mueller matrices, for each channel."""
        if not mi.is_polarized:
            powers = [0.5 * sum(map(squared, jones)) for jones in matrices]
            return mi.UnpolarizedSpectrum(powers if len(powers) > 1 else powers[0])
        # light that goes up is that which goes down, reversed: with other s, so other signs
        importance = ctx.mode == mi.TransportMode.Importance
        falls = (mi.Frame3f.cos_theta(si.wi) > 0.0) == mi.Mask(importance)
        ends = -crossing.above, crossing.below
        light = tuple(
            dr.select(falls, *both) for both in ((ends[0], -ends[1]), (ends[1], -ends[0]))
        )
        about = tuple(
            dr.select(falls, *both) for both in ((axes[0], -axes[1]), (axes[1], -axes[0]))
        )
        turned_round = [
            (ss, dr.select(falls, sp, -ps), dr.select(falls, ps, -sp), pp)
            for ss, sp, ps, pp in matrices
        ]
        return mueller(turned_round, light, about)

    def _share(self, cos_i: Float, reflects: bool, passes: bool) -> Float:
        """Share of the orders' samples that stay on their side."""
        if not (reflects and passes):
            return mi.Float(1.0 if reflects else 0.0)
        cosine = dr.abs(cos_i) if self.thin else cos_i
        flat = dr.detach(mi.fresnel(cosine, self.material.eta)[0])
        if self.thin:
            flat = 2.0 * flat * dr.rcp(1.0 + flat)
        return dr.clip(flat, _LEAST_SHARE, 1.0 - _LEAST_SHARE)


def _changed(
    bsdf: BSDF, si: Interaction, place: Pair | Place, scale: Float, change: Colour | None
) -> Colour:
    """⟨|P|²⟩ as `PowerModel.power` has it, with order 0 multiplied by `change`."""
    power = bsdf.power.power(place, scale, si)
    if change is None:
        return power
    # of speckle, which may be dark, the ensemble's order 0 is not all there
    return power + (change - 1.0) * dr.minimum(bsdf.power.zeroth(place, scale, si), power)


def _asked(ctx: Context) -> tuple[bool, bool]:
    """Whether a context asks for reflection, and for transmission."""
    return (
        ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0),
        ctx.is_enabled(mi.BSDFFlags.GlossyTransmission, 1),
    )
