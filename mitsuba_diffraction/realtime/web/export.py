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

from ...atomic import atomic_path
from ...errors import DiffractionError
from ...progress import Progress, silent
from ..glsl.emitters import Emitters
from ..glsl.scene import load, read_scene
from .scene import MAX_BYTES, WebScene, web_scene
from .tables import WEB_METHODS

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
    loaded = load(scene)
    realtime = read_scene(loaded, sensor)
    emitters = Emitters(loaded, realtime.middle) if loaded.emitters() else None
    packed = web_scene(loaded, realtime, emitters, title, methods, progress)
    text = _filled(packed)
    if len(text.encode()) > MAX_BYTES:
        raise DiffractionError(
            f"the page would have {len(text.encode()) / 1e6:.1f} MB, more than "
            f"{MAX_BYTES / 1e6:.0f}; use fewer triangles or a smaller coherence_width"
        )
    return Page(text, packed.loss, packed.left_out, tuple(packed.header["omissions"]))


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


def _filled(scene: WebScene) -> str:
    """The page with everything in it."""
    parts: dict[str, Callable[[], str]] = {
        "style": lambda: _asset("style.css"),
        "script": lambda: "\n".join(_asset(name) for name in _SCRIPTS),
        # "</script" would end the element, and "<!--<script" its end
        "header": lambda: json.dumps(scene.header, ensure_ascii=False).replace("<", "\\u003c"),
        "data": lambda: base64.b64encode(scene.data).decode(),
    }
    pieces = []
    for n, piece in enumerate(_asset("page.html").replace("}}", "{{").split("{{")):
        pieces.append(parts[piece]() if n % 2 else piece)
    return "".join(pieces)


@functools.cache
def _asset(name: str) -> str:
    return resources.files(__package__).joinpath("page", name).read_text(encoding="utf-8")
