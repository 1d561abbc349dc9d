"""Fields of directions on meshes, and the meshes whose patch follows them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.orientation.directions import GUIDES, direction_field
from mitsuba_diffraction.scene.orientation.mesh_files import write_ply
from mitsuba_diffraction.scene.orientation.trimesh import (
    oriented_mesh,
    vertex_normals,
)
from scenes.make import disc
from tests.support.meshes import Arrays, ball, ring, wrapped


def bent_tube() -> tuple[Arrays, np.ndarray]:
    """Three quarters of a torus, open, and the direction along it."""
    mesh = ring(60, 16, radii=(3.0, 0.4), part=0.75)
    x, y, _ = mesh[0].T
    return mesh, np.stack([-y, x, 0 * x], axis=1) / np.hypot(x, y)[:, None]


@pytest.mark.parametrize("along", GUIDES)
@pytest.mark.parametrize(("mesh", "euler"), [(ball, 2), (ring, 0)])
def test_singular_points_add_up_to_the_euler_characteristic(mesh, euler, along):
    field = direction_field(*mesh(), along)
    assert field.indices.sum() == euler  # Poincaré–Hopf
    assert np.allclose(np.linalg.norm(field.directions, axis=1), 1)
    assert np.abs((field.directions * mesh()[1]).sum(axis=1)).max() < 1e-12


def test_the_smoothest_field_has_no_more_singular_points_than_it_must():
    assert list(direction_field(*ball()).indices) == [1, 1]
    assert not len(direction_field(*ring()).indices)


def test_an_axis_is_followed_where_it_lies_in_the_surface():
    positions, normals, faces = ball()
    field = direction_field(positions, normals, faces, "z")
    projected = [0.0, 0.0, 1.0] - normals[:, 2:] * normals
    sine = np.linalg.norm(projected, axis=1)
    cosine = (field.directions * projected).sum(axis=1) / np.maximum(sine, 1e-9)
    # meridians are their own best smoothing but near the poles, which the grid has in vertices
    assert np.degrees(np.arccos(np.clip(cosine[sine > 0.5], -1, 1))).max() < 2
    assert np.abs(field.singular[:, 2]).min() > 0.95


def test_a_current_runs_along_a_body():
    mesh, along = bent_tube()
    field = direction_field(*mesh, "body")
    assert not len(field.indices)
    cosine = (field.directions * along).sum(axis=1)
    sign = np.sign(np.median(cosine))
    angle = np.degrees(np.arccos(np.clip(sign * cosine, -1, 1)))
    # at its two ends the current gathers in one point: three widths away exp(−3 · 0.8 / 0.4), in
    # potential, is left of that; twice as much on both sides in slope, 0.3°
    i = np.arctan2(-along[:, 0], along[:, 1]) % (2 * np.pi)
    middle = (i > 2.4 / 3) & (i < 1.5 * np.pi - 2.4 / 3)
    assert angle[middle].max() < 0.6


def test_parts_that_do_not_touch_have_fields_of_their_own():
    positions, normals, faces = ball()
    two = np.concatenate([positions, 0.1 * positions + [5.0, 0.0, 0.0]])
    joined = np.concatenate([faces, faces + len(positions)])
    for along in GUIDES:
        field = direction_field(two, np.tile(normals, (2, 1)), joined, along)
        assert np.allclose(np.linalg.norm(field.directions, axis=1), 1), along
        assert field.indices.sum() == 4


def test_each_of_many_parts_has_a_current_of_its_own():
    """Strips of two triangles: in all of them alike, as if each were alone."""
    strip = np.array([[0.0, 0, 0], [2, 0, 0], [2, 0.5, 0], [0, 0.5, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    places = 3.0 * np.arange(3000)[:, None, None] * [0.0, 1.0, 0.0] + strip
    normals = np.tile([0.0, 0.0, 1.0], (len(places) * 4, 1))
    joined = faces + 4 * np.arange(len(places))[:, None, None]
    many = direction_field(places.reshape(-1, 3), normals, joined.reshape(-1, 3), "body")
    alone = direction_field(strip, normals[:4], faces, "body")
    same = np.abs((many.directions.reshape(-1, 4, 3) * alone.directions).sum(axis=2))
    assert same.min() > 1.0 - 1e-6


@pytest.mark.usefixtures("some_variant")
@pytest.mark.parametrize("own_uv", [True, False])
def test_mitsuba_lays_the_patch_along_the_field(own_uv: bool, tmp_path: Path) -> None:
    """The frame at a hit, turned by the attribute, is the interpolated field."""
    import mitsuba as mi

    positions, normals, faces = ball()
    field = direction_field(positions, normals, faces, "x").directions
    i, j, _ = wrapped(20, 40)
    uv = None if own_uv else np.stack([3 * j, i + 0.3 * j], axis=1)  # stretched and askew
    mesh = oriented_mesh(positions, normals, faces, field, uv)
    write_ply(tmp_path / "ball.ply", mesh)
    scene = mi.load_dict({"type": "scene", "ball": {
        "type": "ply", "filename": str(tmp_path / "ball.ply")}})  # fmt: skip
    corners = positions[faces]
    # close to a corner of every triangle
    places = np.einsum("fcx,c->fx", corners, [0.98, 0.01, 0.01])
    inwards = -places / np.linalg.norm(places, axis=1, keepdims=True)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f((places - inwards).T), mi.Vector3f(inwards.T)))
    turn = si.shape.eval_attribute_3("vertex_orientation", si)
    found = np.array(si.to_world(mi.Vector3f(turn.x, turn.y, 0.0))).T
    expected = field[faces[:, 0]]
    hit = np.array(si.is_valid())
    assert hit.mean() > 0.9  # the ends of triangles without area at the poles
    # next to the two singular points the field turns by up to 180° along an edge
    hit &= np.abs(positions[faces[:, 0], 0]) < 0.8
    cosine = (found * expected).sum(axis=1)[hit] / np.linalg.norm(found[hit], axis=1)
    # 2 % of the 20° that it turns by from corner to corner elsewhere
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.4


@given(
    arrays(np.int64, st.tuples(st.integers(1, 12), st.just(3)), elements=st.integers(0, 7)),
    st.integers(0, 99),
    st.sampled_from(GUIDES),
    st.booleans(),
)
@settings(max_examples=60)
def test_any_triangles_get_a_finite_field_or_are_refused(faces, seed, along, own_uv):
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(8, 3))
    normals = vertex_normals(positions, faces)
    try:
        field = direction_field(positions, normals, faces, along)
    except DiffractionError as error:
        assert "no triangle has an area" in str(error)
        return
    uv = None if own_uv else rng.normal(size=(8, 2))
    mesh = oriented_mesh(positions, normals, faces, field.directions, uv)
    assert np.isfinite(mesh.uv).all()
    assert np.isfinite(mesh.orientation).all()


@pytest.mark.parametrize("inner", [0.0, 2.0])
def test_a_disc_has_its_area_and_faces_up(inner: float) -> None:
    mesh = disc(inner, 5.0, sectors=360)
    corners = mesh.positions[mesh.faces]
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert up.min() > 0
    # a polygon of 360 corners lacks 5e-5 of the circle
    assert up.sum() == pytest.approx(np.pi * (25 - inner**2), rel=1e-4)
