"""What a shader reads: textures, uniforms and definitions, as plain NumPy.

Nothing here knows of OpenGL: a desktop renderer and a page with WebGL upload the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError

#: Texels in a row of a list: every OpenGL 3.3 and nearly every WebGL 2 has textures this wide.
PAGE = 1 << 12

#: Half floats are used where they change a sum of coefficients by less than this share of it.
HALF_ERROR = 2e-4
_LOOKED_AT = 1 << 20  # to know it

#: A number, a vector, or an array of vectors (n, components) of single precision.
Uniform = float | int | bool | tuple[float, ...] | tuple[int, ...] | NDArray[np.float32]


@dataclass(frozen=True)
class Texture:
    """One texture."""

    name: str  # of the sampler in the shader
    # (rows, columns, channels) float16, float32, uint8 or uint32 (read as whole numbers), one, two
    # or four channels
    data: NDArray[np.generic]
    # whether it is a picture, filtered and repeated; else a list, read texel by texel
    smooth: bool = False

    @property
    def nbytes(self) -> int:
        """Size in the memory of the graphics card."""
        return self.data.nbytes


@dataclass(frozen=True)
class Packed:
    """What one part of a shader reads."""

    textures: tuple[Texture, ...] = ()  # by the names of their samplers
    uniforms: Mapping[str, Uniform] = field(default_factory=dict)  # by name
    # constants that the compiler must know
    definitions: Mapping[str, str] = field(default_factory=dict)

    @property
    def nbytes(self) -> int:
        """Size of all textures."""
        return sum(texture.nbytes for texture in self.textures)

    def __or__(self, other: Packed) -> Packed:
        return Packed(
            self.textures + other.textures,
            {**self.uniforms, **other.uniforms},
            {**self.definitions, **other.definitions},
        )


def listed(name: str, entries: NDArray[np.generic]) -> Texture:
    """Entries (n, channels) as a texture with rows of `PAGE` texels: what `entry` reads.

    Raises a DiffractionError if they are too many for a texture.
    """
    count, channels = entries.shape
    rows = -(-count // PAGE)
    if rows > 1 << 14:
        raise DiffractionError(
            f"a table of {entries.nbytes / 1e9:.1f} GB is too large for a texture; use method lut, "
            "or a table with a larger tolerance"
        )
    data = np.zeros((rows * PAGE, channels), entries.dtype)
    data[:count] = entries
    return Texture(name, data.reshape(rows, PAGE, channels))


def texels(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Numbers (n, m) as texels of four, (n·⌈m/4⌉, 4), filled up with zeros."""
    numbers = values.shape[1]
    missing = -numbers % 4
    padded = np.pad(values, [(0, 0), (0, missing)]) if missing else values
    return np.ascontiguousarray(padded).reshape(-1, 4)


def half_error(values: NDArray[np.floating]) -> float:
    """Σ|half(x) − x| / Σ|x|: what half floats cost, of a million numbers where there are more."""
    some = values.ravel()
    if some.size > _LOOKED_AT:
        some = some[np.random.default_rng(0).integers(0, some.size, _LOOKED_AT)]
    rounded = some.astype(np.float16).astype(some.dtype)
    total = float(np.abs(some).sum(dtype=np.float64))
    return float(np.abs(rounded - some).sum(dtype=np.float64)) / total if total > 0.0 else 0.0


def as_half(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """The values as half floats if that is exact enough, else in single precision."""
    if values.dtype == np.float16:
        return values
    if np.abs(values).max(initial=0.0) < 6e4 and half_error(values) <= HALF_ERROR:
        return values.astype(np.float16)
    return values.astype(np.float32, copy=False)


def shortened(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """The values rounded to 8 binary digits: what the upper half of a float32 holds.

    Half floats have 11 digits, but other exponents: drivers in software take as long to undo that
    as to fetch the numbers, where these take a shift.
    """
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32)
    nearest = bits + (0x7FFF + (bits >> 16 & 1))  # ties to even
    return (nearest & np.uint32(0xFFFF0000)).view(np.float32)


def paired(values: NDArray[np.floating]) -> NDArray[np.uint32]:
    """The upper halves of numbers (…, 2n), `shortened`, two in each word (…, n), low one first."""
    upper = shortened(values).view(np.uint32)
    return np.asarray(upper[..., ::2] >> 16 | upper[..., 1::2], np.uint32)


def plain(value: Any) -> Any:
    """A uniform for JSON; an array's numbers are one list."""
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if isinstance(value, tuple):
        return [plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value
