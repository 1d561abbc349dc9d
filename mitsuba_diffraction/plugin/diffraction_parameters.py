"""Parameters of the plugin `diffraction`, read from Mitsuba's Properties and checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError
from ..optics.boundary import MODELS
from ..settings import COHERENCES, SURFACE, checked
from . import support
from .boundary import Boundary, boundary_of
from .directions import SHADOWINGS
from .fresnel import Conductor, Dielectric, Perfect, Reflectance
from .layer_parameters import coat_of, film_of, material_of, stack_of, warn_of_film
from .layers import LAYERINGS, Blend, Layering, Transmission, UnderCoat, UnderFilm
from .properties import choice, class_of, number
from .second_order import SecondOrder, ratios_of_second_order
from .sources import TableProvider
from .stack import UnderStack
from .support import Support, check_combination, supported
from .surface_parameters import (
    REFLECTING,
    SurfaceParameters,
    coherence_of,
    nested_of,
    read_surface,
)
from .types import BSDF, Properties

#: Layers, pigment and medium that "none" leaves out.
OPTIONAL = ("coat_ior", "film_ior", "layers", "ext_ior", "pigment")


@dataclass(frozen=True)
class Parameters:
    """Parameters of `diffraction`, checked.

    Attributes
    ----------
    surface : table, height scale, orientation.
    reflectance : of the flat surface: faces of coat, film and structure together.
    coat : the clear layer over the structure, or None.
    boundary : model of the light that the material reflects.
    vcavity : whether the surface shadows itself like V-shaped grooves.
    layering : how diffraction and the nested BSDF share the light.
    nested : the BSDF beneath, or None.
    second_order : the second order of small slope, or None.
    """

    surface: SurfaceParameters
    reflectance: Reflectance | UnderCoat | UnderFilm | UnderStack
    coat: Dielectric | None
    boundary: Boundary
    vcavity: bool
    layering: Layering
    nested: BSDF | None
    second_order: SecondOrder | None


def read_parameters(props: Properties, provider: TableProvider) -> Parameters:
    """Read and check everything, and get the table: loaded, or from `provider`.

    Raises a DiffractionError with the parameter, its value and the choices.
    """
    for name in OPTIONAL:  # so that a scene can have a parameter for them
        if name in props and props.get(name) == "none":
            del props[name]
    nested = nested_of(props, REFLECTING)
    coat = coat_of(props)
    material = material_of(props, coat)
    layering, model = choice(props, "layering", LAYERINGS), _model(props, material)
    choices = list(_choices(props, material, model))
    check_combination(dict(_asked(props, nested)), choices)

    wants_second_order = checked("second_order", props.get("second_order", "auto"))
    may_have_second_order = bool(wants_second_order) and supported("second_order", choices)
    optical = 1.0 if coat is None else float(dr.slice(coat.eta))
    surface = read_surface(props, provider, optical, may_have_second_order)

    filmed = stack_of(
        props,
        film_of(props, material, surface.wavelength, surface.table.wavelength_range[0]),
        surface.wavelength,
        surface.table.wavelength_range,
    )
    if isinstance(filmed, UnderStack) and filmed.absorbs:
        check_combination(dict(_asked(props, nested)), [support.OPAQUE])
    if isinstance(filmed, UnderFilm) and filmed.absorbs:
        check_combination(dict(_asked(props, nested)), [support.ABSORBING])
    warn_of_film(filmed, surface.table, surface.largest_scale)
    flat: Reflectance | UnderCoat | UnderFilm | UnderStack = filmed
    if coat is not None and isinstance(material, Dielectric | Conductor):
        flat = UnderCoat(material, coat)
    boundary = boundary_of(model, filmed, surface.table.roughness)
    second_order = None
    if may_have_second_order and isinstance(material, Dielectric):
        ratios = ratios_of_second_order(props, surface.table)
        if ratios is not None and boundary.model.has_second_order:
            second_order = SecondOrder(material, boundary, ratios)
    return Parameters(
        surface=surface,
        reflectance=flat,
        coat=coat,
        boundary=boundary,
        vcavity=choice(props, "shadowing", SHADOWINGS) == "vcavity",
        layering=_layering(props, layering, flat, nested is not None),
        nested=nested,
        second_order=second_order,
    )


def _model(props: Properties, material: Reflectance) -> str:
    """Name of the boundary model; by default small slope if there is an index and no thesis."""
    scalar = (
        isinstance(material, Perfect)
        or "layers" in props
        or props.get("layering", LAYERINGS[0]) == "thesis"
    )
    default = "kirchhoff" if scalar else "small_slope"
    return choice(props, "model", (default, *(name for name in MODELS if name != default)))


def _asked(props: Properties, nested: BSDF | None) -> Iterator[tuple[str, str]]:
    """Features that a scene asks for, as messages call them."""
    if nested is not None:
        pigment = "pigment" in props
        yield "nested", "the pigment" if pigment else f"the nested BSDF {class_of(nested)}"
    if (model := props.get("model", "kirchhoff")) != "kirchhoff":
        yield "index", f"model='{model}'"
    if props.get("layering", "") == "thesis":
        yield "thesis", "layering='thesis'"
    if coherence_of(props) == SURFACE:
        yield "placed", f"coherence='{SURFACE}'"
    if checked("second_order", props.get("second_order", "auto")) is True:
        yield "second_order", "second_order=true"
    if "layers" in props:
        yield "layers", "layers"
    for name in ("coat", "film"):
        if f"{name}_ior" in props:
            yield name, f"{name}_ior"


def _choices(props: Properties, material: Reflectance, model: str) -> Iterator[Support]:
    """Declarations of all that a scene chooses."""
    if isinstance(material, Perfect):
        yield support.MIRROR
    elif isinstance(material, Conductor):
        yield support.CONDUCTOR if material.absorbs else support.DISPERSIVE
    elif float(dr.slice(material.eta)) < 1.0:
        yield support.RARER
    if "coat_ior" in props:
        yield support.COAT
    if "film_ior" in props:
        yield support.FILM
    if "layers" in props:
        yield support.STACK
    if model != "small_slope":
        yield support.without_second_order(model)
    if props.get("layering", "") == "thesis":
        yield support.THESIS
    if coherence_of(props) != COHERENCES[0]:
        yield support.PLACED if coherence_of(props) == SURFACE else support.PATCH
    if mi.is_rgb:
        yield support.COLOURS


def _layering(
    props: Properties,
    name: str,
    reflectance: Reflectance | UnderCoat | UnderFilm | UnderStack,
    nested: bool,
) -> Layering:
    if name == "transmission":
        if "diffuse_weight" in props:
            raise DiffractionError("diffuse_weight needs layering='thesis'; leave it out")
        return Transmission(reflectance)
    if not nested:
        raise DiffractionError("layering='thesis' needs a nested BSDF; add one")
    weight = number(props, "diffuse_weight", 0.0)
    if not 0.0 <= weight <= 1.0:
        raise DiffractionError(f"diffuse_weight={weight:g} must lie between 0 and 1")
    return Blend(reflectance, weight)
