"""Export of a scene as one self-contained page of HTML, to a file or a notebook."""

from __future__ import annotations

import base64
import functools
import html
import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...errors import DiffractionError, check_choice
from ...optics.display import VIEWS
from ...progress import Progress, silent
from ..glsl.emitters import Emitters
from ..glsl.methods import CONSUMERS
from ..glsl.rewriting import shader_file
from ..glsl.scene import RealtimeScene, SceneSurface, load, read_scene
from ..glsl.shader_materials import (
    Diffracting,
    ShaderMaterial,
    pack_conservation,
    pack_emission,
    pack_surface,
)
from ..glsl.source import (
    WEB_METHODS,
    display_definitions,
    fragment_parts,
    plain_source,
    vertex_source,
)
from ..glsl.texels import Packed
from .light import packed_light, packed_surroundings
from .material_choices import INDEXED, changeable, packed_materials
from .sections import Sections, packed_array, packed_mesh, packed_parts
from .tables import fitting_tables, strongest_orders

#: Largest size of a page, bytes.
MAX_BYTES = 25_000_000

#: Height scales of the tables for energy conservation, log2 of the factor on the scene's scale.
OCTAVES = (-2.0, -1.5, -1.0, -0.5, 0.0, 0.5)

#: Upper bound of a page's shaders, scripts and styles, bytes.
CODE_BYTES = 200_000

_SCRIPTS = (
    "vectors.js", "data.js", "mesh.js", "camera.js", "light.js", "drawing.js", "shadow.js",
    "surroundings.js", "viewer.js", "link.js", "map.js", "controls.js", "main.js",
)  # fmt: skip


@dataclass(frozen=True)
class Page:
    """Exported page of HTML.

    Attributes
    ----------
    text : source of the page.
    loss : mean and 99th percentile of the ΔE2000 by rounding of the tables, by method.
    left_out : methods that were left out, each with the reason.
    omissions : parts of the scene that are left out or simplified.
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
    view: str = "natural",
    bounces: bool = True,
    progress: Progress = silent,
) -> Page:
    """Build the page of a scene.

    Raises a DiffractionError if nothing in the scene diffracts, a method or the view is unknown, or
    the page would be too large.

    Parameters
    ----------
    scene : a `mi.Scene` of the current variant, or an XML file.
    title : title of the page; by default the file's name.
    methods : methods of `WEB_METHODS`; the page starts with the first, and leaves out the last
        ones where it would have more than 25 MB.
    sensor : index of the camera.
    view : view of the page's picture, one of `optics.display.VIEWS`.
    bounces : add light between surfaces, which takes seconds to trace.
    progress : called as progress(done, total, text).
    """
    unknown = [method for method in methods if method not in WEB_METHODS]
    if unknown or not methods or len(set(methods)) < len(methods):
        raise DiffractionError(
            f"methods={list(methods)!r}: choose from {', '.join(WEB_METHODS)}, each at most once"
        )
    check_choice("view", view, VIEWS)
    if title is None:
        is_file = isinstance(scene, str | os.PathLike)
        title = Path(scene).stem if is_file else "Diffraction"
    header, data = _packed(load(scene), sensor, title, methods, view, bounces, progress)
    text = _filled(header, data)
    if len(text.encode()) > MAX_BYTES:
        raise DiffractionError(
            f"the page would have {len(text.encode()) / 1e6:.1f} MB, more than "
            f"{MAX_BYTES / 1e6:.0f}; use fewer triangles or a smaller coherence_width"
        )
    return Page(text, header["loss"], header["left_out"], tuple(header["omissions"]))


def export_viewer(scene: Any, path: str | os.PathLike[str], **options: Any) -> Page:
    """Write the page of a scene; options and errors as in `make_page`."""
    page = make_page(scene, **options)
    with atomic_path(path) as temporary:
        temporary.write_text(page.text, encoding="utf-8")
    return page


class Viewer:
    """Page of a scene in a cell of a notebook; options and errors as in `make_page`.

    Parameters
    ----------
    scene : a `mi.Scene` of the current variant, or an XML file.
    height : height of the cell, pixels.
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
    """Fill the template of the page."""
    # "</script" would end the element of the header, and "<!--<script" its end
    text = json.dumps(header, ensure_ascii=False).replace("<", "\\u003c")
    parts = {
        "style": _asset("style.css"),
        "script": "\n".join(_asset(name) for name in _SCRIPTS),
        "header": text,
        "data": base64.b64encode(data).decode(),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], _asset("page.html"))


@functools.cache
def _asset(name: str) -> str:
    """Read a file of the page."""
    return resources.files(__package__).joinpath("page", name).read_text(encoding="utf-8")


def _packed(
    loaded: Any,
    sensor: int,
    title: str,
    methods: Sequence[str],
    view: str,
    bounces: bool,
    progress: Progress,
) -> tuple[dict[str, Any], bytes]:
    """Return the page's header, as JSON types, and all arrays and pictures, compressed.

    The last methods are left out if their tables exceed the size of the page.

    The scripts of the page read the header's entries by name:

    light, around : see `light.packed_light` and `light.packed_surroundings`.
    tables : numbers of each table's sections, by method.
    octaves, energy_pages : ends of the slider of height scales, and pages of energy scales.
    background : radiance of the sky, linear sRGB.
    box, subject : corners of the scene, and of what diffracts.
    programs : section of the distinct sources; the page replaces LIGHTS_LIT by its light's
        definitions and appends one of `mains`.
    vertex, shadow, shown : other sources.
    loss, left_out, omissions : see `Page`.
    orders : brightest orders of each table.
    materials : materials that surfaces can be given.
    sections : position and layout of each section.
    surfaces : of each the name; numbers of the sections of its `mesh` and `parts`; whether it
        `emits` light; the scene's `height_scale`, null where nothing diffracts; number of its
        `table`; number of its shader's source by method, `programs`, and the same with one of the
        materials, `named`, empty where it cannot change; number of its `coat` among the materials'
        parts; and whether it is `pigmented`: diffracts over a diffuse base.
    """
    scene = read_scene(loaded, sensor)
    emitters = Emitters(loaded, scene.middle) if loaded.emitters() else None
    sections = Sections()
    packers: dict[int, Diffracting] = {}
    for diffracting in scene.diffracting:
        packers.setdefault(id(diffracting.described.table), diffracting)
    numbers = {key: n for n, key in enumerate(packers)}
    tables = list(packers.values())  # a surface of each table
    stored = []
    for n, surface in enumerate(scene.surfaces):
        progress(n, len(scene.surfaces), f"packing {surface.name}")
        common = _common(surface)
        mesh = packed_mesh(surface.vertices, sections)
        stored.append((common, mesh, packed_parts(common, sections)))
    light = packed_light(scene, emitters, sections)
    coats = sorted(
        {_coat(s.material) for s in scene.surfaces if changeable(s.material.diffraction)}
    )
    materials = packed_materials(coats, sections)
    progress(0, 0, "light between surfaces")
    around, definitions = packed_surroundings(loaded, scene, emitters, tables, sections, bounces)
    room = (MAX_BYTES - CODE_BYTES) // 4 * 3 - sections.nbytes
    shown, packed, left_out = _fitted(methods, tables, room, progress)
    sources: list[str] = []

    def program(method: str, known: dict[str, str]) -> int:
        """Return the number of a shader's source."""
        source = _source(method, {**known, **definitions, "SHADOWED": "", "LIVE": ""})
        if source not in sources:
            sources.append(source)
        return sources.index(source)

    stored_tables, losses = {}, {}
    for method in shown:
        rounded = [packed[method, n] for n in range(len(tables))]
        stored_tables[method] = [packed_parts(t.packed, sections, t.sections) for t in rounded]
        # largest mean and largest 99th percentile
        losses[method] = tuple(map(max, zip(*(table.loss for table in rounded), strict=True)))
    entries = []
    for surface, (common, mesh, parts) in zip(scene.surfaces, stored, strict=True):
        diffraction = surface.material.diffraction
        described = None if diffraction is None else diffraction.described
        number = numbers[id(described.table)] if described else 0
        known = {
            method: {
                **common.definitions,
                **(packed[method, number].packed.definitions if described else {}),
            }
            for method in shown
        }
        given = known if changeable(diffraction) else {}
        entries.append(
            {
                "name": surface.name,
                "mesh": mesh,
                "parts": parts,
                "emits": surface.radiance is not None,
                "height_scale": described.height_scale.number if described else None,
                "table": number,
                "programs": {m: program(m, d) for m, d in known.items()},
                "named": {m: program(m, {**d, **INDEXED}) for m, d in given.items()},
                "coat": coats.index(_coat(surface.material)) if given else 0,
                "pigmented": described is not None and described.nested is not None,
            }
        )
    joined = json.dumps(sources).encode()
    programs = sections.add(packed_array(np.frombuffer(joined, np.uint8)[:, None]))
    data, layouts = sections.joined()
    display = plain_source(
        "shown.frag", ("library.glsl", "formulas"), display_definitions(view), "web"
    )
    header = {
        "title": title,
        "surfaces": entries,
        "light": light,
        "around": around,
        "tables": stored_tables,
        "methods": shown,
        "omissions": _omissions(scene, emitters),
        "background": _zenith(scene.lighting.sky),
        "camera": {
            "to_world": scene.camera.to_world.tolist(),
            "fov": scene.camera.fov,
            "size": list(scene.camera.size),
            "offset": list(scene.camera.offset),
        },
        "box": [scene.low.tolist(), scene.high.tolist()],
        "subject": [x.tolist() for x in scene.subject],
        "programs": programs,
        "mains": {n: shader_file(f"{n}.frag") for n in ("surface", "picked", "map")},
        "vertex": vertex_source("web"),
        "shadow": plain_source("position.frag", dialect="web"),
        "shown": {"vertex": vertex_source("web", "whole.vert"), "fragment": display},
        "loss": losses,
        "left_out": left_out,
        "orders": [strongest_orders(table.described) for table in tables],
        "sections": layouts,
        "octaves": (OCTAVES[0], OCTAVES[-1]),
        "energy_pages": len(OCTAVES),
        "materials": materials,
    }
    return header, data


def _coat(material: ShaderMaterial) -> float:
    """Return the index of a surface's coat, 1 without one."""
    diffraction = material.diffraction
    return (diffraction and diffraction.described.coat) or 1.0


def _common(surface: SceneSurface) -> Packed:
    """Pack a surface without its table; energy conservation at all height scales of the slider."""
    material = surface.material
    packed = pack_surface(material) | pack_emission(surface.radiance)
    return packed | pack_conservation(material, [2.0**n for n in OCTAVES])


def _fitted(
    methods: Sequence[str], tables: Sequence[Diffracting], room: int, progress: Progress
) -> tuple[list[str], Any, dict[str, str]]:
    """Return the methods whose tables fit, their tables, and why others are left out."""
    shown, left_out = list(methods), {}
    for method in methods:
        consumer = CONSUMERS.get(method)
        refusals = [consumer.refusal(surface.described) for surface in tables] if consumer else []
        if reason := next((refusal for refusal in refusals if refusal), None):
            shown.remove(method)
            left_out[method] = reason
    while shown:
        packed = fitting_tables(shown, tables, room, progress)
        if not isinstance(packed, int):
            return shown, packed, left_out
        left_out[shown.pop()] = (
            f"{(packed - room) / 1e6:.1f} MB too large for a page of {MAX_BYTES / 1e6:.0f} MB"
        )
    reasons = "; ".join(f"{method}: {reason}" for method, reason in left_out.items())
    raise DiffractionError(
        f"the scene is too large for a page ({reasons}); use fewer triangles, a smaller "
        "coherence_width, or a shallower surface"
    )


def _source(method: str, definitions: dict[str, str]) -> str:
    """Return a source without its main function; code of surroundings is conditional."""
    parts = dict(fragment_parts(method, definitions, "web")[:-1])
    with_surroundings = fragment_parts(method, {**definitions, "LOOKED_UP": ""}, "web")[:-1]
    further = "".join(text for name, text in with_surroundings if name not in parts)
    conditional = f"#if defined(WEIGHTED) || defined(LOOKED_UP)\n{further}#endif\n"
    return "".join((*parts.values(), conditional))


def _omissions(scene: RealtimeScene, emitters: Emitters | None) -> list[str]:
    """Return the parts of the scene that the page leaves out, in a few words each."""
    omissions = [text for text in scene.omissions if text not in scene.lighting.omissions]
    omissions += [] if emitters is None else emitters.omissions
    return list(dict.fromkeys(omissions))


def _zenith(sky: NDArray[np.float64]) -> list[float]:
    """Return the largest radiance of a sky: at the zenith of a half, the mean of a whole one."""
    slope = np.linalg.norm(sky[1:], axis=0)
    return [float(x) for x in np.maximum(sky[0] + slope, 0.0)]
