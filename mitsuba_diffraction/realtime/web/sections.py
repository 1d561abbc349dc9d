"""Compression of arrays, triangles and textures for the page.

Arrays are stored as byte planes, of differences where these are smaller, and compressed by zlib;
`data.js` decodes them.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import encode_srgb
from ..glsl.scene import VERTEX
from ..glsl.texels import Packed, Texture, plain

_LEVEL = 6

_UNIT = 32767  # integer that encodes a coordinate 1 of directions
_STEPS = 65535  # integer that encodes the far side of a bounding box
_NO_DIRECTION = -32768  # integer that encodes a direction of length 0


@dataclass(frozen=True)
class Section:
    """Array or file in the page's data."""

    data: bytes  # stored bytes
    layout: dict[str, Any]  # parameters to decode them, as JSON types


def packed_array(values: NDArray[Any], *, differences: bool = False) -> Section:
    """Compress an array (rows, columns) without loss.

    All first bytes of a column are adjacent, then all second ones: similar bytes compress well.

    values : values of a type that JavaScript has an array of, or half floats.
    differences : whether to store differences from the row before, for integers in similar rows.
    """
    if values.dtype == np.float16:  # JavaScript has no half floats; WebGL takes their bits
        values = values.view(np.uint16)
    rows, columns = values.shape
    kind, size = f"{values.dtype.name.capitalize()}Array", values.dtype.itemsize
    if differences:
        # integers of fixed size wrap around, here and in the page
        values = np.concatenate([values[:1], values[1:] - values[:-1]])
    contiguous = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    planes = contiguous.view(np.uint8).reshape(rows, columns * size).T
    data = zlib.compress(np.ascontiguousarray(planes).data, _LEVEL)
    layout = {"kind": kind, "rows": rows, "columns": columns, "differences": differences}
    return Section(data, layout)


def as_columns(data: Any, width: int) -> Any:
    """Arrange a texture's numbers in rows of a given width; the last row is padded with zeros."""
    flat = data.reshape(-1)
    missing = -len(flat) % width
    return (np.pad(flat, (0, missing)) if missing else flat).reshape(-1, width)


class Sections:
    """Data of the page, a sequence of sections."""

    def __init__(self) -> None:
        self._parts: list[Section] = []

    def add(self, section: Section) -> int:
        """Append a section unless it exists, and return its number."""
        if section in self._parts:
            return self._parts.index(section)
        self._parts.append(section)
        return len(self._parts) - 1

    @property
    def nbytes(self) -> int:
        """Number of bytes so far."""
        return sum(len(part.data) for part in self._parts)

    def joined(self) -> tuple[bytes, list[dict[str, Any]]]:
        """Return all bytes, and position and layout of each section."""
        layouts, start = [], 0
        for part in self._parts:
            layouts.append({**part.layout, "start": start, "length": len(part.data)})
            start += len(part.data)
        return b"".join(part.data for part in self._parts), layouts


def packed_mesh(vertices: NDArray[np.float32], sections: Sections) -> dict[str, Any]:
    """Encode vertices (n, 17) with attributes of `glsl.scene.VERTEX`, three to a triangle.

    Returns
    -------
    JSON types for the page's header, with numbers of sections:

    columns : (vertices, n) sixteen-bit attributes of every distinct vertex.
    corners : (3 · triangles, 1) indices of vertices.
    tangents : (triangles, 2), if each triangle has one; otherwise they are in `columns`.
    layout : columns of each attribute; a constant attribute has its value instead.
    """
    names, sizes = zip(*VERTEX, strict=True)
    parts = dict(zip(names, np.split(vertices, np.cumsum(sizes)[:-1], axis=1), strict=True))
    tangents = octahedral(parts.pop("tangent"))
    by_triangle = tangents.reshape(-1, 3, 2)
    flat = bool(np.all(by_triangle == by_triangle[:, :1]))
    columns = [octahedral(parts.pop("normal")).view(np.uint16)]
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
    distinct, corners = _distinct(np.concatenate(columns, axis=1))
    arrays: dict[str, Any] = {"columns": distinct, "corners": corners[:, None]}
    if flat:
        arrays["tangents"] = by_triangle[:, 0]
    stored = {n: sections.add(packed_array(a, differences=True)) for n, a in arrays.items()}
    return {"tangents": None, **stored, "layout": layout}


def octahedral(directions: NDArray[np.floating]) -> NDArray[np.int16]:
    """Encode directions (n, 3) of any length as two integers (Cigolle et al. 2014).

    The error is at most 7e-5 rad. Both integers of a vector of length 0 are -32768.
    """
    d = np.asarray(directions, np.float64)
    length = np.abs(d).sum(axis=1, keepdims=True)
    nonzero = length[:, 0] > 1e-20
    d = d / np.where(length > 1e-20, length, 1.0)
    folded = (1.0 - np.abs(d[:, 1::-1])) * np.where(d[:, :2] < 0.0, -1.0, 1.0)
    plane = np.where(d[:, 2:] < 0.0, folded, d[:, :2])
    result = np.round(plane * _UNIT).astype(np.int16)
    result[~nonzero] = _NO_DIRECTION
    return result


def _distinct(rows: NDArray[np.uint16]) -> tuple[NDArray[np.uint16], NDArray[np.uint32]]:
    """Return distinct rows in the order of their first occurrence, and the index of each row.

    The order keeps neighbours together, so that differences between them are small.
    """
    whole = np.ascontiguousarray(rows).view(np.dtype((np.void, rows.itemsize * rows.shape[1])))
    _, first, inverse = np.unique(whole.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order).astype(np.uint32)
    return rows[first[order]], rank[inverse.ravel()]


def converted(packed: Packed, functions: Mapping[str, Callable[[Any], Any]]) -> Packed:
    """Apply functions to the data of the textures that they are named by."""
    textures = [replace(t, data=functions[t.name](t.data)) if t.name in functions else t
                for t in packed.textures]  # fmt: skip
    return replace(packed, textures=tuple(textures))


def packed_parts(
    packed: Packed, sections: Sections, compressed: Mapping[str, Section] | None = None
) -> dict[str, Any]:
    """Return textures and uniforms as JSON types; `compressed` has sections of some textures."""
    ready = compressed or {}
    return {
        "uniforms": {name: plain(value) for name, value in packed.uniforms.items()},
        "textures": [_texture(t, sections, ready.get(t.name)) for t in packed.textures],
    }


def _texture(texture: Texture, sections: Sections, section: Section | None) -> dict[str, Any]:
    """Return a texture as JSON types, and store its data, if not yet compressed, as a section."""
    rows, columns, channels = texture.data.shape
    entry: dict[str, Any] = {
        "name": texture.name, "width": columns, "height": rows, "channels": channels,
        "smooth": texture.smooth,
    }  # fmt: skip
    if texture.name == "colour_map":
        picture = Section(_picture(texture.data), {"kind": "file"})
        return entry | {"kind": "picture", "section": sections.add(picture)}
    data = texture.data
    entry["kind"] = {1: "bytes", 2: "half", 4: "single"}[data.dtype.itemsize]
    section = section or packed_array(as_columns(data, channels))
    return entry | {"section": sections.add(section)}


def _picture(data: NDArray[np.generic]) -> bytes:
    """Encode a picture of reflectances as WebP in 8-bit sRGB, as nearly all source files have."""
    from PIL import Image

    linear = np.asarray(data, np.float64)[..., :3]
    pixels = np.round(255.0 * encode_srgb(linear)).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels, "RGB").save(file, "WEBP", lossless=True)
    return file.getvalue()
