"""Triangles of Mitsuba's shapes, and distances for marched rays."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, bsdf_dict, gratings
from mitsuba_diffraction.realtime.glsl.packed_scene import PackedScene
from mitsuba_diffraction.realtime.glsl.scene import triangles_of, winding_of
from mitsuba_diffraction.realtime.glsl.surroundings import pack_obstacles


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("kind", ["sphere", "cylinder", "disk", "rectangle"])
def test_normals_are_mitsubas(some_variant: str, kind: str, flipped: bool) -> None:
    """At the first hit of a ray through each triangle's middle."""
    turn = mi.ScalarTransform4f().rotate([1, 0, 0], 70)
    shape = mi.load_dict({"type": kind, "flip_normals": flipped, "to_world": turn})
    scene = mi.load_dict({"type": "scene", "shape": shape})
    made = triangles_of(shape)
    corners, normals = (x.reshape(-1, 3, 3)[::97] for x in (made.positions, made.normals))
    middles = corners.mean(axis=1)
    # from beside the triangle, straight onto it
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    kept = np.linalg.norm(flat, axis=1) > 1e-9  # at a pole they are lines
    flat = flat[kept] / np.linalg.norm(flat[kept], axis=1, keepdims=True)
    origin, towards = (mi.Point3f((middles[kept] + 0.01 * flat).T), mi.Vector3f(-flat.T))
    found = scene.ray_intersect(mi.Ray3f(origin, towards))
    expected = np.array(found.sh_frame.n).reshape(3, -1).T
    mean = normals.mean(axis=1)[kept]
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    assert len(mean) > 0
    assert np.array(found.is_valid()).all()
    assert np.abs(mean - expected).max() < 0.02


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_closed_surfaces_are_told_from_open_ones(some_variant: str, mirrored: float) -> None:
    to_world = mi.ScalarTransform4f().scale([mirrored, 1.0, 1.0])
    for kind, closed in (("sphere", True), ("cube", True), ("cylinder", False), ("disk", False)):
        shape = mi.load_dict({"type": kind, "to_world": to_world})
        triangles = triangles_of(shape).positions.reshape(-1, 3, 3)
        a, b, c = triangles[1]
        turn = np.sign(np.cross(b - a, c - a) @ (a + b + c))  # as seen from outside a convex body
        assert winding_of(triangles) == (turn if closed else 0), kind


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


def test_relief_ends_where_a_table_does(some_variant: str) -> None:
    """Beyond it powers would be those at its end, and scales of energy extrapolated."""
    field = gratings.sinusoidal(1.6, 0.05, periods=2)
    sensor = {"type": "perspective", "film": {"type": "hdrfilm"}}
    for most, octaves in ((1.0, (-1.0, 0.0)), (1.5, (-1.0, 0.0, 0.5))):
        table = DiffractionTable.build(field, coherence_width=6, height_scale_max=most)
        surface = bsdf_dict(table, energy_conserving=False)
        scene = {"type": "scene", "disk": {"type": "disk", "bsdf": surface}, "sensor": sensor}
        assert PackedScene(mi.load_dict(scene), 0, (-1.0, 0.0, 0.5)).octaves == octaves
