"""Mitsuba's BSDFs as materials for shaders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from ...plugin.description import Consumer, Feature, Mix, Surface, describe
from ...plugin.parameter_changes import children
from ...shading.spectra import spectra_of
from .diffracting import index_spectra, pack_conservation, pack_constants
from .maps import Map, Spectrum, axis_map, colour_map, interval_maps, raw_picture
from .packing import pack_conductor
from .texels import Packed, Texture, Uniform, as_half, four_channels

_COSINES = 64  # nodes of transmittances
_KINDS = ("RoughPlastic", "SmoothPlastic", "RoughConductor", "SmoothConductor", "Principled")
#: Unsupported parameters of the principled BSDF.
_LEFT_OUT = ("spec_trans", "anisotropic", "sheen", "flatness", "clearcoat", "spec_tint")


#: Classes of BSDFs that wrap another BSDF; masks are not supported.
_WRAPPERS = ("TwoSidedBRDF", "BumpMap", "NormalMap", "MaskBSDF")
_OTHER_GREY = 0.5  # reflectance of unsupported BSDFs

#: Features that the shaders draw.
GLSL = Consumer(
    "the realtime renderer",
    frozenset(Feature) - {
        Feature.TRANSMISSION, Feature.FILM, Feature.STACK, Feature.PLACED,
        Feature.VARYING_HEIGHT, Feature.CROSSED, Feature.VARYING_FILM,
    },
    "leave it out, or render the scene with Mitsuba",
    {Feature.CROSSED: "render the scene with Mitsuba"},
)  # fmt: skip


@dataclass(frozen=True)
class Gloss:
    """Specular reflection of a BSDF that does not diffract."""

    bsdf: Any  # BSDF of Mitsuba
    alpha: float  # roughness; 0 of a smooth face
    ggx: bool  # distribution of facets: GGX, or else Beckmann
    # (n,) transmittance at cosines even from 0 to 1, None of a metal and the principled BSDF. The
    # base has the BRDF ρ/π times the transmittances of both directions.
    through: NDArray[np.float64] | None
    omissions: tuple[str, ...] = ()  # unsupported features, in a few words each

    @classmethod
    def read(cls, bsdf: Any) -> Gloss | None:
        """Read the gloss of a BSDF, or return None for an unsupported kind."""
        import mitsuba as mi

        if bsdf.class_name() not in _KINDS:
            return None
        if bsdf.class_name() == "Principled":
            left_out = (name.replace("_", " ") for name in _LEFT_OUT if _mean(bsdf, name) > 0.0)
            alpha = max(_mean(bsdf, "roughness") ** 2, 1e-3)  # Mitsuba's formula
            return cls(bsdf, alpha, True, None, tuple(f"the {part}" for part in left_out))
        parameters = mi.traverse(bsdf)
        alpha = next((parameters[n] for n in ("alpha", "alpha.value") if n in parameters), 0.0)
        if bsdf.class_name().startswith("Rough") and not np.any(alpha):
            return None  # anisotropic, or a texture
        metal = bsdf.class_name().endswith("Conductor")
        through = None if metal else _through(bsdf)
        rough = float(np.array(alpha).ravel()[0])
        return cls(bsdf, rough, "distribution = ggx" in str(bsdf), through)

    @property
    def pigment(self) -> Any:
        """Texture of the diffuse base, None of a metal."""
        textures = children(self.bsdf)
        return textures.get("diffuse_reflectance", textures.get("base_color"))

    def packed(self) -> Packed:
        """Pack the gloss for shaders/gloss.glsl."""
        import mitsuba as mi

        definitions = {"GLOSS": ""} | ({"GGX": ""} if self.ggx else {})
        if self.alpha == 0.0:
            definitions["MIRROR"] = ""
        packed = Packed((), {"gloss_alpha": self.alpha}, definitions)
        if self.bsdf.class_name() == "Principled":
            return packed | _principled(self.bsdf)
        parts = children(self.bsdf)
        if self.through is None:
            return packed | pack_conductor(*index_spectra(parts["eta"], parts["k"]))
        eta = float(np.array(mi.traverse(self.bsdf)["eta"]).ravel()[0])
        rows = np.repeat(self.through.reshape(1, -1, 1), 4, axis=2).astype(np.float32)
        face = Packed(
            (Texture("through", rows),), {"eta": eta}, {"SURFACE_KIND": "1", "THROUGH": ""}
        )
        return packed | face


def _mean(bsdf: Any, name: str) -> float:
    """Return the mean of a BSDF's texture."""
    return float(np.array(children(bsdf)[name].mean()).ravel()[0])


def _principled(bsdf: Any) -> Packed:
    """Pack index, metallic and roughness of the principled BSDF."""
    import mitsuba as mi

    parameters = mi.traverse(bsdf)
    if "eta" in parameters:
        eta = float(np.array(parameters["eta"]).ravel()[0])
    else:
        specular = float(np.array(parameters["specular"]).ravel()[0])
        eta = 2.0 / (1.0 - np.sqrt(0.08 * specular)) - 1.0  # Mitsuba's formula
    return Packed(
        (),
        {"eta": eta, "metallic": _mean(bsdf, "metallic"), "roughness": _mean(bsdf, "roughness")},
        {"SURFACE_KIND": "1", "PRINCIPLED": ""},
    )


def _through(bsdf: Any) -> NDArray[np.float64]:
    """Return the transmittance of the face from Mitsuba's values of the diffuse part."""
    import drjit as dr
    import mitsuba as mi

    cosines = np.maximum(np.linspace(0.0, 1.0, _COSINES), 1e-3)
    context = mi.BSDFContext()
    context.type_mask = mi.BSDFFlags.Diffuse
    sines = np.sqrt(1.0 - cosines**2)

    def twice_passed(si: Any) -> Any:
        si.uv = mi.Point2f(0.5, 0.5)
        si.wi = mi.Vector3f(mi.Float(sines), 0.0, mi.Float(cosines))
        reflected = bsdf.eval(context, si, mi.Vector3f(0.0, 0.0, 1.0))
        base = children(bsdf)["diffuse_reflectance"].eval(si)
        return dr.select(base > 0.0, np.pi * mi.unpolarized_spectrum(reflected) / base, 0.0)

    twice = spectra_of(twice_passed, np.full(4, 550.0), _COSINES)[:, 0].astype(float)
    return np.asarray(twice / np.sqrt(max(float(twice[-1]), 1e-12)))


@dataclass(frozen=True)
class ShaderMaterial:
    """Material of one shape."""

    pigment: Map  # diffuse reflectance, linear sRGB
    diffraction: Surface | None = None  # None where nothing diffracts
    two_sided: bool = False  # whether the back reflects like the front
    # (cos, sin) from the tangent to the patch's x axis, and the factor by which it is stretched
    axis: Map = field(default_factory=lambda: Map(np.array([1.0, 0.0, 1.0])))
    gloss: Gloss | None = None  # specular reflection of a BSDF that does not diffract
    bumps: Map | None = None  # heights (rows, columns, 1) in the scene's unit, or None
    normals: Map | None = None  # (rows, columns, 3) in the shading frame, or None
    mask: Map | None = None  # interval of [0, 1) that the surface takes in a mix, or None

    @property
    def black(self) -> bool:
        """Whether the material reflects no light."""
        diffuse = self.diffraction is None and self.gloss is None
        constant = self.pigment.picture is None and self.pigment.attribute is None
        return diffuse and constant and not self.pigment.value.any()


def read_materials(
    bsdf: Any, omissions: list[str], name: str, light: Spectrum
) -> list[ShaderMaterial]:
    """Read the material of a shape, or the materials of a mix.

    Unsupported features are appended to `omissions`.

    light : wavelengths and spectrum relative to D65, under which pigments get their colours.
    """
    import mitsuba as mi

    two_sided, bumps, normals = False, None, None
    while bsdf.class_name() in _WRAPPERS:
        kind = bsdf.class_name()
        two_sided = two_sided or kind == "TwoSidedBRDF"
        if kind == "MaskBSDF":
            omissions.append(f"the mask of {name}")
        if kind == "BumpMap":
            bumps = raw_picture(bsdf, "nested_texture", 1, float(mi.traverse(bsdf)["scale"]))
        if kind == "NormalMap":
            normals = raw_picture(bsdf, "normalmap", 3, 2.0, -1.0)
        inner = [b for b in children(bsdf).values() if _is_bsdf(b)]
        if len(inner) > 1 and inner[0] is not inner[-1]:
            omissions.append(f"the back of {name}, another material")
        bsdf = inner[0]
    described = describe(bsdf)
    if described is not None:
        GLSL.check(described, name)
    if isinstance(described, Mix):
        parts = []
        masks = interval_maps(described)
        for (part, inner), mask in zip(described.parts.items(), masks, strict=True):
            materials = read_materials(inner, omissions, f"{part} of {name}", light)
            if len(materials) > 1 or materials[0].bumps or materials[0].normals:
                raise DiffractionError(
                    f"{part} of {name}: a mix, bumps or a normal map within a mix are not "
                    "supported by the shaders; put them around it, or render with Mitsuba"
                )
            both = two_sided or materials[0].two_sided
            parts.append(
                replace(materials[0], two_sided=both, bumps=bumps, normals=normals, mask=mask)
            )
        return parts
    if described is not None:
        pigment = Map(np.zeros(3))
        if (nested := described.nested) is not None:
            pigment = _diffuse(nested, omissions, f"the base beneath {name}", light)
        material = ShaderMaterial(pigment, described, axis=axis_map(described))
    elif (gloss := Gloss.read(bsdf)) is not None:
        omissions += [f"{part} of {name}" for part in gloss.omissions]
        pigment = Map(np.zeros(3)) if gloss.pigment is None else colour_map(gloss.pigment, light)
        material = ShaderMaterial(pigment, gloss=gloss)
    else:
        material = ShaderMaterial(_diffuse(bsdf, omissions, name, light))
    return [replace(material, two_sided=two_sided, bumps=bumps, normals=normals)]


def pack_surface(material: ShaderMaterial, factors: Sequence[float] = (1.0,)) -> Packed:
    """Pack a material without its tables.

    factors : on the height scale, with a page of energy conservation each.
    """
    uniforms: dict[str, Uniform] = {"two_sided": material.two_sided}
    definitions: dict[str, str] = {}
    textures = []
    maps = {
        "colour": material.pigment, "axis": material.axis, "mask": material.mask,
        "bump": material.bumps, "normal": material.normals,
    }  # fmt: skip
    for name, value in maps.items():
        if value is not None and value.picture is not None:
            smooth, picture = name != "bump", value.picture  # bumps are read texel by texel
            packed_picture = as_half(four_channels(picture) if smooth else picture)
            textures.append(Texture(f"{name}_map", packed_picture, smooth))
            uniforms[f"{name}_uv"] = tuple(value.to_uv.T.ravel().tolist())
            marks = {"MAPPED": True, "CLAMPED": value.clamped, "NEAREST": value.nearest}
            definitions |= {f"{name.upper()}_{mark}": "true" for mark, on in marks.items() if on}
    packed = Packed(tuple(textures), uniforms, definitions)
    diffraction, gloss = material.diffraction, material.gloss
    if diffraction is None:
        pigmented = gloss is None or gloss.pigment is not None
    else:
        pigmented = diffraction.nested is not None
    if pigmented:
        definitions["PIGMENTED"] = ""
    if gloss is not None:
        return packed | gloss.packed()
    if diffraction is None:
        return packed
    return packed | pack_constants(diffraction) | pack_conservation(diffraction, factors)


def pack_emission(radiance: Real | None) -> Packed:
    """Pack the radiance that a surface emits, (3,) linear sRGB, if any."""
    if radiance is None:
        return Packed()
    return Packed((), {"emission": tuple(radiance.tolist())}, {"EMITTING": ""})


def _is_bsdf(child: Any) -> bool:
    """Return whether a child of a BSDF is a BSDF."""
    import mitsuba as mi

    return isinstance(child, mi.BSDF)


def diffracts(bsdf: Any) -> bool:
    """Return whether a BSDF, or the first BSDF inside its wrappers, diffracts."""
    while bsdf.class_name() in _WRAPPERS:
        bsdf = next(b for b in children(bsdf).values() if _is_bsdf(b))
    return describe(bsdf) is not None


def _diffuse(bsdf: Any, omissions: list[str], name: str, light: Spectrum) -> Map:
    """Return the reflectance of a diffuse BSDF; other kinds become their diffuse part, or grey."""
    textures, kind = children(bsdf), bsdf.class_name()
    for key in ("diffuse_reflectance", "base_color", "reflectance"):
        if key in textures:
            if kind != "SmoothDiffuse":
                omissions.append(f"the gloss of {name} ({kind})")
            return colour_map(textures[key], light)
    omissions.append(f"the material of {name} ({kind}, shown as grey)")
    return Map(np.full(3, _OTHER_GREY))
