"""Light that surfaces of a scene send to each other, path-traced onto a coarse grid.

Shaders draw direct light. Rays of lobes that meet a surface, and matt surfaces, look up the rest
here: the mean radiance that leaves the surfaces of a cell, and the mean radiance that arrives there
from other surfaces, each towards six directions (an ambient cube, McTaggart 2004).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ...arrays import Real
from ...shading.spectra import uploaded, vectors_of
from .scene import RealtimeScene
from .texels import Packed, pack_grid

_BATCHES, _POINTS = 2, 1 << 16  # batches, and points of each that two paths begin at
_DEPTH = 7  # largest number of segments of a path
_CELLS = 1 << 14  # approximate number of cells
_ROOM = 0.6  # margin of the grid around what diffracts, in diagonals of its box
_RARE = 1e-3  # share of places beyond either side of the grid
_FLAT = 1.0 / 16.0  # least side of the grid, in its largest side
_BRIGHTEST = 32.0  # radiance of a path at most, in means over all: caustics are found by chance
_BLUR = 0.6  # standard deviation of the filter over cells
_REACH = 2.0  # cells next to those with light that have the light of the nearest


def pack_bounces(mitsuba_scene: Any, scene: RealtimeScene) -> Packed:
    """Trace the light between the surfaces of a scene, for shaders/bounces.glsl."""
    low, high = scene.subject
    room = _ROOM * float(np.linalg.norm(high - low))
    low, high = np.maximum(low - room, scene.low), np.minimum(high + room, scene.high)
    rng = np.random.default_rng(0)
    traced = []
    for seed in range(_BATCHES):
        origins = low + rng.random((_POINTS, 3)) * (high - low)
        traced.append(_traced(mitsuba_scene, origins, rng, seed))
        if seed == 0:  # beyond walls and under floors no light is looked up
            low, high = _lit_box(traced[0][0][0][0], low, high)
    middle = 0.5 * (low + high)
    sides = np.maximum(high - low, _FLAT * max(float((high - low).max()), 1e-12))
    cell = float((sides.prod() / _CELLS) ** (1.0 / 3.0))
    size = np.ceil(sides / cell).astype(int)
    low = middle - 0.5 * cell * size
    sums = np.zeros((2, 2, 3, *size[::-1], 4))  # kinds, signs, axes, cells, colours and weight
    for kinds in traced:
        for kind, parts in zip(sums, kinds, strict=True):
            for places, axes, radiance in parts:
                _add(kind, (places - low) / cell, axes, radiance)
    light = _filled(sums)
    # entries of a cell: kind, axis, sign
    entries = light.transpose(3, 4, 5, 0, 2, 1, 6).reshape(-1, 3)
    half = np.minimum(np.pad(entries, [(0, 0), (0, 1)]), 6e4).astype(np.float16)
    return pack_grid("bounces", half, low, cell, size) | Packed(definitions={"BOUNCES": ""})


#: Places of surfaces, directions that light leaves along or normals that it arrives at, and its
#: radiance in linear sRGB, (n, 3) each.
_Light = tuple[Real, Real, Real]


def _lit_box(places: Real, low: Real, high: Real) -> tuple[Real, Real]:
    """Return the corners of a box around nearly all places (n, 3) that lie in another box."""
    inside = places[((places >= low) & (places <= high)).all(axis=1)]
    if not len(inside):
        return low, high
    return np.quantile(inside, _RARE, axis=0), np.quantile(inside, 1.0 - _RARE, axis=0)


def _traced(scene: Any, origins: Real, rng: np.random.Generator, seed: int) -> list[list[_Light]]:
    """Trace two paths from each of the points that random rays from origins (n, 3) meet.

    Returns the light that leaves the surfaces which rays to and from these points meet, and the
    light that arrives at the points from other surfaces.
    """
    import mitsuba as mi

    directions = rng.normal(size=origins.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    to_points = mi.Ray3f(mi.Point3f(*uploaded(origins)), mi.Vector3f(*uploaded(directions)))
    points, seen = _met(scene, to_points, True)
    local = mi.warp.square_to_cosine_hemisphere(
        mi.Point2f(*uploaded(rng.random((len(origins), 2))))
    )
    away = points.spawn_ray(points.to_world(local))
    others, met = _met(scene, away, seen)
    count = len(origins)
    begin, along = vectors_of(away.o, count), vectors_of(away.d, count)
    active = np.concatenate([np.array(mask, bool).ravel() for mask in (seen, met)])
    radiance = _radiance(
        scene, np.concatenate([origins, begin]), np.concatenate([directions, along]), active, seed
    )
    first, second = np.split(radiance, 2)
    used, hit = np.split(active, 2)
    places = vectors_of(points.p, count)[used]
    return [
        [(places, -directions[used], first[used]),
         (vectors_of(others.p, count)[hit], -along[hit], second[hit])],
        [(places, vectors_of(points.sh_frame.n, count)[used], second[used])],
    ]  # fmt: skip


def _met(scene: Any, rays: Any, active: Any) -> tuple[Any, Any]:
    """Intersect rays; the second value is whether they meet the front of a surface without light.

    The back of a surface may be the inside of a closed one.
    """
    si = scene.ray_intersect(rays, active)
    return si, si.is_valid() & ~si.shape.is_emitter() & (si.wi.z > 0.0)


def _radiance(
    scene: Any, origins: Real, directions: Real, active: NDArray[np.bool_], seed: int
) -> Real:
    """Path-trace the radiance along rays (n, 3), linear sRGB (n, 3), and 0 of inactive ones."""
    import drjit as dr
    import mitsuba as mi

    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(origins))
    rays = mi.Ray3f(mi.Point3f(*uploaded(origins)), mi.Vector3f(*uploaded(directions)))
    weight = mi.Spectrum(1.0)
    if mi.is_spectral:
        rays.wavelengths, weight = mi.sample_rgb_spectrum(mi.sample_shifted(sampler.next_1d()))
    known = uploaded(active[:, None])[0] > 0.0
    integrator = mi.load_dict({"type": "path", "max_depth": _DEPTH})
    spectrum, _, _ = integrator.sample(scene, sampler, rays, None, known)
    colour = mi.unpolarized_spectrum(spectrum) * weight
    if mi.is_spectral:
        colour = mi.spectrum_to_srgb(colour, rays.wavelengths)
    known &= dr.isfinite(colour[0] + colour[1] + colour[2])
    radiance = vectors_of(dr.select(known, mi.Color3f(colour), 0.0), len(origins))
    return np.clip(radiance, 0.0, _BRIGHTEST * max(float(radiance.mean()), 1e-30))


def _add(sums: Real, places: Real, axes: Real, radiance: Real) -> None:
    """Add radiances (n, 3) at places (n, 3), in cells, to sums over signs, axes and cells."""
    size = np.array(sums.shape[4:1:-1])
    x, y, z = np.clip(places.astype(int), 0, size - 1).T
    cell = (z * size[1] + y) * size[0] + x
    values = np.pad(radiance, [(0, 0), (0, 1)], constant_values=1.0)
    flat = sums.reshape(2, 3, -1, 4)
    for axis in range(3):
        for sign in range(2):
            weights = values * np.maximum((1 - 2 * sign) * axes[:, axis, None], 0.0) ** 2
            for n in range(4):
                flat[sign, axis, :, n] += np.bincount(cell, weights[:, n], flat.shape[2])


def _filled(sums: Real) -> Real:
    """Return the means (kinds, signs, axes, cells, 3), also in neighbours of cells with light."""
    blurred = scipy.ndimage.gaussian_filter(
        sums, (0, 0, 0, _BLUR, _BLUR, _BLUR, 0), mode="constant"
    )
    means = blurred[..., :3] / np.maximum(blurred[..., 3:], 1e-30)
    for index in np.ndindex(*sums.shape[:3]):
        empty = blurred[(*index, ..., 3)] < 1e-2
        if empty.all():
            continue
        apart, nearest = scipy.ndimage.distance_transform_edt(empty, return_indices=True)
        means[index] = means[index][tuple(nearest)] * (apart <= _REACH)[..., None]
    return np.asarray(means)
