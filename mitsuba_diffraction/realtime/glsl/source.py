"""Shader sources: one body for desktop OpenGL 3.3 and WebGL 2, with a preamble for each.

`rewriting` changes sources for other programs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from ...errors import check_choice
from ...optics.display import VIEWS
from .formulas import formulas
from .methods import METHODS, method_of
from .rewriting import shader_file
from .texels import PAGE

Dialect = Literal["desktop", "web"]

#: Largest number of lights in one draw call.
LIGHTS = 4

_CONSTANTS = {
    "PAGE": str(PAGE), "PAGE_BITS": str(PAGE.bit_length() - 1), "LIGHTS": str(LIGHTS),
    "SURFACE_KIND": "0", "LIGHTS_LIT": "1", "TEXELS": "1", "TAPS_X": "1", "TAPS_Y": "1",
    "COLOUR_CLAMPED": "false", "AXIS_CLAMPED": "false", "MASK_CLAMPED": "false",
    "COLOUR_NEAREST": "false", "AXIS_NEAREST": "false", "MASK_NEAREST": "false",
}  # fmt: skip

_PREAMBLES = {
    "desktop": "#version 330 core\n",
    "web": (
        "#version 300 es\nprecision highp float;\nprecision highp int;\n"
        "precision highp sampler2D;\n"
    ),
}


def vertex_source(dialect: Dialect = "desktop", name: str = "surface.vert") -> str:
    """Return the source of the vertex stage, which all methods share."""
    return _PREAMBLES[dialect] + shader_file(name)


def fragment_parts(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
) -> list[tuple[str, str]]:
    """Return names and texts of the parts of a method's fragment stage, which are to be joined.

    definitions : definitions of the surface, the tables and the light (`Packed.definitions`).
    dialect : "desktop" is GLSL 3.30 core, "web" GLSL ES 3.00.

    Raises a DiffractionError if the method is unknown.
    """
    files = [*surface_files(definitions), "frame.glsl"]
    further = {"SHADOWED": "shadow.glsl", "GLOSS": "gloss.glsl"}
    files += [name for definition, name in further.items() if definition in definitions]
    if "WEIGHTED" in definitions or "LOOKED_UP" in definitions:
        files += ["obstacles.glsl", "surroundings.glsl", "bounces.glsl", "lobes.glsl"]
    return _parts(
        [*files, *method_files(method, definitions), "surface.frag"], definitions, dialect
    )


def _parts(
    files: Sequence[str], definitions: Mapping[str, str], dialect: Dialect
) -> list[tuple[str, str]]:
    """Return names and texts of a preamble with these definitions, and of files."""
    known = _CONSTANTS | dict(definitions)
    lines = [f"#define {name} {value}\n" for name, value in known.items()]
    preamble = _PREAMBLES[dialect] + "".join(lines)
    return [("preamble", preamble), *((name, part(name, known)) for name in files)]


def part(name: str, definitions: Mapping[str, str]) -> str:
    """Return the text of a file, or of `formulas`."""
    if name == "formulas":
        return formulas(definitions)
    packages = (method.package for method in METHODS.values() if name in method.files)
    return shader_file(name, next(packages, ""))


def surface_files(definitions: Mapping[str, str]) -> list[str]:
    """Return the files of a surface that all methods share, which come first."""
    files = ["library.glsl", "formulas", "reflectance.glsl", "boundary.glsl", "layers.glsl"]
    if "ORDERS" in definitions:
        return [*files, "orders.glsl"]
    if "ORDER_0" in definitions:
        files.append("mirror.glsl")
    return [*files, "pair.glsl"] if "DIFFRACTING" in definitions else files


def method_files(method: str, definitions: Mapping[str, str]) -> list[str]:
    """Return the files of a method's `diffraction`."""
    files = method_of(method).files
    if "ORDERS" in definitions:
        return [*files[:-1], "orders_light.glsl"]
    return [*files, *(["diffraction.glsl"] if "DIFFRACTING" in definitions else [])]


def plain_source(
    name: str,
    shared: Sequence[str] = (),
    definitions: Mapping[str, str] | None = None,
    dialect: Dialect = "desktop",
) -> str:
    """Return the source of a stage that depends on neither surfaces nor tables.

    shared : files that it includes, or `formulas`.
    """
    parts = _parts([*shared, name], definitions or {}, dialect)
    return "".join(text for _, text in parts)


def display_definitions(view: str) -> dict[str, str]:
    """Return the definitions with which shaders show light by a view, by `displayed`.

    Raises a DiffractionError if the view is unknown.
    """
    check_choice("view", view, VIEWS)
    return {"DISPLAYED": ""} | ({"NATURAL": ""} if view == "natural" else {})
