"""Textures, uniforms and definitions that shaders read, as plain NumPy.

The module is independent of OpenGL: the desktop renderer and pages with WebGL share it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError

#: Texels per row of a list: every OpenGL 3.3 and nearly every WebGL 2 has textures this wide.
PAGE = 1 << 12

#: Largest relative error Σ|half(x) − x| / Σ|x| for which half floats are used.
HALF_ERROR = 2e-4

Scalar = TypeVar("Scalar", bound=np.generic)

#: Value of a uniform: number, vector, or array of vectors (n, components) of single precision.
Uniform = float | int | bool | tuple[float, ...] | tuple[int, ...] | NDArray[np.float32]


@dataclass(frozen=True)
class Texture:
    """Data of one texture."""

    name: str  # name of the sampler in the shader
    # (rows, columns, channels) float16, float32 or uint8, one, two
    # or four channels
    data: NDArray[np.generic]
    # True: a picture, filtered and repeated; False: a list, read texel by texel
    smooth: bool = False


@dataclass(frozen=True)
class Packed:
    """Textures, uniforms and definitions of one part of a shader."""

    textures: tuple[Texture, ...] = ()
    uniforms: Mapping[str, Uniform] = field(default_factory=dict)  # by name
    definitions: Mapping[str, str] = field(default_factory=dict)  # macros of the preprocessor

    @property
    def nbytes(self) -> int:
        """Size of all textures in bytes."""
        return sum(texture.data.nbytes for texture in self.textures)

    def __or__(self, other: Packed) -> Packed:
        return Packed(
            self.textures + other.textures,
            {**self.uniforms, **other.uniforms},
            {**self.definitions, **other.definitions},
        )


def listed(name: str, entries: NDArray[np.generic]) -> Texture:
    """Arrange entries (n, channels) in rows of `PAGE` texels, for the shaders' function `entry`.

    Raises a DiffractionError if a texture cannot hold them.
    """
    count, channels = entries.shape
    rows = -(-count // PAGE)
    if rows > 1 << 14:
        raise DiffractionError(
            f"a table of {entries.nbytes / 1e9:.1f} GB is too large for a texture; use method fast "
            "or a table of a larger tolerance"
        )
    data = np.zeros((rows * PAGE, channels), entries.dtype)
    data[:count] = entries
    return Texture(name, data.reshape(rows, PAGE, channels))


def pack_grid(
    name: str, entries: NDArray[np.generic], low: NDArray[Any], cell: float, size: NDArray[Any]
) -> Packed:
    """Pack entries of cells, x fastest, with a grid's lowest corner, side of a cell, and size."""
    uniforms: dict[str, Uniform] = {
        f"{name}_low": tuple(low.tolist()),
        f"{name}_cell": cell,
        f"{name}_size": tuple(size.tolist()),
    }
    return Packed((listed(name, entries),), uniforms)


def texels(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Arrange numbers (n, m) as texels of four, (n·⌈m/4⌉, 4), padded with zeros."""
    numbers = values.shape[1]
    missing = -numbers % 4
    padded = np.pad(values, [(0, 0), (0, missing)]) if missing else values
    return np.ascontiguousarray(padded).reshape(-1, 4)


def four_channels(picture: NDArray[Any]) -> NDArray[Any]:
    """Pad a picture to four channels, which graphics cards store anyway, and some loaders need."""
    return np.pad(picture, [(0, 0), (0, 0), (0, 4 - picture.shape[2])])


def as_half(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Convert values to half floats if the error is small enough, else to single precision."""
    values = values if values.dtype == np.float16 else values.astype(np.float32, copy=False)
    with np.errstate(over="ignore"):  # of numbers beyond the halves, whose error is infinite
        half = values.astype(np.float16)
    error, size = (np.abs(x).sum(dtype=np.float64) for x in (half - values, values))
    return half if error <= HALF_ERROR * size else values


def shortened(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Round values to 8 binary digits, so that the upper half of a float32 holds them.

    Half floats have 11 digits, but software drivers take as long to convert their exponents as to
    fetch the numbers; these need only a shift.
    """
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32)
    nearest = bits + (0x7FFF + (bits >> 16 & 1))  # ties to even
    return (nearest & np.uint32(0xFFFF0000)).view(np.float32)


def paired(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Pack the upper halves of `shortened` numbers (…, 2n) in floats (…, n), low half first.

    A second number of 0 becomes 1e-38: cards may read floats without exponent as 0.
    """
    bits = shortened(values).view(np.uint32)
    low, high = bits[..., ::2], bits[..., 1::2]
    high = np.where(high & np.uint32(0x7F800000), high, np.uint32(0x00800000))
    return np.asarray(low >> 16 | high, np.uint32).view(np.float32)


def plain(value: Uniform) -> Any:
    """Convert a uniform to JSON types; an array becomes one flat list."""
    array = np.asarray(value)
    return array.ravel().tolist() if array.ndim else array.item()


def distinct_rows(rows: NDArray[Scalar]) -> tuple[NDArray[Scalar], NDArray[np.uint32]]:
    """Return distinct rows (m, k) in the order of their first occurrence, and each row's place.

    The order keeps neighbours together, so that differences between them are small.
    """
    whole = np.ascontiguousarray(rows).view(np.dtype((np.void, rows.itemsize * rows.shape[1])))
    _, first, inverse = np.unique(whole.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order).astype(np.uint32)
    return rows[first[order]], rank[inverse.ravel()]
