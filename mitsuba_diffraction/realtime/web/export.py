"""A scene as one self-contained page of HTML: in a file, or in a notebook."""

from __future__ import annotations

import base64
import functools
import html
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...errors import DiffractionError
from ...progress import Progress, silent
from ...tables.table import DiffractionTable
from ..glsl.emitters import Emitters
from ..glsl.materials import (
    Material,
    height_scale,
    pack_conservation,
    pack_emission,
    pack_relief,
    pack_surface,
)
from ..glsl.scene import RealtimeScene, box_of, load, read_scene
from ..glsl.source import fragment_parts, fragment_source, plain_source, shader_file, vertex_source
from ..glsl.texels import Packed
from .light import packed_light, packed_surroundings
from .sections import Sections, packed_mesh, packed_parts, sections_of
from .tables import WEB_METHODS, fitting_tables, strongest_orders

#: Largest page, bytes.
MAX_BYTES = 25_000_000

#: What conserves energy is at height scales 2^n of the scene's own.
OCTAVES = (-2.0, -1.5, -1.0, -0.5, 0.0, 0.5)

_HEADER = 200_000  # bytes for shaders, script and style, generously

_SCRIPTS = (
    "vectors.js", "data.js", "mesh.js", "camera.js", "light.js", "drawing.js", "shadow.js",
    "surroundings.js", "viewer.js", "link.js", "map.js", "controls.js", "main.js",
)  # fmt: skip


@dataclass(frozen=True)
class Page:
    """A page of HTML.

    Attributes
    ----------
    text : all of it.
    loss : mean and 99th percentile of ΔE2000 that rounding the tables makes, by method.
    left_out : methods that did not fit, each with the reason.
    omissions : what of the scene is not shown.
    """

    text: str
    loss: dict[str, tuple[float, float]]
    left_out: dict[str, str] = field(default_factory=dict)
    omissions: tuple[str, ...] = ()


def make_page(
    scene: Any,
    *,
    title: str | None = None,
    methods: Sequence[str] = WEB_METHODS,
    sensor: int = 0,
    progress: Progress = silent,
) -> Page:
    """The page of a scene.

    Parameters
    ----------
    scene : a `mi.Scene` of the variant that is set, or an XML file.
    title : by default the file's name.
    methods : of `WEB_METHODS`; the first is shown first, and the last is left out first if the
        page would have more than 25 MB.
    sensor : index of the camera.
    progress : is told what is done.

    Raises
    ------
    DiffractionError
        If nothing in the scene diffracts, a method is unknown, or the scene does not fit.
    """
    unknown = [method for method in methods if method not in WEB_METHODS]
    if unknown or not methods or len(set(methods)) < len(methods):
        raise DiffractionError(
            f"methods={list(methods)!r}: choose from {', '.join(WEB_METHODS)}, each at most once"
        )
    if title is None:
        named = isinstance(scene, str | os.PathLike)
        title = Path(scene).stem if named else "Diffraction"
    header, data = _packed(load(scene), sensor, title, methods, progress)
    text = _filled(header, data)
    if len(text.encode()) > MAX_BYTES:
        raise DiffractionError(
            f"the page would have {len(text.encode()) / 1e6:.1f} MB, more than "
            f"{MAX_BYTES / 1e6:.0f}; use fewer triangles or a smaller coherence_width"
        )
    return Page(text, header["loss"], header["left_out"], tuple(header["omissions"]))


def export_viewer(scene: Any, path: str | os.PathLike[str], **options: Any) -> Page:
    """Write the page of a scene; arguments as of `make_page`, errors too."""
    page = make_page(scene, **options)
    with atomic_path(path) as temporary:
        temporary.write_text(page.text, encoding="utf-8")
    return page


class Viewer:
    """The page of a scene in a cell of a notebook; arguments and errors as of `make_page`.

    Parameters
    ----------
    scene : a `mi.Scene` of the variant that is set, or an XML file.
    height : of the cell, pixels.
    """

    def __init__(self, scene: Any, *, height: int = 520, **options: Any) -> None:
        self.height = height
        self.page = make_page(scene, **options)

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.page.text)}" sandbox="allow-scripts '
            'allow-downloads" style="width: 100%; border: 0; border-radius: 8px" '
            f'height="{self.height}"></iframe>'
        )


def _filled(header: dict[str, Any], data: bytes) -> str:
    """The page with everything in it."""
    parts: dict[str, Callable[[], str]] = {
        "style": lambda: _asset("style.css"),
        "script": lambda: "\n".join(_asset(name) for name in _SCRIPTS),
        # "</script" would end the element, and "<!--<script" its end
        "header": lambda: json.dumps(header, ensure_ascii=False).replace("<", "\\u003c"),
        "data": lambda: base64.b64encode(data).decode(),
    }
    pieces = []
    for n, piece in enumerate(_asset("page.html").replace("}}", "{{").split("{{")):
        pieces.append(parts[piece]() if n % 2 else piece)
    return "".join(pieces)


@functools.cache
def _asset(name: str) -> str:
    return resources.files(__package__).joinpath("page", name).read_text(encoding="utf-8")


def _packed(
    loaded: Any, sensor: int, title: str, methods: Sequence[str], progress: Progress
) -> tuple[dict[str, Any], bytes]:
    """The page's header, as JSON, and all arrays and pictures, compressed.

    Methods whose tables do not fit are left out, from the last on.
    """
    scene = read_scene(loaded, sensor)
    emitters = Emitters(loaded, scene.middle) if loaded.emitters() else None
    sections = Sections()
    tables: list[DiffractionTable] = []
    materials: list[Material] = []
    surfaces = []
    for number, surface in enumerate(scene.surfaces):
        progress(number, len(scene.surfaces), f"packing {surface.name}")
        material = surface.material
        # at all height scales that the slider offers
        common = pack_surface(material) | pack_relief(material) | pack_emission(surface.radiance)
        common |= pack_conservation(material, [2.0**n for n in OCTAVES])
        entry: dict[str, Any] = {
            "name": surface.name,
            "mesh": sections_of(packed_mesh(surface.vertices), sections.add),
            "parts": packed_parts(common, sections),
            "emits": surface.radiance is not None,
        }
        if material.bsdf is not None:
            entry["height_scale"] = height_scale(material)
            if not any(material.table is t for t in tables):
                tables.append(material.table)
                materials.append(material)
            entry["table"] = next(n for n, t in enumerate(tables) if t is material.table)
        surfaces.append((entry, common))
    light = packed_light(scene, emitters, sections)
    around, definitions = packed_surroundings(loaded, scene, emitters, materials, sections)

    room = (MAX_BYTES - _HEADER) // 4 * 3 - sections.nbytes
    shown, packed, left_out = _fitted(methods, tables, room, progress)
    header: dict[str, Any] = {
        "title": title,
        "surfaces": [entry for entry, _ in surfaces],
        "light": light,
        "around": around,
        "tables": {
            method: [
                packed_parts(packed[method, n].packed, sections, packed[method, n].sections)
                for n in range(len(tables))
            ]
            for method in shown
        },
        "methods": shown,
        "octaves": [OCTAVES[0], OCTAVES[-1]],
        "energy_pages": len(OCTAVES),
        "omissions": _omissions(scene, emitters),
        "background": _zenith(scene.lighting.sky),
        "camera": {
            "to_world": scene.camera.to_world.tolist(),
            "fov": scene.camera.fov,
            "size": list(scene.camera.size),
            "offset": list(scene.camera.offset),
        },
        "box": [scene.low.tolist(), scene.high.tolist()],
        "subject": [x.tolist() for x in box_of([s.vertices[:, :3] for s in scene.diffracting])],
    }
    _add_programs(header, surfaces, shown, packed, definitions)
    header["loss"] = {
        method: _worst([packed[method, n].loss for n in range(len(tables))]) for method in shown
    }
    header["left_out"] = left_out
    header["orders"] = [strongest_orders(table) for table in tables]
    data, header["sections"] = sections.joined()
    return header, data


def _fitted(
    methods: Sequence[str], tables: Sequence[DiffractionTable], room: int, progress: Progress
) -> tuple[list[str], Any, dict[str, str]]:
    """Methods whose tables fit, the tables, and why the others are not there."""
    shown, left_out = list(methods), {}
    if "spectral" in shown and any(table.grid.coherent for table in tables):
        shown.remove("spectral")
        left_out["spectral"] = "orders interfere with coherence='patch', which it cannot add up"
    while shown:
        packed = fitting_tables(shown, tables, room, progress)
        if not isinstance(packed, int):
            return shown, packed, left_out
        left_out[shown.pop()] = (
            f"{(packed - room) / 1e6:.1f} MB too much for a page of {MAX_BYTES / 1e6:.0f} MB"
        )
    reasons = "; ".join(f"{method}: {reason}" for method, reason in left_out.items())
    raise DiffractionError(
        f"the scene does not fit into a page ({reasons}); use fewer triangles, a smaller "
        "coherence_width, or a shallower surface"
    )


def _worst(losses: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return max(mean for mean, _ in losses), max(most for _, most in losses)


def _add_programs(
    header: dict[str, Any],
    surfaces: Sequence[tuple[dict[str, Any], Packed]],
    methods: Sequence[str],
    packed: Any,
    around: dict[str, str],
) -> None:
    """The shaders, each once, and which surface is drawn with which.

    The page puts what it knows of the light where LIGHTS_LIT is defined, and appends one of the
    main functions.

    around : definitions of what surrounds the scene.
    """
    sources: list[str] = []
    for entry, common in surfaces:
        # what does not diffract is drawn by any of the programs
        table = entry.setdefault("table", 0)
        entry["programs"] = {}
        for method in methods:
            tables = packed[method, table].packed.definitions
            source = _source(method, {**common.definitions, **tables, **around, "SHADOWED": ""})
            if source not in sources:
                sources.append(source)
            entry["programs"][method] = sources.index(source)
    header["programs"] = sources
    header["mains"] = {
        main: shader_file(f"{file}.frag")
        for main, file in (("surface", "surface"), ("picked", "picked"), ("map", "map"))
    }
    header["vertex"] = vertex_source("web")
    header["shadow"] = plain_source("position.frag", dialect="web")
    whole = fragment_source(
        methods[0], packed[methods[0], 0].packed.definitions, "web", "shown.frag"
    )
    header["shown"] = {"vertex": vertex_source("web", "whole.vert"), "fragment": whole}


def _source(method: str, definitions: dict[str, str]) -> str:
    """All but the main function, with what looks up surroundings only where that is asked for."""
    parts = dict(fragment_parts(method, definitions, "web")[:-1])
    looked_up = fragment_parts(method, {**definitions, "LOOKED_UP": ""}, "web")[:-1]
    more = "".join(text for name, text in looked_up if name not in parts)
    within = f"#if defined(WEIGHTED) || defined(LOOKED_UP)\n{more}#endif\n"
    return "".join((*parts.values(), within))


def _omissions(scene: RealtimeScene, emitters: Emitters | None) -> list[str]:
    """What the page does not show: of emitters only what the sequence of lights leaves out."""
    found = [text for text in scene.omissions if text not in scene.lighting.omissions]
    found += [] if emitters is None else emitters.omissions
    return list(dict.fromkeys(found))


def _zenith(sky: NDArray[np.float64]) -> list[float]:
    """The brightest of a sky: its own where it lights one half, the mean where it is all around."""
    slope = np.linalg.norm(sky[1:], axis=0)
    return [float(x) for x in np.maximum(sky[0] + slope, 0.0)]
