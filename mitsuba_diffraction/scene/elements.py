"""Elements of a scene: their names, the surfaces in their BSDFs, and what a shape has to have."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError, counted
from ..plugin.description import Surface, describe
from ..plugin.parameter_changes import children
from ..plugin.textures import is_attribute

#: What `mesh_files.write_ply` calls a field of directions.
ORIENTATION = "vertex_orientation"

#: What Mitsuba's parser gives to elements without an id, numbered.
_UNNAMED = "_unnamed"
# Meshes print the name of their file, plugins that were not given one nothing.
_FILE = re.compile(r'\w*Mesh\[\s*name = "([^"]+)"')
# Mitsuba has no other way to ask a mesh attribute for its name.
_ATTRIBUTE = re.compile(r'name = "([^"]+)"')
# Materials that a line names.
_MOST_SURFACES = 3
_MADE = "make it with the command 'tangents MESH -o FIELD.ply', and use that file"


def name_of(element: Any, number: int | None = None) -> str:
    """An element's id; else its mesh's file, or its kind, and which of the scene's shapes it is.

    Parameters
    ----------
    element : of Mitsuba's, with `id()`.
    number : of a shape, its place in `scene.shapes()`, counted from 0.
    """
    scene_id = own_id(element.id())
    if scene_id:
        return scene_id
    file = _FILE.match(str(element))
    if file:
        kind = f"the mesh {Path(file[1]).name}"
    else:
        words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", element.class_name()).lower()
        kind = f"{'an' if words[:1] in 'aeiou' else 'a'} {words} without id"
    return kind if number is None else f"shape {number + 1} ({kind})"


def own_id(name: str) -> str:
    """Return the id that the scene gives, empty if Mitsuba made it up."""
    return "" if name.startswith(_UNNAMED) else name


def surfaces_text(scene: Any) -> str:
    """Describe the materials of a scene's diffracting surfaces, after "; "; "" without any."""
    found = (s.summary for shape in scene.shapes() for s in surfaces_within(shape.bsdf()))
    first, rest = (texts := list(dict.fromkeys(found)))[:_MOST_SURFACES], texts[_MOST_SURFACES:]
    more = [counted(len(rest), "more material")] if rest else []
    return "".join(f"; {text}" for text in (*first, *more))


def surfaces_within(bsdf: Any) -> list[Surface]:
    """Return the descriptions of all surfaces that diffract within a BSDF, itself included."""
    return [d for part in parts_of(bsdf) if isinstance(d := describe(part), Surface)]


def parts_of(thing: Any) -> Iterator[Any]:
    """Yield an object of Mitsuba's, and everything within it that it shows to `traverse`."""
    if thing is not None:
        yield thing
        for part in children(thing).values():
            yield from parts_of(part)


def check_attributes(shape: Any, name: str) -> None:
    """Refuse a shape that lacks a mesh attribute or the UV coordinates that its BSDF reads.

    Mitsuba's kernels would go on with zeros, which turn no patch and colour nothing, and with UV
    coordinates of each triangle.

    shape, name : `mi.Shape` of the variant that is set, and its name by `name_of`.

    Raises a DiffractionError that names the attribute, and the way to get one of directions.
    """
    surfaces = surfaces_within(shape.bsdf())
    placed = any(surface.coherence == "surface" for surface in surfaces)
    if placed and shape.is_mesh() and not has_texcoords(shape):
        raise DiffractionError(
            f"{name} has no UV coordinates, from which coherence='surface' has places on the "
            "surface; unwrap it, or use coherence='ensemble'"
        )
    stretching = [attribute_of(surface.lateral_scale.texture) for surface in surfaces]
    attributes = [read for part in parts_of(shape.bsdf()) if (read := attribute_of(part))]
    for read in dict.fromkeys(attributes):
        if np.all(shape.has_attribute(read)):
            if read in stretching and (least := np.array(mi.traverse(shape)[read]).min()) <= 0.0:
                raise DiffractionError(
                    f"{name}: lateral_scale reads the attribute {read}, whose least number is "
                    f"{least:g}; factors must be above 0"
                )
            continue
        remedy = _MADE if read == ORIENTATION else "add it to the mesh's file, or correct the name"
        if not shape.is_mesh():
            remedy = "only meshes have any: leave the texture out, or use a mesh"
        raise DiffractionError(f"{name} has no attribute {read}, which its BSDF reads; {remedy}")


def has_texcoords(mesh: Any) -> bool:
    """Return whether the vertices of a `mi.Mesh` have texture coordinates."""
    name = "has_vertex_texcoords"  # Mitsuba 3.10 calls it without "vertex"
    return bool(np.all(getattr(mesh, name if hasattr(mesh, name) else "has_texcoords")()))


def attribute_of(thing: Any) -> str:
    """Return the name of the attribute that a texture reads; empty for anything else."""
    if thing is None or not is_attribute(thing):
        return ""
    match = _ATTRIBUTE.search(str(thing))
    assert match is not None
    return match[1]
