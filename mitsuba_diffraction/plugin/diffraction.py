"""The Mitsuba BSDF plugin `diffraction`: measured surfaces that diffract the light they reflect.

Parameters, with defaults in brackets; ∂: differentiable. Lengths are in µm, wavelengths in nm.
`docs/parameters.md` is made of this text. Surfaces that light goes through as well are of the
plugin `diffraction_dielectric`.

The surface
-----------
heightfield : string
    File of heights: image (PNG, BMP, TIFF, EXR), array (NPY), text, instrument file or recipe
    (TOML). A table is accepted, too.
table : string
    Instead: a table made by `mitsuba-diffraction precompute`.
data : mi.TensorXf
    Instead: heights in µm, shape (ny, nx), in dictionaries only. `md.bsdf_dict` passes a whole
    HeightField, which needs no pixel_size.
pixel_size : float or string [from the file]
    Distance between heights in µm: one number, "dx, dy", or "auto".
max_height : float or string [from the file]
    Height of white in an integer image, µm, or "auto". Other heights are scaled to this range.
height_unit : string [from the file]
    Unit of the numbers in the file, for example `nm`, if the file states none or a wrong one.
channel : string or integer [the heights]
    Channel of an instrument file, by name or index; of an EXR image, by name.
crop : float or string [none]
    Size of the central region to keep, µm: one number for a square, or "width, height"; or of one
    elsewhere, with its lower left corner: "width, height, x, y".
fill : string [none]
    Treatment of points without data: `none` refuses them, `nearest` copies the nearest height,
    `harmonic` spans a membrane over the gap.
level : string [auto]
    `plane` subtracts the best plane, `quadratic` the best paraboloid, as of a scanner's arc;
    `lines` aligns the scan lines by their medians first, then the plane; `none`.
    `auto` is `plane` for a file of heights whose tilt turns the mirror direction, else `none`.
clip : float [none]
    Number of robust standard deviations, at least 1, beyond which heights are clipped, as of dust.
periodic : string [auto]
    Statement about the edges: `exact`, the patch is whole periods of a surface that repeats, and
    tiles the plane; `open`, it is a part of a larger surface, seen through windows that fade
    towards its edges. `auto`: files of heights are open, generated patches tile. Treatments are
    applied in the order crop, fill, level, clip.
orientation : float or texture ∂ [0]
    Angle in degrees from the first tangent to the patch's x axis, up to 36000. Or a texture (raw,
    in a float format such as EXR) or mesh attribute of three channels, the first two of which are
    (cos, sin) of the angle. Tangents follow UV coordinates. On a mesh without UV coordinates they
    are arbitrary and turn from triangle to triangle, of which `info MESH` and `render` warn.
lateral_scale : float or texture ∂ [1]
    Factor that stretches the patch in its plane, heights unchanged, between 0.01 and 100: a
    grating's period at each point. Or a raw bitmap, another texture or a mesh attribute of one
    channel. Spatial frequencies are divided by it. coherence_width applies at the largest factor,
    or of 1 if none is above 1; elsewhere the window shrinks with the patch, so that it covers the
    same number of periods everywhere. May change up to lateral_scale_max. A table serves factors up
    to 1. Energy is conserved for it (docs/holograms.md).
lateral_scale_max : float [of a bitmap; max(1, the value loaded)]
    Largest factor of a texture, above which factors are clipped; required unless the texture is a
    bitmap. Or the largest value that a number may change to: give 1.5 × lateral_scale to optimise
    a period in both directions. Tables grow with its square.
height_scale : float or texture ∂ [1]
    Factor on the heights, up to 1.5 × max(1, the value loaded). Or a raw bitmap, another texture or
    a mesh attribute of one channel, for worn and fresh places.
height_scale_max : float [of a bitmap]
    Largest factor of such a texture, above which factors are clipped. Required unless the texture
    is a bitmap.

The table
---------
coherence_width : float or string [auto]
    Width over which light is coherent, µm, 4σ of its Gaussian amplitude window. `auto` is the width
    of the table or the recipe, else 65 (sunlight). The mirror direction (order 0) has it from any
    scan. Other orders of a scan have its windows' width at most. Patches that repeat exactly set no
    limit.
coherence : string [ensemble]
    `ensemble`: the mean over many windows, as seen by a pixel that covers many coherence areas.
    `patch`: the speckle of a single window, the same everywhere. `surface`: the speckle of the
    window centred where the light falls, the grain seen from close up, whose mean is `ensemble`.
    `surface` requires UV coordinates, uv_scale or world_scale, and a spectral or mono variant;
    sampling and energy are as in `ensemble`.
uv_scale : float or string [none]
    µm per unit of the UV coordinates: one number, or "u, v".
world_scale : float [none]
    Instead: µm per unit of length of the scene, 1000 for mm. Distances on the surface follow from
    the UV coordinates, whose scale must be the same all over it.
tiling : string [periodic]
    Cover of the surface by patches: `periodic`, side by side; or `random`, shifted at random and
    blended with the same mean and contrast, which hides the repetition (Heitz and Neyret 2018). Use
    `random` for rough surfaces only: it breaks the lines of a grating.
basis : string [auto]
    Basis of the series in κ: `svd` (also `auto`), `chebyshev` or `taylor`.
tolerance : float [0.001]
    Largest relative error of ⟨|P|²⟩. A table that cannot meet it is refused.
terms : integer [from tolerance]
    Length of the series.
windows : float or string [auto]
    Width, µm, of the windows that an open patch is seen through; several overlap, each is levelled,
    and their powers are averaged (Welch 1967). `auto`: a scan up to 32 µm is one window, as wide as
    its smaller side; a wider one has windows of half its side, at least 32 µm and at most
    coherence_width. Wider windows have narrower lobes and more grain.

The material
------------
material : string or float
    A tissue or a liquid, with its index over wavelength: `keratin`, `chitin`, `melanin`, `guanine`,
    `water`, `SiO2`, `MgF2`; an index, `1.56` or `1.56+0.05i`; a conductor by symbol, as in
    `roughconductor`, or
    plain name: `Au`, `gold`; or `none`, which reflects all light.
eta, k : spectra ∂
    Instead: the conductor's complex refractive index.
int_ior, ext_ior : float or string [1.5, 1.000277]
    Indices of a dielectric and of the medium above it, the default material (1.5: shed snake skin),
    or names: `water`. The medium changes the reflectance alone. Waves in it are shorter: multiply
    lateral_scale and height_scale by its index, as `--ext-ior` does.
    Their ratio is the differentiable parameter `eta`; under a coat, int_ior over coat_ior.
coat_ior : float or string [none]
    Index of a flat clear layer over the structure, too thick to interfere, as the polycarbonate of
    a CD (1.58), or `water` on a wet animal. Light is refracted into the layer and out again; its
    own face is a mirror of the same coherence width. Light that the face sends back is summed as
    between two mirrors. Light that leaves the structure beyond the critical angle is lost
    (docs/validation.md). Energy is conserved as without a coat. The index relative to the medium
    above is the differentiable parameter `coat_eta`. Renderings have water's index at 589 nm in
    paths and face: at 400 nm, orders are 4 % too dark at most. `spectrum` has n(λ).
film_ior : float or string [none]
    Index of a thin film that follows the heights and interferes, as an oxide on a metal (1.77:
    alumina) or wax on a scale. The upper face has the heights of the structure, film_thickness
    above it. The index relative to the medium above is the differentiable parameter `film_eta`.
    Excludes a coat.
film_thickness : float ∂ [none]
    Thickness of the film along the vertical, nm. 2 n d is at most 12 µm, the coherence length. RGB
    variants sum the film's colours over wavelengths, apart from the orders.
film_k : float ∂ [0]
    Absorption of the film: k of its index n + ik, over the index of the medium above. Excludes a
    nested BSDF.
layers : string [none]
    Instead of a film: a stack of layers that follows the heights, a TOML file of `layers`, pairs of
    a material and a thickness in µm from the material upwards; `repeat`; and `spread`, the standard
    deviation of all thicknesses from place to place, as a share:
    `layers = [["chitin", 0.09], ["1.33", 0.08]]`. Reflectance is tabulated over angle and
    wavelength. The model is `kirchhoff`; coats are excluded, and a nested BSDF under layers that
    absorb. Under a spread, polarised variants keep the mean phase between s and p.
model : string [small_slope]
    `small_slope`: first-order small-slope approximation (Voronovich 1985), blended with Kirchhoff's
    where the surface is rough at the scale of an order; polarised variants have its Mueller
    matrices. `kirchhoff`: the tangent plane, also the default of material `none`, which has no
    index.
energy_conserving : boolean [true]
    Scales the BSDF by s(ωi) s(ωo) so that no direction reflects more than it receives; reciprocal.
    The scale belongs to the table, model, material and wavelength. Dielectrics are unaffected;
    gratings of metal lose some per cent of the light in directions without gain, too
    (docs/energy.md). `false` keeps the model as it is, for checks. The scale costs seconds the
    first time and is cached. It is interpolated over height_scale: an optimisation waits when it
    enters a new interval. For its derivative, enable the derivative of height_scale before
    parameters.update(). Derivatives with respect to indices and films hold it constant.
shadowing : string [none]
    `vcavity`: shadowing of long V-shaped grooves (Torrance and Sparrow 1967); `none`.

The light beneath
-----------------
(nested) : BSDF ∂
    BSDF beneath a dielectric, for example pigment, which receives the light that is not reflected:
    T(ωi) T(ωo) with T = 1 − a and a the albedo of the surface; under a coat, of both flat faces.
    Any BSDF that only reflects, mirrors included. Component 0 is the diffraction; the nested BSDF's
    components follow.
pigment : string or float [none]
    Instead: a diffuse pigment, by its reflectance: a grey, `r,g,b` (linear), `#804020`, `sienna`,
    or a spectrum, constant beyond its ends: a text of wavelengths and reflectances, `brown.csv`,
    `feathers.csv:male` (one column of several), `brown.csv:percent` (or `fraction`). Or a
    picture, which texture coordinates lay over the surface, or a `.glb` with such a base colour.
Variants
--------
wavelength : float [550]
    Wavelength of mono variants, nm.

The model is the power of diffraction orders under a Gaussian coherence window (Stam 1999) times a
factor of the material:

    f = 4 cosθi cosθo N / (λ² A w²) · ⟨|P|²⟩

N is the mean power of a Jones matrix for unpolarised light; by Kirchhoff (Beckmann and Spizzichino
1963) it is R (1 + ωi·ωo)² / (2 cosθi cosθo)².

Denoisers that ask for an albedo get the reflectance at normal incidence, nested BSDF included.

Derivatives pass through renderings backward and forward, for all parameters marked ∂. Functions
of `dr.freeze` give `mi.render` a seed of type `mi.UInt32`: a plain number would be recorded. On
CUDA Dr.Jit 1.5 cannot record `sample` of a bitmap.

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

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi

from ..optics.geometry import vcavity
from . import parameters as read
from .arithmetic import maximum, plain
from .boundary import KIRCHHOFF, Boundary
from .description import Feature, Surface, unscaled
from .directions import SHADOWINGS, CoatedPair, Pair, Site
from .energy import EnergyModel, reflector_of
from .layers import UnderCoat
from .properties import choice
from .sampling import EVEN, direction_of, with_even_share
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
    coat : the clear layer over the structure, or None; mirror : its face.
    vcavity : whether the surface shadows itself like V-shaped grooves.
    """

    title = "Diffraction"

    def __init__(self, props: Properties) -> None:
        nested = read.nested_of(props, read.REFLECTING)
        coat = read.coat_of(props)
        optical = 1.0 if coat is None else plain(coat.eta)
        super().__init__(props, nested, read.material_of(props, coat), optical)
        self.coat = coat
        self.vcavity = choice(props, "shadowing", SHADOWINGS) == "vcavity"
        if self.coat is not None:
            self.fresnel = UnderCoat(self.boundary.material, self.coat)
            self.mirror = Boundary(KIRCHHOFF, self.coat)
        self.energy = EnergyModel(
            self.mean_table,
            self.wavelength,
            partial(reflector_of, self.boundary, self.coat),
            conserving=self.energy_conserving,
            beneath=nested is not None and self.coat is None,
        )
        self.ready()

    # ------------------------------------------------------------------ the diffraction

    def diffracted(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """See `SurfaceBSDF.diffracted`."""
        # Eq. 1: (u, v, w) = ωi + ωo in the patch's frame, within a coat where there is one
        pair = Pair(site.si, wo, site.frame, active)
        if self.coat is not None:
            pair = CoatedPair(pair, self.coat.eta)
        drawing = self._drawing_scale(site)
        if kinds == "d":
            density = self.power.density(pair.outer, drawing, site.si)
            return mi.Spectrum(0.0), with_even_share(density)
        # Eq. 2 and 3: ⟨|P|²⟩ at q = k (u, v) and κ = k w, for each wavelength
        if kinds == "v":
            power, density = self.power.power(pair, site.scale, site.si), mi.Float(0.0)
        else:
            power, density = self.power.both(pair, site.scale, drawing, site.si)
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
            value += self.face(ctx, site, pair.outer, self.mirror, active)
        if self.energy.scales:
            # s(ωi) s(ωo), so that no direction reflects more than it receives
            value *= mi.Spectrum(self.energy.factor(site, pair.outer.wo))
        return value

    def draw(self, ctx: Context, site: Site, sample1: Float, sample2: Vector2f) -> Vector3f:
        """See `SurfaceBSDF.draw`."""
        wi = site.si.wi
        ordered = maximum((sample1 - EVEN) * (1.0 / (1.0 - EVEN)), 0.0)
        scale = dr.detach(self._drawing_scale(site))
        uv = self.power.draw(mi.Frame3f.cos_theta(wi), scale, ordered, sample2, site.si)
        direction = direction_of(site.frame.from_table(uv) - mi.Vector2f(wi.x, wi.y))
        return dr.select(sample1 < EVEN, mi.warp.square_to_uniform_hemisphere(sample2), direction)

    def _drawing_scale(self, site: Site) -> Float:
        """Height scale to draw directions for: under a coat κ is as if heights were larger."""
        return site.scale if self.coat is None else site.scale * self.coat.eta

    def beneath(self, site: Site, wo: Vector3f, active: Mask) -> Colour:
        """See `SurfaceBSDF.beneath`: T = 1 − a, with a the flat reflectance times a smooth ratio.

        a is the albedo of the diffraction, so that what is not reflected goes on, and a white pair
        reflects at most what it gets. Under a coat it is the flat reflectance alone.
        """
        inwards, outwards = (
            dr.maximum(1.0 - self.energy.reflected(w, site) * flat, 0.0)
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
        material: Any = self.boundary.material
        other_kernels = (
            getattr(material, "reflects_all", False),
            getattr(material, "sums", None),
            material.tint is None,
        )
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
            reflected=energy.ratio,
        )

    def shown(self) -> dict[str, Any]:
        """See `PluginBSDF.shown`."""
        more = {"shadowing": "vcavity" if self.vcavity else "none"}
        return {**super().shown(), **more, **({"nested": self.nested} if self.nested else {})}


mi.register_bsdf("diffraction", Diffraction)
