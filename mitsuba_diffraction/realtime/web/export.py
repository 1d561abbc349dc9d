"""Export of a scene as one self-contained page of HTML, to a file or a notebook."""

from __future__ import annotations

import base64
import html
import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...errors import DiffractionError, check_choice
from ...optics.display import VIEWS
from ...plugin.description import Surface
from ...progress import Progress, showing, silent, tracked
from ..glsl.methods import WEB_METHODS, check_methods, refusal
from ..glsl.packed_scene import PackedScene, PackedSurface
from ..glsl.rewriting import shader_file
from ..glsl.source import display_definitions, fragment_parts, joined, web_source
from .light import packed_light, packed_surroundings
from .material_choices import INDEXED, packed_materials
from .sections import Sections, packed_array, packed_mesh, packed_parts
from .tables import DIGITS, strongest_orders, web_table

#: Largest size of a page, bytes.
MAX_BYTES = 25_000_000

#: Height scales of the tables for energy conservation, log2 of the factor on the scene's scale; a
#: page has those that its tables serve.
OCTAVES = (-2.0, -1.5, -1.0, -0.5, 0.0, 0.5)

#: Upper bound of a page's shaders, scripts and styles, bytes.
CODE_BYTES = 200_000

_SCRIPTS = (
    "vectors.js", "data.js", "mesh.js", "camera.js", "light.js", "drawing.js", "shadow.js",
    "viewer.js", "link.js", "map.js", "controls.js", "main.js",
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
    check_methods(methods, WEB_METHODS)
    check_choice("view", view, VIEWS)
    if title is None:
        is_file = isinstance(scene, str | os.PathLike)
        title = Path(scene).stem if is_file else "Diffraction"
    progress(0, 0, "reading the scene")
    with showing(progress):
        packed = PackedScene(scene, sensor, OCTAVES)
        writer = _Writer(packed, bounces, progress)
    header, data = writer.written(title, methods, view, progress)
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

    def file(name: str) -> str:
        """Read a file of the page."""
        return shader_file(f"page/{name}", __package__)

    # "</script" would end the element of the header, and "<!--<script" its end
    text = json.dumps(header, ensure_ascii=False).replace("<", "\\u003c")
    parts = {
        "style": file("style.css"),
        "script": "\n".join(map(file, _SCRIPTS)),
        "header": text,
        "data": base64.b64encode(data).decode(),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], file("page.html"))


class _Table(NamedTuple):
    """Rounded table for a method: its sections and definitions, and loss as of `web_table`."""

    parts: dict[str, Any]
    definitions: Mapping[str, str]
    loss: tuple[float, float]


class _Writer:
    """Header of a page, as JSON types that its scripts read by name, and its data.

    Each method writes the entries of the header that it returns.
    """

    def __init__(self, packed: PackedScene, bounces: bool, progress: Progress) -> None:
        self._packed, self._sections = packed, Sections()
        self._sources: list[str] = []
        self._surfaces = [
            {
                "mesh": packed_mesh(surface.scene.vertices, self._sections),
                "parts": packed_parts(surface.packed, self._sections),
            }
            for surface in tracked(packed.surfaces, progress, "packing surfaces")
        ]
        self._light = packed_light(packed, self._sections)
        self._coats = sorted({coat for s in packed.surfaces if (coat := _coat(s)) is not None})
        self._materials = packed_materials(self._coats, self._sections)
        self._around, self._around_definitions = packed_surroundings(
            packed, self._sections, bounces, progress
        )

    def written(
        self, title: str, methods: Sequence[str], view: str, progress: Progress
    ) -> tuple[dict[str, Any], bytes]:
        """Return the whole header, and all arrays and pictures, compressed.

        The last methods are left out if their tables exceed the size of the page.
        """
        fitted, left_out = self._fitted(methods, progress)
        scene = self._packed.scene
        header: dict[str, Any] = {
            "title": title,
            "methods": list(fitted),
            "left_out": left_out,
            "omissions": _omissions(self._packed),
            "light": self._light,
            "around": self._around,
            "materials": self._materials,
            # ends of the slider of height scales, and pages of energy scales
            "octaves": (self._packed.octaves[0], self._packed.octaves[-1]),
            "energy_pages": len(self._packed.octaves),
            "tables": {method: [t.parts for t in tables] for method, tables in fitted.items()},
            "loss": {m: tuple(np.max([t.loss for t in tables], axis=0).tolist())
                     for m, tables in fitted.items()},
            "orders": [strongest_orders(described) for described in self._packed.diffracting],
            "surfaces": [self._surface(*pair, fitted)
                         for pair in zip(self._packed.surfaces, self._surfaces, strict=True)],
            **_shaders(view),
            "camera": {
                "to_world": scene.camera.to_world.tolist(), "fov": scene.camera.fov,
                "size": scene.camera.size, "offset": scene.camera.offset,
            },
            "box": [scene.low.tolist(), scene.high.tolist()],
            "subject": [x.tolist() for x in scene.subject],
            "background": _zenith(scene.lighting.sky),
        }  # fmt: skip
        sources = np.frombuffer(json.dumps(self._sources).encode(), np.uint8)
        header["programs"] = self._sections.add(packed_array(sources[:, None]))
        data, header["sections"] = self._sections.joined()
        return header, data

    def _fitted(
        self, methods: Sequence[str], progress: Progress
    ) -> tuple[dict[str, list[_Table]], dict[str, str]]:
        """Round the tables of all methods to as many digits as fit into the page, and store them.

        Returns the tables of each method that is shown, and why others are left out.
        """
        diffracting, others = self._packed.diffracting, self._sections
        left_out = {
            method: refusals[0]
            for method in methods
            if (refusals := [r for s in diffracting if (r := refusal(method, s))])
        }
        shown = [method for method in methods if method not in left_out]
        while shown:
            for digits in DIGITS:
                self._sections = Sections(others)
                fitted = {
                    method: [self._rounded(method, one, digits) for one in diffracting]
                    for method in tracked(shown, progress, f"rounding tables to {digits} digits")
                }
                excess = self._sections.nbytes - (MAX_BYTES - CODE_BYTES) // 4 * 3
                if excess <= 0:
                    return fitted, left_out
            left_out[shown.pop()] = (
                f"{excess / 1e6:.1f} MB too large for a page of {MAX_BYTES / 1e6:.0f} MB"
            )
        reasons = "; ".join(f"{method}: {reason}" for method, reason in left_out.items())
        raise DiffractionError(
            f"the scene is too large for a page ({reasons}); use fewer triangles, a smaller "
            "coherence_width, or a shallower surface"
        )

    def _rounded(self, method: str, described: Surface, digits: int) -> _Table:
        """Round a table, and store it."""
        packed, loss = web_table(method, described, digits)
        return _Table(packed_parts(packed, self._sections), packed.definitions, loss)

    def _surface(
        self, surface: PackedSurface, stored: dict[str, Any], fitted: Mapping[str, list[_Table]]
    ) -> dict[str, Any]:
        """Return a surface's entry; numbers of programs and tables are indices of the header's.

        `named` are its programs with one of the header's materials, empty where it cannot change.
        """
        coat, table = _coat(surface), surface.table
        described, own = surface.scene.material.diffraction, surface.packed.definitions
        definitions = {
            method: {**own, **({} if table is None else tables[table].definitions)}
            for method, tables in fitted.items()
        }
        named = {} if coat is None else {m: {**d, **INDEXED} for m, d in definitions.items()}
        return {
            **stored,
            "name": surface.scene.name,
            "emits": surface.scene.radiance is not None,
            "lamp": surface.scene.lamp,
            "height_scale": None if described is None else described.height_scale.number,
            "table": table or 0,
            "programs": {m: self._program(m, d) for m, d in definitions.items()},
            "named": {m: self._program(m, d) for m, d in named.items()},
            "coat": 0 if coat is None else self._coats.index(coat),
            "pigmented": described is not None and described.nested is not None,
        }

    def _program(self, method: str, definitions: Mapping[str, str]) -> int:
        """Return the number of a shader's source, which lacks its main function.

        The page replaces LIGHTS_LIT by its light's definitions and appends one of `mains`.
        """
        live = {**definitions, **self._around_definitions, "SHADOWED": "", "LIVE": ""}
        source = joined(fragment_parts(method, live, "web")[:-1])
        if source not in self._sources:
            self._sources.append(source)
        return self._sources.index(source)


def _coat(surface: PackedSurface) -> float | None:
    """Return the index of a surface's coat, 1 without one; None if its material cannot change.

    The materials of solved orders and of mirrors cannot.
    """
    described = surface.scene.material.diffraction
    return None if described is None or described.index is None else described.coat or 1.0


def _shaders(view: str) -> dict[str, Any]:
    """Return the sources that do not depend on surfaces."""
    display = web_source(
        "library.glsl", "formulas", "shown.frag", definitions=display_definitions(view)
    )
    return {
        "mains": {n: shader_file(f"{n}.frag") for n in ("surface", "picked", "map")},
        "vertex": web_source("surface.vert"),
        "shadow": web_source("position.frag"),
        "add": web_source("add.frag"),
        "shown": {"vertex": web_source("whole.vert"), "fragment": display},
    }


def _omissions(packed: PackedScene) -> list[str]:
    """Return the parts of the scene that the page leaves out, in a few words each."""
    scene = packed.scene
    omissions = [text for text in scene.omissions if text not in scene.lighting.omissions]
    omissions += [] if packed.emitters is None else packed.emitters.omissions
    return list(dict.fromkeys(omissions))


def _zenith(sky: NDArray[np.float64]) -> list[float]:
    """Return the largest radiance of a sky: at the zenith of a half, the mean of a whole one."""
    slope = np.linalg.norm(sky[1:], axis=0)
    return [float(x) for x in np.maximum(sky[0] + slope, 0.0)]
