"""Shader sources: one body for desktop OpenGL 3.3 and for WebGL 2, with a preamble each."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Literal

from ...errors import DiffractionError
from .texels import PAGE

Dialect = Literal["desktop", "web"]

#: Methods of the fragment stage.
METHODS = ("lut", "spectral", "flss", "nmm", "pq")
#: Those of the 2014 thesis; `thesis.methods` evaluates them in NumPy.
THESIS_METHODS = METHODS[2:]

#: Lights at once.
LIGHTS = 4

_CONSTANTS = {
    "PAGE": str(PAGE), "PAGE_BITS": str(PAGE.bit_length() - 1), "LIGHTS": str(LIGHTS),
    "SURFACE_KIND": "0", "LIGHTS_LIT": "1",
}  # fmt: skip

_PREAMBLES = {
    "desktop": "#version 330 core\n",
    "web": (
        "#version 300 es\nprecision highp float;\nprecision highp int;\n"
        "precision highp sampler2D;\nprecision highp usampler2D;\n"
    ),
}


@functools.cache
def shader_file(name: str) -> str:
    """The text of one of the shaders' files."""
    return resources.files(__package__).joinpath("shaders", name).read_text(encoding="utf-8")


def vertex_source(dialect: Dialect = "desktop", name: str = "surface.vert") -> str:
    """The vertex stage, the same for all methods."""
    return _PREAMBLES[dialect] + shader_file(name)


def fragment_source(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> str:
    """The fragment stage of a method.

    Parameters
    ----------
    method : one of `METHODS`.
    definitions : what the surface and the tables ask for (`Packed.definitions`).
    dialect : "desktop" is GLSL 3.30 core, "web" GLSL ES 3.00.
    main : the file with the main function.

    Raises
    ------
    DiffractionError
        If there is no such method.
    """
    return "".join(text for _, text in fragment_parts(method, definitions, dialect, main))


def fragment_parts(
    method: str,
    definitions: Mapping[str, str],
    dialect: Dialect = "desktop",
    main: str = "surface.frag",
) -> list[tuple[str, str]]:
    """The names and texts that `fragment_source` joins; parameters and errors as there."""
    if method not in METHODS:
        raise DiffractionError(f"method={method!r} is unknown; choose one of {', '.join(METHODS)}")
    constants = _CONSTANTS | dict(definitions)
    lines = [f"#define {name} {value}\n" for name, value in constants.items()]
    parts = [("preamble", _PREAMBLES[dialect] + "".join(lines))]
    shared = ["library.glsl", "boundary.glsl"]
    if method in THESIS_METHODS:
        shared.append("taylor.glsl")
    if "SHADOWED" in constants:
        shared.append("shadow.glsl")
    shared.append("layers.glsl")
    if "GLOSS" in constants:
        shared.append("gloss.glsl")
    if "WEIGHTED" in constants or "LOOKED_UP" in constants:
        shared += ["obstacles.glsl", "surroundings.glsl", "lobes.glsl"]
    shared.append(f"{method}.glsl")
    if "DIFFRACTING" in constants:
        shared.append("diffraction.glsl")
    return parts + [(name, shader_file(name)) for name in (*shared, main)]


def plain_source(
    name: str,
    shared: Sequence[str] = (),
    definitions: Mapping[str, str] | None = None,
    dialect: Dialect = "desktop",
) -> str:
    """A stage that knows neither surfaces nor tables.

    shared : files that it uses.
    """
    constants = _CONSTANTS | dict(definitions or {})
    lines = [f"#define {key} {value}\n" for key, value in constants.items()]
    return _PREAMBLES[dialect] + "".join((*lines, *map(shader_file, shared), shader_file(name)))
