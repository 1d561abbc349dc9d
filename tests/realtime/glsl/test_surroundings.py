"""Distances on a grid, by which rays are marched past what stands in their way."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from mitsuba_diffraction.realtime.glsl.scene import triangles_of
from mitsuba_diffraction.realtime.glsl.surroundings import pack_obstacles


def test_a_ball_and_a_plate_are_as_far_away_as_they_are(some_variant: str) -> None:
    """Within the cells' diagonal and a step: a triangle lies anywhere in a cell."""
    ball = mi.load_dict({"type": "sphere", "center": [0.0, 0.0, 1.5], "radius": 1.0})
    plate = mi.load_dict({"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(2.0)})
    corners = np.concatenate([triangles_of(shape).positions for shape in (ball, plate)])
    packed = pack_obstacles(corners.reshape(-1, 3, 3).astype(np.float32))
    low, cell, size = (packed.uniforms[f"obstacles_{n}"] for n in ("low", "cell", "size"))
    texels = packed.textures[0].data.ravel()
    cells = np.random.default_rng(0).integers(0, size, (4000, 3))
    place = low + cell * (cells + 0.5)
    to_ball = np.abs(np.linalg.norm(place - [0.0, 0.0, 1.5], axis=1) - 1.0)
    outside = np.maximum(np.abs(place[:, :2]) - 2.0, 0.0)
    expected = np.minimum(to_ball, np.hypot(np.linalg.norm(outside, axis=1), place[:, 2])) / cell
    found = texels[(cells[:, 2] * size[1] + cells[:, 1]) * size[0] + cells[:, 0]] / 4.0
    near = expected < 60.0  # what a texel can hold
    assert near.mean() > 0.5
    assert np.abs(found - expected)[near].max() < 0.5 * 3**0.5 + 0.25


def test_no_ray_slips_through_a_large_triangle(some_variant: str) -> None:
    """Every cell along a line across it is at most a cell from an occupied one."""
    packed = pack_obstacles(np.array([[[0.0, 0, 0], [1, 0, 0.3], [0.2, 1, 0.7]]]))
    low, cell, size = (packed.uniforms[f"obstacles_{n}"] for n in ("low", "cell", "size"))
    texels = packed.textures[0].data.ravel()[: np.prod(size)].reshape(size[::-1])
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 20000)
    inside = weights @ [[0.0, 0, 0], [1, 0, 0.3], [0.2, 1, 0.7]]
    x, y, z = ((inside - low) / cell).astype(int).T
    assert (texels[z, y, x] == 0).mean() > 0.9
    assert texels[z, y, x].max() <= 4 * 3**0.5
