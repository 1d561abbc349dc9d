"""What the surface is made of, from the plugin's parameters: indices, coat, film, model."""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError, warn
from ..tables.table import DiffractionTable
from .boundary import MODELS, Boundary, Kirchhoff, SmallSlope
from .fresnel import INDEX_PARTS, INDICES, Conductor, Dielectric, Perfect, Reflectance
from .layers import LAYERINGS, UnderFilm
from .parameter_changes import ObjectValues
from .properties import choice, flag, number
from .transmission.sides import LEAST_INDEX
from .types import Properties

#: Of mono variants, nm.
DEFAULT_WAVELENGTH = 550.0
#: Path 2 n d in a film on a metal (nm) times RMS height (µm) from which on colours deviate by 10 %:
#: docs/make/validation/filmed.py has 9 % of 59 and 20 % of 74 and 89.
ROUGH = 65.0


def material_of(props: Properties, coat: Dielectric | None) -> Reflectance:
    """The structure: a conductor, a perfect mirror, or a dielectric, in air or under a coat."""
    conductor = [n for n in ("material", "eta", "k") if n in props]
    dielectric = [n for n in ("int_ior", "ext_ior") if n in props]
    if conductor and dielectric:
        raise DiffractionError(
            f"{conductor[0]} makes a conductor and {dielectric[0]} a dielectric; give one of them"
        )
    if "material" in conductor and len(conductor) > 1:
        raise DiffractionError("material and eta, k both say what the conductor is; give one")
    if "material" in conductor:
        material = str(props.get("material"))
        if material == "none" and coat is not None:
            raise DiffractionError(
                "coat_ior needs a refractive index beneath it, which material='none' has not; give "
                "a conductor, or int_ior"
            )
        if material == "none":
            return Perfect()
        metal = Conductor.of_material(material, number(props, "wavelength", DEFAULT_WAVELENGTH))
        metal.medium = coat
        return metal
    if conductor:
        if len(conductor) == 1:
            raise DiffractionError(f"{conductor[0]} alone is no conductor; give both eta and k")
        metal = Conductor(_index_part(props, "eta"), _index_part(props, "k"), "eta, k")
        metal.medium = coat
        return metal
    medium = _index(props, "ext_ior", 1.000277) if coat is None else _index(props, "coat_ior")
    least = LEAST_INDEX if _transmits(props) else INDICES[0]
    return Dielectric(_index(props, "int_ior", 1.5), medium, least=least)


def coat_of(props: Properties) -> Dielectric | None:
    """The clear layer over the structure, or None."""
    if "coat_ior" not in props:
        return None
    medium = _index(props, "ext_ior", _above(props))
    coat = Dielectric(_index(props, "coat_ior"), medium, "coat_eta", 1.0)
    if dr.slice(coat.eta) < 1.0:
        raise DiffractionError(
            f"coat_ior={props.get('coat_ior')} is below the index of the medium above the coat; "
            "a coat's is at least as large"
        )
    if props.get("layering", LAYERINGS[0]) == "thesis":
        raise DiffractionError("layering='thesis' knows no coat; leave coat_ior or layering out")
    return coat


def passing_of(props: Properties, material: Reflectance) -> Dielectric | None:
    """The dielectric, if light is to go through it, which excludes much."""
    thin = flag(props, "thin", False)
    if not _transmits(props):
        if thin:
            raise DiffractionError("thin=true lets light through; leave transmission=false out")
        return None
    name = "thin" if thin else "transmission"
    if not isinstance(material, Dielectric):
        raise DiffractionError(
            f"{name}=true lets light through, which the material '{material}' does not; give "
            "int_ior instead"
        )
    excluded = [
        *(f"{one}_ior" for one in ("coat", "film") if f"{one}_ior" in props),
        *("a nested BSDF" for _, value in props.objects() if isinstance(value, mi.BSDF)),
        *(f"{one}={props.get(one)}" for one in ("layering", "shadowing") if one in props),
        *("coherence=surface" for one in ("coherence",) if props.get(one, "") == "surface"),
    ]
    if excluded:
        raise DiffractionError(f"{name}=true and {excluded[0]} exclude each other; leave one out")
    if dr.slice(material.eta) < LEAST_INDEX:
        raise DiffractionError(
            f"{name}=true needs int_ior at least {LEAST_INDEX:g} times ext_ior; turn the surface "
            "round where the denser medium is above"
        )
    return material


def _transmits(props: Properties) -> bool:
    return flag(props, "transmission", flag(props, "thin", False))


def under_film(
    props: Properties, material: Reflectance, wavelength: float, shortest: float
) -> Reflectance | UnderFilm:
    """The material, under a film if there is one.

    wavelength : nm, of mono variants; shortest : the least that the table serves.
    """
    given = [name for name in ("film_ior", "film_k", "film_thickness") if name in props]
    if not given:
        return material
    if not {"film_ior", "film_thickness"} <= set(given):
        raise DiffractionError(
            f"{given[0]} alone is no film; give both film_ior and film_thickness (nm)"
        )
    if isinstance(material, Perfect):
        raise DiffractionError(
            "film_ior needs a refractive index beneath it, which material='none' has not; give a "
            "conductor, or int_ior"
        )
    for other, present in (
        ("coat_ior", "coat_ior" in props),
        ("layering='thesis'", props.get("layering", LAYERINGS[0]) == "thesis"),
    ):
        if present:
            raise DiffractionError(
                f"film_ior and {other} exclude each other; leave one of them out"
            )
    medium = _index(props, "ext_ior", _above(props))
    film = Dielectric(_index(props, "film_ior"), medium, "film_eta")
    k, thickness = number(props, "film_k", 0.0), number(props, "film_thickness", 0.0)
    filmed = UnderFilm(material, film, k, thickness, wavelength, shortest)
    for refused in (*(one.refusal() for one in filmed.changeable), filmed.refusal()):
        if refused:
            raise DiffractionError(refused)
    return filmed


def warn_of_film(material: Reflectance | UnderFilm, table: DiffractionTable, scale: float) -> None:
    """Say that a film's fringes are finer than the model can follow on heights times a scale."""
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


def boundary_of(
    props: Properties, material: Reflectance | UnderFilm, table: DiffractionTable
) -> Boundary:
    """By default small slope where there is an index, unless it is the thesis' layering."""
    scalar = isinstance(material, Perfect) or props.get("layering", LAYERINGS[0]) == "thesis"
    if choice(props, "model", MODELS[::-1] if scalar else MODELS) == "kirchhoff":
        return Kirchhoff(material)
    if isinstance(material, Perfect):
        raise DiffractionError(
            "model='small_slope' needs a refractive index, which material='none' has not; give "
            "model='kirchhoff', a conductor, or int_ior"
        )
    return SmallSlope(material, table.roughness)


def _above(props: Properties) -> float:
    """Index of the medium above: air; conductors have theirs given relative to it."""
    return 1.0 if any(name in props for name in ("material", "eta", "k")) else 1.000277


def _index_part(props: Properties, name: str) -> ObjectValues:
    """Part of a complex index, a spectrum or texture whose values are checked where exposed."""
    # A colour becomes a spectrum whose values are coefficients of any sign
    coefficients = mi.is_spectral and props.type(name) == mi.Properties.Type.Color
    texture = props.get_unbounded_texture(name)
    part = ObjectValues(name, texture, None if coefficients else INDEX_PARTS[name])
    if refused := part.refusal():
        raise DiffractionError(f"{refused}: the index is eta + ik")
    return part


def _index(props: Properties, name: str, default: float = 1.0) -> float | str:
    value = props.get(name, default)
    if isinstance(value, str):
        return value
    if not (isinstance(value, int | float) and math.isfinite(value) and value >= 1.0):
        raise DiffractionError(
            f"{name}={value} must be a refractive index of at least 1, or a name"
        )
    return float(value)
