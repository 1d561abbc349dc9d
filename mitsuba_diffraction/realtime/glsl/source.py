"""Shader sources: one body for desktop OpenGL 3.3 and WebGL 2, with a preamble for each.

`rewriting` changes sources for other programs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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
    "SURFACE_KIND": "0", "LIGHTS_LIT": "1", "TEXELS": "1",
    "COLOUR_CLAMPED": "false", "AXIS_CLAMPED": "false", "MASK_CLAMPED": "false",
    "COLOUR_NEAREST": "false", "AXIS_NEAREST": "false", "MASK_NEAREST": "false",
}  # fmt: skip

#: Files of the surroundings, which lobes look up.
_LOOKED_UP = (
    "#if defined(WEIGHTED) || defined(LOOKED_UP)",
    "obstacles.glsl", "surroundings.glsl", "bounces.glsl", "lobes.glsl",
    "#endif",
)  # fmt: skip

_PREAMBLES = {
    "desktop": "#version 330 core\n",
    "web": (
        "#version 300 es\nprecision highp float;\nprecision highp int;\n"
        "precision highp sampler2D;\n"
    ),
}


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
    further = {"SHADOWED": "shadow.glsl", "GLOSS": "gloss.glsl"}
    files = [*surface_files(definitions), "frame.glsl"]
    files += [name for definition, name in further.items() if definition in definitions]
    files += [*_LOOKED_UP, *method_files(method, definitions), "surface.frag"]
    return source_parts(files, definitions, dialect)


def source_parts(
    files: Sequence[str], definitions: Mapping[str, str] | None = None, dialect: Dialect = "desktop"
) -> list[tuple[str, str]]:
    """Return names and texts of a preamble with these definitions, and of files.

    files : names of files, `formulas` or directives; the last one has the stage's main function.
    """
    known = _CONSTANTS | dict(definitions or {})
    lines = [f"#define {name} {value}\n" for name, value in known.items()]
    preamble = _PREAMBLES[dialect] + "".join(lines)
    return [("preamble", preamble), *((name, part(name, known)) for name in files)]


def part(name: str, definitions: Mapping[str, str]) -> str:
    """Return the text of a file, of `formulas`, or of a directive."""
    if name.startswith("#"):
        return f"{name}\n"
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


def joined(parts: Iterable[tuple[str, str]]) -> str:
    """Return the source of a stage, of the texts of its parts."""
    return "".join(text for _, text in parts)


def web_source(*files: str, definitions: Mapping[str, str] | None = None) -> str:
    """Return the source of a stage for WebGL; parameters as of `source_parts`."""
    return joined(source_parts(files, definitions, "web"))


def display_definitions(view: str) -> dict[str, str]:
    """Return the definitions with which shaders show light by a view, by `displayed`.

    Raises a DiffractionError if the view is unknown.
    """
    check_choice("view", view, VIEWS)
    return {"DISPLAYED": ""} | ({"NATURAL": ""} if view == "natural" else {})
