"""Methods of a BSDF that diffracts light over a nested BSDF, which receives what is not reflected.

A plugin takes them as they are, and has the methods of `Nesting`. Component 0 is the diffraction;
those of the nested BSDF follow.
"""

from __future__ import annotations

import functools
import operator
from typing import Any, Protocol

import drjit as dr
import mitsuba as mi

from .types import (
    BSDF,
    Colour,
    Context,
    Float,
    Interaction,
    Mask,
    Sample,
    Spectrum,
    Vector2f,
    Vector3f,
)

#: Component of a context that asks for all of them.
ALL_COMPONENTS = 0xFFFFFFFF


class Nesting(Protocol):
    """A BSDF with the methods of this module.

    Attributes
    ----------
    nested : the BSDF beneath, or None.
    """

    nested: BSDF

    def diffracted_value(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask
    ) -> Spectrum:
        """Return f cosθo of the diffraction, for directions above the surface."""

    def diffracted_density(self, si: Interaction, wo: Vector3f, active: Mask) -> Float:
        """Return the density of `draw` per solid angle."""

    def diffracted_both(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask
    ) -> tuple[Spectrum, Float]:
        """Return `diffracted_value` and `diffracted_density` at once."""

    def draw(self, si: Interaction, sample1: Float, sample2: Vector2f, active: Mask) -> Vector3f:
        """Draw a direction, possibly below the surface, where it has no density and no value."""

    def reflected_share(self, si: Interaction, active: Mask) -> Colour:
        """Return the part of the light from ωi that the surface reflects, about."""

    def beneath(self, si: Interaction, wo: Vector3f, active: Mask) -> Colour:
        """Return the factor of the nested BSDF."""

    def normal_reflectance(self, si: Interaction, active: Mask) -> Spectrum:
        """Return the share of the light that the surface reflects at normal incidence."""

    eval_pdf: Any


def components_of(nested: BSDF) -> list[int]:
    """Return the flags of all components of a surface over a nested BSDF, or over None."""
    flags = mi.BSDFFlags
    glossy = flags.GlossyReflection | flags.Anisotropic | flags.FrontSide
    below = [] if nested is None else [nested.flags(n) for n in range(nested.component_count())]
    return [glossy, *below]


def flags_of(components: list[int]) -> int:
    """Return all flags of components."""
    return functools.reduce(operator.or_, components)


def evaluate(
    self: Nesting, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
) -> Spectrum:
    """Return f cosθo per wavelength."""
    active = _lit(si, wo, active)
    diffracts, nested = _lobes(self, ctx)
    value = mi.Spectrum(0.0)
    if diffracts:
        value = self.diffracted_value(ctx, si, wo, active)
    if nested is not None:
        # T(ωi) T(ωo) f of the BSDF beneath
        beneath = mi.Spectrum(self.beneath(si, wo, active))
        value += beneath * _valid(self.nested.eval(nested, si, wo, active))
    return dr.select(active, value, 0.0)


def density(
    self: Nesting, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
) -> Float:
    """Return the density of `sample` per solid angle."""
    active = _lit(si, wo, active)
    diffracts, nested = _lobes(self, ctx)
    value = mi.Float(0.0)
    if diffracts:
        value = self.diffracted_density(si, wo, active)
    if nested is not None:
        beneath = self.nested.pdf(nested, si, wo, active)
        value = dr.lerp(beneath, value, _glossy_share(self, diffracts, si, active))
    return dr.select(active, value, 0.0)


def evaluate_both(
    self: Nesting, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
) -> tuple[Spectrum, Float]:
    """Return `eval` and `pdf` at once."""
    active = _lit(si, wo, active)
    diffracts, nested = _lobes(self, ctx)
    value, pdf = mi.Spectrum(0.0), mi.Float(0.0)
    if diffracts:
        value, pdf = self.diffracted_both(ctx, si, wo, active)
    if nested is not None:
        beneath = mi.Spectrum(self.beneath(si, wo, active))
        nested_value, nested_pdf = self.nested.eval_pdf(nested, si, wo, active)
        value += beneath * _valid(nested_value)
        pdf = dr.lerp(nested_pdf, pdf, _glossy_share(self, diffracts, si, active))
    return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)


def sample(
    self: Nesting,
    ctx: Context,
    si: Interaction,
    sample1: Float,
    sample2: Vector2f,
    active: Mask = True,
) -> tuple[Sample, Spectrum]:
    """Draw a direction; return it with f cosθo over its density.

    Lobes of a nested BSDF that have a single direction are returned alone: the diffraction has no
    share in them. All others are mixed with it, in value and density.
    """
    active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0)
    diffracts, nested = _lobes(self, ctx)
    result = dr.zeros(mi.BSDFSample3f)
    result.eta = 1.0
    result.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
    share, delta, weight = mi.Float(1.0), mi.Mask(False), mi.Spectrum(0.0)
    if nested is not None:
        share = _glossy_share(self, diffracts, si, active)
        chosen = active & (sample1 >= share)
        remaining = (sample1 - share) / dr.select(chosen, 1.0 - share, 1.0)
        below, weight = self.nested.sample(nested, si, remaining, sample2, chosen)
        weight = _valid(weight)
        below.sampled_component += 1
        result = dr.select(chosen, below, result)
        delta = chosen & mi.has_flag(below.sampled_type, mi.BSDFFlags.Delta)
        sample1 = dr.select(chosen, sample1, sample1 / dr.select(chosen, 1.0, share))
    if diffracts:
        drawn = self.draw(si, sample1, sample2, active)
        result.wo = drawn if nested is None else dr.select(chosen, result.wo, drawn)
    value, pdf = self.eval_pdf(ctx, si, result.wo, active & ~delta)
    value = value / dr.select(pdf > 0.0, pdf, 1.0)
    if nested is not None:
        beneath = mi.Spectrum(self.beneath(si, result.wo, delta))
        value = dr.select(delta, beneath * weight / dr.select(delta, 1.0 - share, 1.0), value)
        pdf = dr.select(delta, result.pdf * (1.0 - share), pdf)
    active &= (pdf > 0.0) & (mi.Frame3f.cos_theta(result.wo) > 0.0)
    result.pdf = dr.select(active, pdf, 0.0)
    return result, dr.select(active, value, 0.0)


def evaluate_diffuse_reflectance(self: Nesting, si: Interaction, active: Mask = True) -> Spectrum:
    """Return the reflectance at normal incidence, nested BSDF included, for denoisers."""
    reflectance = self.normal_reflectance(si, active)
    if self.nested is not None:
        level = mi.SurfaceInteraction3f(si)
        level.wi = mi.Vector3f(0.0, 0.0, 1.0)
        nested = self.nested.eval_diffuse_reflectance(level, active)
        reflectance += mi.Spectrum(self.beneath(level, level.wi, active)) * _valid(nested)
    return dr.select(active, dr.clip(reflectance, 0.0, 1.0), 0.0)


def _valid(light: Spectrum) -> Spectrum:
    """Return light of a nested BSDF, 0 where it is negative or not a number."""
    valid = mi.unpolarized_spectrum(light) >= 0.0
    return dr.select(dr.all(valid) if mi.is_polarized else valid, light, 0.0)


def _lit(si: Interaction, wo: Vector3f, active: Mask) -> Mask:
    """Mask of lanes whose two directions lie above the surface."""
    cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
    return mi.Mask(active) & (cos_i > 0.0) & (cos_o > 0.0)


def _lobes(surface: Nesting, ctx: Context) -> tuple[bool, Context | None]:
    """Whether a context asks for the diffraction, and its request to the nested BSDF."""
    diffracts = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
    nested = surface.nested
    if nested is None or ctx.component == 0:
        return diffracts, None
    lobes = nested.flags()
    asked = mi.BSDFContext(ctx.mode, ctx.type_mask, ctx.component)
    if ctx.component != ALL_COMPONENTS:
        asked.component -= 1
        lobes = nested.flags(asked.component)
    return diffracts, asked if ctx.type_mask & int(lobes) & int(mi.BSDFFlags.All) else None


def _glossy_share(surface: Nesting, diffracts: bool, si: Interaction, active: Mask) -> Float:
    """Share of the samples for diffraction over a nested BSDF: by reflected power."""
    if not diffracts:
        return mi.Float(0.0)
    mean = dr.mean(mi.unpolarized_spectrum(surface.reflected_share(si, active)))
    # A nested BSDF is taken to return half of the light that it receives
    return dr.clip(mean / (0.5 + 0.5 * mean), 0.1, 0.9)
