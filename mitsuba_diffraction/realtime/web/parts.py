"""What a shader reads, as the page's header names it."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import encode_srgb
from ..glsl.texels import Packed, Texture
from .sections import Section, Sections, packed_array, packed_file
from .tables import as_columns


def packed_parts(
    packed: Packed, sections: Sections, done: Mapping[str, Section] | None = None
) -> dict[str, Any]:
    """Textures and uniforms as JSON; `done` are sections that are there already, by texture."""
    return {
        "uniforms": {name: _plain(value) for name, value in packed.uniforms.items()},
        "textures": [_texture(t, sections, (done or {}).get(t.name)) for t in packed.textures],
    }


def _texture(texture: Texture, sections: Sections, done: Section | None) -> dict[str, Any]:
    rows, columns, channels = texture.data.shape
    entry: dict[str, Any] = {
        "name": texture.name, "width": columns, "height": rows, "channels": channels,
        "smooth": texture.smooth,
    }  # fmt: skip
    if texture.name == "colour_map":
        entry["kind"] = "picture"
        entry["section"] = sections.add(packed_file(_png(texture.data)))
        return entry
    data = texture.data
    entry["kind"] = {1: "bytes", 2: "half", 4: "single"}[data.dtype.itemsize]
    if data.dtype == np.uint32:
        entry["kind"] = "words"
    if done is None:
        done = packed_array(as_columns(data, channels), differences=entry["kind"] == "bytes")
    entry["section"] = sections.add(done)
    return entry


def _png(data: NDArray[np.generic]) -> bytes:
    """A picture of reflectances as eight bits of sRGB, as which nearly all of them began."""
    from PIL import Image

    linear = np.asarray(data, np.float64)[..., :3]
    pixels = np.round(255.0 * encode_srgb(linear)).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels, "RGB").save(file, "PNG", optimize=True)
    return file.getvalue()


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value
