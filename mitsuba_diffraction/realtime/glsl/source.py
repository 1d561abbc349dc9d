"""Shader sources: one body for desktop OpenGL 3.3 and WebGL 2, with a preamble for each.

`rewriting` changes sources for other programs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from ...errors import check_choice
from ...optics.display import VIEWS
from .formulas import formulas
from .rewriting import shader_file
from .texels import PAGE

Dialect = Literal["desktop", "web"]

#: Methods of the fragment stage.
METHODS = ("fast", "exact", "flss", "nmm", "pq")
#: Methods of the 2014 thesis; `thesis.methods` evaluates them in NumPy.
THESIS_METHODS = METHODS[2:]

#: Largest number of lights in one draw call.
LIGHTS = 4

_CONSTANTS = {
    "PAGE": str(PAGE), "PAGE_BITS": str(PAGE.bit_length() - 1), "LIGHTS": str(LIGHTS),
    "SURFACE_KIND": "0", "LIGHTS_LIT": "1", "TEXELS": "1", "TAPS_X": "1", "TAPS_Y": "1",
}  # fmt: skip

_PREAMBLES = {
    "desktop": "#version 330 core\n",
    "web": (
        "#version 300 es\nprecision highp float;\nprecision highp int;\n"
        "precision highp sampler2D;\nprecision highp usampler2D;\n"
    ),
}


def vertex_source(dialect: Dialect = "desktop", name: str = "surface.vert") -> str:
    """Return the source of the vertex stage, which all methods share."""
    return _PREAMBLES[dialect] + shader_file(name)


def fragment_source(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> str:
    """Return the source of a method's fragment stage.

    definitions : definitions of the surface, the tables and the light (`Packed.definitions`).
    dialect : "desktop" is GLSL 3.30 core, "web" GLSL ES 3.00.
    main : file with the main function.

    Raises a DiffractionError if the method is unknown.
    """
    return "".join(text for _, text in fragment_parts(method, definitions, dialect, main))


def fragment_parts(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> list[tuple[str, str]]:
    """Return names and texts of the parts of `fragment_source`; parameters and errors as there."""
    check_choice("method", method, METHODS)
    known = _CONSTANTS | dict(definitions)
    lines = [f"#define {name} {value}\n" for name, value in known.items()]
    parts = [("preamble", _PREAMBLES[dialect] + "".join(lines))]
    shared = ["library.glsl", "formulas", "reflectance.glsl", "frame.glsl", "boundary.glsl"]
    if method in THESIS_METHODS:
        shared.append("taylor.glsl")
    if "SHADOWED" in known:
        shared.append("shadow.glsl")
    shared.append("layers.glsl")
    if "SECOND_ORDER" in known:
        shared.append("second_order.glsl")
    if "ORDERS" in known:
        shared.append("orders.glsl")
    elif "DIFFRACTING" in known:
        shared.append("pair.glsl")
    if "GLOSS" in known:
        shared.append("gloss.glsl")
    if "WEIGHTED" in known or "LOOKED_UP" in known:
        shared += ["obstacles.glsl", "surroundings.glsl", "bounces.glsl", "lobes.glsl"]
    shared += method_files(method, known)
    return parts + [(name, part(name, known)) for name in (*shared, main)]


def part(name: str, definitions: Mapping[str, str]) -> str:
    """Return the text of a file, or of `formulas`."""
    return formulas(definitions) if name == "formulas" else shader_file(name)


def method_files(method: str, definitions: Mapping[str, str]) -> list[str]:
    """Return the files of a method's `diffraction`."""
    files = ["responses.glsl"] if method == "exact" else []
    if "ORDERS" in definitions:
        return [*files, "orders_light.glsl"]
    files.append(f"{method}.glsl")
    return [*files, "diffraction.glsl"] if "DIFFRACTING" in definitions else files


def plain_source(
    name: str,
    shared: Sequence[str] = (),
    definitions: Mapping[str, str] | None = None,
    dialect: Dialect = "desktop",
) -> str:
    """Return the source of a stage that depends on neither surfaces nor tables.

    shared : files that it includes, or `formulas`.
    """
    known = _CONSTANTS | dict(definitions or {})
    lines = [f"#define {key} {value}\n" for key, value in known.items()]
    return _PREAMBLES[dialect] + "".join((*lines, *(part(n, known) for n in (*shared, name))))


def display_definitions(view: str) -> dict[str, str]:
    """Return the definitions with which shaders show light by a view, by `displayed`.

    Raises a DiffractionError if the view is unknown.
    """
    check_choice("view", view, VIEWS)
    return {"DISPLAYED": ""} | ({"NATURAL": ""} if view == "natural" else {})
