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
    Heights in µm instead, shape (ny, nx); dictionaries only. `md.bsdf_dict` fills it in with a
    whole HeightField, which needs no pixel_size.
pixel_size : float or string [from the file]
    Distance between heights in µm: one number, "dx, dy", or "auto".
max_height : float or string [from the file]
    Height of white in an integer image, µm, or "auto"; other heights are scaled to span it.
height_unit : string [from the file]
    Unit of the numbers in the file, `nm` for instance, where it states none or a wrong one.
channel : string or integer [the heights]
    Which channel of an instrument file: its name or index; of an EXR image, its name.
crop : float or string [none]
    Crop to a central region (µm): one number for a square, or "width, height".
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
    Degrees that the patch's x axis is turned by from the first tangent, up to 36000; or a texture
    (raw, in a float format such as EXR) or mesh attribute of three channels, the first two of
    which are (cos, sin) of that angle. Tangents follow UV coordinates: on a mesh without them they
    are arbitrary, and turn from triangle to triangle. A BSDF cannot see that; `info MESH` and
    `render` warn.
height_scale : float or texture ∂ [1]
    Multiplies the heights, up to 1.5 × max(1, value given); or, worn and fresh places: a raw bitmap
    or another texture or mesh attribute of one channel.
height_scale_max : float [of a bitmap]
    The largest factor of such a texture, which all but bitmaps need; larger ones are taken for it.

The table
---------
coherence_width : float or string [65]
    4σ of the Gaussian amplitude window, µm: the width over which light is coherent. `auto`, as
    without it: that of the table or the recipe, else 65.
coherence : string [ensemble]
    `ensemble`: what a pixel sees that covers many coherence areas; `patch`: one window's speckle,
    the same everywhere; `surface`: that of the window centred where the light falls, the grain seen
    from close up, which averages to `ensemble` from afar. It needs UV coordinates and one of the
    next two, and a spectral or mono variant. Directions and energy are those of `ensemble`.
uv_scale : float or string [none]
    µm a unit of the UV coordinates: one number, or "u, v".
world_scale : float [none]
    Or µm a unit of length of the scene, 1000 for mm: positions are then as far apart as UV
    coordinates are on the surface, which must be alike all over it.
tiling : string [periodic]
    How the patch covers the surface: `periodic`, side by side; `random`, shifted at random and
    blended such that mean and contrast stay, so that it does not show again and again (Heitz and
    Neyret 2018; for rough surfaces: the lines of a grating would be broken).
basis : string [auto]
    `svd` (also as `auto`), `chebyshev` or `taylor`: the series in κ.
tolerance : float [0.001]
    Relative error of ⟨|P|²⟩, met or refused.
terms : integer [from tolerance]
    Length of the series.
windows : float or string [none]
    Width, in µm, of the overlapping windows that a scan much wider than coherence_width is cut
    into, each levelled, whose powers are averaged (Welch 1967); `auto` is twice coherence_width.

The material
------------
material : string
    A conductor by name, as in `roughconductor`; `none` reflects everything.
eta, k : spectra ∂
    The same by its complex refractive index.
int_ior, ext_ior : float or string [1.5, 1.000277]
    A dielectric, which the surface is unless it is a conductor (1.5: shed snake skin).
    Their ratio is the differentiable parameter `eta`; under a coat that of int_ior and coat_ior.
coat_ior : float or string [none]
    A flat clear layer over the structure, too thick to interfere: 1.58 is the polycarbonate of a
    CD. Light is refracted into it and out again, and its own face is a mirror of the same
    coherence width. Light that the face sends back is summed as between two mirrors; what leaves
    the structure beyond the critical angle is lost (docs/validation.md has figures), so coats never
    gain, and energy_conserving has nothing to do. Over that of the medium above it is the
    differentiable parameter `coat_eta`.
film_ior : float or string [none]
    A thin film that follows the heights and interferes: oxide on a metal (1.77 is alumina), wax on
    a scale. Its lower face is the structure, its upper one the same heights, film_thickness above.
    Over that of the medium above it is the differentiable parameter `film_eta`. It excludes a coat.
    Small slope has the mean of the second order under a film, which thick films on metals need: a
    second or two at loading, kept in the cache, in steps of 5 nm and of 0.01 of the indices.
film_thickness : float ∂ [none]
    The film's thickness along the vertical, nm; at most the length over which light is coherent,
    2 n d = 12 µm. RGB variants sum its colours over wavelengths, apart from those of the orders.
film_k : float ∂ [0]
    The film's absorption, the k of n + ik over that of the medium above it; not over a nested BSDF.
transmission : boolean [false]
    Light goes through the dielectric, from both sides: orders of κ = k (n cosθt − cosθi). The side
    that normals point to has ext_ior, the other one int_ior, which is at least 1.01 times that.
    Component 0 is what is reflected, 1 what goes through. Orders that change the tangential part by
    more than 2/λ are left out. It excludes coat, film, nested BSDF and shadowing. energy_conserving
    makes R + T 1, since a dielectric loses no light: order 0 is multiplied by c(ωi) c(ωo), c on the
    directions of both sides, and where that is not enough all is scaled likewise, by at most 1.5²;
    what is still missing of steep slopes is spread over all directions where some is missing. A few
    seconds' work, kept in the cache, in steps of 0.01 of eta.
thin : boolean [false]
    Light goes through a sheet, whose other side is flat; both sides have ext_ior. What that side
    sends back is summed as between two mirrors. Light beyond the sheet's critical angle is lost,
    unless energy_conserving puts it back, into order 0 first.
model : string [small_slope]
    `small_slope`: first-order small-slope approximation (Voronovich 1985), blended with Kirchhoff's
    where the surface is rough at the scale of an order; polarised variants have its Mueller
    matrices. `kirchhoff`: the tangent plane, also the default of material `none`, which has no
    index, and of layering `thesis`.
second_order : string or boolean [auto]
    Multiplies orders by the second order of small slope (Voronovich 1994), a factor of directions
    and of the heights' slopes. `auto` applies it if the table changes colours by 5 % or more: of
    discs and blazed gratings, not of skins. `true` applies it wherever it is known: light that a
    dielectric denser than the medium above it reflects, bare or under a coat, by model
    `small_slope`, in an ensemble, without layering `thesis`; elsewhere it is refused. `false`
    leaves it out. The change is measured when the table is built, for index 1.5 in light from 60°
    and heights as they are (`mitsuba-diffraction info`). For light from 60° it lowers the error of
    colours on a CD's pits from a third to a tenth (docs/validation.md). Polarised variants
    multiply matrices by the factor for unpolarised light. Order 0, sampled directions and the
    light for what lies beneath are the same without it. Coefficients follow the index in steps of
    0.01.
energy_conserving : boolean [true]
    Where the model reflects more than it gets, multiplies it by s(ωi) s(ωo), a scale of directions
    found for this table, model, material and each wavelength, so that no more is reflected than
    comes in: reciprocal. Kirchhoff's model fades within 5° of the horizon as well. Dielectrics gain
    nothing and are as they are; blazed metal gratings lose some of the light of directions that
    gain nothing, too (docs/energy.md has figures). `false` is the model as it is, for checks. The
    scale takes a second or more the first time, and is kept in the cache. It follows height_scale,
    interpolated between a few: an optimisation waits where it enters such an interval for the first
    time. For its derivative, enable that of height_scale before parameters.update().
shadowing : string [none]
    `vcavity`: the surface shadows itself like long V-shaped grooves (Torrance and Sparrow 1967);
    `none`.

The light beneath
-----------------
(nested) : BSDF ∂
    What lies beneath a dielectric and receives the light that is not reflected, e.g. pigment:
    any BSDF that only reflects, mirrors included. Its components follow the diffraction's, which
    is number 0.
layering : string [transmission]
    How the nested BSDF shares the light. `transmission`: it gets and returns T(ωi) T(ωo), with
    T = 1 − a, a the diffracting surface's own albedo (under a coat, the reflectance of both flat
    faces, bounces included). `thesis`: (1 − w) f_diffraction + (1 − F + w) f_nested, F at the half
    vector, as in the thesis of 2014 that the method comes from; for comparisons with its pictures
    only, since it gains energy.
diffuse_weight : float [0]
    That w.

Variants
--------
wavelength : float [550]
    nm, in mono variants; the others have their own.

The model is that of diffraction orders under a Gaussian coherence window (Stam 1999), looked up in
a table of the patch, times what the material makes of them:

    f = 4 cosθi cosθo N / (λ² A w²) · ⟨|P|²⟩

N is the mean power of a Jones matrix for unpolarised light; by Kirchhoff (Beckmann and Spizzichino
1963) it is R (1 + ωi·ωo)² / (2 cosθi cosθo)².

Denoisers that ask for an albedo get the reflectance at normal incidence, that of what lies beneath
included.

Several such surfaces in one, by weights: the BSDF `diffraction_mix` (docs/own-scene.md).

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
import weakref
from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..tables.energy.grid import DirectionalTable
from .boundary import Boundary, Kirchhoff
from .directions import Pair, from_patch, in_patch, vcavity
from .energy import EnergyModel
from .fresnel import tinted
from .layers import CoatedPair, Transmission, UnderFilm
from .llvm import require_loaded_llvm
from .parameter_changes import Bounded, ObjectValues, arrays_within, marks, take_changes
from .parameters import ABSORBED, read_parameters
from .power import power_model
from .sampling import EVEN, direction_of, with_even_share
from .sources import TableProvider, from_cache
from .textures import LEAST_SCALE, PLACED, VaryingHeightScale
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

#: The component of a context that asks for all of them.
_ALL = 0xFFFFFFFF


class Diffraction(mi.BSDF):
    """Diffraction by a measured height field."""

    def __init__(self, props: Properties, provider: TableProvider = from_cache) -> None:
        require_loaded_llvm()
        super().__init__(props)
        parameters = read_parameters(props, provider)
        self.table = parameters.table
        self.places, self.heights = parameters.places, parameters.heights
        self.fresnel = parameters.reflectance
        self.boundary, self.coat = parameters.boundary, parameters.coat
        self.mirror = Kirchhoff(self.coat) if self.coat is not None else None
        self.nested: BSDF = parameters.nested  # or None
        self.through = parameters.through
        self._second_order = parameters.second_order
        self._set_height_scale(parameters.height_scale, parameters.optical)
        self.orientation = parameters.orientation
        self.layering = parameters.layering
        self.vcavity = parameters.vcavity
        self.power = power_model(self.table, parameters.wavelength, self.places)
        mean = self.table if self.places is None else self.table.averaged
        # Under a coat, or of light that goes through, nothing is known of the albedo
        self._energy = (
            EnergyModel(mean, self.boundary, parameters.wavelength, parameters.energy_conserving)
            if self.coat is None and self.through is None
            else None
        )
        self.area_factor = 4.0 * dr.pi * self.table.sigma**2  # 4π²σ⁴ over the window's area πσ²
        front = mi.BSDFFlags.FrontSide
        glossy = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.Anisotropic | front
        components = [glossy] if self.through is None else self.through.flags()
        if self.nested is not None:
            components += [self.nested.flags(n) for n in range(self.nested.component_count())]
        self.m_components = components  # at once: what it gives back is a copy
        self.m_flags = functools.reduce(operator.or_, components)
        self.parameters = [*self._scale_changeable, *self.orientation.changeable]
        self.parameters += self.fresnel.changeable
        if self.nested is not None:
            self.parameters.append(ObjectValues("nested", self.nested))
        self.mix: weakref.ref[Any] | None = None
        self.derive()

    def _set_height_scale(self, given: float | VaryingHeightScale, optical: float) -> None:
        """A bounded number; or factors that vary, of which `height_scale` is the largest."""
        if isinstance(given, VaryingHeightScale):
            self._scale: VaryingHeightScale | Bounded = given
            self._scale_changeable = given.changeable
            self._varying: VaryingHeightScale | None = given
            self.height_scale: Float = mi.Float(given.high)
            return
        most = self.table.height_scale_max / optical
        bounded = Bounded(
            "height_scale", given, LEAST_SCALE, most, functools.partial(_scale_refusal, most)
        )
        self._scale, self._varying, self.height_scale = bounded, None, bounded.value
        self._scale_changeable = (bounded,)

    # ------------------------------------------------------------------ Mitsuba's interface

    def eval(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Spectrum:
        """f·cosθo per wavelength; where light goes through, as the context's mode has it."""
        if self.through is not None:
            return self.through.eval_pdf(self, ctx, si, wo, active)[0]
        active = self._above(si, wo, active)
        above, nested = self._lobes(ctx)
        value = mi.Spectrum(0.0)
        if above:
            pair = self._pair(si, wo, active)
            power = self.power.power(pair, self.scale_at(si, active), si)
            value = self.layering.above * self.diffracted(ctx, si, pair, power, active)
        if nested is not None:
            beneath = mi.Spectrum(self._beneath(si, wo, active))
            value += beneath * self.nested.eval(nested, si, wo, active)
        return dr.select(active, value, 0.0)

    def pdf(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Float:
        """Density of `sample` per solid angle."""
        if self.through is not None:
            return self.through.eval_pdf(self, ctx, si, wo, active)[1]
        active = self._above(si, wo, active)
        above, nested = self._lobes(ctx)
        density = mi.Float(0.0)
        if above:
            pair = self._pair(si, wo, active).outer
            density = with_even_share(self.power.density(pair, self._drawing_scale(si, active), si))
        if nested is not None:
            beneath = self.nested.pdf(nested, si, wo, active)
            density = dr.lerp(beneath, density, self._glossy_share(above, si, active))
        return dr.select(active, density, 0.0)

    def eval_pdf(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
    ) -> tuple[Spectrum, Float]:
        """`eval` and `pdf` at once."""
        if self.through is not None:
            return self.through.eval_pdf(self, ctx, si, wo, active)
        active = self._above(si, wo, active)
        above, nested = self._lobes(ctx)
        value, density = mi.Spectrum(0.0), mi.Float(0.0)
        if above:
            pair = self._pair(si, wo, active)
            scales = self.scale_at(si, active), self._drawing_scale(si, active)
            power, orders = self.power.both(pair, *scales, si)
            density = with_even_share(orders)
            value = self.layering.above * self.diffracted(ctx, si, pair, power, active)
        if nested is not None:
            beneath = mi.Spectrum(self._beneath(si, wo, active))
            its_value, its_density = self.nested.eval_pdf(nested, si, wo, active)
            value += beneath * its_value
            density = dr.lerp(its_density, density, self._glossy_share(above, si, active))
        return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

    def sample(
        self,
        ctx: Context,
        si: Interaction,
        sample1: Float,
        sample2: Vector2f,
        active: Mask = True,
    ) -> tuple[Sample, Spectrum]:
        """A direction, and f·cosθo over its density.

        Of what lies beneath, lobes of one direction are returned alone: the diffraction has no
        share in them. All others are mixed with it, in value and density.
        """
        if self.through is not None:
            return self.through.sample(self, ctx, si, sample1, sample2, active)
        active = mi.Mask(active) & (mi.Frame3f.cos_theta(si.wi) > 0.0)
        above, nested = self._lobes(ctx)
        result = dr.zeros(mi.BSDFSample3f)
        result.eta = 1.0
        result.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        share, delta, weight = mi.Float(1.0), mi.Mask(False), mi.Spectrum(0.0)
        if nested is not None:
            share = self._glossy_share(above, si, active)
            chosen = active & (sample1 >= share)
            remaining = (sample1 - share) / dr.select(chosen, 1.0 - share, 1.0)
            below, weight = self.nested.sample(nested, si, remaining, sample2, chosen)
            below.sampled_component += 1
            result = dr.select(chosen, below, result)
            delta = chosen & mi.has_flag(below.sampled_type, mi.BSDFFlags.Delta)
            sample1 = dr.select(chosen, sample1, sample1 / dr.select(chosen, 1.0, share))
        if above:
            drawn = self._draw(si, sample1, sample2, active)
            result.wo = drawn if nested is None else dr.select(chosen, result.wo, drawn)
        value, density = self.eval_pdf(ctx, si, result.wo, active & ~delta)
        value = value / dr.select(density > 0.0, density, 1.0)
        if nested is not None:
            beneath = mi.Spectrum(self._beneath(si, result.wo, delta))
            value = dr.select(delta, beneath * weight / dr.select(delta, 1.0 - share, 1.0), value)
            density = dr.select(delta, result.pdf * (1.0 - share), density)
        active &= (density > 0.0) & (mi.Frame3f.cos_theta(result.wo) > 0.0)
        result.pdf = dr.select(active, density, 0.0)
        return result, dr.select(active, value, 0.0)

    def eval_diffuse_reflectance(self, si: Interaction, active: Mask = True) -> Spectrum:
        """What a denoiser takes for the surface's colour: its reflectance at normal incidence.

        That of the interface, and of what lies beneath; 0 to 1, the same from every direction.
        """
        reflectance = mi.Spectrum(self.fresnel.reflectance(mi.Float(1.0), si, active))
        if self.nested is not None:
            level = mi.SurfaceInteraction3f(si)
            level.wi = mi.Vector3f(0.0, 0.0, 1.0)
            beneath = self._beneath(level, level.wi, active)
            own = self.nested.eval_diffuse_reflectance(level, active)
            reflectance = self.layering.above * reflectance + mi.Spectrum(beneath) * own
        return dr.select(active, dr.clip(reflectance, 0.0, 1.0), 0.0)

    def traverse(self, callback: Callback) -> None:
        """Expose what may change between renderings without another table."""
        self._scale.traverse(callback)
        self.orientation.traverse(callback)
        self.fresnel.traverse(callback)
        if self.nested is not None:
            callback.put("nested", self.nested, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys: list[str]) -> None:
        """Take all changes, or none of them.

        Raises
        ------
        DiffractionError
            If a parameter is out of bounds, as a height_scale that the table does not serve. All
            parameters then have their last values.
        """
        mix = self.mix and self.mix()
        take_changes(self, mix.together if mix else [self])

    def refusals(self) -> Iterator[str | None]:
        """See `Changing.refusals`."""
        yield self._optical_refusal()
        if self._varying is not None:
            yield self._varying.refusal()
        if isinstance(self.fresnel, UnderFilm):
            yield self.fresnel.refusal()
            if self.nested is not None and self.fresnel.numbers()[0].imag:
                yield ABSORBED

    def derive(self) -> None:
        """Compute what depends on the parameters: scales of energy, and what `dr.freeze` sees."""
        self.fresnel.derive()
        largest = dr.slice(dr.max(dr.detach(self.height_scale)))
        differentiable = dr.grad_enabled(self.height_scale)
        lowest = self._varying.range()[0] if self._varying else None
        if self._energy is not None:
            beneath = self.nested is not None and isinstance(self.layering, Transmission)
            self._energy.update(largest, differentiable, beneath, lowest)
        if self.through is not None and self.through.balance is not None:
            self.through.balance.update(largest, differentiable, lowest)
        if self._second_order is not None:
            self._second_order.update()
        held = arrays_within(
            self.power,
            self._energy,
            self.orientation,
            self.fresnel,
            self.boundary,
            self.mirror,
            self.through,
            self._varying,
            self._second_order,
        )
        self._for_freezing = held + marks(
            self.table,
            str(self.places),
            str(self._varying),
            self.vcavity,
            str(self.layering),
            str(self.boundary),
            self.coat is None,
            self._second_order is None,
            self.through is None or self.through.thin,
            self._takes,
            getattr(self.boundary.material, "reflects_all", False),  # other kernels
            getattr(self.boundary.material, "channels", None),
            getattr(self.boundary.material, "tint", None) is None,
        )

    def _optical_refusal(self) -> str | None:
        """Reason why heights times the index that they are in are beyond the table, or None."""
        medium = self.coat
        if self.through is not None:
            medium = self.through.material
        if medium is None:
            return None
        name = "coat" if self.coat else "int"
        optical = float(dr.slice(dr.max(dr.detach(self.height_scale * medium.eta))))
        if optical <= self.table.height_scale_max * (1.0 + 1e-6):
            return None
        return (
            f"height_scale times {'coat_' if self.coat else ''}eta is {optical:g}, beyond the "
            f"table's {self.table.height_scale_max:g}; load the plugin anew with that {name}_ior"
        )

    @property
    def model(self) -> str:
        """What the material makes of the light, for people."""
        return f"{self.boundary}, second order" if self._second_order else str(self.boundary)

    @property
    def second_order_index(self) -> float | None:
        """Index that the second order of small slope is for; None without it."""
        return None if self._second_order is None else self._second_order.index

    @property
    def only_traced(self) -> str | None:
        """What it has that only the path tracer shows."""
        if self.places is not None:
            return "coherence='surface'"
        if self.through is not None:
            return "light that goes through"
        if isinstance(self.fresnel, UnderFilm):
            return "a thin film"
        return "a height_scale that varies" if self._varying else None

    @property
    def energy_conserving(self) -> bool:
        """Whether it takes what it would reflect too much."""
        if self.through is not None:
            return self.through.balance is not None
        return self._energy is not None and self._energy.conserving

    def energy_scale(self, height_scale: float) -> tuple[NDArray[np.float32], bool] | None:
        """What conserves energy, for who knows no wavelengths: s, and whether it fades as well.

        s : (polar + 1, azimuthal) on `tables.energy.grid.FINE`; None where nothing is.
        """
        if self._energy is None or not self._energy.conserving:
            return None
        scale = self._energy.brightness(height_scale)
        return None if scale is None else (scale, self._energy.fades)

    def reflected_ratio(self, height_scale: float) -> DirectionalTable | None:
        """Its albedo over the flat interface's reflectance, where T = 1 − a goes on beneath."""
        beneath = self.nested is not None and isinstance(self.layering, Transmission)
        return self._energy.ratio(height_scale) if beneath and self._energy is not None else None

    @property
    def _takes(self) -> int:
        balance = self._energy if self.through is None else self.through.balance
        return 0 if balance is None else balance.takes

    def to_string(self) -> str:
        """All parameters, for people."""
        nested = "" if self.nested is None else f"  nested = {self.nested},\n"
        places = "" if self.places is None else f"  {PLACED}, {self.places},\n"
        return (
            "Diffraction[\n"
            f"  table = {self.table},\n"
            f"  coherence_width = {self.table.coherence_width:g} µm,\n"
            f"{places}"
            f"  tolerance = {self.table.tolerance:g},\n"
            f"  surface = {self.fresnel},\n"
            f"  model = {self.model},\n"
            f"  height_scale = {self._varying or f'{dr.slice(self.height_scale):g}'},\n"
            f"  energy_conserving = {'true' if self.energy_conserving else 'false'},\n"
            f"  orientation = {self.orientation},\n"
            f"{self._sides()}"
            f"  shadowing = {'vcavity' if self.vcavity else 'none'},\n"
            f"  layering = {self.layering},\n"
            f"{nested}]"
        )

    def _sides(self) -> str:
        if self.through is None:
            return ""
        return f"  {'thin' if self.through.thin else 'transmission'} = true,\n"

    # ------------------------------------------------------------------ the model

    def diffracted(
        self, ctx: Context, si: Interaction, pair: Pair, power: Colour, active: Mask
    ) -> Spectrum:
        """N' / (λ² A w² cosθi) · ⟨|P|²⟩, that is f·cosθo of diffraction alone (see `boundary`).

        Under a coat that of its face too, the lobe of a flat patch.

        power : what the power model says of this pair of directions.
        """
        value = self.lobe(ctx, si, pair, self.boundary, active, power)
        if self.mirror is not None:
            value += self.face(ctx, si, pair.outer, self.mirror, active)
        return value

    def lobe(
        self,
        ctx: Context,
        si: Interaction,
        pair: Pair,
        boundary: Boundary,
        active: Mask,
        power: Colour | None = None,
    ) -> Spectrum:
        """f·cosθo of the structure alone; power : what the power model says, if it was asked."""
        w = pair.cos_i + pair.cos_o
        outside = self.area_factor * dr.rcp(dr.square(w) * pair.cos_i)
        if isinstance(pair, CoatedPair):
            outside *= pair.outer.cos_o * dr.rcp(pair.cos_o)
        if self.vcavity:
            outside *= vcavity(pair.cos_i, pair.cos_o, pair.one_plus_dot)
        wavenumbers, scale = self.power.wavenumbers(si), self.scale_at(si, active)
        if power is None:
            power = self.power.power(pair, scale, si)
        if self._second_order is not None:
            # order 0 keeps its power, and others where a mirror's lobe, its most, outshines them
            mirror = dr.abs(self.power.flat(pair, si))
            others = power - dr.clip(power, -mirror, mirror)  # colours may be negative
            added = self._second_order.added(pair, scale, wavenumbers)
            power = power + others * mi.UnpolarizedSpectrum(added)
        factor = boundary.factor(pair, scale, wavenumbers, si, active, ctx.mode)
        power = outside * power
        if self._energy is not None and self._energy.takes:
            power *= self._energy.factor(pair, wavenumbers, scale)
        return dr.select(active, tinted(mi.Spectrum(power) * factor, boundary.material), 0.0)

    def face(
        self, ctx: Context, si: Interaction, pair: Pair, mirror: Boundary, active: Mask
    ) -> Spectrum:
        """f·cosθo of a flat face: the lobe of a flat patch."""
        wavenumbers = self.power.wavenumbers(si)
        outside = self.area_factor * dr.rcp(dr.square(pair.w) * pair.cos_i)
        factor = mirror.factor(pair, self.height_scale, wavenumbers, si, active, ctx.mode)
        return dr.select(active, mi.Spectrum(outside * self.power.flat(pair, si)) * factor, 0.0)

    def _beneath(self, si: Interaction, wo: Vector3f, active: Mask) -> Colour:
        """Factor of the nested BSDF."""
        ratios = mi.UnpolarizedSpectrum(1.0), mi.UnpolarizedSpectrum(1.0)
        if self._energy is not None and isinstance(self.layering, Transmission):
            rotation = self.orientation.rotation(si, active)
            k, scale = self.power.wavenumbers(si), self.scale_at(si, active)
            ratios = tuple(
                self._energy.reflected(in_patch(d, rotation), mi.Frame3f.cos_theta(d), k, scale)
                for d in (si.wi, wo)
            )
        return self.layering.beneath(si, wo, active, ratios)

    def scale_at(self, si: Interaction, active: Mask) -> Float:
        """The factor on the heights at points of the surface."""
        return self._varying.at(si, active) if self._varying else self.height_scale

    def _drawing_scale(self, si: Interaction, active: Mask) -> Float:
        """What directions are drawn for: under a coat κ is as if heights were larger."""
        scale = self.scale_at(si, active)
        return scale if self.coat is None else scale * self.coat.eta

    def _pair(self, si: Interaction, wo: Vector3f, active: Mask) -> Pair:
        pair = Pair(si, wo, self.orientation.rotation(si, active), active)
        return pair if self.coat is None else CoatedPair(pair, self.coat.eta)

    def _above(self, si: Interaction, wo: Vector3f, active: Mask) -> Mask:
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        return mi.Mask(active) & (cos_i > 0.0) & (cos_o > 0.0)

    def _lobes(self, ctx: Context) -> tuple[bool, Context | None]:
        """Whether a context asks for the diffraction, and what it asks of the nested BSDF."""
        above = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
        if self.nested is None or ctx.component == 0:
            return above, None
        lobes = self.nested.flags()
        asked = mi.BSDFContext(ctx.mode, ctx.type_mask, ctx.component)
        if ctx.component != _ALL:
            asked.component -= 1
            lobes = self.nested.flags(asked.component)
        return above, asked if ctx.type_mask & int(lobes) & int(mi.BSDFFlags.All) else None

    def _draw(self, si: Interaction, sample1: Float, sample2: Vector2f, active: Mask) -> Vector3f:
        """A direction, possibly below the surface (then it has no density and no value)."""
        uv = self.power.draw(
            mi.Frame3f.cos_theta(si.wi),
            dr.detach(self._drawing_scale(si, active)),
            dr.maximum((sample1 - EVEN) * (1.0 / (1.0 - EVEN)), 0.0),
            sample2,
            si,
        )
        rotation = self.orientation.rotation(si, active)
        ordered = direction_of(from_patch(uv, rotation) - mi.Vector2f(si.wi.x, si.wi.y))
        return dr.select(sample1 < EVEN, mi.warp.square_to_uniform_hemisphere(sample2), ordered)

    def _glossy_share(self, above: bool, si: Interaction, active: Mask) -> Float:
        """Share of the samples for diffraction where something lies beneath: by reflected power."""
        if not above:
            return mi.Float(0.0)
        reflectance = self.fresnel.reflectance(mi.Frame3f.cos_theta(si.wi), si, active)
        mean = dr.mean(mi.unpolarized_spectrum(reflectance))
        # What lies beneath is taken to return half of what it gets
        return dr.clip(mean / (0.5 + 0.5 * mean), 0.1, 0.9)


def _scale_refusal(most: float, height_scale: float) -> str:
    return (
        f"height_scale={height_scale:g} is outside what the table serves, above 0 and up to "
        f"{most:g}; load the plugin anew with that height_scale"
    )


mi.register_bsdf("diffraction", Diffraction)
