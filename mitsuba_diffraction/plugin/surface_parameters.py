"""Parameters that both plugins have: read from Mitsuba's Properties, checked, in one record."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import mitsuba as mi

from ..errors import DiffractionError
from ..heights.field import HeightField
from ..heights.lengths import is_auto, numbers_of
from ..heights.read import LoadOptions
from ..optics.materials import index_at_sodium
from ..settings import COHERENCES, SURFACE, checked
from ..tables.table import DiffractionTable
from .dictionary import ORDERS, PLUGINS
from .factors import HEIGHT, LateralScale, VaryingFactor, largest_of, read_factor, read_lateral
from .llvm import require_loaded_llvm
from .pigment import pigment_bsdf
from .properties import choice, class_of, flag, number
from .sources import (
    Factors,
    TableProvider,
    heights_of_file,
    heights_of_tensor,
    table_of_file,
    table_of_heights,
)
from .textures import ConstantOrientation, Orientation, OrientationTexture
from .types import BSDF, Properties
from .window_positions import TILINGS, WindowPositions

SOURCES = ("heightfield", "table", "data")
READING = tuple(field.name for field in fields(LoadOptions))
#: Settings of the table.
TABLE = ("coherence_width", "coherence", "basis", "tolerance", "terms", "windows")
#: Parameters of coherence='surface'.
PLACING = ("uv_scale", "world_scale", "tiling")
#: µm a unit; beyond, single precision holds positions on the surface to no better than 1 µm.
MOST_UV_SCALE = 1e7
#: nm, of mono variants.
DEFAULT_WAVELENGTH = 550.0

_COMMON = (
    *SOURCES,
    *READING,
    *TABLE,
    "int_ior",
    "ext_ior",
    "model",
    "orientation",
    "height_scale",
    "height_scale_max",
    "lateral_scale",
    "lateral_scale_max",
    "wavelength",
    "energy_conserving",
)
_LAYERS = (
    "coat_ior", "film_ior", "film_k", "film_thickness", "layers", "layering", "diffuse_weight",
    "pigment",
)  # fmt: skip
REFLECTING, TRANSMITTING = PLUGINS
#: Names of the parameters of each plugin.
NAMES: Mapping[str, tuple[str, ...]] = {
    REFLECTING: (
        *_COMMON, *PLACING, "second_order", "material", "eta", "k", *_LAYERS, "shadowing",
    ),
    TRANSMITTING: (*_COMMON, "thin"),
    ORDERS: ("table", "data", "coherence_width", "orientation", "wavelength"),
}  # fmt: skip


@dataclass(frozen=True)
class SurfaceParameters:
    """Parameters of the surface itself, checked.

    Attributes
    ----------
    table : the diffraction table.
    heights : function that reads the heights that the table is made of.
    window_positions : positions of windows, or None where the table averages over them.
    orientation : angle from the first tangent to the patch's x axis.
    lateral_scale : factor on lengths in the patch's plane.
    height_scale : factor on all heights, or a texture of factors.
    optical : index of the medium that heights are in, relative to the medium above.
    wavelength : nm, of mono variants.
    energy_conserving : whether the BSDF is scaled where it would gain or lose light.
    """

    table: DiffractionTable
    heights: Callable[[], HeightField]
    window_positions: WindowPositions | None
    orientation: Orientation
    lateral_scale: LateralScale
    height_scale: float | VaryingFactor
    optical: float
    wavelength: float
    energy_conserving: bool

    @property
    def mean_table(self) -> DiffractionTable:
        """Table of the mean over all positions of the window."""
        return self.table if self.window_positions is None else self.table.averaged

    @property
    def largest_scale(self) -> float:
        """Largest factor on the heights."""
        return largest_of(self.height_scale)


def read_surface(
    props: Properties, provider: TableProvider, optical: float, second_order: bool
) -> SurfaceParameters:
    """Read and check the parameters that both plugins have, and get the table.

    Raises a DiffractionError with the parameter, its value and the choices.

    Parameters
    ----------
    provider : gets the tables of heights.
    optical : index of the medium that heights are in, relative to the medium above.
    second_order : whether the table may need slope ratios.
    """
    height_scale = read_factor(props, HEIGHT)
    lateral = read_lateral(props)
    # κ grows by the index, as if heights did
    largest = largest_of(height_scale) * optical
    table, heights = _table(props, largest, lateral.of_table, provider, second_order)
    return SurfaceParameters(
        table=table,
        heights=heights,
        window_positions=_window_positions(props, table),
        orientation=orientation_of(props),
        lateral_scale=lateral,
        height_scale=height_scale,
        optical=optical,
        wavelength=mono_wavelength(props, table.wavelength_range),
        energy_conserving=flag(props, "energy_conserving", True),
    )


def nested_of(props: Properties, plugin: str) -> BSDF | None:
    """Return the nested BSDF or pigment, or None; refuse parameters that the plugin lacks.

    Raises a DiffractionError if a name is unknown, there are several nested BSDFs, or it lets light
    through.
    """
    require_loaded_llvm()
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


def coherence_of(props: Properties) -> str:
    """Return the coherence that a scene asks for."""
    return choice(props, "coherence", (*COHERENCES, SURFACE))


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


def _table(
    props: Properties,
    height_scale: float,
    stretch: float,
    provider: TableProvider,
    second_order: bool,
) -> tuple[DiffractionTable, Callable[[], HeightField]]:
    sources = [name for name in SOURCES if name in props]
    if len(sources) != 1:
        raise DiffractionError(
            f"give exactly one of {', '.join(SOURCES)}; got {' and '.join(sources) or 'none'}"
        )
    (source,) = sources
    options = LoadOptions.parse(**{name: props.get(name) for name in READING if name in props})
    settings = _settings(props, second_order)
    value = props.get(source)
    if source == "data":
        heights = heights_of_tensor(value, options).stretched(stretch)
        return table_of_heights(heights, settings, height_scale, provider), lambda: heights
    if not isinstance(value, str):
        raise DiffractionError(f"{source}={value!r} must be the name of a file")
    path = resolved_path(value, source)
    must_be_table, factors = source == "table", Factors(height_scale, stretch)
    table = table_of_file(path, must_be_table, options, settings, factors, provider)
    return table, lambda: heights_of_file(path, must_be_table, options).stretched(stretch)


def _settings(props: Properties, second_order: bool) -> dict[str, Any]:
    """Settings of the table that the scene asks for, checked."""
    settings = {name: props.get(name) for name in (*TABLE, "second_order") if name in props}
    if coherence_of(props) == SURFACE:
        settings["coherence"] = "patch"  # each window has its own speckle
    if not second_order:
        settings["second_order"] = False  # slope ratios would be built in vain
    if is_auto(settings.get("coherence_width", 0.0)):
        del settings["coherence_width"]
    return {name: checked(name, value) for name, value in settings.items()}


def _window_positions(props: Properties, table: DiffractionTable) -> WindowPositions | None:
    """Positions of windows on the patch, from UV coordinates with a scale."""
    tiling = choice(props, "tiling", TILINGS)
    # Checked in any case: one scene may be rendered with every coherence
    scales = {name: props.get(name) for name in PLACING[:2] if name in props}
    if coherence_of(props) != SURFACE:
        return None
    if len(scales) != 1:
        raise DiffractionError(
            f"coherence='{SURFACE}' takes one of uv_scale, µm a unit of UV coordinates, and "
            f"world_scale, µm a unit of length of the scene; got {' and '.join(scales) or 'none'}"
        )
    ((name, value),) = scales.items()
    numbers, most = numbers_of(value) or (), 1 if name == "world_scale" else 2
    if not (1 <= len(numbers) <= most and all(0.0 < n <= MOST_UV_SCALE for n in numbers)):
        expected = "one number" if most == 1 else "one number or two, 'u, v',"
        raise DiffractionError(
            f"{name}={value!r} must be {expected} of µm, above 0 and at most {MOST_UV_SCALE:g}"
        )
    return WindowPositions((numbers[0], numbers[-1]), name == "world_scale", tiling, table)


def resolved_path(name: str, parameter: str) -> Path:
    """Return the file of this name: as it is, or in a folder where Mitsuba looks for files.

    Raises a DiffractionError if the file is missing, with the folders.
    """
    resolver = mi.file_resolver()
    path = Path(str(resolver.resolve(name)))
    if path.exists() or path.is_absolute():
        return path  # whoever opens it says that it does not exist
    folders = dict.fromkeys(str(Path(str(folder)).resolve()) for folder in resolver)
    looked = ", ".join(repr(folder) for folder in folders)
    raise DiffractionError(
        f"{parameter}: '{name}' does not exist; looked for it in {looked}; give its whole path, "
        "or put it there"
    )


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
    objects = dict(props.objects())
    if "orientation" in objects:
        texture = objects["orientation"]
        if not isinstance(texture, mi.Texture):
            raise DiffractionError(
                f"orientation={class_of(texture)} must be degrees, or a raw texture or mesh "
                "attribute whose first two channels are (cos, sin)"
            )
        return OrientationTexture(texture)
    return ConstantOrientation(number(props, "orientation", 0.0))
