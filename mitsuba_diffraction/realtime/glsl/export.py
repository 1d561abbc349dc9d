"""Export of a surface's shader to other programs: GLSL, textures, constants and an example."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from ...atomic import atomic_path, make_folder
from ...plugin.description import Consumer, Feature, Surface
from ...tables import write_channels
from .diffracting import pack_table, words_of
from .features import GLSL
from .maps import Map
from .methods import check_methods
from .packing import pack_responses
from .rewriting import global_names, renamed, shader_file
from .shader_materials import ShaderMaterial, pack_surface
from .source import method_files, part, surface_files
from .texels import PAGE, Packed, Texture, four_channels, plain

#: Methods that can be exported, and the names of their functions.
EXPORTED = {"fast": "diffraction", "exact": "diffraction_exact"}

#: Features that an exported shader has; orientation and base are left to the program that draws.
SHADER = Consumer(
    "an exported shader",
    GLSL.shows - {Feature.MIX, Feature.VARYING_LENGTH},
    "export the surface without, or render it with Mitsuba",
    {Feature.MIX: "export its surfaces one by one",
     Feature.CROSSED: "render it with Mitsuba",
     Feature.VARYING_LENGTH: "export one with a number for each period"},
)  # fmt: skip

_PREFIX = "md_"
_HEAD = """// Diffraction of a measured surface, made by mitsuba_diffraction {version}: {surface}.
//
//   {functions}
//
// return f·cosθ_o, 1/sr, in linear sRGB under daylight: radiance towards wi for each unit of
// irradiance (of a surface that faces the light) from wo. Both are unit vectors away from the
// surface in its tangent frame: x along dp/du, y = cross(normal, x), z the normal; wi towards
// the eye, wo towards the light. Zero unless both have z > 0.
//
//   vec3 diffraction_transmission(vec3 wi, vec3 wo)
//
// is the share of light that passes the surface twice, to a diffuse base and back: multiply the
// base's radiance by it.
// Uniforms: constants.json. GLSL ES 3.00 (precision highp float, int and sampler2D) or GLSL 3.30.
"""
_ENTRY = """
vec3 {name}(vec3 wi, vec3 wo)
{{
    if (min(wi.z, wo.z) <= 0.0) return vec3(0.0);
    return {prefix}diffraction(wi, wo, vec2({stretch:.9g}, 0.0), 0);
}}
"""
_BENEATH = f"""
vec3 diffraction_transmission(vec3 wi, vec3 wo)
{{
    wi.z = max(wi.z, {_PREFIX}LOWEST);
    wo.z = max(wo.z, {_PREFIX}LOWEST);
    return {_PREFIX}transmission(wi, wo, vec2(1.0, 0.0));
}}
"""


@dataclass(frozen=True)
class Shader:
    """Shader of a surface for other programs.

    Attributes
    ----------
    code : source in GLSL.
    uniforms : values of the uniforms, by name.
    textures : textures, named like their samplers.
    functions : names of the functions in `code`, by method.
    surface : description of the surface in a few words.
    coherence_width : 4σ of the mirror lobe's amplitude window, µm.
    """

    code: str
    uniforms: dict[str, Any]
    textures: tuple[Texture, ...]
    functions: dict[str, str]
    surface: str
    coherence_width: float

    def constants(self) -> dict[str, Any]:
        """Return functions, uniforms and textures for a program, as JSON types."""
        return {
            "generator": f"mitsuba_diffraction {version('mitsuba_diffraction')}",
            "surface": self.surface,
            "coherence_width": self.coherence_width,
            "functions": self.functions,
            "uniforms": self.uniforms,
            "textures": {
                t.name: {
                    "file": f"{t.name}.exr",
                    "width": t.data.shape[1], "height": t.data.shape[0],
                    "type": "half" if t.data.dtype.itemsize == 2 else "float",
                    "filter": "linear" if t.smooth else "nearest",
                    "wrap": "repeat" if t.smooth else "clamp",
                }
                for t in self.textures
            },
        }  # fmt: skip


def make_shader(bsdf: Any, methods: Sequence[str] = tuple(EXPORTED)) -> Shader:
    """Build the shader of a surface.

    Raises a DiffractionError if the BSDF does not diffract or has features that the shaders lack, a
    method is unknown, or a method does not support the table.

    Parameters
    ----------
    bsdf : BSDF of the plugin `diffraction` or `diffraction_orders`, from `mi.load_dict`; the base
        beneath it and its orientation are left to the program that draws.
    methods : methods of `EXPORTED`, each at most once.
    """
    described = SHADER.described(bsdf)
    check_methods(methods, EXPORTED)
    common = pack_surface(ShaderMaterial(Map(np.zeros(3)), described))
    constants = {"PAGE": str(PAGE), "PAGE_BITS": str(PAGE.bit_length() - 1), "SURFACE_KIND": "0"}
    common |= Packed(definitions={**constants, **common.definitions})
    tables = {method: pack_table(described, method) for method in methods}
    if "exact" in tables:
        tables["exact"] |= pack_responses([(np.array([360.0, 830.0]), np.ones(2))])
    return _joined(common, tables, described, words_of(described))


def export_shader(
    bsdf: Any, folder: str | Path, methods: Sequence[str] = tuple(EXPORTED)
) -> Shader:
    """Write the shader of a surface into a folder, with an example; see `make_shader`.

    The folder is created if it does not exist; existing files are replaced.

    Raises a DiffractionError as `make_shader` does, or if the folder cannot be written.
    """
    folder = Path(folder)
    make_folder(folder)
    shader = make_shader(bsdf, methods)
    for texture in shader.textures:
        # the first line of the file is the texture's last row
        write_channels(folder / f"{texture.name}.exr", {"RGBA": texture.data[::-1]})
    texts = {
        "diffraction.glsl": shader.code,
        "constants.json": json.dumps(shader.constants(), indent=1, ensure_ascii=False) + "\n",
        **{name: shader_file(f"../three/{name}") for name in ("diffraction.js", "example.html")},
    }
    for name, text in texts.items():
        with atomic_path(folder / name) as path:
            path.write_text(text, encoding="utf-8")
    return shader


def _joined(common: Packed, tables: dict[str, Packed], described: Surface, words: str) -> Shader:
    """Join the shared source with each method's, under prefixed names."""
    stretch = described.lateral_scale.number
    shared_by_all = dict(set.intersection(*(set(t.definitions.items()) for t in tables.values())))
    definitions = {**common.definitions, **shared_by_all}
    constants = [f"#define {name} {value}\n" for name, value in definitions.items()]
    files = [part(name, definitions) for name in surface_files(definitions)]
    shared = "".join(constants) + "\n".join(files)
    names = global_names(shared)
    code = [renamed(shared, [(_PREFIX, names)])]
    declared = _declared(common, _PREFIX, names)
    for method, packed in tables.items():
        prefix = f"{_PREFIX}{method}_"
        text = "\n".join(map(shader_file, method_files(method, definitions)))
        own = {n: v for n, v in packed.definitions.items() if n not in definitions}
        text = "".join(f"#define {n} {v}\n" for n, v in own.items()) + text
        text += "".join(f"\n#undef {n}" for n in own)
        method_names = global_names(text)
        text = renamed(text, [(_PREFIX, names), (prefix, method_names)])
        code.append(text + _ENTRY.format(name=EXPORTED[method], prefix=prefix, stretch=stretch))
        declared |= _declared(packed, prefix, method_names) | _declared(packed, _PREFIX, names)
    functions = {method: EXPORTED[method] for method in tables}
    head = _HEAD.format(
        version=version("mitsuba_diffraction"), surface=words,
        functions="\n//   ".join(f"vec3 {name}(vec3 wi, vec3 wo)" for name in functions.values()),
    )  # fmt: skip
    text = f"{head}\n" + "".join(code) + _BENEATH
    textures = {texture.name: texture for texture in declared.textures}  # methods share some
    width = stretch * described.coherence_width
    return Shader(text, dict(declared.uniforms), tuple(textures.values()), functions, words, width)


def _declared(packed: Packed, prefix: str, names: set[str]) -> Packed:
    """Return the textures and uniforms among global `names`, under prefixed names."""
    samplers = [t for t in packed.textures if t.name in names]
    uniforms = {prefix + n: plain(value) for n, value in packed.uniforms.items() if n in names}
    textures = tuple(Texture(prefix + t.name, four_channels(t.data), t.smooth) for t in samplers)
    return Packed(textures, uniforms)
