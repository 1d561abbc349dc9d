"""Whether textures are what a BSDF reads, and a shape has the attributes; BSDFs cannot see it."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from ..errors import DiffractionError
from .names import name_of
from .roles import Texture

#: What `meshes.write_ply` calls a field of directions.
ORIENTATION = "vertex_orientation"

#: Of the plugin's `to_string`, where its windows follow places.
PLACED = "coherence = surface"

_MADE = "make it with 'mitsuba-diffraction tangents MESH -o FIELD.ply', and use that file"
_READ = re.compile(r'MeshAttribute\[\s*name = "([^"]+)"')


def check_attributes(shape: Any, number: int | None = None) -> None:
    """Refuse a shape whose BSDF reads what it lacks: a mesh attribute, or where on it one is.

    Mitsuba's kernels would go on with zeros, which turn no patch and colour nothing, and with UV
    coordinates of each triangle.

    Parameters
    ----------
    shape : `mi.Shape` of the variant that is set.
    number : its place among the scene's shapes, counted from 0, to name one without an id.

    Raises
    ------
    DiffractionError
        Which names the attribute, and how to get one of directions.
    """
    if PLACED in str(shape.bsdf()) and shape.is_mesh() and not shape.has_vertex_texcoords():
        raise DiffractionError(
            f"{name_of(shape, number)} has no UV coordinates, from which coherence='surface' has "
            "places on the surface; unwrap it, or use coherence='ensemble'"
        )
    for name in dict.fromkeys(_READ.findall(str(shape.bsdf()))):
        if np.all(shape.has_attribute(name)):
            continue
        if not shape.is_mesh():
            remedy = "only meshes have any: leave the texture out, or use a mesh"
        else:
            added = "add it to the mesh's file, or correct the name"
            remedy = _MADE if name == ORIENTATION else added
        raise DiffractionError(
            f"{name_of(shape, number)} has no attribute {name}, which its BSDF reads; {remedy}"
        )


def is_bitmap(texture: Texture) -> bool:
    """Whether it is a picture, whose numbers can be looked at."""
    return str(texture).startswith("BitmapTexture[")


def is_attribute(texture: Texture) -> bool:
    """Whether it is a mesh attribute, which has values on that mesh only."""
    return str(texture).startswith("MeshAttribute[")


def require_raw(texture: Texture, parameter: str, meaning: str) -> None:
    """Refuse a picture whose numbers Mitsuba would take for colours.

    Raises
    ------
    DiffractionError
        With the remedy.
    """
    if is_bitmap(texture) and "raw = 1" not in str(texture):
        raise DiffractionError(
            f"{parameter}: the bitmap is not raw, so that Mitsuba takes {meaning} for colours; "
            'add <boolean name="raw" value="true"/> to the texture ("raw": True in Python)'
        )
