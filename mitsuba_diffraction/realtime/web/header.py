"""Header of a page: all its data beside arrays, as JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

from ..glsl.rewriting import shader_file
from ..glsl.source import plain_source, vertex_source
from .material_choices import MaterialEntry


@dataclass(frozen=True)
class SurfaceEntry:
    """Surface of a scene in the page's header.

    Attributes
    ----------
    mesh, parts : numbers of its sections (`sections`).
    emits : whether it emits light.
    height_scale : height scale of the scene; null where nothing diffracts.
    table : number of its table; 0 where nothing diffracts.
    programs : number of its shader's source, by method.
    named : the same with a material of `Header.materials`; empty where it cannot change.
    coat : number of its coat among the materials' parts.
    pigmented : whether it diffracts over a diffuse base.
    """

    name: str
    mesh: dict[str, Any]
    parts: dict[str, Any]
    emits: bool
    height_scale: float | None
    table: int
    programs: dict[str, int]
    named: dict[str, int]
    coat: int
    pigmented: bool


@dataclass(frozen=True)
class Header:
    """Data of a page beside its arrays; `page/data.js` reads the fields by name.

    Attributes
    ----------
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
    """

    title: str
    surfaces: list[SurfaceEntry]
    light: dict[str, Any]
    around: dict[str, Any] | None
    tables: dict[str, list[dict[str, Any]]]
    methods: list[str]
    omissions: list[str]
    background: list[float]
    camera: dict[str, Any]
    box: list[list[float]]
    subject: list[list[float]]
    programs: int
    shown: dict[str, str]
    loss: dict[str, tuple[float, float]]
    left_out: dict[str, str]
    orders: list[list[list[float]]]
    sections: list[dict[str, Any]]
    octaves: tuple[float, float]
    energy_pages: int
    materials: list[MaterialEntry]
    mains: dict[str, str] = field(
        default_factory=lambda: {n: shader_file(f"{n}.frag") for n in ("surface", "picked", "map")}
    )
    vertex: str = field(default_factory=lambda: vertex_source("web"))
    shadow: str = field(default_factory=lambda: plain_source("position.frag", dialect="web"))

    def json(self) -> str:
        """Return the header as JSON for an element of a page."""
        text = json.dumps(self, default=vars, ensure_ascii=False)
        # "</script" would end the element, and "<!--<script" its end
        return text.replace("<", "\\u003c")
