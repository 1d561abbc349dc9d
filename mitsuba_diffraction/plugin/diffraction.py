"""The Mitsuba BSDF plugin `diffraction`: measured surfaces that diffract the light they reflect.

Parameters, with defaults in brackets; ∂: differentiable. Lengths are in µm, wavelengths and
film_thickness in nm. `docs/parameters.md` is made of this text. Surfaces that light goes through as
well are of the plugin `diffraction_dielectric`.

The surface
-----------
filename : string
    File of the height map: image, array (NPY), text, instrument file or recipe (TOML); or a table
    of `mitsuba-diffraction precompute`.
data : mi.TensorXf
    Instead: heights, µm, shape (ny, nx); in dictionaries only. `md.bsdf_dict` passes a HeightField.
    `mi.traverse` has it: other heights make another table.
pixel_size : float or string [from the file]
    Distance between heights, µm: one number, "dx, dy", or "auto".
max_height : float or string [from the file]
    Height of white in an integer image, µm, or "auto". Other heights are scaled to this range.
height_unit : string [from the file]
    Unit of the numbers in the file, for example `nm`.
channel : string or integer [the heights]
    Channel of an instrument file, by name or index; of an EXR image, by name.
crop : float or string [none]
    Region to keep, µm: "width" or "width, height", central; or "width, height, x, y".
fill : string [none]
    Points without data: `none`, `auto` refuse them, `nearest` copies the nearest height,
    `harmonic` spans a membrane.
level : string [auto]
    Surface to subtract: `plane`, `quadratic`, `lines` (aligned scan lines, then a plane) or `none`;
    `auto`: `plane` for files with a visible tilt.
clip : float [none]
    Number of robust standard deviations, at least 1, beyond which heights are clipped (dust).
periodic : string [auto]
    Statement about the edges: `exact`, whole periods that tile; `open`, part of a larger surface.
    `auto`: files are open, generated patches tile.
orientation : float or texture ∂ [0]
    Angle, degrees, from ∂p/∂u to the x axis. Textures and mesh attributes hold (cos, sin); 8 and 16
    bits: (1 + cos)/2, (1 + sin)/2.
lateral_scale : float or texture ∂ [1]
    Factor on lengths in the plane, 0.01 to 100: multiplies the period. Number, raw texture or mesh
    attribute of one channel. Changeable only if given.
lateral_scale_max : float [of a bitmap; max(1, the value loaded)]
    Largest lateral_scale that can be set later, or of a texture that is no bitmap. Tables grow with
    its square.
height_scale : float or texture ∂ [1]
    Factor on the heights, up to 1.5 × max(1, the value loaded). Number, raw texture or mesh
    attribute of one channel.
height_scale_max : float [of a bitmap]
    Largest factor of a height_scale texture; required unless the texture is a bitmap.

The table
---------
coherence_width : float or string [auto]
    Width over which light is coherent, µm, 4σ of a Gaussian window. `auto`: 65 (sunlight), or the
    width of the table or recipe.
coherence : string [ensemble]
    `ensemble`: mean over all windows. `patch`: speckle of one window, at the patch's centre.
    `surface`: speckle of the window where the light falls.
uv_scale : float or string [none]
    Size of a unit of the texture coordinates, µm, for coherence=surface: one number, or "u, v".
world_scale : float [none]
    Instead: size of a unit of length of the scene, µm; 1000 for mm.
tiling : string [periodic]
    Cover for coherence=surface: `periodic`, side by side; `random`, shifted at random and blended,
    for rough surfaces without grooves.
basis : string [auto]
    Basis of the series in κ: `svd` (also `auto`), `chebyshev` or `taylor`.
tolerance : float [0.001]
    Largest relative error of ⟨|P|²⟩. A table that cannot meet it is refused.
terms : integer [from tolerance]
    Length of the series.
windows : float or string [auto]
    Width of the windows of an open patch, µm. `auto`: the smaller side up to 32 µm; above, half of
    it, 32 µm to coherence_width.

The material
------------
material : string or float
    Tissue or liquid (`keratin`, `chitin`, `melanin`, `guanine`, `water`, `SiO2`, `MgF2`), index
    (`1.56`, `1.56+0.05i`), conductor (`Au`, `gold`), or `none` (R = 1).
eta, k : spectra ∂
    Instead: complex index of a conductor.
int_ior, ext_ior : float or string [1.5, 1.000277]
    Indices of the default dielectric and of the surrounding medium, or names (`water`). Their
    ratio is the differentiable `eta`.
coat_ior : float or string [none]
    Index of a flat clear layer over the structure, too thick to interfere: 1.58 (lacquer), `water`.
    Relative index: the differentiable `coat_eta`.
film_ior : float or string [none]
    Index of a thin film that follows the heights and interferes. Relative index: the
    differentiable `film_eta`. Excludes a coat.
film_thickness : float or texture ∂ [none]
    Along the vertical, nm; 2 n d is at most 12 µm. Or a picture, raw texture or mesh attribute,
    0 to 1.
film_thickness_min, film_thickness_max : float [0, none]
    Thicknesses, nm, where a texture of film_thickness is 0 and 1.
film_k : float ∂ [0]
    Absorption of the film, k of its index n + ik. Excludes a nested BSDF.
layers : string [none]
    TOML file of a stack that follows the heights: `layers`, pairs of material and thickness, µm;
    `repeat`; `spread`. Excludes film and coat.
model : string [small_slope]
    Model of the boundary: `small_slope`, blended with Kirchhoff's on rough surfaces; or
    `kirchhoff`, the tangent plane, default of `none` and stacks.
energy_conserving : boolean [true]
    Whether s(ωi) s(ωo) scales the BSDF so that no direction reflects more than it receives.
shadowing : string [none]
    `vcavity`: shadowing of long V-shaped grooves (Torrance and Sparrow 1967); `none`.

The light beneath
-----------------
(nested) : BSDF ∂
    Base BSDF beneath a clear material, which receives the light that is not reflected. Any BSDF
    that only reflects. Its components follow component 0.
pigment : string or float [none]
    Instead: diffuse reflectance: grey, `r,g,b`, `#804020`, `sienna`, spectrum (`brown.csv`,
    `feathers.csv:male`, `brown.csv:percent`), picture or `.glb`.

Variants
--------
wavelength : float [550]
    Wavelength of mono variants, nm.

The model is the power of diffraction orders under a Gaussian coherence window (Stam 1999) times a
factor of the material:

    f = 4 cosθi cosθo N / (λ² A w²) · ⟨|P|²⟩

**Heights.** The order of treatments is crop, fill, level, clip. Order 0 has the coherence
width on any scan; other orders have at most the width of the scan's windows (Welch 1967).

**Scales.** coherence_width applies at the largest lateral_scale, or at 1 if none is larger;
elsewhere the window shrinks with the patch. A table file serves lateral factors up to 1.

**Speckle.** `surface` requires texture coordinates of one scale, uv_scale or world_scale, and a
spectral or mono variant. `random` tiling: Heitz and Neyret (2018).

**Media.** ext_ior changes only the reflectance. For its shorter waves, multiply lateral_scale
and height_scale by its index, as `--ext-ior` does. Renderings use water's index at 589 nm,
`spectrum` n(λ).

**Coats.** Light is refracted into the coat and out again; its face is a mirror of the same
coherence width. Reflections between face and structure are summed. Light beyond the critical angle
is lost (docs/validation.md). Under water's index at 589 nm, orders at 400 nm are up to 4 % too
dark.

**Films and stacks.** Scales of energy under a texture of thicknesses from 100 to 600 nm take a
minute, once; beyond 82° single thicknesses send on up to 1.09 of the light. RGB variants sum the
film's colours over wavelengths, apart from the orders. A stack's `spread` is the thicknesses'
standard deviation from place to place, as a share: `layers = [["chitin", 0.09], ["1.33", 0.08]]`.
Stacks exclude a nested BSDF if they absorb. Under a spread, polarised variants keep the mean phase
between s and p.

**Energy.** Metal gratings lose some per cent in directions without gain (docs/energy.md). The scale
takes seconds, once, and is interpolated over height_scale. For its derivative, enable that of
height_scale before parameters.update(). Derivatives by indices and films hold it constant, in steps
of 5 nm of film_thickness.

**Derivatives by data** take `periodic=exact`, `basis=chebyshev`, `model=kirchhoff`,
`energy_conserving=false`, nothing beneath, no RGB variant and a wide window.

**The light beneath** is multiplied by T(ωi) T(ωo), T = 1 − a with the albedo a of the surface and
its coat. Spectra of pigments are constant beyond their ends.

**Tools.** Functions of `dr.freeze` give `mi.render` a seed of type `mi.UInt32`. On CUDA Dr.Jit 1.5
cannot record `sample` of a bitmap.

XML and the same in Python:

    <bsdf type="diffraction">
        <string name="filename" value="scale.png"/>
        <float name="pixel_size" value="0.0488"/>
        <float name="max_height" value="0.375"/>
    </bsdf>

    import mitsuba_diffraction  # before Mitsuba: registers the plugin
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    bsdf = mi.load_dict(
        {
            "type": "diffraction",
            "filename": "scale.png",
            "pixel_size": 0.0488,
            "max_height": 0.375,
        }
    )
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi

from ..optics.geometry import vcavity
from . import parameters as read
from .arithmetic import plain
from .description import Feature, Surface, unscaled
from .directions import SHADOWINGS, CoatedPair, Pair, Site
from .energy import EnergyModel, reflectors_of
from .layers import UnderCoat
from .properties import choice
from .sampling import direction_of, drawn, with_even_share
from .surface import DiffractingSurface
from .types import (
    Colour,
    Context,
    Float,
    Mask,
    Powers,
    Properties,
    Spectrum,
    Vector2f,
    Vector3f,
)


class Diffraction(DiffractingSurface):
    """Reflection by a surface that diffracts, in the symbols and equations of `reference.model`.

    f cosθo = N' ⟨|P|²⟩ / (λ² A w² cosθi),   N' = (2 cosθi cosθo)² N,   is eq. 4 times cosθo.

    Attributes
    ----------
    coat : the clear layer over the structure, or None.
    vcavity : whether the surface shadows itself like V-shaped grooves.
    """

    title = "Diffraction"

    def __init__(self, props: Properties) -> None:
        nested = read.nested_of(props, read.REFLECTING)
        coat = read.coat_of(props)
        optical = 1.0 if coat is None else plain(coat.eta)
        super().__init__(props, nested, read.surface_material(props, coat), optical)
        self.coat = coat
        self.vcavity = choice(props, "shadowing", SHADOWINGS) == "vcavity"
        if self.coat is not None:
            self.fresnel = UnderCoat(self.boundary.material, self.coat)
        self.energy = EnergyModel(
            self.table.wavelength_range,
            self.wavelength,
            partial(reflectors_of, self.boundary, self.coat),
            conserving=self.energy_conserving,
            beneath=nested is not None,
            thickness=self.boundary.material.varying,
        )
        self.ready()

    # ------------------------------------------------------------------ the diffraction

    def diffracted(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """See `SurfaceBSDF.diffracted`."""
        pair = self.pair(site, wo, active)  # eq. 1
        # Eq. 2 and 3: ⟨|P|²⟩ at q = k (u, v) and κ = k w, for each wavelength
        drawing = self._drawing_scale(site)
        power, density = self.power.answers(pair, site.scale, drawing, site.si, kinds)
        if "v" not in kinds:
            return mi.Spectrum(0.0), with_even_share(density)
        # Eq. 4 to 10: times N' of the material and the rest
        return self.light(ctx, site, pair, power, active), with_even_share(density)

    def light(self, ctx: Context, site: Site, pair: Pair, power: Powers, active: Mask) -> Spectrum:
        """Return f cosθo of the structure, and of the coat's face where there is one.

        power : ⟨|P|²⟩ / (4π²σ⁴ λ²) of the pair in 1/µm², eq. 2 and 3, from the power model.
        """
        shadowing = 1.0
        if self.vcavity:
            shadowing = vcavity(pair.cos_i, pair.cos_o, pair.one_plus_dot)
        # Eq. 4 to 10: N' or a Mueller matrix from Jones matrices
        value = self.lobe(ctx, site, pair, self.boundary, power, active, shadowing)
        if self.coat is not None:
            value += self.face(ctx, site, pair.outer, self.coat, active)
        if self.energy.scales:
            # s(ωi) s(ωo), so that no direction reflects more than it receives
            value *= mi.Spectrum(self.energy.factor(site, pair.outer.wo))
        return value

    def pair(self, site: Site, wo: Vector3f, active: Mask) -> Pair:
        """Return (u, v, w) = ωi + ωo in the patch's frame, eq. 1; within a coat if there is one."""
        pair = Pair(site.si, wo, site.frame, active)
        return pair if self.coat is None else CoatedPair(pair, self.coat.eta)

    def draw(self, ctx: Context, site: Site, sample1: Float, sample2: Vector2f) -> Vector3f:
        """See `SurfaceBSDF.draw`."""
        wi = site.si.wi
        scale = dr.detach(self._drawing_scale(site))

        def by_orders(sample1: Float) -> Vector3f:
            uv = self.power.draw(mi.Frame3f.cos_theta(wi), scale, sample1, sample2, site.si)
            return direction_of(site.frame.from_table(uv) - mi.Vector2f(wi.x, wi.y))

        return drawn(by_orders, sample1, sample2)

    def _drawing_scale(self, site: Site) -> Float:
        """Height scale to draw directions for: under a coat κ is as if heights were larger."""
        return site.scale if self.coat is None else site.scale * self.coat.eta

    def beneath(self, site: Site, wo: Vector3f, active: Mask) -> Colour:
        """See `SurfaceBSDF.beneath`: T = 1 − a, a the flat reflectance plus a smooth difference.

        a is the albedo of the diffraction, so that what is not reflected goes on, and a white pair
        reflects at most what it gets.
        """
        inwards, outwards = (
            dr.clip(1.0 - self.energy.albedo_excess(w, site) - flat, 0.0, 1.0)
            for w in (site.si.wi, wo)
            for flat in [self.fresnel.reflectance(mi.Frame3f.cos_theta(w), site.si, active)]
        )
        return inwards * outwards

    # ------------------------------------------------------------------ changes of parameters

    def refusals(self) -> Iterator[str | None]:
        """See `PluginBSDF.refusals`."""
        yield from super().refusals()
        if self.coat is not None:
            yield self.optical_refusal(self.coat.eta, "coat_eta", "coat_ior")
        if self.nested is not None and self.boundary.material.absorbs:
            yield read.refusal(Feature.NESTED.phrase(), Feature.OPAQUE.phrase())

    def kernel_constants(self) -> tuple[object, ...]:
        """See `PluginBSDF.kernel_constants`."""
        material = self.boundary.material
        varying = str(material.varying and material.varying.texture)
        other_kernels = material.reflects_all, material.sums, material.tint is None, varying
        own = self.vcavity, self.coat is None, self.energy.kernel_constants()
        return *super().kernel_constants(), *own, *other_kernels

    # ------------------------------------------------------------------ for shaders and people

    def describe(self) -> Surface:
        """See `DiffractingSurface.describe`."""
        energy = self.energy
        return replace(
            super().describe(),
            coat=None if self.coat is None else plain(self.coat.eta),
            nested=self.nested,
            shadowing=self.vcavity,
            # shaders have no scale under a coat, where it is near 1
            energy_scale=unscaled if self.coat is not None else energy.scale,
            albedo_excess=energy.excess,
        )

    def shown(self) -> dict[str, Any]:
        """See `PluginBSDF.shown`."""
        more = {"shadowing": "vcavity" if self.vcavity else "none"}
        return {**super().shown(), **more, **({"nested": self.nested} if self.nested else {})}


mi.register_bsdf("diffraction", Diffraction)
