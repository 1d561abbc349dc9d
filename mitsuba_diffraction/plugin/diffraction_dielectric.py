"""The Mitsuba BSDF plugin `diffraction_dielectric`: reflects light, and lets the rest through.

Interface of two dielectrics, or thin sheet with one structured side, in light from either
side. It has the parameters of `diffraction` for the heights, the table (without
`coherence=surface`), `orientation`, `lateral_scale`, `height_scale` and `wavelength`, and those
below. It has no coat, film, nested BSDF or shadowing.

The dielectric
--------------
int_ior, ext_ior : float or string [1.5, 1.000277]
    Indices below and above the surface; of a sheet and around it. Normals point to ext_ior. Ratio,
    at least 1.01: the differentiable `eta`.
thin : boolean [false]
    Whether the surface is a sheet with a flat lower side; both sides have ext_ior.
model : string [small_slope]
    `small_slope` or `kirchhoff`, as of `diffraction`.
energy_conserving : boolean [true]
    Whether s(ωi) s(ωo) scales all light so that R + T = 1. Takes seconds once and is cached, in
    steps of 0.002 of eta.

The model is that of `diffraction` where light is reflected; light that goes through has orders of
κ = k (n cosθt − cosθi). Component 0 is the reflection, component 1 the transmission. Orders that
change the tangential part by more than 2/λ are left out. In a sheet, light reflected at the flat
side is summed as between two mirrors. Light beyond the critical angle is lost, unless
energy_conserving shares it among all other light.

[theory/transmission.md](theory/transmission.md) has the equations, from `optics.through`.

XML and the same in Python:

    <bsdf type="diffraction_dielectric">
        <string name="filename" value="scale.png"/>
        <float name="pixel_size" value="0.0488"/>
        <float name="max_height" value="0.375"/>
        <boolean name="thin" value="true"/>
    </bsdf>

    import mitsuba_diffraction  # before Mitsuba: registers the plugin
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    sheet = mi.load_dict(
        {
            "type": "diffraction_dielectric",
            "filename": "scale.png",
            "pixel_size": 0.0488,
            "max_height": 0.375,
            "thin": True,
        }
    )
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi

from ..optics import through
from ..optics.boundary import Geometry, Jones, geometry, power
from ..optics.through import (
    flat_transmittances,
    order_0,
    out_of_sheet,
    outside_square,
    returned,
)
from . import parameters as read
from .arithmetic import plain
from .base import asked_sides
from .boundary import Boundary, mueller, polarisation_axes
from .directions import (
    CoatedPair,
    Pair,
    PairBelow,
    PairThrough,
    PairWithin,
    Site,
    drawing_cosine,
    media,
)
from .energy import EnergyModel, dielectric_of
from .materials import Dielectric, Inside
from .properties import flag
from .sampling import direction_of, drawn, with_even_share
from .surface import DiffractingSurface, interfering
from .types import (
    Colour,
    Context,
    Float,
    Interaction,
    Mask,
    Powers,
    Properties,
    Spectrum,
    Vector2f,
    Vector3f,
)

_LEAST_SHARE = 0.1


class DiffractionDielectric(DiffractingSurface):
    """Reflection and transmission of a dielectric that diffracts, or of a thin sheet.

    Attributes
    ----------
    material : the dielectric.
    thin : whether the side below is beyond the flat side of a sheet.
    """

    title = "DiffractionDielectric"
    transmits = True

    def __init__(self, props: Properties) -> None:
        nested, material = read.nested_of(props, read.TRANSMITTING), read.transmissive_of(props)
        # Light below the surface has the wavelength λ/n
        super().__init__(props, nested, material, plain(material.eta))
        self.material: Dielectric = material
        self.thin = flag(props, "thin", False)
        self.energy = EnergyModel(
            self.table.wavelength_range,
            self.wavelength,
            partial(dielectric_of, self.boundary, material, self.thin),
            conserving=self.energy_conserving,
        )
        self.ready()

    @property
    def inner_boundary(self) -> Boundary:
        """Model of light that is reflected below the surface."""
        return replace(self.boundary, material=Inside(self.material, self.thin))

    @property
    def media_differ(self) -> bool:
        """See `SurfaceBSDF.media_differ`."""
        return not self.thin

    def relative_index(self, cos_i: Float, cos_o: Float) -> Float:
        """See `SurfaceBSDF.relative_index`."""
        into, out = media(self.material.eta, self.thin, cos_i > 0.0)
        return out / into

    # ------------------------------------------------------------------ light and draws

    def diffracted(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """See `SurfaceBSDF.diffracted`."""
        si, frame = site.si, site.frame
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        reflects, transmits = asked_sides(ctx)
        share = self._staying_share(cos_i, ctx)
        value, density = mi.Spectrum(0.0), mi.Float(0.0)
        if reflects:
            for reflected, sign in ((self._above, 1.0), (self._below, -1.0)):
                lit = active & (sign * cos_i > 0.0) & (cos_i * cos_o > 0.0)
                side, orders = reflected(ctx, site, wo, lit, kinds)
                value = dr.select(lit, side, value)
                density = dr.select(lit, share * with_even_share(orders), density)
        if transmits:
            lit = active & (cos_i * cos_o < 0.0)
            crossing = PairThrough(si, wo, frame, lit, self.material.eta, self.thin)
            power, orders = self.power.answers(crossing, site.scale, site.scale, si, kinds)
            if "v" in kinds:
                passed = self._transmitted(ctx, site, crossing, power) * dr.abs(cos_o)
                value = dr.select(lit, passed, value)
            orders = with_even_share(orders * dr.square(crossing.out))
            density = dr.select(lit, (1.0 - share) * orders, density)
        if "v" in kinds and self.energy.scales:
            # s(ωi) s(ωo), such that reflected and transmitted light add up to 1
            value *= mi.Spectrum(self.energy.factor(site, wo))
        return value, density

    def draw(self, ctx: Context, site: Site, sample1: Float, sample2: Vector2f) -> Vector3f:
        """Draw a side by the flat reflectance, then a direction by the orders."""
        si, cos_i = site.si, mi.Frame3f.cos_theta(site.si.wi)
        share = self._staying_share(cos_i, ctx)
        reflected = sample1 < share
        sample1 = dr.select(
            reflected, sample1 / dr.maximum(share, 1e-6), (sample1 - share) / (1.0 - share + 1e-6)
        )
        down, n = cos_i > 0.0, dr.detach(self.material.eta)
        into, beyond = media(n, self.thin, down)
        out = dr.select(reflected, into, beyond)
        sign = dr.select(reflected & down, 1.0, -1.0)
        cosine = dr.abs(cos_i)
        inwards = dr.select(reflected, cosine, drawing_cosine(cosine, n, self.thin, down))
        scale = dr.detach(site.scale * dr.select(reflected & (cos_i < 0.0), n, 1.0))

        def by_orders(sample1: Float) -> Vector3f:
            uv = self.power.draw(inwards, scale, sample1, sample2, si)
            total = sign * site.frame.from_table(uv) - into * mi.Vector2f(si.wi.x, si.wi.y)
            return direction_of(total / out)

        wo = drawn(by_orders, sample1, sample2)
        # 0, where no light goes, of a direction beyond the horizon
        wo.z = dr.maximum(wo.z, 0.0)
        wo.z = dr.select(reflected == down, wo.z, -wo.z)
        return wo

    # ------------------------------------------------------------------ reflection

    def _above(
        self, ctx: Context, site: Site, wo: Vector3f, lit: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """Return f cosθo and density of light that stays above the surface."""
        pair = Pair(site.si, wo, site.frame, lit)
        power, density = self.power.answers(pair, site.scale, site.scale, site.si, kinds)
        if "v" not in kinds:
            return mi.Spectrum(0.0), density
        value = self.lobe(ctx, site, pair, self.boundary, power, lit)
        if self.thin:
            value += self._returned(site, pair)
        return value, density

    def _below(
        self, ctx: Context, site: Site, wo: Vector3f, lit: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """Return f cosθo and density of light that stays below the surface, or below a sheet."""
        n, si, boundary = self.material.eta, site.si, self.inner_boundary
        outer = PairBelow(si, wo, site.frame, lit)
        inner = PairWithin(si, wo, site.frame, lit, n)
        pair: Pair = CoatedPair(outer, n) if self.thin else inner
        power, density = self.power.answers(pair, site.scale, site.scale * n, si, kinds)
        value = mi.Spectrum(0.0)
        if "v" in kinds and self.thin:
            value = self.lobe(ctx, site, pair, boundary, power, lit)
            value += self.face(ctx, site, outer, self.material, lit)
        elif "v" in kinds:
            # a new mask, for the caller's stays as it is: tables do not reach farther
            lit = lit & inner.reached
            value = self.lobe(ctx, site, inner, boundary, power, lit) * dr.square(n)
        return value, density if self.thin else density * dr.square(n)

    def _returned(self, site: Site, pair: Pair) -> Spectrum:
        """f cosθo of light that the flat side of a sheet sends back through the structure."""
        n, ends = self.material.eta, (pair.cos_i, pair.cos_o)
        deep = [dr.sqrt(dr.fma(cosine, cosine, n * n - 1.0)) - cosine for cosine in ends]
        point = copy.copy(pair)
        point.w = dr.sqrt(dr.fma(deep[0], deep[0], dr.square(deep[1])))
        power, _ = self.power.answers(point, site.scale, site.scale, site.si, "v")
        both = dr.safe_sqrt(returned(ends[0], n) * returned(ends[1], n))
        visible, cosines = self._mirror(site, pair)
        flat = visible * mi.UnpolarizedSpectrum([returned(cosine, n) for cosine in cosines])
        level = self.area_factor * pair.frame.area * pair.cos_o
        others = mi.depolarizer(power.others * (level * both))
        zeroth = mi.depolarizer(power.zeroth * (level * flat))
        return interfering(others, zeroth, power.cosine)

    def _mirror(self, site: Site, pair: Pair | PairThrough) -> tuple[Colour, list[Float]]:
        """Return C(X_i) C(X_o), and cosθm for each channel."""
        width = self.table.sigma_0 * pair.frame.stretch
        visible = mi.UnpolarizedSpectrum([pair.visible(width, k) for k in site.wavenumbers])
        return visible, [pair.mirror_cosine(k * width) for k in site.wavenumbers]

    # ------------------------------------------------------------------ transmission

    def _transmitted(
        self, ctx: Context, site: Site, crossing: PairThrough, power: Powers
    ) -> Spectrum:
        """Return f of light that goes through, as the mode of transport has it.

        Order 0 has what the flat surface transmits, and is finite where w → 0, as all others are.
        """
        si = site.si
        if mi.is_rgb and power.cosine is None:  # a channel out of gamut stays finite where w → 0
            zeroth = dr.minimum(power.zeroth, power.others + power.zeroth)
            power = Powers(power.others + power.zeroth - zeroth, zeroth)
        per_w = crossing.n * dr.rcp(dr.square(crossing.w) * crossing.above.z * -crossing.inside.z)
        pair = geometry(crossing.above, crossing.inside)
        others = self._factor(ctx, si, crossing, self._matrices(site, crossing, pair))
        flat = self._order_0(ctx, site, crossing, pair)
        rest, mirror = mi.Spectrum(power.others * per_w) * others, mi.Spectrum(power.zeroth) * flat
        value = interfering(rest, mirror, power.cosine)
        outside = mi.Float(self.area_factor * crossing.frame.area)
        if not self.thin:
            # Radiance over n² is transmitted; light along ωi or ωo
            down = mi.Frame3f.cos_theta(si.wi) > 0.0
            scales = mi.Float(1.0), dr.square(crossing.n)
            if ctx.mode == mi.TransportMode.Importance:
                scales = scales[::-1]
            outside *= dr.select(down, *scales)
        return dr.select(crossing.active, value * outside, 0.0)

    def _matrices(self, site: Site, crossing: PairThrough, pair: Geometry) -> list[Jones]:
        """Return 2 cosθi cosθt J of light from above, of each channel or of all."""
        n, above, below = crossing.n, crossing.above, crossing.below
        heights = self.boundary.heights(crossing.place, site.scale, site.wavenumbers)
        # Beyond the critical angle light decays outside; from outside none arrives there
        outside = outside_square(pair, n)
        outside = outside if self.thin else mi.Complex2f(outside, 0.0)
        formula = through.MODELS[self.boundary.model.name]
        matrices = [formula(pair, above, crossing.inside, n, outside, each) for each in heights]
        if not self.thin:
            return matrices
        return [out_of_sheet(jones, n, above.z, -below.z) for jones in matrices]

    def _order_0(self, ctx: Context, site: Site, crossing: PairThrough, pair: Geometry) -> Spectrum:
        """Return N_0 C(X_i) C(X_o) of order 0, or its Mueller matrix, for each channel."""
        visible, cosines = self._mirror(site, crossing)
        passed = [flat_transmittances(cosine, crossing.n, self.thin) for cosine in cosines]
        if mi.is_polarized:
            matrices = [order_0(pair, powers) for powers in passed]
            flat = self._factor(ctx, site.si, crossing, matrices)
        else:
            flat = mi.UnpolarizedSpectrum([0.5 * sum(powers) for powers in passed])
        return dr.select(crossing.leaves, flat * mi.Spectrum(visible), 0.0)

    def _factor(
        self, ctx: Context, si: Interaction, crossing: PairThrough, matrices: list[Jones]
    ) -> Spectrum:
        """Return ½ Σ|J|², or Mueller matrices, for each channel."""
        if not mi.is_polarized:
            return self.material.channels([power(jones) for jones in matrices])
        # light that goes up is that which goes down, reversed: with other s, so other signs
        importance = ctx.mode == mi.TransportMode.Importance
        falls = (mi.Frame3f.cos_theta(si.wi) > 0.0) == mi.Mask(importance)
        light, about = (
            (dr.select(falls, into, -out), dr.select(falls, out, -into))
            for into, out in (
                (-crossing.above, crossing.below),
                polarisation_axes(-crossing.above, crossing.inside),
            )
        )
        turned_round = [
            (ss, dr.select(falls, sp, -ps), dr.select(falls, ps, -sp), pp)
            for ss, sp, ps, pp in matrices
        ]
        return mueller(turned_round, light, about)

    def _staying_share(self, cos_i: Float, ctx: Context) -> Float:
        """Share of the samples that stay on their side."""
        reflects, transmits = asked_sides(ctx)
        if not (reflects and transmits):
            return mi.Float(1.0 if reflects else 0.0)
        cosine = dr.abs(cos_i) if self.thin else cos_i
        flat = dr.detach(mi.fresnel(cosine, self.material.eta)[0])
        if self.thin:
            flat = 2.0 * flat * dr.rcp(1.0 + flat)
        return dr.clip(flat, _LEAST_SHARE, 1.0 - _LEAST_SHARE)

    # ------------------------------------------------------------------ changes of parameters

    def refusals(self) -> Iterator[str | None]:
        """See `PluginBSDF.refusals`."""
        yield from super().refusals()
        yield self.optical_refusal(self.material.eta, "eta", "int_ior")

    def kernel_constants(self) -> tuple[object, ...]:
        """See `PluginBSDF.kernel_constants`."""
        return *super().kernel_constants(), self.thin, self.energy.kernel_constants()

    def shown(self) -> dict[str, Any]:
        """See `PluginBSDF.shown`."""
        return {**super().shown(), "thin": "true" if self.thin else "false"}


mi.register_bsdf("diffraction_dielectric", DiffractionDielectric)
