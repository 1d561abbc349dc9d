"""Mitsuba's BSDFs and textures as a shader knows them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from ...optics.geometry import wavenumber
from ...plugin.changing import children
from ...tables.table import DiffractionTable
from .gloss import Gloss
from .packing import pack_beneath, pack_conductor, pack_energy, pack_roughness
from .textures import Packed, Texture, Uniform, as_half

Array = NDArray[np.float64]
#: Wavelengths (n,) in nm, and values (n,).
Spectrum = tuple[Array, Array]

#: BSDFs around another one, by class, and what they change that is not shown.
_WRAPPERS = {"TwoSidedBRDF": "", "BumpMap": "", "NormalMap": "", "MaskBSDF": "mask"}
_OTHER_GREY = 0.5
_CHEQUERS = 512  # texels along either side of two by two


@dataclass(frozen=True)
class Map:
    """A value over a surface: the same everywhere, at every vertex, or a picture.

    Attributes
    ----------
    value : (channels,), where it is the same.
    picture : (rows, columns, channels), row 0 at v = 0, and `to_uv` (3, 3) that leads into it.
    attribute : name of a mesh attribute.
    clamped : whether the picture's edges go on beyond it, which else repeats.
    """

    value: Array
    picture: NDArray[np.floating] | None = None
    to_uv: Array = field(default_factory=lambda: np.eye(3))
    attribute: str | None = None
    clamped: bool = False


@dataclass(frozen=True)
class Material:
    """How one shape reflects.

    Attributes
    ----------
    pigment : diffuse reflectance, linear sRGB.
    two_sided : whether the back reflects like the front.
    bsdf : the diffraction BSDF, or None.
    axis : (cos, sin) from the tangent to the patch's x axis.
    gloss : what a BSDF that does not diffract mirrors, or None.
    bumps : heights (rows, columns, 1) in the scene's unit, or None.
    normals : (rows, columns, 3) in the shading frame, or None.
    """

    pigment: Map
    two_sided: bool = False
    bsdf: Any = None
    axis: Map = field(default_factory=lambda: Map(np.array([1.0, 0.0])))
    gloss: Gloss | None = None
    bumps: Map | None = None
    normals: Map | None = None

    @property
    def table(self) -> DiffractionTable:
        """The diffraction table."""
        table: DiffractionTable = self.bsdf.table
        return table


def read_material(bsdf: Any, omissions: list[str], name: str, light: Spectrum) -> Material:
    """The material of a shape; what cannot be shown is added to `omissions`.

    light : wavelengths and a spectrum relative to D65, under which pigments get their colours.
    """
    import mitsuba as mi

    two_sided = False
    bumps, normals = None, None
    while bsdf.class_name() in _WRAPPERS:
        kind, lost = bsdf.class_name(), _WRAPPERS[bsdf.class_name()]
        two_sided = two_sided or kind == "TwoSidedBRDF"
        if lost:
            omissions.append(f"the {lost} of {name}")
        if kind == "BumpMap":
            bumps = _picture(bsdf, "nested_texture", 1, float(mi.traverse(bsdf)["scale"]))
        if kind == "NormalMap":
            normals = _picture(bsdf, "normalmap", 3, 2.0, -1.0)
        inner = [b for b in children(bsdf).values() if _is_bsdf(b)]
        if len(inner) > 1 and inner[0] is not inner[-1]:
            omissions.append(f"the back of {name}, another material")
        bsdf = inner[0]
    if only := getattr(bsdf, "only_traced", None):
        raise DiffractionError(f"{only} of {name} is for the path tracer alone")
    if _diffracts(bsdf):
        pigment = Map(np.zeros(3))
        if bsdf.nested is not None:
            pigment = _diffuse(bsdf.nested, omissions, f"what lies beneath {name}", light)
        return Material(
            pigment, two_sided, bsdf, _axis(bsdf.orientation), bumps=bumps, normals=normals
        )
    gloss = Gloss.of(bsdf)
    if gloss is None:
        return Material(
            _diffuse(bsdf, omissions, name, light), two_sided, bumps=bumps, normals=normals
        )
    pigment = Map(np.zeros(3)) if gloss.pigment is None else colour_map(gloss.pigment, light)
    return Material(pigment, two_sided, gloss=gloss, bumps=bumps, normals=normals)


def _picture(bsdf: Any, name: str, channels: int, scale: float, shift: float = 0.0) -> Map:
    """The numbers of a wrapper's raw texture, of one or three channels, scaled and shifted."""
    texture = children(bsdf)[name]
    width, height = (int(n) for n in texture.resolution())
    uv, to_uv = _centres(texture, width, height)
    si = _interaction(uv)
    value = texture.eval_1(si) if channels == 1 else texture.eval_3(si)
    found = np.array(value, np.float32).reshape(channels, height, width)
    return Map(np.zeros(channels), scale * found.transpose(1, 2, 0) + shift, to_uv)


def pack_conservation(material: Material, factors: Sequence[float] = (1.0,)) -> Packed:
    """What conserves its energy, and goes beneath, at its height scale times these factors."""
    if material.bsdf is None:
        return Packed()
    scales = [height_scale(material) * factor for factor in factors]
    return conservation_at(material.bsdf, scales)


def conservation_at(bsdf: Any, scales: Sequence[float]) -> Packed:
    """The same, of a diffraction BSDF at height scales."""
    ratios = [bsdf.reflected_ratio(scale) for scale in scales]
    beneath = pack_beneath([ratio for ratio in ratios if ratio is not None])
    found = [bsdf.energy_scale(scale) for scale in scales]
    given = [one for one in found if one is not None]
    if not given:
        return beneath
    ones = np.ones_like(given[0][0])
    values = [ones if one is None else one[0] for one in found]
    return beneath | pack_energy(values, given[0][1])


def pack_surface(material: Material) -> Packed:
    """A material, all but its tables and what conserves its energy."""
    uniforms: dict[str, Uniform] = {
        "two_sided": material.two_sided,
        "colour_uv": tuple(material.pigment.to_uv.T.ravel().tolist()),
        "axis_uv": tuple(material.axis.to_uv.T.ravel().tolist()),
    }
    definitions: dict[str, str] = {}
    textures = []
    for name, found in (("colour", material.pigment), ("axis", material.axis)):
        if found.picture is not None:
            textures.append(Texture(f"{name}_map", as_half(_four(found.picture)), smooth=True))
            definitions[f"{name.upper()}_MAPPED"] = ""
            if found.clamped:
                definitions[f"{name.upper()}_CLAMPED"] = ""
    packed = Packed(tuple(textures), uniforms, definitions)
    bsdf, gloss = material.bsdf, material.gloss
    if bsdf is not None and bsdf.nested is None:
        pass
    elif gloss is None or gloss.through is not None:
        definitions["PIGMENTED"] = ""
    if gloss is not None:
        return packed | gloss.packed(_spectra)
    if bsdf is None:
        return packed
    definitions["DIFFRACTING"] = ""
    if bsdf.vcavity:
        definitions["VCAVITY"] = ""
    if hasattr(bsdf.layering, "weight"):
        definitions["THESIS"] = ""
        uniforms["diffuse_weight"] = float(bsdf.layering.weight)
    from ...plugin.boundary import SmallSlope  # which only a variant has

    surface = bsdf.fresnel
    if bsdf.coat is not None:
        surface = surface.material
        definitions["COATED"] = ""
        uniforms["coat"] = coat_index(material)
        uniforms["channel_wavenumbers"] = tuple(wavenumber(RGB_WAVELENGTHS).tolist())
    if isinstance(bsdf.boundary, SmallSlope):
        packed |= pack_roughness(material.table.roughness)
    return packed | _reflectance(surface)


def pack_relief(material: Material) -> Packed:
    """Its bumps and normals."""
    packed = Packed()
    for name, relief in (("bump", material.bumps), ("normal", material.normals)):
        if relief is None or relief.picture is None:
            continue
        picture = relief.picture if name == "bump" else _four(relief.picture)
        definition = {"bump": "BUMPED", "normal": "NORMAL_MAPPED"}[name]
        packed |= Packed(
            (Texture(f"{name}_map", picture.astype(np.float32), smooth=True),),
            {f"{name}_uv": tuple(relief.to_uv.T.ravel().tolist())},
            {definition: ""},
        )
    return packed


def height_scale(material: Material) -> float:
    """The factor on the heights."""
    return _number(material.bsdf.height_scale)


def coat_index(material: Material) -> float:
    """Of the layer over the structure, over that outside; 1 without one."""
    return 1.0 if material.bsdf.coat is None else _number(material.bsdf.coat.eta)


def _number(value: Any) -> float:
    return float(np.array(value).ravel()[0])


def _reflectance(surface: Any) -> Packed:
    kind = type(surface).__name__
    if kind == "Dielectric":
        ratio = _number(surface.eta)
        if ratio < 1.0:  # total reflection has phases, as a conductor's
            return pack_conductor(np.array([360.0, 830.0]), np.full(2, ratio), np.zeros(2))
        return Packed(uniforms={"eta": ratio}, definitions={"SURFACE_KIND": "1"})
    if kind == "Conductor":
        lam, eta, k = _spectra(surface.eta, surface.k)
        medium = 1.0 if surface.medium is None else _number(surface.medium.eta)
        return pack_conductor(lam, eta / medium, k / medium)
    return Packed()


def _spectra(eta: Any, k: Any) -> tuple[Array, Array, Array]:
    """Wavelengths, and two textures over them; three colours count as three wavelengths."""
    import mitsuba as mi

    if mi.is_spectral:
        lam = np.linspace(360.0, 830.0, 96)
        uv = np.full((1, 2), 0.5)
        return lam, *(_evaluated(t, uv, lam)[0].astype(float) for t in (eta, k))
    colours = np.array([464.0, 549.0, 611.0])  # of sRGB's primaries
    uv = np.full((1, 2), 0.5)
    return colours, *(_evaluated(t, uv, colours)[0][::-1].astype(float) for t in (eta, k))


def _is_bsdf(thing: Any) -> bool:
    import mitsuba as mi

    return isinstance(thing, mi.BSDF)


def _diffracts(bsdf: Any) -> bool:
    from ...plugin.bsdf import Diffraction

    return isinstance(bsdf, Diffraction)


def diffracts(bsdf: Any) -> bool:
    """Whether a BSDF diffracts, or the first one that it is wrapped around."""
    while bsdf.class_name() in _WRAPPERS:
        bsdf = next(b for b in children(bsdf).values() if _is_bsdf(b))
    return hasattr(bsdf, "only_traced")


def _diffuse(bsdf: Any, omissions: list[str], name: str, light: Spectrum) -> Map:
    """Reflectance of a diffuse BSDF; another is shown by its diffuse part, or as grey."""
    textures = children(bsdf)
    if bsdf.class_name() == "SmoothDiffuse":
        return colour_map(textures["reflectance"], light)
    kind = bsdf.class_name()
    for key in ("diffuse_reflectance", "base_color", "reflectance"):
        if key in textures:
            omissions.append(f"the gloss of {name} ({kind})")
            return colour_map(textures[key], light)
    omissions.append(f"the material of {name} ({kind}, shown as grey)")
    return Map(np.full(3, _OTHER_GREY))


def colour_map(texture: Any, light: Spectrum) -> Map:
    """A texture of reflectances in linear sRGB, right when multiplied with the light's colour."""
    attribute = _attribute(texture)
    if attribute is not None:
        return Map(np.ones(3), attribute=attribute)
    import mitsuba as mi

    width, height = (int(n) for n in texture.resolution())
    if texture.class_name() == "Checkerboard":
        width = height = _CHEQUERS  # filtered only as far as a texel reaches
    elif width * height <= 1:
        width = height = 1
    uv, to_uv = _centres(texture, width, height)
    found = _lit(texture, uv, light) if mi.is_spectral else _evaluated(texture, uv, np.zeros(3))
    if width * height == 1:
        return Map(found[0].astype(float))
    clamped = _clamps(lambda uv: _evaluated(texture, uv, np.full(4, 550.0)), to_uv)
    return Map(np.ones(3), found.reshape(height, width, 3), to_uv, clamped=clamped)


def _lit(texture: Any, uv: Array, light: Spectrum) -> NDArray[np.float32]:
    """A texture's values (points, 3) under a light, over the light's own, in linear sRGB."""
    lam = np.linspace(380.0, 740.0, 36)
    weights = linear_srgb(response(lam)) * np.interp(lam, *light)[:, None]
    weights /= weights.sum(axis=0)
    total = np.zeros((len(uv), 3), np.float32)
    for start in range(0, len(lam), 4):
        four = slice(start, start + 4)
        total += _evaluated(texture, uv, lam[four]) @ weights[four].astype(np.float32)
    return total


def _axis(orientation: Any) -> Map:
    """Where the patch's x axis points."""
    if not hasattr(orientation, "texture"):
        angle = np.radians(float(np.array(orientation.degrees).ravel()[0]))
        return Map(np.array([np.cos(angle), np.sin(angle)]))
    texture = orientation.texture
    attribute = _attribute(texture)
    if attribute is not None:
        return Map(np.array([1.0, 0.0]), attribute=attribute)
    width, height = (int(n) for n in texture.resolution())
    uv, to_uv = _centres(texture, width, height)

    def evaluated(uv: Array) -> Array:
        return np.array(texture.eval_3(_interaction(uv)), np.float64).T

    value = evaluated(uv).reshape(height, width, 3)[..., :2]
    return Map(np.array([1.0, 0.0]), value, to_uv, clamped=_clamps(evaluated, to_uv))


def _clamps(evaluated: Callable[[Array], NDArray[np.floating]], to_uv: Array) -> bool:
    """Whether a texture is beyond its edge more like the edge than like the other side."""
    along = np.linspace(0.02, 0.98, 16)
    back = np.linalg.inv(to_uv)

    def values(across: float) -> NDArray[np.floating]:
        both = [np.stack([np.full(16, across), along]), np.stack([along, np.full(16, across)])]
        places = np.concatenate([np.concatenate(both, axis=1), np.ones((1, 32))])
        return evaluated((back @ places)[:2].T)

    beyond = values(-0.3)
    return bool(np.abs(beyond - values(1e-4)).sum() < np.abs(beyond - values(0.7)).sum())


def _attribute(texture: Any) -> str | None:
    if texture.class_name() != "MeshAttribute":
        return None
    found = re.search(r'name = "?(\w+)', str(texture))
    return found[1] if found else None


def _centres(texture: Any, width: int, height: int) -> tuple[Array, Array]:
    """(u, v) of all texels' middles, and the transform that the texture puts before its picture."""
    import mitsuba as mi

    parameters = mi.traverse(texture)
    to_uv = np.eye(3)
    if "to_uv" in parameters:
        to_uv = np.array(parameters["to_uv"].matrix, np.float64).reshape(3, 3)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    inside = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    return (np.linalg.inv(to_uv) @ inside)[:2].T, to_uv


def _interaction(uv: Array) -> Any:
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
    single = np.ascontiguousarray(uv.T, np.float32)
    si.uv = mi.Point2f(mi.Float(single[0]), mi.Float(single[1]))
    return si


def _evaluated(texture: Any, uv: Array, wavelengths: Array) -> NDArray[np.float32]:
    """A texture's values (points, wavelengths), or its three colours."""
    import mitsuba as mi

    si = _interaction(uv)
    found = []
    step = 4 if mi.is_spectral else len(wavelengths)
    for start in range(0, len(wavelengths), step):
        if mi.is_spectral:
            si.wavelengths = mi.Spectrum(*(float(w) for w in wavelengths[start : start + 4]))
        value = np.array(texture.eval(si), np.float32)
        value = value.reshape(value.shape[0], -1)
        found.append(np.broadcast_to(value, (value.shape[0], len(uv))))
    return np.concatenate(found).T


def _four(picture: NDArray[np.floating]) -> NDArray[np.float32]:
    """Four channels: graphics cards pad three to four anyway."""
    missing = 4 - picture.shape[2]
    return np.pad(picture, [(0, 0), (0, 0), (0, missing)]).astype(np.float32)
