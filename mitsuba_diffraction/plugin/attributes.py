"""Whether a shape has the mesh attributes that its BSDF reads; the BSDF itself cannot see it."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from ..errors import DiffractionError
from .names import name_of

#: What `meshes.write_ply` calls a field of directions.
ORIENTATION = "vertex_orientation"

_MADE = "make it with 'mitsuba-diffraction tangents MESH -o FIELD.ply', and use that file"
_READ = re.compile(r'MeshAttribute\[\s*name = "([^"]+)"')


def check_attributes(shape: Any, number: int | None = None) -> None:
    """Refuse a shape whose BSDF reads a mesh attribute that it lacks.

    Mitsuba's kernels would go on with zeros, which turn no patch and colour nothing.

    Parameters
    ----------
    shape : `mi.Shape` of the variant that is set.
    number : its place among the scene's shapes, counted from 0, to name one without an id.

    Raises
    ------
    DiffractionError
        Which names the attribute, and how to get one of directions.
    """
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
