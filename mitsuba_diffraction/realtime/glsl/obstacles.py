"""How far it is to the nearest surface, on a grid: what rays through a scene are marched by.

A ray may step as far as the nearest surface is without missing one (Hart 1996, *Sphere tracing*).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from .texels import Packed, listed

Array = NDArray[np.floating]

_CELLS = 1 << 22  # in all, about
_MARGIN = 2  # cells around it
_PER_CELL = 4.0  # steps of the distances
_SPACING = 0.7  # cells between two places of a triangle, at most
_AT_ONCE = 1 << 20  # places


def pack_obstacles(triangles: Array) -> Packed:
    """What shaders/obstacles.glsl reads of triangles (n, 3, 3)."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    # flat or thin, a scene gets some room
    room = np.maximum(high - low, max(float((high - low).max()), 1e-12) / 64.0)
    cell = float((room.prod() / _CELLS) ** (1.0 / 3.0))
    low = low - _MARGIN * cell
    size = np.ceil((high - low) / cell).astype(int) + _MARGIN
    empty = np.ones(size[::-1], bool)
    for places in _places((triangles - low) / cell):
        x, y, z = places.astype(np.int32).T
        empty[z, y, x] = False
    apart = distance_transform_edt(empty)
    steps = np.minimum(np.floor(_PER_CELL * apart), 255.0).astype(np.uint8)
    return Packed(
        (listed("obstacles", steps.reshape(-1, 1)),),
        {
            "obstacles_low": tuple(low.tolist()),
            "obstacles_cell": cell,
            "obstacles_size": tuple(size.tolist()),
        },
        {"OBSTACLES": str(255.0 / _PER_CELL)},
    )


def _places(triangles: Array) -> Iterator[Array]:
    """Places (n, 3) all over triangles (n, 3, 3), in cells, some at a time."""
    sides = triangles - np.roll(triangles, 1, axis=1)
    longest = np.sqrt((sides**2).sum(axis=2).max(axis=1))
    parts = np.maximum(np.ceil(longest / _SPACING), 1.0).astype(int)
    parts = 2 ** np.ceil(np.log2(parts)).astype(int)  # few kinds
    for count in np.unique(parts):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1))
        kept = i + j <= count
        weights = np.stack([i[kept], j[kept], count - i[kept] - j[kept]], axis=1) / count
        chosen = triangles[parts == count]
        step = max(1, _AT_ONCE // len(weights))
        for start in range(0, len(chosen), step):
            yield np.einsum("wc,ncx->nwx", weights, chosen[start : start + step]).reshape(-1, 3)
