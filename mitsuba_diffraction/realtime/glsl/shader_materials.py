"""Mitsuba's BSDFs as materials for shaders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from ...plugin.description import Mix, Surface, describe
from ...plugin.parameter_changes import children
from ...shading.spectra import spectra_of
from .diffracting import index_spectra, pack_conservation, pack_constants
from .features import GLSL
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


def pack_gloss(bsdf: Any) -> Packed | None:
    """Pack the specular reflection of a BSDF that does not diffract, for shaders/gloss.glsl.

    None for an unsupported kind. The base of plastic has the BRDF ρ/π times the transmittances
    `through` of both directions, tabulated at cosines even from 0 to 1.
    """
    import mitsuba as mi

    kind, parameters = bsdf.class_name(), mi.traverse(bsdf)
    if kind not in _KINDS:
        return None

    def number(name: str) -> float:
        return float(np.array(parameters[name]).ravel()[0])

    if kind == "Principled":
        roughness = _mean(bsdf, "roughness")
        # Mitsuba's formulas
        alpha = max(roughness**2, 1e-3)
        if "eta" not in parameters:
            eta = 2.0 / (1.0 - np.sqrt(0.08 * number("specular"))) - 1.0
        else:
            eta = number("eta")
        uniforms: dict[str, Uniform] = {
            "gloss_alpha": alpha, "eta": eta, "metallic": _mean(bsdf, "metallic"),
            "roughness": roughness,
        }  # fmt: skip
        definitions = dict.fromkeys(("GLOSS", "GGX", "PIGMENTED", "PRINCIPLED"), "")
        return Packed((), uniforms, definitions | {"SURFACE_KIND": "1"})
    alphas = next((parameters[n] for n in ("alpha", "alpha.value") if n in parameters), 0.0)
    if kind.startswith("Rough") and not np.any(alphas):
        return None  # anisotropic, or a texture
    alpha = float(np.array(alphas).ravel()[0])
    marks = {"GGX": "distribution = ggx" in str(bsdf), "MIRROR": alpha == 0.0, "GLOSS": True}
    definitions = {name: "" for name, has in marks.items() if has}
    packed = Packed((), {"gloss_alpha": alpha}, definitions)
    if kind.endswith("Conductor"):
        parts = children(bsdf)
        return packed | pack_conductor(*index_spectra(parts["eta"], parts["k"]))
    rows = np.repeat(_through(bsdf).reshape(1, -1, 1), 4, axis=2).astype(np.float32)
    face = {"SURFACE_KIND": "1", "THROUGH": "", "PIGMENTED": ""}
    return packed | Packed((Texture("through", rows),), {"eta": number("eta")}, face)


def _mean(bsdf: Any, name: str) -> float:
    """Return the mean of a BSDF's texture."""
    return float(np.array(children(bsdf)[name].mean()).ravel()[0])


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
    gloss: Packed | None = None  # specular reflection of a BSDF that does not diffract
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
    elif (gloss := pack_gloss(bsdf)) is not None:
        if bsdf.class_name() == "Principled":
            left_out = (part for part in _LEFT_OUT if _mean(bsdf, part) > 0.0)
            omissions += [f"the {part.replace('_', ' ')} of {name}" for part in left_out]
        texture = _base(bsdf)
        pigment = Map(np.zeros(3)) if texture is None else colour_map(texture, light)
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
    described, gloss = material.diffraction, material.gloss
    if gloss is not None:
        return packed | gloss
    if described is None or described.nested is not None:
        definitions["PIGMENTED"] = ""
    if described is None:
        return packed
    return packed | pack_constants(described) | pack_conservation(described, factors)


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
    kind = bsdf.class_name()
    if (texture := _base(bsdf)) is not None:
        if kind != "SmoothDiffuse":
            omissions.append(f"the gloss of {name} ({kind})")
        return colour_map(texture, light)
    omissions.append(f"the material of {name} ({kind}, shown as grey)")
    return Map(np.full(3, _OTHER_GREY))


def _base(bsdf: Any) -> Any:
    """Return the texture of a BSDF's diffuse part, or None."""
    names, textures = ("diffuse_reflectance", "base_color", "reflectance"), children(bsdf)
    return next((textures[name] for name in names if name in textures), None)
