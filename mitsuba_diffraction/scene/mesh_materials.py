"""Materials of glTF files by their names: each wanted one becomes a shape of the scene."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import mitsuba as mi

from ..errors import check_choice, warn
from ..files import GLTF, readable_file
from ..gltf import GltfMaterial, materials_of
from ..plugin.pigment import base_colour
from .surfaces import appended, copied, inner

#: Shape that is put on the stage; these are split.
FITTED = "fitted_mesh"
#: Values of `others`: materials that no surface is put on have the shape's surface, or their own.
OTHERS = ("surface", "own")
#: Properties of a shape: numbers of the materials of its file that it has, a text with commas; and
#: whether it has the file's own material.
PART, OWN = "materials", "own"


def split_meshes(state: Any, wanted: Collection[str]) -> list[str]:
    """Make shapes of the materials of glTF files that surfaces are put on.

    Ids of the scene go before names of materials.

    state : `mi.parser.ParserState`.
    wanted : ids that surfaces are put on.

    Returns the names of all materials of these files.
    """
    known: list[str] = []
    for number in range(len(state.nodes)):
        props = state.nodes[number].props
        if props.plugin_name() != FITTED or "filename" not in props:
            continue
        others = str(props.get("others", OTHERS[0]))
        check_choice("others", others, OTHERS)
        file = Path(str(mi.file_resolver().resolve(props["filename"])))
        if file.suffix.lower() not in GLTF:
            continue
        materials = materials_of(readable_file(file))
        known += [material.name for material in materials]
        ids = set(wanted) - set(state.id_to_index)
        parts = {m.name: [o for o in materials if o.name == m.name] for m in materials}
        rest = [m for m in materials if m.name not in ids]
        if len(rest) == len(materials) or not ids:
            continue
        if others == OTHERS[0]:
            parts = {name: parts[name] for name in parts if name in ids}
            parts |= {props.id(): rest} if rest else {}
        made = [
            _part(state, number, name, part, others == OTHERS[1] and name not in ids)
            for name, part in parts.items()
        ]
        _put_shapes(state, number, made)
    return known


def _part(state: Any, number: int, name: str, part: list[GltfMaterial], own: bool) -> Any:
    """Return the properties of a shape of some materials of another shape's file.

    own : whether it has the file's material in place of the surface of the whole.
    """
    whole = state.nodes[number]
    surfaces = inner(state, whole, mi.ObjectType.BSDF) if own else ()
    copy = copied(whole.props, whole.props.plugin_name(), leave=[*surfaces])
    if own:
        copy[OWN] = True
    copy[PART] = ",".join(str(material.number) for material in part)
    copy.set_id(name)
    return copy


def _put_shapes(state: Any, number: int, made: list[Any]) -> None:
    """Put several shapes in place of one."""
    ids = {name: n for name, n in state.id_to_index.items() if n != number}
    state.nodes[number].props, ids[made[0].id()] = made[0], number
    for props in made[1:]:
        added = appended(state, mi.ObjectType.Shape, props)
        ids[props.id()] = added.index()
        state.nodes[0].props[f"part_{added.index()}"] = added
    state.id_to_index = ids


def own_bsdf(file: Path, number: int) -> Any:
    """Return the BSDF of a material of a glTF file: base colour, metallic and roughness.

    The textures of metallic and roughness (glTF 2.0, 3.9.2), and all else, are left out with a
    warning.
    """
    material = next(each for each in materials_of(file) if each.number == number)
    if material.left_out:
        warn(
            f"material {material.name!r} of '{file}' is shown without its "
            f"{', '.join(material.left_out)}"
        )
    principled = {
        "type": "principled", "base_color": base_colour(file, f"'{file}'", material.number),
        "metallic": material.metallic, "roughness": material.roughness,
    }  # fmt: skip
    return mi.load_dict({"type": "twosided", "bsdf": principled})
