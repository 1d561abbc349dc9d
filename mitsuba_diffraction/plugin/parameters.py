"""Parameters of the BSDFs, read from Mitsuba's Properties and checked."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

import mitsuba as mi

from ..errors import DiffractionError, warn
from ..heights import LoadOptions
from ..llvm import require_loaded_llvm
from ..optics.boundary import MODELS
from ..optics.materials import PERFECT, TISSUES, index_at_sodium, material_named
from ..retired import retired
from ..settings import SCENE_SETTINGS, SURFACE
from ..tables import DiffractionTable
from .arithmetic import plain
from .description import Feature
from .dictionary import ORDERS, PLUGINS
from .layers import FILM_ENDS, UnderFilm, thickness_of
from .materials import INDEX_PARTS, Conductor, Dielectric, Material, Perfect
from .parameter_changes import Changeable
from .pigment import pigment_bsdf
from .properties import choice, class_of, coherence_of, number
from .stack import UnderStack, read_layers
from .types import BSDF, Properties
from .varying import Orientation
from .window_positions import PLACING

SOURCES = ("filename", "data")
#: Earlier names of parameters, which are accepted with one line.
EARLIER = {"heightfield": "filename", "table": "filename"}
READING = tuple(field.name for field in fields(LoadOptions))
#: Layers, pigment and medium that "none" leaves out, so that a scene can have a parameter for them.
OPTIONAL = ("coat_ior", "film_ior", "layers", "ext_ior", "pigment")
#: nm, of mono variants.
DEFAULT_WAVELENGTH = 550.0
#: Default indices: air, and the keratin of shed snake skin.
AIR, KERATIN = 1.000277, 1.5
#: Smallest relative index that light goes through: orders that go through depend on n − 1.
LEAST_INDEX = 1.01

REFLECTING, TRANSMITTING = PLUGINS
_COMMON = (
    *SOURCES, *READING, *SCENE_SETTINGS, "int_ior", "ext_ior", "model", "orientation",
    "height_scale", "height_scale_max", "lateral_scale", "lateral_scale_max", "wavelength",
    "energy_conserving",
)  # fmt: skip
#: Names of the parameters of each plugin.
NAMES: Mapping[str, tuple[str, ...]] = {
    REFLECTING: (
        *_COMMON, *PLACING, "material", "eta", "k", "coat_ior", "film_ior", "film_k",
        "film_thickness", *FILM_ENDS, "layers", "pigment", "shadowing",
    ),
    TRANSMITTING: (*_COMMON, "thin"),
    ORDERS: (*SOURCES, "coherence_width", "orientation", "wavelength"),
}  # fmt: skip

#: Features that exclude each other.
_EXCLUDED = (
    (Feature.COAT, Feature.FILM, Feature.STACK, Feature.MIRROR),
    (Feature.SMALL_SLOPE, Feature.STACK), (Feature.SMALL_SLOPE, Feature.MIRROR),
    (Feature.NESTED, Feature.MIRROR), (Feature.NESTED, Feature.OPAQUE),
    (Feature.NESTED, Feature.TRANSMISSION), (Feature.PLACED, Feature.TRANSMISSION),
    (Feature.PLACED, Feature.COLOURS),
    (Feature.VARYING_FILM, Feature.VARYING_HEIGHT), (Feature.VARYING_FILM, Feature.VARYING_LENGTH),
)  # fmt: skip


# ------------------------------------------------------------------ names and combinations


def nested_of(props: Properties, plugin: str) -> BSDF | None:
    """Return the nested BSDF or pigment, or None; refuse parameters that the plugin lacks.

    Raises a DiffractionError if a name is unknown, there are several nested BSDFs, or it lets light
    through.
    """
    require_loaded_llvm()
    _rename(props)
    for name in OPTIONAL:
        if name in props and props.get(name) == "none":
            del props[name]
    for name in retired(props.keys()):
        del props[name]
    nested = {name: value for name, value in props.objects() if isinstance(value, mi.BSDF)}
    if len(nested) > 1:
        raise DiffractionError(
            f"{len(nested)} nested BSDFs ({', '.join(nested)}); at most one can lie beneath"
        )
    for name in props.keys():  # noqa: SIM118 - Properties is no mapping
        if name not in (*NAMES[plugin], *nested, "id"):
            raise DiffractionError(_unknown(name, plugin))
    bsdf = next(iter(nested.values()), None)
    if "pigment" in props and "pigment" not in nested:
        if bsdf is not None:
            raise DiffractionError(
                f"pigment and the nested BSDF {class_of(bsdf)} both lie beneath; give one of them"
            )
        return pigment_bsdf(props.get("pigment"))
    if bsdf is not None and bsdf.flags() & mi.BSDFFlags.Transmission:
        raise DiffractionError(
            f"the nested BSDF {class_of(bsdf)} lets light through, which would be lost beneath; "
            "nest one that only reflects"
        )
    return bsdf


def _rename(props: Properties) -> None:
    """Give parameters their current names, with a warning about each earlier one.

    Raises a DiffractionError if both names are given.
    """
    for old, new in EARLIER.items():
        if old in props:
            if new in props:
                raise DiffractionError(f"{old} is now {new}, and both are given; give {new} alone")
            props[new] = props.get(old)
            del props[old]
            warn(f"{old} is now {new}: rename the parameter")


def _unknown(name: str, plugin: str) -> str:
    """Return the message on a parameter that a plugin does not have."""
    if name == "transmission":
        return (
            f"'transmission' is not a parameter: light goes through every BSDF of type "
            f"'{TRANSMITTING}' and through none of type '{REFLECTING}'; set the type, and leave "
            "transmission out"
        )
    for other, names in NAMES.items():
        if name in names:
            return (
                f"'{name}' is a parameter of the plugin '{other}', not of '{plugin}'; change the "
                "type of the BSDF, or leave it out"
            )
    near = difflib.get_close_matches(name, NAMES[plugin], 1)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"unknown parameter '{name}'; {hint}Allowed: {', '.join(NAMES[plugin])}"


def check_combination(props: Properties, material: Material, nested: BSDF | None) -> None:
    """Refuse features of a scene that exclude each other, naming both."""
    textures = {name for name, value in props.objects() if isinstance(value, mi.Texture)}
    chosen = {
        Feature.VARYING_FILM: FILM_ENDS[1] in props,
        Feature.VARYING_HEIGHT: "height_scale" in textures,
        Feature.VARYING_LENGTH: "lateral_scale" in textures,
        Feature.NESTED: nested is not None,
        Feature.COAT: "coat_ior" in props,
        Feature.FILM: "film_ior" in props,
        Feature.STACK: "layers" in props,
        Feature.SMALL_SLOPE: props.get("model", "kirchhoff") != "kirchhoff",
        Feature.PLACED: coherence_of(props) == SURFACE,
        Feature.MIRROR: isinstance(material, Perfect),
        Feature.OPAQUE: material.absorbs,
        Feature.TRANSMISSION: props.plugin_name() == TRANSMITTING,
        Feature.COLOURS: mi.is_rgb,
    }
    for group in _EXCLUDED:
        both = [feature.phrase() for feature in group if chosen[feature]][:2]
        if len(both) == 2:
            raise DiffractionError(refusal(*both))


def refusal(first: str, second: str) -> str:
    """Return the message on two features that exclude each other."""
    return f"{first} cannot be combined with {second}; leave one of them out"


def model_of(props: Properties, material: Material) -> str:
    """Return the name of the boundary model; by default small slope if there is an index."""
    default = "kirchhoff" if isinstance(material, Perfect) or "layers" in props else "small_slope"
    return choice(props, "model", (default, *(name for name in MODELS if name != default)))


# ------------------------------------------------------------------ material and layers


def surface_material(props: Properties, coat: Dielectric | None) -> Material:
    """Read the structure's material: conductor, perfect mirror or dielectric, in air or a coat."""
    conductor = [n for n in ("material", "eta", "k") if n in props]
    if conductor and "int_ior" in props:
        raise DiffractionError(
            f"{conductor[0]} makes a conductor and int_ior a dielectric; give one of them"
        )
    if "material" in conductor and len(conductor) > 1:
        raise DiffractionError("material and eta, k both define the conductor; give one")
    if len(conductor) == 1 and "material" not in conductor:
        raise DiffractionError(f"{conductor[0]} alone is not a conductor; give both eta and k")
    if not conductor:
        return _dielectric(props, read_index(props, "int_ior", KERATIN), coat)
    wavelength = number(props, "wavelength", DEFAULT_WAVELENGTH)
    if "material" not in conductor:
        metal = Conductor(_index_part(props, "eta"), _index_part(props, "k"), "eta, k")
    elif not isinstance(value := props.get("material"), str | int | float):
        raise DiffractionError(f"material={class_of(value)} must be a name or an index")
    elif (material := material_named(value)) == PERFECT:
        return Perfect()
    elif isinstance(material, str):
        metal = Conductor.of_material(material, wavelength)
    elif not material.imag:
        return _dielectric(props, material.real, coat)
    else:
        parts = zip(INDEX_PARTS, (material.real, material.imag), strict=True)
        eta, k = (
            Changeable(n, mi.load_dict({"type": "uniform", "value": x}), INDEX_PARTS[n])
            for n, x in parts
        )
        metal = Conductor(eta, k, f"n = {material.real:g} + {material.imag:g}i")
    # into the medium above it, with its dispersion
    above = material_named(str(props.get("coat_ior", props.get("ext_ior", ""))) or PERFECT)
    if above in TISSUES:
        metal.disperse(str(above), wavelength)
    metal.medium = coat
    if "ext_ior" in props:
        if coat is not None:
            raise DiffractionError(
                "ext_ior and coat_ior over a material with an index over wavelength: only one "
                "medium can be above it; leave ext_ior out"
            )
        metal.medium = Dielectric(read_index(props, "ext_ior"), 1.0, "ext_eta")
    return metal


def _dielectric(props: Properties, index: float | str, coat: Dielectric | None) -> Dielectric:
    """Dielectric in the medium above it, or in a coat."""
    name, default = ("ext_ior", AIR) if coat is None else ("coat_ior", 1.0)
    return Dielectric(index, read_index(props, name, default))


def transmissive_of(props: Properties) -> Dielectric:
    """Read a dielectric that light goes through."""
    advice = (
        f": int_ior must be at least {LEAST_INDEX:g} times ext_ior; turn the surface round if the "
        "denser medium is above"
    )
    indices = read_index(props, "int_ior", KERATIN), read_index(props, "ext_ior", AIR)
    return Dielectric(*indices, least=LEAST_INDEX, advice=advice)


def coat_of(props: Properties) -> Dielectric | None:
    """Read the clear layer over the structure, or return None."""
    if "coat_ior" not in props:
        return None
    advice = ": coat_ior must not be below the index of the medium above the coat"
    return Dielectric(read_index(props, "coat_ior"), _above(props), "coat_eta", 1.0, advice)


def layered(props: Properties, material: Material, table: DiffractionTable) -> Material:
    """Read the film or the stack on a material; return the material with it, or as it is."""
    wavelength = mono_wavelength(props, table.wavelength_range)
    if "layers" in props:
        if not isinstance(name := props.get("layers"), str):
            raise DiffractionError(f"layers={class_of(name)} must be the name of a file (.toml)")
        layers = read_layers(Path(str(mi.file_resolver().resolve(name))))
        medium = plain(Dielectric(_above(props), 1.0).eta)
        return UnderStack(material, layers, medium, wavelength, table.wavelength_range)
    names = "film_ior", "film_k", "film_thickness", *FILM_ENDS
    parameters = [name for name in names if name in props]
    if not parameters:
        return material
    if not {"film_ior", "film_thickness"} <= set(parameters):
        raise DiffractionError(
            f"{parameters[0]} alone is not a film; give both film_ior and film_thickness (nm)"
        )
    if isinstance(material, Perfect):
        raise DiffractionError("film_ior needs a material with a refractive index beneath it")
    film = Dielectric(read_index(props, "film_ior"), _above(props), "film_eta")
    k, thickness = number(props, "film_k", 0.0), thickness_of(props)
    return UnderFilm(material, film, k, thickness, wavelength, table.wavelength_range)


def _above(props: Properties) -> float | str:
    """Read the index of the medium above; conductors' indices are relative to it by default."""
    relative = any(name in props for name in ("material", "eta", "k"))
    return read_index(props, "ext_ior", 1.0 if relative else AIR)


def _index_part(props: Properties, name: str) -> Changeable:
    """Part of a complex index, a spectrum or texture whose values are checked where exposed."""
    # A colour becomes a spectrum whose values are coefficients of any sign
    coefficients = mi.is_spectral and props.type(name) == mi.Properties.Type.Color
    texture = props.get_unbounded_texture(name)
    part = Changeable(name, texture, None if coefficients else INDEX_PARTS[name])
    if refused := part.refusal():
        raise DiffractionError(f"{refused}: the index is eta + ik")
    return part


def read_index(props: Properties, name: str, default: float = 1.0) -> float | str:
    """Return a refractive index, also of a tissue, or a medium that Mitsuba knows by name.

    Raises a DiffractionError if it is below 1, or no number.
    """
    value = props.get(name, default)
    if isinstance(value, str):
        value = index_at_sodium(value, name)
        if isinstance(value, str):
            return value
    if not (isinstance(value, int | float) and math.isfinite(value) and value >= 1.0):
        raise DiffractionError(
            f"{name}={value} must be a refractive index of at least 1, or a name"
        )
    return float(value)


# ------------------------------------------------------------------ table and surface


def mono_wavelength(props: Properties, wavelength_range: tuple[float, float]) -> float:
    """Return the wavelength of mono variants in nm; a scene for all variants may give it in all.

    wavelength_range : shortest and longest of the table, nm.

    Raises a DiffractionError if it is outside the table.
    """
    wavelength = number(props, "wavelength", DEFAULT_WAVELENGTH)
    if not mi.is_monochromatic and "wavelength" not in props:
        return wavelength
    shortest, longest = wavelength_range
    if not shortest <= wavelength <= longest:
        raise DiffractionError(
            f"wavelength={wavelength:g} nm is outside the table's {shortest:g} to {longest:g} nm"
        )
    return wavelength


def orientation_of(props: Properties) -> Orientation:
    """Return the angle, or the texture of angles, from the first tangent to the patch's x axis.

    Raises a DiffractionError if the element is not a texture, or the number not an angle.
    """
    element = dict(props.objects()).get("orientation")
    if element is None:
        return Orientation(number(props, "orientation", 0.0))
    if not isinstance(element, mi.Texture):
        raise DiffractionError(
            f"orientation={class_of(element)} must be degrees, or a raw texture or mesh "
            "attribute whose first two channels are (cos, sin)"
        )
    return Orientation(element)
