"""Which triangles a shadow map needs."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.realtime.glsl.scene import triangles_of
from mitsuba_diffraction.realtime.glsl.shadows import Solid, outline


def solid_of(**shape: Any) -> Solid:
    found = triangles_of(mi.load_dict(shape))
    triangles, normals = (x.reshape(-1, 3, 3) for x in (found.positions, found.normals))
    return Solid.analyse(triangles, normals)


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_closed_surfaces_are_told_from_open_ones(some_variant: str, mirrored: float) -> None:
    to_world = mi.ScalarTransform4f().scale([mirrored, 1.0, 1.0])
    for kind, closed in (("sphere", True), ("cube", True), ("cylinder", False), ("disk", False)):
        shape = {"type": kind, "to_world": to_world}
        a, b, c = triangles_of(mi.load_dict(shape)).positions.reshape(-1, 3, 3)[1]
        turn = np.sign(np.cross(b - a, c - a) @ (a + b + c))  # as seen from outside a convex body
        assert solid_of(**shape).winding == (turn if closed else 0), kind


def test_what_is_more_bent_needs_more_bias(some_variant: str) -> None:
    flat, smooth = solid_of(type="rectangle").bias, solid_of(type="cylinder").bias
    assert 0.0 < flat < smooth < 0.1
    triangle = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    bent = np.array([[[0.0, 0.0, 1.0], [0.3, 0.0, 1.0], [0.0, 0.0, 1.0]]])
    assert Solid.analyse(triangle, bent).bias > 0.5


def test_an_outline_reaches_as_far_as_what_it_is_of() -> None:
    places = np.random.default_rng(0).normal(size=(5000, 3))
    directions = np.random.default_rng(1).normal(size=(3, 200))
    for some in (places, places * [1.0, 1.0, 0.0], places[:3]):
        around = outline(some)
        assert len(around) < 400 or not some[:, 2].any()
        assert np.allclose((around @ directions).max(axis=0), (some @ directions).max(axis=0))
