"""Look-alikes of snake scales: overlapping fingers, as an atomic-force microscope measures them.

The parameters of `elaphe_like` are fitted to one measured patch of *Elaphe guttata* (65 µm square,
0.375 µm full scale): the mean finger and the mean notch between two fingers, the distributions of
heights and slopes, the statistics of the fingers' positions, and the power spectrum. The patches
tile without a seam. A seed gives the same heights on every machine: they are rounded to a
picometre, which hides the last bits in which processors differ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from ...arrays import Real
from ..field import HeightField
from ..lengths import number_between
from .fingers import Blade, FingerRow, Layout, lay_out, overlay, ramp
from .noise import (
    Counts,
    Lengths,
    Pair,
    Rng,
    Shape,
    grain,
    grid,
    patch,
    sample_field,
    smooth_field,
)

# Grid spacing of creases and bends, µm, independent of the pixels.
_COARSE = 0.3


@dataclass(frozen=True)
class Species:
    """Structures of a species' scale; lengths in µm, densities per µm²."""

    name: str
    layout: Layout
    blade: Blade
    depth: float  # full scale to which the heights below refer
    level: float  # mean height as a fraction of the full scale, 0 to 1
    fray: float  # rms displacement of edges from one scan line to the next
    streak: float  # rms height of the grooves along the floor between fingers
    pore: float  # depth of the pores in the floor
    fuzz: float  # rms height of white noise
    bend: float  # rms height of the bending of the whole scale
    bend_reach: Pair  # correlation length of the bending
    crease: float  # depth of creases
    beads: float  # density
    debris: float  # density of heaps
    flakes: float  # density
    scratches: float  # density


ELAPHE = Species(
    name="elaphe_like",
    layout=Layout(
        pitch=1.03, row_pitch=3.03, sway=0.17, wave=1.3, wave_reach=(6.0, 8.0), jitter_x=0.02,
        jitter_y=0.08, rise=0.012, faults=0.003,
    ),
    blade=Blade(
        notch=0.94, tip_width=0.152, taper=0.173, tip_round=0.17, tip_drop=0.002,
        root_drop=0.023, side_drop=0.028, root_side=0.048, floor=0.065, floor_slope=0.014,
        pocket=0.053, sink=0.71, lag=0.13, dive=0.42, wall=0.85,
    ),
    depth=0.375, level=0.527, fray=0.019, streak=0.006, pore=0.018, fuzz=0.0013, bend=0.031,
    bend_reach=(20.0, 35.0), crease=0.02, beads=0.15, debris=0.03, flakes=0.0006,
    scratches=0.001,
)  # fmt: skip

# Not fitted to a measured patch: finger sizes are published ones; heights and irregularities are
# those of Elaphe, reduced until the first order is as pure as the animal's colours.
XENOPELTIS = Species(
    name="xenopeltis_like",
    layout=Layout(
        pitch=0.6, row_pitch=1.5, sway=0.09, wave=1.0, wave_reach=(12.0, 10.0), jitter_x=0.006,
        jitter_y=0.03, rise=0.004, faults=0.002,
    ),
    blade=Blade(
        notch=0.92, tip_width=0.15, taper=0.16, tip_round=0.2, tip_drop=0.002, root_drop=0.018,
        side_drop=0.026, root_side=0.048, floor=0.072, floor_slope=0.01, pocket=0.025,
        sink=0.72, lag=0.12, dive=0.42, wall=1.0,
    ),
    depth=0.25, level=0.5, fray=0.01, streak=0.0025, pore=0.006, fuzz=0.0008, bend=0.018,
    bend_reach=(20.0, 30.0), crease=0.01, beads=0.04, debris=0.01, flakes=0.0002,
    scratches=0.0005,
)  # fmt: skip


def elaphe_like(
    extent: Lengths = 65.0,
    pixels: Counts = 1332,
    seed: int = 0,
    *,
    depth: float = 0.375,
    irregularity: float = 1.0,
    bending: float = 1.0,
    roughness: float = 1.0,
    dirt: float = 1.0,
) -> HeightField:
    """Generate a patch like the shed of a corn snake (*Elaphe guttata*).

    Long overlapping fingers are 1.03 µm apart along x, in rows 3.03 µm apart along y. They lie
    along y and point to +y, upwards in an image of the patch. A finger's crest is 0.065 to 0.13 µm
    above the floor beside it; the whole patch spans some 0.35 µm.

    Raises a DiffractionError if a parameter is out of its range.

    Parameters
    ----------
    extent
        Size in µm, one length or (along x, along y), 2 to 500. Fingers and rows are stretched by a
        few per cent so that whole numbers of them fit.
    pixels
        Samples, one count or (along x, along y). Fingers, bends and dirt of one seed do not depend
        on the number; fine roughness does. Pixels above 0.1 µm do not resolve the fingers' edges.
    seed
        A whole number; each seed is another piece of the same animal.
    depth
        Full scale, µm: the heights lie within [0, depth], from the deepest pits to the highest
        dust, and are proportional to it.
    irregularity
        Variation of fingers' positions and heights; 1 as measured, 0 a perfect lattice.
    bending
        Bending and creases of the whole scale; 1 as measured, 0 none.
    roughness
        Frayed edges, streaks, pores and noise; 1 as measured, 0 none.
    dirt
        Number of beads, crumbs, flakes and scratches; 1 as measured, 0 none.
    """
    amounts = (irregularity, bending, roughness, dirt)
    return _patch(ELAPHE, extent, pixels, seed, depth, amounts)


def xenopeltis_like(
    extent: Lengths = 65.0,
    pixels: Counts = 1332,
    seed: int = 0,
    *,
    depth: float = 0.25,
    irregularity: float = 1.0,
    bending: float = 1.0,
    roughness: float = 1.0,
    dirt: float = 1.0,
) -> HeightField:
    """Generate a patch like the scale of a sunbeam snake (*Xenopeltis unicolor*).

    Short fingers, 0.6 µm apart along x, point to +y in irregular rows 1.5 µm apart along y. The
    patch is more regular and cleaner than `elaphe_like`, so its colours are purer and, with the
    finer pitch, farther apart. It is not fitted to a measurement: sizes are published ones, relief
    and irregularity are Elaphe's, reduced. Parameters and errors as in `elaphe_like`.
    """
    amounts = (irregularity, bending, roughness, dirt)
    return _patch(XENOPELTIS, extent, pixels, seed, depth, amounts)


def _patch(
    species: Species,
    extent: Lengths,
    pixels: Counts,
    seed: int,
    depth: float,
    amounts: tuple[float, float, float, float],
) -> HeightField:
    """Check the parameters (see `elaphe_like`), and draw a patch of a species."""
    generator = species.name
    size, shape, seeds = grid(generator, extent, pixels, seed, (2.0, 500.0))
    full = number_between(depth, f"{generator}: depth", 0.0, 10.0, " µm")
    names = ("irregularity", "bending", "roughness", "dirt")
    irregularity, bending, roughness, dirt = (
        number_between(value, f"{generator}: {name}", 0.0, 3.0)
        for name, value in zip(names, amounts, strict=True)
    )
    # one random stream per structure, so that leaving one out does not change the others
    rngs = [np.random.default_rng(stream) for stream in seeds.spawn(7)]
    rows = lay_out(rngs[0], size, species.layout.scaled(irregularity))
    heights = _surface(rngs[1], size, shape, rows, species, roughness)
    heights += bending * _bent(rngs[2], size, shape, species)
    heights += beads(rngs[3], size, shape, rows, dirt * species.beads)
    heights += debris(rngs[4], size, shape, dirt * species.debris)
    heights += flakes(rngs[5], size, shape, dirt * species.flakes)
    heights += scratches(rngs[6], size, shape, dirt * species.scratches)
    heights -= heights.mean()
    heights = full * np.clip(species.level + heights / species.depth, 0.0, 1.0)
    return patch(generator, heights, size)


def _surface(
    rng: Rng, extent: Pair, shape: Shape, rows: list[FingerRow], species: Species, roughness: float
) -> Real:
    """Draw sheets with frayed edges, streaks and pores of the floor, and noise, (ny, nx) in µm."""
    # scan lines run along x, and the probe meets an edge a little earlier or later on each
    fray = roughness * species.fray * grain(rng, extent, shape, (0.08, 0.018))
    heights, gap = overlay(rows, extent, fray, species.blade)
    heights = scipy.ndimage.gaussian_filter1d(
        heights, 0.024 * shape[1] / extent[0], axis=1, mode="wrap"
    )
    floor = ramp(0.0, 0.08, gap)
    heights -= 0.007 * floor * np.exp(-gap / 0.06)  # the floor dips towards the fingers' sides
    streaks = grain(rng, extent, shape, (0.05, 0.35))
    heights += roughness * species.streak * streaks * (0.5 + floor)
    pores = grain(rng, extent, shape, (0.04, 0.05))
    pores = np.maximum(pores, 0) * ramp(-0.5, 1.5, -streaks)  # pores lie in the grooves
    heights -= roughness * species.pore * pores * floor
    heights += roughness * species.fuzz * rng.standard_normal(shape)
    return heights


def _bent(rng: Rng, extent: Pair, shape: Shape, species: Species) -> Real:
    """Draw the bending of the whole scale and its creases, (ny, nx) in µm."""
    reach = 30.0  # correlation length of creases, µm
    bend = smooth_field(rng, extent, species.bend_reach, 3.3, species.bend_reach[0] / _COARSE)
    fold = smooth_field(rng, extent, (reach, reach), 4.0, reach / _COARSE)
    strength = smooth_field(rng, extent, (reach, reach), 4.0, reach / _COARSE)
    my, mx = fold.shape
    dy, dx = np.gradient(np.pad(fold, 1, mode="wrap"), extent[1] / my, extent[0] / mx)
    slope = np.hypot(dx, dy)[1:-1, 1:-1]
    away = fold / np.maximum(slope, 1e-3)  # about the distance from the line fold = 0, µm
    creases = np.maximum(strength, 0) * np.exp(-((away / 0.9) ** 2))
    y, x = np.mgrid[: shape[0], : shape[1]]
    bent, creased = (sample_field(field, shape[::-1], x, y) for field in (bend, creases))
    return species.bend * bent - species.crease * creased


def stamp(shape: Shape, extent: Pair, x: Real, y: Real, radius: Real, height: Real) -> Real:
    """Draw the upper envelope (ny, nx) of rounded bumps at (x, y) on the torus, µm.

    A bump is height·(1 − r²/radius²)² within its radius; the envelope is 0 between bumps.
    """
    ny, nx = shape
    dx, dy = extent[0] / nx, extent[1] / ny
    result = np.zeros(ny * nx)
    reach_x = math.ceil(float(radius.max(initial=0)) / dx)
    reach_y = math.ceil(float(radius.max(initial=0)) / dy)
    across = np.arange(-min(reach_x, nx // 2), min(reach_x, nx // 2) + 1)
    along = np.arange(-min(reach_y, ny // 2), min(reach_y, ny // 2) + 1)[:, None]
    step = max(1, 2**22 // (across.size * along.size))
    for first in range(0, x.size, step):  # at most some 4 million points at a time
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


def beads(rng: Rng, extent: Pair, shape: Shape, rows: list[FingerRow], density: float) -> Real:
    """Draw small round beads on the crests of fingers, in swarms; `density` per µm²."""
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


def debris(rng: Rng, extent: Pair, shape: Shape, density: float) -> Real:
    """Draw crumbs, alone or in loose heaps up to 2 µm across; `density` of heaps per µm²."""
    n = int(rng.poisson(density * extent[0] * extent[1]))
    spread = np.minimum(0.05 / (1 - rng.random(n)), 0.35)  # µm, heavy-tailed
    grains = rng.integers(1, 4, size=n) + np.floor(150 * spread**2).astype(np.int64)
    heap = np.repeat(np.arange(n), grains)
    x = (extent[0] * rng.random(n))[heap] + spread[heap] * rng.standard_normal(heap.size)
    y = (extent[1] * rng.random(n))[heap] + 1.3 * spread[heap] * rng.standard_normal(heap.size)
    radius = 0.08 + 0.2 * rng.random(heap.size) ** 2
    return stamp(shape, extent, x, y, radius, radius * (0.08 + 0.3 * rng.random(heap.size)))


def flakes(rng: Rng, extent: Pair, shape: Shape, density: float) -> Real:
    """Draw particles with flat, tilted tops and straight, steep sides; `density` per µm²."""
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
        covered = np.ix_(iy.astype(np.intp) % ny, ix.astype(np.intp) % nx)
        np.maximum.at(result, covered, z)
    return result


def scratches(rng: Rng, extent: Pair, shape: Shape, density: float) -> Real:
    """Draw thin broken lines, all at about the same angle; `density` per µm²."""
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
