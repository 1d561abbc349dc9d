"""Export of a surface to Blender: a shader in Open Shading Language (OSL) and its textures."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..atomic import atomic_path, make_folder
from ..errors import DiffractionError, one_line, quoted
from ..optics.boundary import MODELS
from ..optics.colour import WORKING_SPACES, daylight_shares
from ..orders import OrderTable
from ..plugin.description import Consumer, Feature, Surface
from ..shading import dialects
from ..shading.orders import pack_orders
from ..shading.spectra import spectra_of
from ..tables import write_channels
from .formulas import order_formulas, patch_formulas, shader_file
from .patch import (
    energy_texture,
    mean_transmittance,
    patch_constants,
    patch_error,
    patch_textures,
)
from .sockets import Socket, array_parameter, sockets_of
from .solved import MOST_BYTES, interpolation_error, order_constants
from .spectrum import NODES, drawn_spectrum

#: Script that adds the material to a .blend file, copied into the folder.
SCRIPT = "blender_material.py"

#: Features that the shaders for Cycles have.
OSL = Consumer(
    "OSL",
    frozenset(
        {
            Feature.HEIGHTS, Feature.ORDERS, Feature.MIRROR, Feature.DIELECTRIC, Feature.RARER,
            Feature.CONDUCTOR, Feature.SMALL_SLOPE, Feature.KIRCHHOFF, Feature.HEIGHT_SCALE,
            Feature.LATERAL_SCALE, Feature.ORIENTATION, Feature.ENERGY_SCALE,
            Feature.OWN_MODEL, Feature.COAT, Feature.NESTED,
        }
    ),
    "export the surface without, or render it with Mitsuba",
    remedies={
        Feature.CROSSED: "render it with Mitsuba",
        Feature.LIMITED: "export a table of all orders, or the height field",
        Feature.MIX: "export its surfaces one by one, and mix their shaders in Blender",
        Feature.VARYING_ORIENTATION: "export a number, and give the texture to the script in "
        "Blender as its orientation",
        Feature.VARYING_LENGTH: "export a number, and give the texture to the script in Blender "
        "as its stretch",
        Feature.TRANSMISSION: "export a table of the reflecting side, or render it with Mitsuba",
    },
)  # fmt: skip

_HEAD = "// {surface}; made by mitsuba_diffraction {version}.\n"


@dataclass(frozen=True)
class Exported:
    """Files of an exported surface.

    Attributes
    ----------
    shader, document : the shader (.osl), and its sockets for the script (.json).
    textures : files by the identifier of the socket that names them.
    surface : description in a few words.
    error : figures of the textures' error, for people.
    """

    shader: Path
    document: Path
    textures: dict[str, Path]
    surface: str
    error: dict[str, float]


@dataclass(frozen=True)
class OslShader:
    """Shader of a surface before it is written.

    Attributes
    ----------
    source : name of the file in `shaders`.
    formulas : functions of `optics` that it calls.
    constants : macros.
    arrays : declarations of parameters that are constant arrays.
    sockets : inputs.
    textures : pixels (height, width, 4), by the identifier of the socket that names the file.
    surface, error : see `Exported`.
    """

    source: str
    formulas: str
    constants: Mapping[str, Any]
    arrays: Sequence[str]
    sockets: Sequence[Socket]
    textures: Mapping[str, NDArray[Any]]
    surface: str
    error: dict[str, float]


def export(bsdf: Any, folder: str | os.PathLike[str], name: str = "diffraction") -> Exported:
    """Write `NAME.osl`, its textures (EXR), `NAME.json` and `blender_material.py` into a folder.

    Raises a DiffractionError if the surface has features that the shader lacks, or the folder
    cannot be written.

    Parameters
    ----------
    bsdf : BSDF of the plugin `diffraction` or `diffraction_orders`, from `mi.load_dict`, without
        film or nested BSDF.
    folder : made if it is missing.
    name : of the shader and its files; letters, digits and underscores.
    """
    check_name(name)
    shader = shader_of(OSL.described(bsdf))
    path = Path(folder)
    make_folder(path)
    files = {
        key: path / f"{name}_{key.removesuffix('File').lower()}.exr" for key in shader.textures
    }
    for key, pixels in shader.textures.items():
        write_channels(files[key], {"RGBA": pixels})
    textures = [
        Socket(key, key.removesuffix("File") + " Texture", "string", file.name,
               "File of the export, beside the shader; the script in Blender sets its path")
        for key, file in files.items()
    ]  # fmt: skip
    sockets = [*shader.sockets, *textures]
    exported = Exported(
        path / f"{name}.osl", path / f"{name}.json", files, shader.surface, shader.error
    )
    _save_text(exported.shader, _source(shader, sockets, name))
    document = {
        "generator": f"mitsuba_diffraction {version('mitsuba_diffraction')}",
        "surface": shader.surface,
        "shader": exported.shader.name,
        "inputs": [socket.document() for socket in sockets],
        "output": "BSDF",
        "textures": {key: file.name for key, file in files.items()},
    }
    _save_text(exported.document, json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    script = resources.files(__package__).joinpath(SCRIPT)
    if script.is_file():
        _save_text(path / SCRIPT, script.read_text(encoding="utf-8"))
    return exported


def check_name(name: str) -> None:
    """Refuse a name that a shader cannot have, without its tables.

    Raises a DiffractionError if the name is no identifier, or a word of OSL or of GLSL.
    """
    allowed = "letters, digits and underscores, a letter first"
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise DiffractionError(f"name={quoted(name)} must be {allowed}: it is the name of a shader")
    files = (shader_file(file) for file in ("common.osl", "patch.osl", "orders.osl"))
    formulas = [order_formulas(), *(patch_formulas(model, True) for model in MODELS.values())]
    source = re.sub('"[^"]*"', "", re.sub("//.*", "", "\n".join([*files, *formulas])))
    if name in dialects.OSL.reserved or re.search(rf"\b{name}\b", source):
        raise DiffractionError(
            f"name='{name}' is a word of the Open Shading Language or of the shaders' source; "
            f"choose another of {allowed}, for example 'my_{name}'"
        )


def shader_of(described: Surface) -> OslShader:
    """Return the shader of a surface that `OSL` shows."""
    orders = described.orders
    placed = {"Rotation": described.orientation.number, "Pigment": pigment_of(described)}
    return _patch(described, placed) if orders is None else _orders(described, orders, placed)


def _orders(described: Surface, table: OrderTable, placed: Mapping[str, Any]) -> OslShader:
    packed = pack_orders(table, MOST_BYTES)
    return OslShader(
        "orders.osl",
        order_formulas(),
        order_constants(table, packed),
        [],
        sockets_of({"CoherenceWidth": described.coherence_width, **placed}),
        {"OrdersFile": packed.pixels},
        str(table),
        interpolation_error(table, packed),
    )


def _patch(described: Surface, placed: Mapping[str, Any]) -> OslShader:
    table = described.patch
    textures = patch_textures(table)
    index = None if described.index is None else described.index(drawn_spectrum()[0])
    parts = np.full(NODES, 1.5 + 0j) if index is None else index
    model = None if index is None else MODELS[described.model]
    statistic = table.roughness
    if model is not None and model.statistic is not None:
        statistic = model.statistic(statistic)
    arrays = {
        "Eta": np.real(parts),
        "Absorption": np.imag(parts),
        "Statistic": statistic.nodes,
        "Factors": textures.factors,
    }
    constants = patch_constants(table, textures, statistic)
    if described.coat is not None:
        constants["COAT"] = float(described.coat)
    files: dict[str, NDArray[Any]] = {
        "PowersFile": textures.powers,
        "DrawsFile": textures.draws,
    }
    if (energy := energy_texture(described)) is not None:
        files["EnergyFile"], scales = energy
        constants |= scales
    constants["PIGMENT_SHARE"] = mean_transmittance(index, described.coat)
    return OslShader(
        "patch.osl",
        patch_formulas(model, described.coat is not None),
        constants,
        [array_parameter("float", name, values) for name, values in arrays.items()],
        sockets_of(
            {
                "CoherenceWidth": table.coherence_width,
                "HeightScale": described.height_scale.number,
                "Stretch": described.lateral_scale.number,
                **placed,
            },
            table.height_scale_max,
        ),
        files,
        f"patch of {table.source.get('name', 'heights')}, {described.text}",
        patch_error(table, textures),
    )


def pigment_of(described: Surface) -> tuple[float, float, float]:
    """Return the colour beneath a surface, linear sRGB in daylight; black without a BSDF there.

    Raises a DiffractionError if the BSDF beneath is not diffuse, or varies.
    """
    import mitsuba as mi

    if described.nested is None:
        return 0.0, 0.0, 0.0
    bsdf, lam = described.nested, np.linspace(380.0, 740.0, 36)
    refusal = (
        "the BSDF beneath the surface has no single diffuse colour, which OSL cannot show; leave "
        "it out, and link its picture to Pigment in Blender"
    )
    # bitmaps and patterns have a transform; other textures are looked up at three places
    placed = any(key.endswith("to_uv") for key in mi.traverse(bsdf).keys())  # noqa: SIM118
    if bsdf.class_name() != "SmoothDiffuse" or placed:
        raise DiffractionError(refusal)

    def reflectance_at(uv: tuple[float, float]) -> Any:
        def look_up(si: Any) -> Any:
            si.uv, si.wi = mi.Point2f(*uv), mi.Vector3f(0.0, 0.0, 1.0)
            return bsdf.eval_diffuse_reflectance(si)

        return spectra_of(look_up, lam)[0].astype(np.float64)

    places = [reflectance_at(uv) for uv in ((0.3, 0.3), (0.7, 0.2), (0.6, 0.9))]
    if np.ptp(places, axis=0).max() > 1e-4:  # rounding of single precision is far below
        raise DiffractionError(refusal)
    colour = places[0]
    if len(colour) > 3:
        colour = colour @ daylight_shares(lam)
    # mono variants have one number
    red, green, blue = (float(max(value, 0.0)) for value in np.resize(colour, 3))
    return red, green, blue


def _source(shader: OslShader, sockets: Sequence[Socket], name: str) -> str:
    """Return the source of a shader: constants, the shared functions, and its own."""
    wavelengths, by_space = drawn_spectrum()
    arrays = [array_parameter("float", "Wavelengths", wavelengths)]
    arrays += [
        array_parameter("color", f"Colours{n}", colours)
        for n, colours in enumerate(by_space.values())
    ]
    declarations = [socket.declaration() for socket in sockets]
    parameters = [*declarations, *arrays, *shader.arrays, "output closure color BSDF = 0"]
    constants = {"N_NODES": NODES, **shader.constants}
    lines = [f"#define {key} {_literal(value)}" for key, value in constants.items()]
    lines += [f'#define SPACE_{n} "{space}"' for n, space in enumerate(WORKING_SPACES)]
    common, own = shader_file("common.osl"), shader_file(shader.source)
    own = own.replace("SHADER(PARAMETERS)", f"{name}(\n    " + ",\n    ".join(parameters) + "\n)")
    head = _HEAD.format(surface=one_line(shader.surface), version=version("mitsuba_diffraction"))
    return "\n".join([head + "\n".join(lines), "", common, shader.formulas, own])


def _literal(value: float | int) -> str:
    """Format a number for OSL: floats have a decimal point, integers none."""
    return str(value) if isinstance(value, int) else repr(float(value))


def _save_text(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
