"""The plugin's parameters: read from Mitsuba's Properties, checked, in one plain record."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, fields
from pathlib import Path

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError
from ..heights.field import HeightField
from ..heights.lengths import is_auto, numbers_of
from ..heights.read import LoadOptions
from ..settings import COHERENCES, SCENE_SETTINGS, SURFACE, checked
from ..tables.table import DiffractionTable
from .boundary import Boundary, SmallSlope
from .directions import SHADOWINGS
from .fresnel import Conductor, Dielectric, Perfect, Reflectance
from .layers import LAYERINGS, Blend, Layering, Transmission, UnderCoat, UnderFilm
from .materials import (
    DEFAULT_WAVELENGTH,
    boundary_of,
    coat_of,
    material_of,
    passing_of,
    under_film,
    warn_of_film,
)
from .properties import choice, flag, kind_of, number
from .second_order import SecondOrder, material_of_second_order, ratios_of_second_order
from .sources import (
    TableProvider,
    from_cache,
    heights_of_file,
    heights_of_tensor,
    table_of_file,
    table_of_heights,
)
from .textures import ConstantOrientation, Orientation, OrientationTexture, VaryingHeightScale
from .transmission.energy import SidesModel
from .transmission.sides import Through
from .types import BSDF, Properties
from .window_positions import TILINGS, Places

SOURCES = ("heightfield", "table", "data")
READING = tuple(field.name for field in fields(LoadOptions))
#: Of coherence='surface'.
PLACING = ("uv_scale", "world_scale", "tiling")
#: µm: beyond, single precision holds places on the surface to no better than 1 µm.
MOST_UV_SCALE = 1e7
ABSORBED = (
    "film_k makes a film that absorbs, over a nested BSDF, which would get that light; leave "
    "film_k out, or remove the nested BSDF"
)
NAMES = (
    *SOURCES,
    *READING,
    *SCENE_SETTINGS,
    *PLACING,
    "material",
    "eta",
    "k",
    "int_ior",
    "ext_ior",
    "coat_ior",
    "film_ior",
    "film_k",
    "film_thickness",
    "transmission",
    "thin",
    "model",
    "orientation",
    "height_scale",
    "height_scale_max",
    "wavelength",
    "energy_conserving",
    "shadowing",
    "layering",
    "diffuse_weight",
)


@dataclass(frozen=True)
class Parameters:
    """What the BSDF needs, checked.

    Attributes
    ----------
    table : the diffraction table.
    places : where its windows sit, or None for wherever the table has them.
    heights : reads the heights that it was made of.
    reflectance : the surface's own reflectance, that of the faces of coat, film and structure
        together.
    coat : the clear layer over the structure, or None.
    boundary : what the material makes of the light, by model.
    orientation : from the first tangent to the patch's x axis.
    height_scale : factor on all heights, or how it varies.
    energy_conserving : whether to divide by a bound of the albedo.
    vcavity : whether the surface shadows itself like V-shaped grooves.
    layering : how diffraction and the nested BSDF share the light.
    wavelength : nm, that of mono variants.
    nested : the BSDF beneath, or None.
    through : both sides of a surface that lets light through, or None.
    optical : index that heights are in, of coat or dielectric, over that of the medium above.
    second_order : the second order of small slope, or None.
    """

    table: DiffractionTable
    places: Places | None
    heights: Callable[[], HeightField]
    reflectance: Reflectance | UnderCoat | UnderFilm
    coat: Dielectric | None
    boundary: Boundary
    orientation: Orientation
    height_scale: float | VaryingHeightScale
    energy_conserving: bool
    vcavity: bool
    layering: Layering
    wavelength: float
    nested: BSDF | None
    through: Through | None
    optical: float
    second_order: SecondOrder | None


def read_parameters(props: Properties, provider: TableProvider = from_cache) -> Parameters:
    """Check everything, and get the table: loaded, or from what provides those of heights.

    Raises
    ------
    DiffractionError
        With the parameter, its value and the choices.
    """
    beneath = {name: value for name, value in props.objects() if isinstance(value, mi.BSDF)}
    if len(beneath) > 1:
        raise DiffractionError(
            f"{len(beneath)} nested BSDFs ({', '.join(beneath)}); at most one can lie beneath"
        )
    nested = next(iter(beneath.values()), None)
    _refuse_unknown(props, beneath)
    if nested is not None and nested.flags() & mi.BSDFFlags.Transmission:
        raise DiffractionError(
            f"the nested BSDF {kind_of(nested)} lets light through, which would be lost beneath; "
            "nest one that only reflects"
        )
    height_scale = _height_scale(props)
    coat = coat_of(props)
    material = material_of(props, coat)
    if nested is not None and isinstance(material, Perfect | Conductor):
        raise DiffractionError(
            f"a nested BSDF lies beneath a surface that lets no light through (material="
            f"'{material}'); give int_ior instead, or remove the nested BSDF"
        )
    second = material_of_second_order(props, material)
    passing = passing_of(props, material)
    # κ grows by the coat's index, or in a dielectric by its own, as if heights did
    medium = coat or passing
    optical = 1.0 if medium is None else float(dr.slice(medium.eta))
    largest = height_scale.high if isinstance(height_scale, VaryingHeightScale) else height_scale
    table, heights = _table(props, largest * optical, provider, second is not None)
    wavelength = _wavelength(props, table)
    reflectance = under_film(props, material, wavelength, table.wavelength_range[0])
    if nested is not None and isinstance(reflectance, UnderFilm) and reflectance.numbers()[0].imag:
        raise DiffractionError(ABSORBED)
    flat: Reflectance | UnderCoat | UnderFilm = reflectance
    if coat is not None and not isinstance(material, Perfect):
        flat = UnderCoat(material, coat)
    warn_of_film(reflectance, table, largest)
    boundary = boundary_of(props, reflectance, table)
    second_order = None
    ratios = None if second is None else ratios_of_second_order(props, table)
    if second is not None and ratios is not None and isinstance(boundary, SmallSlope):
        second_order = SecondOrder(second, boundary, ratios)
    conserving, through = flag(props, "energy_conserving", True), None
    places = _places(props, table)
    if passing is not None:
        thin = flag(props, "thin", False)
        mean = table if places is None else table.averaged
        balance = SidesModel(mean, passing, str(boundary), thin, wavelength) if conserving else None
        through = Through(passing, boundary, thin, balance)
    return Parameters(
        table=table,
        places=places,
        heights=heights,
        reflectance=flat,
        coat=coat,
        boundary=boundary,
        orientation=_orientation(props),
        height_scale=height_scale,
        energy_conserving=conserving,
        vcavity=choice(props, "shadowing", SHADOWINGS) == "vcavity",
        layering=_layering(props, flat, nested is not None),
        wavelength=wavelength,
        nested=nested,
        through=through,
        optical=optical,
        second_order=second_order,
    )


def _height_scale(props: Properties) -> float | VaryingHeightScale:
    given = dict(props.objects()).get("height_scale")
    most = number(props, "height_scale_max", math.nan) if "height_scale_max" in props else None
    if isinstance(given, mi.Texture):
        return VaryingHeightScale(given, most)
    if most is not None:
        raise DiffractionError("height_scale_max is for a height_scale that is a texture")
    factor = number(props, "height_scale", 1.0)
    if not 0.0 < factor <= 1e3:
        raise DiffractionError(f"height_scale={factor:g} must be above 0 and at most 1000")
    return factor


def _table(
    props: Properties, height_scale: float, provider: TableProvider, second_order: bool
) -> tuple[DiffractionTable, Callable[[], HeightField]]:
    given = [name for name in SOURCES if name in props]
    if len(given) != 1:
        raise DiffractionError(
            f"give exactly one of {', '.join(SOURCES)}; got {' and '.join(given) or 'none'}"
        )
    given_settings = {name: props.get(name) for name in SCENE_SETTINGS if name in props}
    if _on_surface(props):
        given_settings["coherence"] = "patch"
    if not second_order:
        given_settings["second_order"] = False  # not to be built for nothing
    if is_auto(given_settings.get("coherence_width", 0.0)):
        del given_settings["coherence_width"]
    asked = {name: checked(name, value) for name, value in given_settings.items()}
    options = LoadOptions.parse(**{name: props.get(name) for name in READING if name in props})
    value = props.get(given[0])
    if given[0] == "data":
        heights = heights_of_tensor(value, options)
        return table_of_heights(heights, asked, height_scale, provider), lambda: heights
    if not isinstance(value, str):
        raise DiffractionError(f"{given[0]}={value!r} must be the name of a file")
    path = _found(value, given[0])
    table = table_of_file(path, given[0] == "table", options, asked, height_scale, provider)
    return table, lambda: heights_of_file(path, given[0] == "table", options)


def _on_surface(props: Properties) -> bool:
    """Whether the window sits where the light falls; the table is then that of one window."""
    coherence = choice(props, "coherence", (*COHERENCES, SURFACE))
    if coherence != SURFACE:
        return False
    if mi.is_rgb:
        raise DiffractionError(
            f"coherence='{SURFACE}' needs wavelengths, whose speckle differs, and variant "
            f"{mi.variant()} has none; use a spectral or a mono variant"
        )
    return True


def _places(props: Properties, table: DiffractionTable) -> Places | None:
    """From UV coordinates with a scale to places on the patch."""
    tiling = choice(props, "tiling", TILINGS)
    given = {name: props.get(name) for name in PLACING[:2] if name in props}  # read in any case
    if not _on_surface(props):
        return None  # a scene for all coherences may give the scale in all
    if len(given) != 1:
        raise DiffractionError(
            f"coherence='{SURFACE}' takes one of uv_scale, µm a unit of UV coordinates, and "
            f"world_scale, µm a unit of length of the scene; got {' and '.join(given) or 'none'}"
        )
    ((name, value),) = given.items()
    numbers, most = numbers_of(value) or (), 1 if name == "world_scale" else 2
    if not (1 <= len(numbers) <= most and all(0.0 < n <= MOST_UV_SCALE for n in numbers)):
        expected = "one number" if most == 1 else "one number or two, 'u, v',"
        raise DiffractionError(
            f"{name}={value!r} must be {expected} of µm, above 0 and at most {MOST_UV_SCALE:g}"
        )
    return Places((numbers[0], numbers[-1]), name == "world_scale", tiling, table)


def _found(name: str, parameter: str) -> Path:
    """The file of this name: as it is, or in a folder where Mitsuba looks for files.

    Raises
    ------
    DiffractionError
        If there is none, with the folders.
    """
    resolver = mi.file_resolver()
    path = Path(str(resolver.resolve(name)))
    if path.exists() or path.is_absolute():
        return path  # what is not there is told by who opens it
    folders = dict.fromkeys(str(Path(str(folder)).resolve()) for folder in resolver)
    looked = ", ".join(repr(folder) for folder in folders)
    raise DiffractionError(
        f"{parameter}: '{name}' does not exist; looked for it in {looked}; give its whole path, "
        "or put it there"
    )


def _wavelength(props: Properties, table: DiffractionTable) -> float:
    """The wavelength of mono variants in nm: a scene for all variants may give it in all."""
    wavelength = number(props, "wavelength", DEFAULT_WAVELENGTH)
    if not mi.is_monochromatic and "wavelength" not in props:
        return wavelength  # nobody asks for it
    shortest, longest = table.wavelength_range
    if not shortest <= wavelength <= longest:
        raise DiffractionError(
            f"wavelength={wavelength:g} nm is outside the table's {shortest:g} to {longest:g} nm"
        )
    return wavelength


def _refuse_unknown(props: Properties, objects: Collection[str]) -> None:
    for name in props.keys():  # noqa: SIM118 - Properties is no mapping
        if name in NAMES or name in objects or name == "id":
            continue
        near = difflib.get_close_matches(name, NAMES, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise DiffractionError(f"unknown parameter '{name}'; {hint}Allowed: {', '.join(NAMES)}")


def _orientation(props: Properties) -> Orientation:
    objects = dict(props.objects())
    if "orientation" in objects:
        texture = objects["orientation"]
        if not isinstance(texture, mi.Texture):
            raise DiffractionError(
                f"orientation={kind_of(texture)} must be degrees, or a raw texture or mesh "
                "attribute whose first two channels are (cos, sin)"
            )
        return OrientationTexture(texture)
    return ConstantOrientation(number(props, "orientation", 0.0))


def _layering(
    props: Properties, reflectance: Reflectance | UnderCoat | UnderFilm, nested: bool
) -> Layering:
    if choice(props, "layering", LAYERINGS) == "transmission":
        if "diffuse_weight" in props:
            raise DiffractionError("diffuse_weight belongs to layering='thesis'; leave it out")
        return Transmission(reflectance)
    if not nested:
        raise DiffractionError("layering='thesis' blends with a nested BSDF, but there is none")
    weight = number(props, "diffuse_weight", 0.0)
    if not 0.0 <= weight <= 1.0:
        raise DiffractionError(f"diffuse_weight={weight:g} must lie between 0 and 1")
    return Blend(reflectance, weight)
