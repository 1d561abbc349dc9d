"""Materials of glTF files by their names: each wanted one becomes a shape of the scene."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import mitsuba as mi

from ..errors import check_choice, warn
from ..files import GLTF, readable_file
from ..gltf import materials_of
from ..plugin.pigment import base_colour
from .surfaces import appended, copied, inner

#: Shape that is put on the stage; these are split.
FITTED = "fitted_mesh"
#: Values of `others`: materials that no surface is put on have the shape's surface, or their own.
OTHERS = ("surface", "own")
#: Properties of a shape that is a part of its file: numbers of its materials, and of the material
#: whose own BSDF it has.
PART, OWN = "_part", "_own"


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
        if len(rest) == len(materials):
            continue
        if others == OTHERS[0]:
            parts = {name: parts[name] for name in parts if name in ids}
            parts |= {props.id(): rest} if rest else {}
        surfaces = inner(state, state.nodes[number], mi.ObjectType.BSDF)
        made = []
        for name, part in parts.items():
            own = others == OTHERS[1] and name not in ids
            made.append(shape := copied(props, FITTED, leave=[*surfaces] if own else ()))
            shape.set_id(name)
            shape[PART] = " ".join(str(material.number) for material in part)
            if own:
                shape[OWN] = part[0].number
        numbers = {name: n for name, n in state.id_to_index.items() if n != number}
        state.nodes[number].props = made[0]  # in place of the whole
        numbers[made[0].id()] = number
        for shape in made[1:]:
            added = appended(state, mi.ObjectType.Shape, shape)
            state.nodes[0].props[f"part_{added.index()}"] = added
            numbers[shape.id()] = added.index()
        state.id_to_index = numbers
    return known


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
        "type": "principled", "base_color": base_colour(file, f"'{file}'", number),
        "metallic": material.metallic, "roughness": material.roughness,
    }  # fmt: skip
    return mi.load_dict({"type": "twosided", "bsdf": principled})
