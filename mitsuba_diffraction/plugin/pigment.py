"""Pigment beneath a structure: a diffuse BSDF of a colour or a measured spectrum."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError, one_line, quoted
from ..extras import optional
from ..files import GLTF, readable_file
from ..gltf import load_gltf
from ..images import FORMATS
from ..limits import check_content
from ..optics.colour import decode_srgb
from ..text_spectra import SPECTRA, choice_of, read_shares
from .conductors import extended
from .types import BSDF

#: Wavelengths that a measured reflectance has to cover, nm; beyond its ends it is constant.
REQUIRED = (400.0, 700.0)
#: Suffixes of pictures, which texture coordinates lay over the surface.
PICTURES = (".png", ".jpg", ".jpeg", ".exr")


def pigment_bsdf(text: str | float) -> BSDF:
    """Return a diffuse BSDF of a pigment.

    text : a grey from 0 to 1, three linear sRGB values "0.3,0.2,0.1", a colour "#804020" or
        "sienna", a text of wavelengths and reflectances (`text_spectra`), a picture, or a glTF
        file, whose material's base colour is taken. The name of a column and a unit may follow a
        text: "feathers.csv:male:percent". Files are looked for where Mitsuba looks for them: beside
        the scene, too.

    Raises a DiffractionError if the text is not one of these, or the spectrum is not one or ends
    within 400 to 700 nm.
    """
    text = str(text)
    path = choice_of(text).path
    if Path(path).suffix.lower() in (*SPECTRA, *PICTURES, *GLTF):
        text = str(mi.file_resolver().resolve(path)) + text[len(path) :]
    return mi.load_dict({"type": "diffuse", "reflectance": _reflectance(text)})


def pigment_range(text: str | float | None) -> tuple[float, float]:
    """Return the wavelengths, nm, between which a pigment is known; without limits of a colour.

    Raises a DiffractionError if the text is not a pigment, or is a picture, which has a colour only
    where there are texture coordinates.
    """
    if text in (None, "none"):
        return 0.0, math.inf
    if Path(str(text)).suffix.lower() in (*PICTURES, *GLTF):
        raise DiffractionError(
            f"pigment={quoted(str(text))} varies over a mesh, and a patch alone has one pigment; "
            "give a colour or a spectrum"
        )
    if not _is_spectrum(str(text)):
        _reflectance(str(text))
        return 0.0, math.inf
    lam, _ = read_shares(str(text), REQUIRED)
    return float(lam[0]), float(lam[-1])


def _is_spectrum(text: str) -> bool:
    return Path(choice_of(text).path).suffix.lower() in SPECTRA


def _reflectance(text: str) -> dict[str, Any]:
    """Return a reflectance as Mitsuba's dictionary of a spectrum."""
    if _is_spectrum(text):
        lam, value = read_shares(text, REQUIRED)
        if lam[0] > REQUIRED[0] or lam[-1] < REQUIRED[1]:
            raise DiffractionError(
                f"pigment='{text}' is known from {lam[0]:g} to {lam[-1]:g} nm, and light from "
                f"{REQUIRED[0]:g} to {REQUIRED[1]:g} nm needs it; give a longer spectrum"
            )
        if not value.any():
            return {"type": "uniform", "value": 0.0}
        parts = (part.tolist() for part in extended(lam, value))
        return {"type": "spectrum", "value": list(zip(*parts, strict=True))}
    if Path(text).suffix.lower() in PICTURES:
        return {"type": "bitmap", "filename": str(readable_file(text).absolute())}
    if Path(text).suffix.lower() in GLTF:
        return base_colour(readable_file(text), f"pigment='{text}'")
    colour = _colour(text)
    if len(set(colour)) == 1:
        return {"type": "uniform", "value": colour[0]}
    return {"type": "rgb", "value": colour}


def base_colour(file: Path, shown: str, number: int | None = None) -> dict[str, Any]:
    """Return the base colour of a glTF file's material: factor, times a texture if it has one.

    Linear values, as glTF 2.0 (Khronos 2021), section 3.9.2, defines factor and texture; white of
    triangles without a material.

    shown : the file, for messages.
    number : of the material; None takes the only one.
    """
    trimesh = optional("trimesh", shown)
    try:
        meshes = load_gltf(file, shown, materials=True).geometry.values()
    except DiffractionError:
        raise
    except Exception as error:  # whatever the package makes of damaged files
        raise DiffractionError(f"{shown}: cannot be read as glTF") from error
    materials = {id(m): m for mesh in meshes if (m := getattr(mesh.visual, "material", None))}
    own = [m for m in materials.values() if isinstance(m, trimesh.visual.material.PBRMaterial)]
    if number is not None:
        own = [m for m in own if m.name == str(number)]
        if not own:
            return {"type": "rgb", "value": [1.0, 1.0, 1.0]}
    elif len(own) != 1:
        raise DiffractionError(
            f"{shown}: it has {len(own)} materials, and a pigment is one; bake their base "
            "colours into a picture, and give that"
        )
    given = own[0].baseColorFactor
    factor = np.ones(3) if given is None else np.asarray(given)[:3] / 255.0
    picture = own[0].baseColorTexture
    if picture is None:
        return {"type": "rgb", "value": factor.tolist()}
    if picture.format not in FORMATS:
        raise DiffractionError(
            f"{shown}: its picture is none of {', '.join(FORMATS)}; save it as PNG"
        )
    check_content(24.0 * picture.width * picture.height, file.stat().st_size, shown)
    try:
        levels = np.asarray(picture.convert("RGB"))
    except (OSError, ValueError, SyntaxError) as error:
        raise DiffractionError(
            f"{shown}: its picture is damaged: {one_line(str(error))}"
        ) from error
    linear = decode_srgb(levels / 255.0) * factor
    return {"type": "bitmap", "bitmap": mi.Bitmap(linear.astype(np.float32))}


def _colour(text: str) -> list[float]:
    """Return the linear sRGB values of one number, three numbers, or a colour of CSS."""
    try:
        numbers = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        numbers = _css(text)
    if len(numbers) == 1:
        numbers *= 3
    if len(numbers) != 3 or not all(0.0 <= number <= 1.0 for number in numbers):
        raise DiffractionError(
            f"pigment={quoted(text)} is not a colour: give a grey from 0 to 1, 'r,g,b', '#804020', "
            f"a name of CSS such as sienna, a spectrum ({', '.join(SPECTRA)}), a picture "
            f"({', '.join(PICTURES)}) or a mesh with a base colour ({', '.join(GLTF)})"
        )
    return numbers


def _css(text: str) -> list[float]:
    from matplotlib.colors import to_rgb

    try:
        encoded = np.array(to_rgb(text.strip()))
    except ValueError:
        return []
    return [float(x) for x in decode_srgb(encoded)]
