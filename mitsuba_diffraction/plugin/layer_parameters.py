"""Material, coat and film of a reflecting surface, from the plugin's parameters."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError, warn
from ..optics.materials import PERFECT, TISSUES, material_named
from ..tables.table import DiffractionTable
from .energy import indices_of
from .fresnel import INDEX_PARTS, Conductor, Dielectric, Perfect, Reflectance
from .layers import UnderFilm, plain
from .parameter_changes import ObjectValues
from .properties import class_of, number
from .stack import UnderStack, read_layers
from .surface_parameters import DEFAULT_WAVELENGTH, read_index
from .types import Properties

#: Default indices: air, and the keratin of shed snake skin.
AIR, KERATIN = 1.000277, 1.5
#: Path 2 n d in a film on a metal (nm) times RMS height (µm) from which on colours deviate by 10 %:
#: docs/make/validation/filmed.py has 9 % of 59 and 20 % of 74 and 89.
ROUGH = 65.0


def material_of(props: Properties, coat: Dielectric | None) -> Reflectance:
    """Read the structure's material: conductor, perfect mirror or dielectric, in air or a coat."""
    conductor = [n for n in ("material", "eta", "k") if n in props]
    dielectric = [n for n in ("int_ior",) if n in props]
    if conductor and dielectric:
        raise DiffractionError(
            f"{conductor[0]} makes a conductor and {dielectric[0]} a dielectric; give one of them"
        )
    if "material" in conductor and len(conductor) > 1:
        raise DiffractionError("material and eta, k both define the conductor; give one")
    if "material" in conductor:
        return _named(props, coat)
    if conductor:
        if len(conductor) == 1:
            raise DiffractionError(f"{conductor[0]} alone is not a conductor; give both eta and k")
        metal = Conductor(_index_part(props, "eta"), _index_part(props, "k"), "eta, k")
        return _in_medium(metal, props, coat)
    return _dielectric(props, read_index(props, "int_ior", KERATIN), coat)


def _named(props: Properties, coat: Dielectric | None) -> Reflectance:
    """Read the parameter `material`: a name or an index (`optics.materials`)."""
    value = props.get("material")
    if not isinstance(value, str | int | float):
        raise DiffractionError(f"material={class_of(value)} must be a name or an index")
    material = material_named(value)
    if material == PERFECT:
        return Perfect()
    if isinstance(material, complex):
        if not material.imag:
            return _dielectric(props, material.real, coat)
        parts = zip(INDEX_PARTS, (material.real, material.imag), strict=True)
        eta, k = (
            ObjectValues(n, mi.load_dict({"type": "uniform", "value": x}), INDEX_PARTS[n])
            for n, x in parts
        )
        metal = Conductor(eta, k, f"n = {material.real:g} + {material.imag:g}i")
    else:
        metal = Conductor.of_material(material, number(props, "wavelength", DEFAULT_WAVELENGTH))
    return _in_medium(metal, props, coat)


def _in_medium(metal: Conductor, props: Properties, coat: Dielectric | None) -> Conductor:
    """Put a material with an index of its own into the medium above it, with its dispersion."""
    above = material_named(str(props.get("coat_ior", props.get("ext_ior", ""))) or PERFECT)
    if above in TISSUES:
        metal.disperse(str(above), number(props, "wavelength", DEFAULT_WAVELENGTH))
    metal.medium = _medium(props, coat)
    return metal


def _dielectric(props: Properties, index: float | str, coat: Dielectric | None) -> Dielectric:
    """Dielectric in the medium above it, or in a coat."""
    name, default = ("ext_ior", AIR) if coat is None else ("coat_ior", 1.0)
    return Dielectric(index, read_index(props, name, default))


def _medium(props: Properties, coat: Dielectric | None) -> Dielectric | None:
    """Return the medium that an index is relative to: the coat, a medium, or None in air."""
    if "ext_ior" not in props:
        return coat
    if coat is not None:
        raise DiffractionError(
            "ext_ior and coat_ior over a material with an index over wavelength: only one medium "
            "can be above it; leave ext_ior out"
        )
    return Dielectric(read_index(props, "ext_ior"), 1.0, "ext_eta")


def coat_of(props: Properties) -> Dielectric | None:
    """Read the clear layer over the structure, or return None."""
    if "coat_ior" not in props:
        return None
    medium = read_index(props, "ext_ior", _above(props))
    coat = Dielectric(read_index(props, "coat_ior"), medium, "coat_eta", 1.0)
    if dr.slice(coat.eta) < 1.0:
        raise DiffractionError(
            f"coat_ior={props.get('coat_ior')} is below the index of the medium above the coat; "
            "a coat's is at least as large"
        )
    return coat


def film_of(
    props: Properties, material: Reflectance, wavelength: float, shortest: float
) -> Reflectance | UnderFilm:
    """Read the film; return the material under it, or the bare material.

    wavelength : nm, of mono variants; shortest : the least that the table serves.
    """
    parameters = [name for name in ("film_ior", "film_k", "film_thickness") if name in props]
    if not parameters:
        return material
    if not {"film_ior", "film_thickness"} <= set(parameters):
        raise DiffractionError(
            f"{parameters[0]} alone is not a film; give both film_ior and film_thickness (nm)"
        )
    if isinstance(material, Perfect):
        raise DiffractionError("film_ior needs a material with a refractive index beneath it")
    medium = read_index(props, "ext_ior", _above(props))
    film = Dielectric(read_index(props, "film_ior"), medium, "film_eta")
    k, thickness = number(props, "film_k", 0.0), number(props, "film_thickness", 0.0)
    filmed = UnderFilm(material, film, k, thickness, wavelength, shortest)
    for refused in (*(parameter.refusal() for parameter in filmed.changeable), filmed.refusal()):
        if refused:
            raise DiffractionError(refused)
    return filmed


def stack_of(
    props: Properties,
    material: Reflectance | UnderFilm,
    wavelength: float,
    wavelengths: tuple[float, float],
) -> Reflectance | UnderFilm | UnderStack:
    """Read the stack; return the material under it, or the material as it is.

    wavelength : nm, of mono variants; wavelengths : that the table serves.
    """
    if "layers" not in props:
        return material
    if not isinstance(name := props.get("layers"), str):
        raise DiffractionError(f"layers={class_of(name)} must be the name of a file (.toml)")
    assert isinstance(material, Dielectric | Conductor)  # `support` refuses others
    medium = Dielectric(read_index(props, "ext_ior", _above(props)), 1.0, "ext_eta")
    layers = read_layers(Path(str(mi.file_resolver().resolve(name))))
    index: Any = partial(indices_of, material)
    return UnderStack(material, index, layers, plain(medium.eta), wavelength, wavelengths)


def warn_of_film(
    material: Reflectance | UnderFilm | UnderStack, table: DiffractionTable, scale: float
) -> None:
    """Warn of a film whose fringes are finer than the model can follow on these heights."""
    if not isinstance(material, UnderFilm) or not isinstance(material.material, Conductor):
        return
    index, thickness = material.numbers()
    rms = scale * math.sqrt(float(table.roughness.nodes.max()))
    if 2.0 * index.real * thickness * rms > ROUGH:
        warn(
            f"film_thickness={thickness:g} nm on a metal of RMS height {1e3 * rms:.0f} nm: beside "
            "rigorous solutions, expect the colours to be off by more than 10 % beyond 45° from "
            "the normal (docs/validation.md)"
        )


def _above(props: Properties) -> float:
    """Return the default index of the medium above; conductors' indices are relative to it."""
    return 1.0 if any(name in props for name in ("material", "eta", "k")) else AIR


def _index_part(props: Properties, name: str) -> ObjectValues:
    """Part of a complex index, a spectrum or texture whose values are checked where exposed."""
    # A colour becomes a spectrum whose values are coefficients of any sign
    coefficients = mi.is_spectral and props.type(name) == mi.Properties.Type.Color
    texture = props.get_unbounded_texture(name)
    part = ObjectValues(name, texture, None if coefficients else INDEX_PARTS[name])
    if refused := part.refusal():
        raise DiffractionError(f"{refused}: the index is eta + ik")
    return part
