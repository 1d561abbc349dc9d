"""BSDF that diffracts light over a nested BSDF, which receives the remaining light.

Component 0 is the diffraction; the nested BSDF's components follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi

from .arithmetic import clip
from .directions import Site
from .lifecycle import ALL_COMPONENTS, PluginBSDF, ask
from .parameter_changes import ObjectValues
from .types import (
    BSDF,
    Colour,
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


class NestingBSDF(PluginBSDF):
    """Diffraction over another BSDF, or over none.

    nested : the BSDF beneath, or None.
    """

    def __init__(self, props: Properties, nested: BSDF) -> None:
        super().__init__(props)
        self.nested = nested

    def ready(self) -> None:
        """Finish loading (`PluginBSDF.ready`); the nested BSDF is the last parameter."""
        if self.nested is not None:
            self.parameters.append(ObjectValues("nested", self.nested))
        super().ready()

    def components(self) -> list[int]:
        """See `PluginBSDF.components`."""
        flags = mi.BSDFFlags
        glossy = flags.GlossyReflection | flags.Anisotropic | flags.FrontSide
        nested = self.nested
        below = [] if nested is None else [nested.flags(n) for n in range(nested.component_count())]
        return [glossy, *below]

    # ------------------------------------------------------------------ the diffraction

    def site_at(self, si: Interaction, active: Mask) -> Site:
        """Return points of the surface, with frame, scale and wavenumbers."""
        raise NotImplementedError

    def diffracted(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """Return f cosθo and the density of `draw`, those asked for: see `PluginBSDF.answers`.

        active : lanes whose two directions lie above the surface.
        """
        raise NotImplementedError

    def draw(self, site: Site, sample1: Float, sample2: Vector2f) -> Vector3f:
        """Draw a direction, possibly below the surface, where it has no density and no value."""
        raise NotImplementedError

    def reflected_share(self, site: Site, active: Mask) -> Colour:
        """Return the part of the light from ωi that the surface reflects, about."""
        raise NotImplementedError

    def beneath(self, site: Site, wo: Vector3f, active: Mask) -> Colour:
        """Return the factor of the nested BSDF."""
        raise NotImplementedError

    def normal_reflectance(self, site: Site, active: Mask) -> Spectrum:
        """Return the share of the light that the surface reflects at normal incidence."""
        raise NotImplementedError

    # ------------------------------------------------------------------ Mitsuba's interface

    def answers(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask, kinds: str
    ) -> Sequence[Any]:
        """See `PluginBSDF.answers`."""
        active = mi.Mask(active)
        value, density = self.evaluated(ctx, self.site_at(si, active), wo, active, kinds)
        return [value if kind == "v" else density for kind in kinds]

    def evaluated(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """Return value and density, nested BSDF included; only those asked for are meant."""
        cos_i, cos_o = mi.Frame3f.cos_theta(site.si.wi), mi.Frame3f.cos_theta(wo)
        active = active & (cos_i > 0.0) & (cos_o > 0.0)
        diffracts, nested = self._asked(ctx)
        value, density = mi.Spectrum(0.0), mi.Float(0.0)
        if diffracts:
            value, density = self.diffracted(ctx, site, wo, active, kinds)
        if nested is not None:
            below = ask(self.nested, nested, site.si, wo, active, kinds)
            if "v" in kinds:  # T(ωi) T(ωo) f of the BSDF beneath
                value += mi.Spectrum(self.beneath(site, wo, active)) * _valid(below[0])
            if "d" in kinds:
                share = self._glossy_share(diffracts, site, active)
                density = dr.lerp(below[-1], density, share)
        return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

    def sample(
        self,
        ctx: Context,
        si: Interaction,
        sample1: Float,
        sample2: Vector2f,
        active: Mask = True,
    ) -> tuple[Sample, Spectrum]:
        """Draw a direction; return it with f cosθo over its density.

        Lobes of a nested BSDF that have a single direction are returned alone: the diffraction has
        no share in them. All others are mixed with it, in value and density.
        """
        active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0)
        site = self.site_at(si, active)
        diffracts, nested = self._asked(ctx)
        result = dr.zeros(mi.BSDFSample3f)
        result.eta = 1.0
        result.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        share, delta, weight = mi.Float(1.0), mi.Mask(False), mi.Spectrum(0.0)
        if nested is not None:
            share = self._glossy_share(diffracts, site, active)
            chosen = active & (sample1 >= share)
            remaining = (sample1 - share) / dr.select(chosen, 1.0 - share, 1.0)
            below, weight = self.nested.sample(nested, si, remaining, sample2, chosen)
            weight = _valid(weight)
            below.sampled_component += 1
            result = dr.select(chosen, below, result)
            delta = chosen & mi.has_flag(below.sampled_type, mi.BSDFFlags.Delta)
            sample1 = dr.select(chosen, sample1, sample1 / dr.select(chosen, 1.0, share))
        if diffracts:
            drawn = self.draw(site, sample1, sample2)
            result.wo = drawn if nested is None else dr.select(chosen, result.wo, drawn)
        smooth = dr.select(delta, False, active)
        value, pdf = self.evaluated(ctx, site, result.wo, smooth, "vd")
        value = value / dr.select(pdf > 0.0, pdf, 1.0)
        if nested is not None:
            beneath = mi.Spectrum(self.beneath(site, result.wo, delta))
            value = dr.select(delta, beneath * weight / dr.select(delta, 1.0 - share, 1.0), value)
            pdf = dr.select(delta, result.pdf * (1.0 - share), pdf)
        active &= (pdf > 0.0) & (mi.Frame3f.cos_theta(result.wo) > 0.0)
        result.pdf = dr.select(active, pdf, 0.0)
        return result, dr.select(active, value, 0.0)

    def eval_diffuse_reflectance(self, si: Interaction, active: Mask = True) -> Spectrum:
        """Return the reflectance at normal incidence, nested BSDF included, for denoisers."""
        level = mi.SurfaceInteraction3f(si)
        level.wi = mi.Vector3f(0.0, 0.0, 1.0)
        site = self.site_at(level, active)
        reflectance = self.normal_reflectance(site, active)
        if self.nested is not None:
            nested = self.nested.eval_diffuse_reflectance(level, active)
            reflectance += mi.Spectrum(self.beneath(site, level.wi, active)) * _valid(nested)
        return dr.select(active, dr.clip(reflectance, 0.0, 1.0), 0.0)

    def _asked(self, ctx: Context) -> tuple[bool, Context | None]:
        """Whether a context asks for the diffraction, and its request to the nested BSDF."""
        diffracts = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
        nested = self.nested
        if nested is None or ctx.component == 0:
            return diffracts, None
        lobes = nested.flags()
        asked = mi.BSDFContext(ctx.mode, ctx.type_mask, ctx.component)
        if ctx.component != ALL_COMPONENTS:
            asked.component -= 1
            lobes = nested.flags(asked.component)
        return diffracts, asked if ctx.type_mask & int(lobes) & int(mi.BSDFFlags.All) else None

    def _glossy_share(self, diffracts: bool, site: Site, active: Mask) -> Float:
        """Share of the samples for diffraction over a nested BSDF: by reflected power."""
        if not diffracts:
            return mi.Float(0.0)
        mean = dr.mean(mi.unpolarized_spectrum(self.reflected_share(site, active)))
        # A nested BSDF is taken to return half of the light that it receives
        return clip(mean / (0.5 + 0.5 * mean), 0.1, 0.9)


def _valid(light: Spectrum) -> Spectrum:
    """Return light of a nested BSDF, 0 where it is negative or not a number."""
    valid = mi.unpolarized_spectrum(light) >= 0.0
    return dr.select(dr.all(valid) if mi.is_polarized else valid, light, 0.0)
