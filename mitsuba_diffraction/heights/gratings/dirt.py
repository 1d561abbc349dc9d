"""What lies on a scale and what has scraped it, as a probe feels them."""

from __future__ import annotations

import math

import numpy as np

from .fingers import Row
from .noise import FloatArray, sample_field, smooth_field


def stamp(
    shape: tuple[int, int],
    extent: tuple[float, float],
    x: FloatArray,
    y: FloatArray,
    radius: FloatArray,
    height: FloatArray,
) -> FloatArray:
    """Upper envelope (ny, nx) of rounded bumps at (x, y) on the torus, µm; 0 between them.

    A bump is height·(1 − r²/radius²)², out to its radius.
    """
    ny, nx = shape
    dx, dy = extent[0] / nx, extent[1] / ny
    result = np.zeros(ny * nx)
    reach_x = math.ceil(float(radius.max(initial=0)) / dx)
    reach_y = math.ceil(float(radius.max(initial=0)) / dy)
    across = np.arange(-min(reach_x, nx // 2), min(reach_x, nx // 2) + 1)
    along = np.arange(-min(reach_y, ny // 2), min(reach_y, ny // 2) + 1)[:, None]
    step = max(1, 2**22 // (across.size * along.size))
    for first in range(0, x.size, step):  # no more than some 4 million points at a time
        part = slice(first, first + step)
        cx, cy = x[part, None, None] / dx, y[part, None, None] / dy
        ix, iy = np.round(cx) + across, np.round(cy) + along
        r2 = ((ix - cx) * dx) ** 2 + ((iy - cy) * dy) ** 2
        cap = 1 - r2 / radius[part, None, None] ** 2
        z = height[part, None, None] * cap * cap
        index = (iy % ny) * nx + ix % nx
        bump = cap > 0
        np.maximum.at(result, index[bump].astype(np.intp), z[bump])
    return result.reshape(shape)


def beads(
    rng: np.random.Generator,
    extent: tuple[float, float],
    shape: tuple[int, int],
    rows: list[Row],
    density: float,
) -> FloatArray:
    """Small round beads that sit on the crests of fingers, in swarms; `density` per µm²."""
    names = ("x", "y", "length", "lean")
    tip_x, tip_y, length, lean = (
        np.concatenate([getattr(row, name) for row in rows]) for name in names
    )
    swarm = np.exp(1.2 * smooth_field(rng, extent, (3.0, 10.0), 3.0))
    weight = sample_field(swarm, extent, tip_x, tip_y).clip(0)
    n = int(rng.poisson(density * extent[0] * extent[1]))
    share = np.cumsum(weight) / weight.sum()
    finger = np.minimum(np.searchsorted(share, rng.random(n)), tip_x.size - 1)
    t = rng.random(n) * length[finger]
    x = tip_x[finger] + lean[finger] * t + 0.1 * rng.standard_normal(n)
    radius = 0.07 + 0.13 * rng.random(n) ** 2
    return stamp(shape, extent, x, tip_y[finger] - t, radius, radius * (0.08 + 0.2 * rng.random(n)))


def debris(
    rng: np.random.Generator,
    extent: tuple[float, float],
    shape: tuple[int, int],
    density: float,
) -> FloatArray:
    """Crumbs, alone or in loose heaps up to 2 µm across; `density` of heaps per µm²."""
    n = int(rng.poisson(density * extent[0] * extent[1]))
    spread = np.minimum(0.05 / (1 - rng.random(n)), 0.35)  # µm, heavy-tailed
    grains = rng.integers(1, 4, size=n) + np.floor(150 * spread**2).astype(np.int64)
    heap = np.repeat(np.arange(n), grains)
    x = (extent[0] * rng.random(n))[heap] + spread[heap] * rng.standard_normal(heap.size)
    y = (extent[1] * rng.random(n))[heap] + 1.3 * spread[heap] * rng.standard_normal(heap.size)
    radius = 0.08 + 0.2 * rng.random(heap.size) ** 2
    return stamp(shape, extent, x, y, radius, radius * (0.08 + 0.3 * rng.random(heap.size)))


def flakes(
    rng: np.random.Generator,
    extent: tuple[float, float],
    shape: tuple[int, int],
    density: float,
) -> FloatArray:
    """Particles with flat, tilted tops and straight, steep sides; `density` per µm²."""
    ny, nx = shape
    result = np.zeros(shape)
    for _ in range(int(rng.poisson(density * extent[0] * extent[1]))):
        x, y = rng.random(2) * extent
        size = 0.35 + 0.45 * rng.random()
        turns = (np.arange(6) + 0.7 * rng.random(6)) * (np.pi / 3)
        radii = size * (0.5 + rng.random(6))
        tilt = 0.15 * rng.standard_normal(2)
        reach = 1.6 * radii.max()
        ix = np.arange(math.floor((x - reach) * nx / extent[0]), (x + reach) * nx / extent[0])
        iy = np.arange(math.floor((y - reach) * ny / extent[1]), (y + reach) * ny / extent[1])
        u = (ix * extent[0] / nx - x)[None, :]
        v = (iy * extent[1] / ny - y)[:, None]
        z = 0.22 + 0.1 * rng.random() + tilt[0] * u + tilt[1] * v
        for turn, radius in zip(turns, radii, strict=True):
            z = np.minimum(z, 1.2 * (radius - np.cos(turn) * u - np.sin(turn) * v))
        at = np.ix_(iy.astype(np.intp) % ny, ix.astype(np.intp) % nx)
        np.maximum.at(result, at, z)
    return result


def scratches(
    rng: np.random.Generator, extent: tuple[float, float], shape: tuple[int, int], density: float
) -> FloatArray:
    """Thin broken lines, all at about the same angle; `density` per µm²."""
    n = int(rng.poisson(density * extent[0] * extent[1]))
    angle = np.radians(48 + 6 * rng.standard_normal(n))
    length = np.minimum(10 + 25 * rng.random(n), max(extent))
    spacing = 0.5 * min(extent[0] / shape[1], extent[1] / shape[0])
    points = (length / spacing).astype(np.int64)
    line = np.repeat(np.arange(n), points)
    along = (np.arange(line.size) - np.repeat(np.cumsum(points) - points, points)) * spacing
    x = (extent[0] * rng.random(n))[line] + along * np.cos(angle[line])
    y = (extent[1] * rng.random(n))[line] + along * np.sin(angle[line])
    visible = sample_field(smooth_field(rng, extent, (1.0, 1.0), 2.5), extent, x, y)
    height = 0.008 * (visible + 0.3).clip(0)
    return stamp(shape, extent, x, y, np.full(line.size, 0.06), height)
