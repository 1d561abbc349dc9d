"""The Mitsuba BSDF plugin `diffraction`: measured surfaces that diffract.

Parameters, with defaults in brackets; ∂: differentiable. Lengths are in µm, wavelengths in nm.
`docs/parameters.md` is made of this text.

The surface
-----------
heightfield : string
    Heights: image (PNG, BMP, TIFF, EXR), array (NPY), text, instrument file, recipe (TOML); a table
    works too.
table : string
    A table made by `mitsuba-diffraction precompute` instead.
data : mi.TensorXf
    Heights in µm instead, shape (ny, nx); dictionaries only, where `md.bsdf_dict` fills it in.
pixel_size : float or string [from the file]
    Distance between heights in µm: one number, "dx, dy", or "auto".
max_height : float or string [from the file]
    Height of white in an integer image, µm, or "auto".
channel : string or integer [the heights]
    Which channel of an instrument file: its name or index; of an EXR image, its name.
crop : float or string [none]
    Keeps the middle of the patch only, so wide in µm: one number for a square, or "width, height".
fill : string [none]
    How points without data are filled: `none` (they are refused), `nearest` (the nearest height)
    or `harmonic` (a membrane spanned over the gap).
level : string [none]
    `plane` subtracts the best plane, `lines` aligns the scan lines by their medians first; `none`.
clip : float [none]
    Cuts heights off beyond so many robust standard deviations: dust. At least 1.
periodic : string [none]
    How opposite edges are made to meet, since the patch tiles the surface: `smooth` (its periodic
    component, Moisan 2011) or `taper` (heights fade towards the edges); `none`. The
    treatments are applied in the order crop, fill, level, clip, periodic.
orientation : float or texture ∂ [0]
    Degrees that the patch's x axis is turned by from the first tangent; or a texture (raw, in a
    float format) or mesh attribute of three channels, the first two of which are (cos, sin) of that
    angle. Tangents follow UV coordinates: on a mesh without them they are arbitrary, and turn from
    triangle to triangle. A BSDF cannot see that; `info MESH` and `render` warn.
height_scale : float ∂ [1]
    Multiplies the heights, up to 1.5 × max(1, value given).

The table
---------
coherence_width : float or string [65]
    4σ of the Gaussian amplitude window, µm: the width over which light is coherent. `auto`, as
    without it: that of the table or the recipe, else 65.
coherence : string [ensemble]
    `ensemble`: what a pixel sees that covers many coherence areas; `patch`: one window's speckle.
basis : string [auto]
    `svd` (also as `auto`), `chebyshev` or `taylor`: the series in κ.
tolerance : float [0.001]
    Relative error of ⟨|P|²⟩, met or refused.
terms : integer [from tolerance]
    Length of the series.

The material
------------
material : string
    A conductor by name, as in `roughconductor`; `none` reflects everything.
eta, k : spectra ∂
    The same by its complex refractive index.
int_ior, ext_ior : float or string [1.5, 1.000277]
    A dielectric, which the surface is unless it is a conductor (1.5: shed snake skin).
    Their ratio is the differentiable parameter `eta`.
energy_conserving : boolean [true]
    Divides by max(1, a(ωi), a(ωo)), where a bounds the directional albedo for R = 1 from above at
    all wavelengths: reciprocal, never brighter than white. `false` is raw Kirchhoff, which gains
    energy at grazing angles (1.3 at 80°, more beyond), for checks. The bound takes a second or
    more the first time, and is kept in the cache. It follows height_scale, interpolated between
    bounds at a few scales: an optimisation waits where it enters such an interval for the first
    time. For its derivative, enable that of height_scale before parameters.update().
shadowing : string [none]
    `vcavity`: the surface shadows itself like long V-shaped grooves (Torrance and Sparrow 1967);
    `none`.

The light beneath
-----------------
(nested) : BSDF ∂
    What lies beneath a dielectric and receives the light that is not reflected, e.g. pigment.
layering : string [transmission]
    How the nested BSDF shares the light. `transmission`: it gets and returns T(ωi) T(ωo), with
    T = 1 − R of the flat interface. `thesis`: (1 − w) f_diffraction + (1 − F + w) f_nested, F at
    the half vector, as in the thesis of 2014 that the method comes from; for comparisons with
    its pictures only, since it gains energy.
diffuse_weight : float [0]
    That w.

Variants
--------
wavelength : float [550]
    nm, in mono variants; the others have their own.

The model is scalar Kirchhoff diffraction (Beckmann and Spizzichino 1963; Stam 1999) under a
Gaussian coherence window, looked up in a table of the patch's diffraction orders:

    f = R (1 + ωi·ωo)² / (λ² A w² cosθi cosθo) · ⟨|P|²⟩

XML and the same in Python:

    <bsdf type="diffraction">
        <string name="heightfield" value="scale.png"/>
        <float name="pixel_size" value="0.0488"/>
        <float name="max_height" value="0.375"/>
    </bsdf>

    import mitsuba_diffraction  # before Mitsuba: registers the plugin
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    bsdf = mi.load_dict(
        {
            "type": "diffraction",
            "heightfield": "scale.png",
            "pixel_size": 0.0488,
            "max_height": 0.375,
        }
    )
"""

from __future__ import annotations

import functools
import operator
from typing import Any

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError
from .energy import EnergyBound
from .frozen import arrays_within, marks
from .llvm import require_loaded_llvm
from .parameters import read_parameters
from .power import variant_light
from .sampling import COSINE, fold, unfolded
from .session import enrol
from .shadowing import vcavity


class Diffraction(mi.BSDF):
    """Scalar Kirchhoff diffraction of a measured height field."""

    def __init__(self, props: mi.Properties) -> None:
        require_loaded_llvm()
        super().__init__(props)
        parameters = read_parameters(props)
        self.table = parameters.table
        self.heights = parameters.heights
        self.surface = parameters.reflectance
        self.nested = parameters.nested
        self.height_scale = mi.Float(parameters.height_scale)
        self.orientation = parameters.orientation
        self.layering = parameters.layering
        self.vcavity = parameters.vcavity
        self.light = variant_light(self.table, parameters.wavelength)
        self._energy = EnergyBound(self.table) if parameters.energy_conserving else None
        self._record = enrol(self, props.id())
        self._area_factor = 4.0 * dr.pi * self.table.sigma**2  # 4π²σ⁴ over the window's area πσ²
        front = mi.BSDFFlags.FrontSide
        glossy = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.Anisotropic | front
        components = [glossy]
        if self.nested is not None:
            components += [self.nested.flags(n) for n in range(self.nested.component_count())]
        self.m_components = components  # at once: what it gives back is a copy
        self.m_flags = functools.reduce(operator.or_, components)
        self.parameters_changed([])

    # ------------------------------------------------------------------ Mitsuba's interface

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """f·cosθo per wavelength."""
        active = self._above(si, wo, active)
        value = mi.Spectrum(0.0)
        if ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
            value = mi.depolarizer(self._diffraction(si, wo, active))
        if self.nested is not None:
            value *= self.layering.above
            beneath = self.layering.beneath(si, wo, active)
            value += mi.Spectrum(beneath) * self.nested.eval(ctx, si, wo, active)
        return dr.select(active, value, 0.0)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Density of `sample` per solid angle."""
        active = self._above(si, wo, active)
        density = self.density(si, wo, active)
        if self.nested is not None:
            beneath = self.nested.pdf(ctx, si, wo, active)
            density = dr.lerp(beneath, density, self._glossy_share(si, active))
        return dr.select(active, density, 0.0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
        """`eval` and `pdf` at once."""
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def sample(
        self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
    ) -> tuple[Any, Any]:
        """A direction, and f·cosθo over its density."""
        active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0)
        result = dr.zeros(mi.BSDFSample3f)
        result.eta = 1.0
        result.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        glossy = active
        if self.nested is not None:
            share = self._glossy_share(si, active)
            glossy = active & (sample1 < share)
            remaining = (sample1 - share) / (1.0 - share)
            result, _ = self.nested.sample(ctx, si, remaining, sample2, active & (sample1 >= share))
            result.sampled_component += 1
            sample1 = dr.select(glossy, sample1 / share, sample1)
            result.eta = dr.select(glossy, 1.0, result.eta)
            result.sampled_type = dr.select(
                glossy, mi.UInt32(+mi.BSDFFlags.GlossyReflection), result.sampled_type
            )
            result.sampled_component = dr.select(glossy, 0, result.sampled_component)
        drawn = self.draw(si, sample1, sample2, active)
        result.wo = dr.select(glossy, drawn, result.wo)
        value, density = self.eval_pdf(ctx, si, result.wo, active)
        active &= density > 0.0
        result.pdf = dr.select(active, density, 0.0)
        return result, dr.select(active, value / dr.select(active, density, 1.0), 0.0)

    def traverse(self, callback: Any) -> None:
        """Expose what may change between renderings without another table."""
        differentiable = mi.ParamFlags.Differentiable
        callback.put("height_scale", self.height_scale, differentiable)
        self.orientation.traverse(callback)
        self.surface.traverse(callback)
        if self.nested is not None:
            callback.put("nested", self.nested, differentiable)

    def parameters_changed(self, keys: Any) -> None:
        """Check what changed, and keep it out of the kernels' code.

        Raises
        ------
        DiffractionError
            If height_scale is beyond what the table serves.
        """
        largest = dr.slice(dr.max(dr.detach(self.height_scale)))
        if not 0.0 < largest <= self.table.height_scale_max:
            raise DiffractionError(
                f"height_scale={largest:g} is outside what the table serves, above 0 and up to "
                f"{self.table.height_scale_max:g}; load the plugin anew with that height_scale"
            )
        if self._energy is not None:
            self._energy.update(largest, dr.grad_enabled(self.height_scale))
        dr.make_opaque(self.height_scale)
        self.orientation.update()
        self.surface.update()
        held = arrays_within(self.light, self._energy, self.orientation, self.surface)
        self._for_freezing = held + marks(self.table, self.vcavity, str(self.layering))

    @property
    def energy_conserving(self) -> bool:
        """Whether it divides by a bound of its albedo."""
        return self._energy is not None

    def to_string(self) -> str:
        """All parameters, for people."""
        nested = "" if self.nested is None else f"  nested = {self.nested},\n"
        return (
            "Diffraction[\n"
            f"  table = {self.table},\n"
            f"  coherence_width = {self.table.coherence_width:g} µm,\n"
            f"  tolerance = {self.table.tolerance:g},\n"
            f"  surface = {self.surface},\n"
            f"  height_scale = {dr.slice(self.height_scale):g},\n"
            f"  energy_conserving = {'false' if self._energy is None else 'true'},\n"
            f"  orientation = {self.orientation},\n"
            f"  shadowing = {'vcavity' if self.vcavity else 'none'},\n"
            f"  layering = {self.layering},\n"
            f"{nested}]"
        )

    # ------------------------------------------------------------------ the model

    def _above(self, si: Any, wo: Any, active: Any) -> Any:
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        return mi.Mask(active) & (cos_i > 0.0) & (cos_o > 0.0)

    def _diffraction(self, si: Any, wo: Any, active: Any) -> Any:
        """R (1 + ωi·ωo)² / (λ² A w² cosθi) · ⟨|P|²⟩, that is f·cosθo, for R = 1."""
        total = si.wi + wo
        rotation = self.orientation.rotation(si, active)
        uv = _in_patch(total, rotation)
        w = dr.select(active, total.z, 1.0)
        # (1 + ωi·ωo) from the sum's length: accurate for opposite grazing directions too
        one_plus_dot = 0.5 * dr.squared_norm(total)
        cos_i = dr.select(active, mi.Frame3f.cos_theta(si.wi), 1.0)
        outside = self._area_factor * dr.square(one_plus_dot / w) / cos_i
        scaled_w = w * self.height_scale
        power = self.light.power(uv, scaled_w, si)
        if self._energy is not None:
            incident, outgoing = _in_patch(si.wi, rotation), _in_patch(wo, rotation)
            outside /= self._energy.divisor(incident, cos_i, outgoing, w - cos_i, self.height_scale)
        if self.vcavity:
            outside *= vcavity(cos_i, w - cos_i, one_plus_dot)
        cos_half = dr.safe_sqrt(0.5 * one_plus_dot)
        reflectance = self.surface.reflectance(cos_half, si, active)
        value = dr.select(active, outside * reflectance * power, 0.0)
        if self._record is not None and self._record[0].listening:
            session, number = self._record
            session.hear(number, si, uv, scaled_w, mi.unpolarized_spectrum(value))
        return value

    def density(self, si: Any, wo: Any, active: Any) -> Any:
        """Density of `draw`: that of the orders, and a little cosine."""
        rotation = self.orientation.rotation(si, active)
        orders = self.light.density(
            _in_patch(si.wi + wo, rotation),
            _in_patch(mi.Vector2f(si.wi.x, si.wi.y) + unfolded(wo), rotation),
            mi.Frame3f.cos_theta(si.wi),
            mi.Frame3f.cos_theta(wo),
            dr.detach(self.height_scale),
            si,
        )
        return dr.lerp(orders, mi.warp.square_to_cosine_hemisphere_pdf(wo), COSINE)

    def draw(self, si: Any, sample1: Any, sample2: Any, active: Any) -> Any:
        """A direction, possibly below the surface (then it has no density and no value)."""
        uv = self.light.draw(
            mi.Frame3f.cos_theta(si.wi),
            dr.detach(self.height_scale),
            dr.maximum((sample1 - COSINE) * (1.0 / (1.0 - COSINE)), 0.0),
            sample2,
            si,
        )
        rotation = self.orientation.rotation(si, active)
        ordered = fold(_from_patch(uv, rotation) - mi.Vector2f(si.wi.x, si.wi.y))
        return dr.select(sample1 < COSINE, mi.warp.square_to_cosine_hemisphere(sample2), ordered)

    def _glossy_share(self, si: Any, active: Any) -> Any:
        """Share of the samples for diffraction where something lies beneath: by reflected power."""
        reflectance = self.surface.reflectance(mi.Frame3f.cos_theta(si.wi), si, active)
        mean = dr.mean(mi.unpolarized_spectrum(reflectance))
        # What lies beneath is taken to return half of what it gets
        return dr.clip(mean / (0.5 + 0.5 * mean), 0.1, 0.9)


def _in_patch(direction: Any, rotation: tuple[Any, Any]) -> Any:
    """A vector's tangential part, turned from the shading frame to the patch's."""
    cos, sin = rotation
    return mi.Vector2f(
        dr.fma(cos, direction.x, sin * direction.y),
        dr.fma(cos, direction.y, -sin * direction.x),
    )


def _from_patch(q: Any, rotation: tuple[Any, Any]) -> Any:
    """The inverse of `_in_patch`."""
    cos, sin = rotation
    return mi.Vector2f(dr.fma(cos, q.x, -sin * q.y), dr.fma(cos, q.y, sin * q.x))


mi.register_bsdf("diffraction", Diffraction)
