"""Base classes of the BSDFs: Mitsuba's interface over values, densities and draws.

`PluginBSDF` has the life cycle: parameters, their changes, `dr.freeze`, text. `SurfaceBSDF` adds
points of a surface, one `sample`, and a nested BSDF, which receives the light that is not
reflected. Component 0 is the diffraction. The nested BSDF's components follow, or, where light goes
through, component 1 is the transmission.
"""

from __future__ import annotations

import functools
import operator
import weakref
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi

from .arithmetic import clip
from .directions import Site
from .parameter_changes import (
    Changeable,
    arrays_within,
    check_parameters,
    marks,
    take_changes,
)
from .types import (
    BSDF,
    Callback,
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

#: Component of a context that asks for all of them.
ALL_COMPONENTS = 0xFFFFFFFF
#: Directions with a lower density are not drawn. In scalar variants a density has double precision,
#: and so small a density would be 0 in single precision, which spectra have.
LEAST_DENSITY = 1e-30


class PluginBSDF(mi.BSDF):
    """BSDF of this package: answers, parameters and their changes.

    Attributes
    ----------
    title : name in `to_string`.
    parameters : everything that `traverse` exposes, in that order.
    mix : the mix that it is part of, as a weak reference, or None.
    """

    title: str

    def __init__(self, props: Properties) -> None:
        super().__init__(props)
        self.parameters: list[Changeable] = []
        self.mix: weakref.ref[Any] | None = None

    def ready(self) -> None:
        """Declare the components, check all parameters and derive what follows from them."""
        components = self.components()
        self.m_components = components  # at once: reading it makes a copy
        self.m_flags = functools.reduce(operator.or_, components)
        check_parameters([self])
        self.changed()

    def components(self) -> list[int]:
        """Return the flags of each component."""
        raise NotImplementedError

    # ------------------------------------------------------------------ answers

    def answers(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask, kinds: str
    ) -> Sequence[Any]:
        """Return the answers of these kinds: "v"alue f |cosθo|, "d"ensity of `sample`, or "vd"."""
        raise NotImplementedError

    def eval(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Spectrum:
        """Return f |cosθo| per wavelength, as the context's mode of transport has it."""
        return mi.Spectrum(self.answers(ctx, si, mi.Vector3f(wo), active, "v")[0])

    def pdf(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Float:
        """Return the density of `sample` per solid angle."""
        return self.answers(ctx, si, mi.Vector3f(wo), active, "d")[0]

    def eval_pdf(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
    ) -> tuple[Spectrum, Float]:
        """Return `eval` and `pdf` at once."""
        value, density = self.answers(ctx, si, mi.Vector3f(wo), active, "vd")
        return mi.Spectrum(value), density

    # ------------------------------------------------------------------ changes of parameters

    def traverse(self, callback: Callback) -> None:
        """Expose the parameters that may change without another table."""
        for parameter in self.parameters:
            parameter.traverse(callback)

    def parameters_changed(self, keys: list[str]) -> None:
        """Accept all changes, or reject all.

        Raises a DiffractionError if a parameter is out of bounds, as a height_scale that the table
        does not serve. All parameters then have their last values.
        """
        mix = self.mix and self.mix()
        take_changes(self, (mix or self).together)

    @property
    def together(self) -> list[PluginBSDF]:
        """BSDFs whose changes are refused together."""
        return [self]

    def refusals(self) -> Iterator[str | None]:
        """Reasons to refuse values that are allowed each by itself; None for none."""
        yield None

    def derive(self) -> None:
        """Compute what depends on the parameters. It may refuse them too."""

    def kernel_constants(self) -> tuple[object, ...]:
        """Return plain values that choose kernels: `dr.freeze` records anew where they change."""
        return ()

    def changed(self) -> None:
        """Derive what depends on the parameters, and tell `dr.freeze` all arrays."""
        self.derive()
        self._for_freezing: list[Any] = []
        held = arrays_within(*vars(self).values())
        self._for_freezing = held + marks(*self.kernel_constants())

    # ------------------------------------------------------------------ for people

    def shown(self) -> Mapping[str, Any]:
        """Return all parameters as `to_string` shows them."""
        raise NotImplementedError

    def to_string(self) -> str:
        """Describe all parameters, for people."""
        lines = "".join(f"  {name} = {value},\n" for name, value in self.shown().items())
        return f"{self.title}[\n{lines}]"


class SurfaceBSDF(PluginBSDF):
    """Diffraction of a surface, over another BSDF or over none.

    Attributes
    ----------
    transmits : whether light goes through, from either side; then nothing is nested.
    nested : the BSDF beneath, or None.
    """

    transmits = False

    def __init__(self, props: Properties, nested: BSDF = None) -> None:
        super().__init__(props)
        self.nested = nested

    def ready(self) -> None:
        """Finish loading (`PluginBSDF.ready`); the nested BSDF is the last parameter."""
        if self.nested is not None:
            self.parameters.append(Changeable("nested", self.nested))
        super().ready()

    def components(self) -> list[int]:
        """See `PluginBSDF.components`."""
        flags = mi.BSDFFlags
        if self.transmits:
            sides = flags.FrontSide | flags.BackSide | flags.Anisotropic
            passed = flags.GlossyTransmission | sides
            differs = flags.NonSymmetric if self.media_differ else 0
            return [flags.GlossyReflection | sides, passed | differs]
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
        """Return f |cosθo| and the density of `draw`, those asked for: see `PluginBSDF.answers`.

        active : lanes whose directions lie above the surface; where light goes through, on a side.
        """
        raise NotImplementedError

    def draw(self, ctx: Context, site: Site, sample1: Float, sample2: Vector2f) -> Vector3f:
        """Draw a direction; one that lies where no light goes has no density and no value."""
        raise NotImplementedError

    def reflected_share(self, site: Site, active: Mask) -> Colour:
        """Return the part of the light from ωi that the surface reflects, about."""
        raise NotImplementedError

    def beneath(self, site: Site, wo: Vector3f, active: Mask) -> Colour:
        """Return the factor of the nested BSDF, T(ωi) T(ωo)."""
        raise NotImplementedError

    @property
    def media_differ(self) -> bool:
        """Whether the media on both sides have different indices."""
        return False

    def relative_index(self, cos_i: Float, cos_o: Float) -> Float:
        """Return the index of the medium of ωo over that of ωi, by their cosines."""
        return mi.Float(1.0)

    # ------------------------------------------------------------------ Mitsuba's interface

    def answers(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask, kinds: str
    ) -> Sequence[Any]:
        """See `PluginBSDF.answers`."""
        active = mi.Mask(active)
        value, density = self.evaluated(ctx, si, self.site_at(si, active), wo, active, kinds)
        return [value if kind == "v" else density for kind in kinds]

    def evaluated(
        self, ctx: Context, si: Interaction, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """Return value and density, nested BSDF included; only those asked for are meant.

        si : for the nested BSDF; the site has its wavelengths within the table's.
        """
        if self.transmits:
            return self.diffracted(ctx, site, wo, active, kinds)
        active = (
            active & (mi.Frame3f.cos_theta(site.si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)
        )
        diffracts, nested = self._asked(ctx)
        value, density = mi.Spectrum(0.0), mi.Float(0.0)
        if diffracts:
            value, density = self.diffracted(ctx, site, wo, active, kinds)
        if nested is not None:
            below = ask(self.nested, nested, si, wo, active, kinds)
            if "v" in kinds:
                value += mi.Spectrum(self.beneath(site, wo, active)) * _valid(below[0])
            if "d" in kinds:
                density = dr.lerp(below[-1], density, self._glossy_share(diffracts, site, active))
        return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

    def sample(
        self, ctx: Context, si: Interaction, sample1: Float, sample2: Vector2f, active: Mask = True
    ) -> tuple[Sample, Spectrum]:
        """Draw a direction; return it with f |cosθo| over its density.

        Lobes of a nested BSDF that have a single direction are returned alone: the diffraction has
        no share in them. All others are mixed with it, in value and density.
        """
        sample1, sample2 = mi.Float(sample1), mi.Point2f(sample2)
        cos_i = mi.Frame3f.cos_theta(si.wi)
        active = mi.Mask(active) & ((cos_i != 0.0) if self.transmits else (cos_i > 0.0))
        site = self.site_at(si, active)
        diffracts, nested = (True, None) if self.transmits else self._asked(ctx)
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
            if nested is not None:  # lanes of the nested BSDF all read the same memory
                sample1 = dr.select(chosen, 0.0, sample1)
                sample2 = dr.select(chosen, mi.Point2f(0.0), sample2)
            drawn = self.draw(ctx, site, sample1, sample2)
            result.wo = drawn if nested is None else dr.select(chosen, result.wo, drawn)
        smooth = dr.select(delta, False, active)
        value, pdf = self.evaluated(ctx, si, site, result.wo, smooth, "vd")
        value = value / dr.select(pdf > LEAST_DENSITY, pdf, 1.0)
        if nested is not None:
            beneath = mi.Spectrum(self.beneath(site, result.wo, delta))
            value = dr.select(delta, beneath * weight / dr.select(delta, 1.0 - share, 1.0), value)
            pdf = dr.select(delta, result.pdf * (1.0 - share), pdf)
        active &= pdf > LEAST_DENSITY
        cos_o = mi.Frame3f.cos_theta(result.wo)
        if self.transmits:
            passed = cos_i * cos_o < 0.0
            result.eta = dr.select(passed, self.relative_index(cos_i, cos_o), 1.0)
            result.sampled_component = dr.select(passed, mi.UInt32(1), mi.UInt32(0))
            transmission = mi.UInt32(+mi.BSDFFlags.GlossyTransmission)
            result.sampled_type = dr.select(passed, transmission, result.sampled_type)
        else:
            active &= cos_o > 0.0
        result.pdf = dr.select(active, pdf, 0.0)
        return result, dr.select(active, value, 0.0)

    def eval_diffuse_reflectance(self, si: Interaction, active: Mask = True) -> Spectrum:
        """Return the reflectance at normal incidence, nested BSDF included, for denoisers."""
        level = mi.SurfaceInteraction3f(si)
        level.wi = mi.Vector3f(0.0, 0.0, 1.0)
        site = self.site_at(level, active)
        reflectance = mi.Spectrum(self.reflected_share(site, active))
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


def ask(
    bsdf: BSDF, ctx: Context, si: Interaction, wo: Vector3f, active: Mask, kinds: str
) -> Sequence[Any]:
    """Return the answers of any BSDF; see `PluginBSDF.answers`."""
    method = {"v": bsdf.eval, "d": bsdf.pdf, "vd": bsdf.eval_pdf}[kinds]
    answers = method(ctx, si, wo, active)
    return answers if kinds == "vd" else [answers]


def asked_sides(ctx: Context) -> tuple[bool, bool]:
    """Return whether a context asks for reflection, and for transmission."""
    kinds = mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission
    reflection, transmission = (ctx.is_enabled(kind, n) for n, kind in enumerate(kinds))
    return reflection, transmission


def _valid(light: Spectrum) -> Spectrum:
    """Return light of a nested BSDF, 0 where it is negative or not a number."""
    valid = mi.unpolarized_spectrum(light) >= 0.0
    return dr.select(dr.all(valid) if mi.is_polarized else valid, light, 0.0)
