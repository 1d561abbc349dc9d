"""Compression of arrays, triangles and textures for the page.

Arrays are stored as planes of bytes, and compressed; `data.js` decodes them.
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
from ..glsl.texels import Packed, Texture, distinct_rows, plain

_LEVEL = 7  # 8 and 9 take two and three times as long, and save at most 2 % of a page
_SAMPLED = 1 << 22  # bytes from which is known whether differences are smaller

_STEPS = 65535  # integer that encodes the far side of a bounding box


@dataclass(frozen=True)
class Section:
    """Array or file in the page's data."""

    data: bytes  # stored bytes
    layout: dict[str, Any]  # parameters to decode them, as JSON types


def packed_array(values: NDArray[Any]) -> Section:
    """Compress an array (rows, columns) without loss: its bits, or their differences if smaller.

    Differences are from the bits in the row before. All first bytes of a column are adjacent, then
    all second bytes: similar bytes compress well.

    values : values of a type that JavaScript has an array of, or half floats.
    """
    # JavaScript has no half floats; WebGL takes their bits
    kind = "uint16" if values.dtype == np.float16 else values.dtype.name
    bits = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    bits = bits.view(f"<u{bits.itemsize}")
    some = bits[: max(_SAMPLED // bits.strides[0], 1)]
    chosen = min((False, True), key=lambda one: len(zlib.compress(_planes(some, one), 1)))
    layout = {
        "kind": f"{kind.capitalize()}Array", "columns": bits.shape[1], "differences": chosen
    }  # fmt: skip
    return Section(zlib.compress(_planes(bits, chosen), _LEVEL), layout)


def _planes(bits: NDArray[Any], differences: bool) -> bytes:
    """Return the bytes of integers, or of their differences, column by column."""
    if differences:  # wrap around, here and in the page
        bits = np.concatenate([bits[:1], bits[1:] - bits[:-1]])
    return bits.view(np.uint8).reshape(len(bits), -1).T.tobytes()


class Sections(list[Section]):
    """Data of the page, a sequence of sections."""

    def add(self, section: Section) -> int:
        """Append a section unless it exists, and return its number."""
        if section not in self:
            self.append(section)
        return self.index(section)

    @property
    def nbytes(self) -> int:
        """Number of bytes so far."""
        return sum(len(part.data) for part in self)

    def joined(self) -> tuple[bytes, list[dict[str, Any]]]:
        """Return all bytes, and position and layout of each section."""
        layouts, start = [], 0
        for part in self:
            layouts.append({**part.layout, "start": start, "length": len(part.data)})
            start += len(part.data)
        return b"".join(part.data for part in self), layouts


def packed_mesh(vertices: NDArray[np.float32], sections: Sections) -> dict[str, Any]:
    """Encode vertices (n, 17) with attributes of `glsl.scene.VERTEX`, three to a triangle.

    Returns
    -------
    JSON types for the page's header, with numbers of sections:

    columns : (vertices, n) sixteen-bit attributes of every distinct vertex.
    corners : (3 · triangles, 1) indices of vertices.
    tangents : (triangles, 3), if each triangle has one; otherwise they are in `columns`.
    width : number of columns.
    layout : columns of each attribute, lowest values and steps; a constant attribute has its value
        instead.
    """
    names, sizes = zip(*VERTEX, strict=True)
    parts = dict(zip(names, np.split(vertices, np.cumsum(sizes)[:-1], axis=1), strict=True))
    for name in ("normal", "tangent"):
        length = np.linalg.norm(parts[name], axis=1, keepdims=True)
        parts[name] = parts[name] / np.maximum(length, 1e-20)
    columns, layout, width = [], dict[str, Any](), 0
    arrays: dict[str, Any] = {}
    for name, values in parts.items():
        low = values.min(axis=0).astype(np.float64)
        extent = values.max(axis=0) - low
        if not extent.any():
            layout[name] = {"value": low.tolist()}
            continue
        steps = extent / _STEPS
        whole = np.round((values - low) / np.where(steps > 0.0, steps, 1.0)).astype(np.uint16)
        layout[name] = {"low": low.tolist(), "step": steps.tolist()}
        by_triangle = whole.reshape(-1, 3, values.shape[1])
        if name == "tangent" and np.all(by_triangle == by_triangle[:, :1]):
            arrays["tangents"] = by_triangle[:, 0]
            continue
        layout[name]["column"] = width
        columns.append(whole)
        width += values.shape[1]
    arrays["columns"], corners = distinct_rows(np.concatenate(columns, axis=1))
    arrays["corners"] = corners[:, None]
    stored = {n: sections.add(packed_array(a)) for n, a in arrays.items()}
    return {"tangents": None, **stored, "width": width, "layout": layout}


def converted(packed: Packed, functions: Mapping[str, Callable[[Any], Any]]) -> Packed:
    """Apply functions to the data of the textures that they are named by."""
    textures = [replace(t, data=functions[t.name](t.data)) if t.name in functions else t
                for t in packed.textures]  # fmt: skip
    return replace(packed, textures=tuple(textures))


def packed_parts(packed: Packed, sections: Sections) -> dict[str, Any]:
    """Return textures and uniforms as JSON types."""
    return {
        "uniforms": {name: plain(value) for name, value in packed.uniforms.items()},
        "textures": [_texture(texture, sections) for texture in packed.textures],
    }


def _texture(texture: Texture, sections: Sections) -> dict[str, Any]:
    """Return a texture as JSON types, and store its data as a section."""
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
    return entry | {"section": sections.add(packed_array(data.reshape(-1, channels)))}


def _picture(data: NDArray[np.generic]) -> bytes:
    """Encode a picture of reflectances as WebP in 8-bit sRGB, as nearly all source files have."""
    from PIL import Image

    linear = np.asarray(data, np.float64)[..., :3]
    pixels = np.round(255.0 * encode_srgb(linear)).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels, "RGB").save(file, "WEBP", lossless=True)
    return file.getvalue()
