"""Triangles of Mitsuba's shapes."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.realtime.glsl.scene import triangles_of


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
