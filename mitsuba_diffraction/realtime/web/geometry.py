"""Triangles in little space: each vertex once, sixteen bits a number."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.scene import VERTEX
from .sections import packed_array

_UNIT = 32767  # of directions
_STEPS = 65535  # over a bounding box
_NO_DIRECTION = -32768


@dataclass(frozen=True)
class Mesh:
    """A surface's triangles.

    Attributes
    ----------
    columns : (vertices, n) sixteen-bit numbers of every vertex that differs from the others.
    corners : (3 · triangles, 1) indices into them.
    tangents : (triangles, 2) where a triangle has one tangent, else they are in `columns`.
    layout : of the columns, by attribute, as JSON; attributes with one value are there as it is.
    """

    columns: NDArray[np.uint16]
    corners: NDArray[np.uint32]
    tangents: NDArray[np.int16] | None
    layout: dict[str, Any] = field(default_factory=dict)


def packed_mesh(vertices: NDArray[np.float32]) -> Mesh:
    """Vertices as `glsl.scene.VERTEX` says, three after another making a triangle."""
    parts: dict[str, NDArray[np.float32]] = {}
    start = 0
    for name, size in VERTEX:
        parts[name] = vertices[:, start : start + size]
        start += size
    tangents = octahedral(parts.pop("tangent"))
    by_triangle = tangents.reshape(-1, 3, 2)
    flat = bool(np.all(by_triangle == by_triangle[:, :1]))
    normals = octahedral(parts.pop("normal"))
    columns = [normals.view(np.uint16)]
    layout: dict[str, Any] = {"normal": {"column": 0}}
    width = 2
    if not flat:
        columns.append(tangents.view(np.uint16))
        layout["tangent"] = {"column": width}
        width += 2
    for name, values in parts.items():
        low = values.min(axis=0).astype(np.float64)
        extent = values.max(axis=0) - low
        if not extent.any():
            layout[name] = {"value": low.tolist()}
            continue
        steps = np.where(extent > 0.0, extent, 1.0) / _STEPS
        columns.append(np.round((values - low) / steps).astype(np.uint16))
        layout[name] = {"column": width, "low": low.tolist(), "step": steps.tolist()}
        width += values.shape[1]
    rows = np.concatenate(columns, axis=1)
    distinct, corners = _distinct(rows)
    return Mesh(distinct, corners[:, None], by_triangle[:, 0] if flat else None, layout)


def sections_of(mesh: Mesh, add: Any) -> dict[str, Any]:
    """The mesh as the page's header names it; `add` takes sections and returns their numbers."""
    return {
        "columns": add(packed_array(mesh.columns, differences=True)),
        "corners": add(packed_array(mesh.corners, differences=True)),
        "tangents": None
        if mesh.tangents is None
        else add(packed_array(mesh.tangents, differences=True)),
        "layout": mesh.layout,
    }


def octahedral(directions: NDArray[np.floating]) -> NDArray[np.int16]:
    """Directions (n, 3) of any length as two numbers each (Cigolle et al. 2014), within 7e-5 rad.

    A vector of length 0 has no direction: both numbers are -32768.
    """
    d = np.asarray(directions, np.float64)
    length = np.abs(d).sum(axis=1, keepdims=True)
    known = length[:, 0] > 1e-20
    d = d / np.where(length > 1e-20, length, 1.0)
    folded = (1.0 - np.abs(d[:, 1::-1])) * np.where(d[:, :2] < 0.0, -1.0, 1.0)
    plane = np.where(d[:, 2:] < 0.0, folded, d[:, :2])
    result = np.round(plane * _UNIT).astype(np.int16)
    result[~known] = _NO_DIRECTION
    return result


def _distinct(rows: NDArray[np.uint16]) -> tuple[NDArray[np.uint16], NDArray[np.uint32]]:
    """Distinct rows in the order in which they come first, and the number of each row's own.

    That order keeps neighbours together, so that differences between them stay small.
    """
    whole = np.ascontiguousarray(rows).view(np.dtype((np.void, rows.itemsize * rows.shape[1])))
    _, first, inverse = np.unique(whole.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.uint32)
    rank[order] = np.arange(len(order), dtype=np.uint32)
    return rows[first[order]], rank[inverse.ravel()]
