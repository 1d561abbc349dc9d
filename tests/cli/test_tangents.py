"""`tangents`: a mesh in, the same mesh with a field for its patch out."""

from __future__ import annotations

import json

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.scene.orientation import (
    TriangleMesh,
    grid_faces,
    load_mesh,
    texture_tangents,
    write_ply,
)
from scenes.make import knot
from tests.support.meshes import obj_of, ring


@pytest.fixture
def bare(tmp_path, monkeypatch):
    """A coarse knot as OBJ, in the current folder."""
    monkeypatch.chdir(tmp_path)
    positions, _, faces = knot(60, 8)
    obj_of(tmp_path / "bare.obj", positions, faces)
    return "bare.obj"


@pytest.fixture
def ball(tmp_path):
    """An octahedron whose triangles were halved four times, on the unit sphere."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2],
                      [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])  # fmt: skip
    for _ in range(4):
        a, b, c = (corners[faces[:, n]] for n in range(3))
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        every = np.concatenate([np.stack(t, 1) for t in
                                ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])  # fmt: skip
        corners, index = np.unique(every.reshape(-1, 3), axis=0, return_inverse=True)
        faces = index.reshape(-1, 3)
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    obj_of(tmp_path / "ball.obj", corners, faces)
    return tmp_path / "ball.obj"


def test_a_mesh_without_texture_coordinates_gets_a_field(run, bare):
    ran = run("tangents", bare, "-o", "field.ply")
    assert ran.code == 0, ran.err
    assert "field.ply: 960 triangles, patch along smooth, had no texture coordinates" in ran.out
    assert "the field is smooth everywhere" in ran.out  # a knot's tube is a torus
    assert '"usable": true' in run("info", "field.ply", "--json").out
    mesh = mi.load_dict({"type": "ply", "filename": "field.ply"})
    turn = np.array(mi.traverse(mesh)["vertex_orientation"]).reshape(-1, 3)
    np.testing.assert_allclose(np.hypot(turn[:, 0], turn[:, 1]), 1, atol=1e-6)
    # relative to the mean direction of the own triangle
    assert np.abs(np.degrees(np.arctan2(turn[:, 1], turn[:, 0]))).max() < 30


def test_singular_points_are_named(run, ball):
    out, report = ball.with_name("field.ply"), ball.with_name("field.json")
    ran = run("tangents", ball, "-o", out, "--along", "z", "--json", report)
    assert ran.code == 0
    data = json.loads(report.read_text(encoding="utf-8"))
    assert sum(place["turns"] for place in data["singular"]) == 2
    assert data["tangents"]["has_orientation"]
    line = ran.out.splitlines()[1]
    assert line.startswith("2 singular points, with the turns around each: (")
    assert line.endswith("together +2")


def test_a_turn_is_counter_clockwise_from_outside(run, ball):
    """Along z, turned by a right angle, the patch's x axis points west: −φ, as z × n is east."""
    out = ball.with_name("field.ply")
    assert run("tangents", ball, "-o", out, "--along", "z", "--rotate", "90").code == 0
    mesh = load_mesh(out)
    corners, uv = mesh.positions[mesh.faces], mesh.uv[mesh.faces]
    along = texture_tangents(corners[:, 1:] - corners[:, :1], uv[:, 1:] - uv[:, :1])[0]
    middle = corners.mean(axis=1)
    west = np.cross(middle, [0.0, 0.0, 1.0])
    near = np.linalg.norm(west, axis=1) > 0.5
    cosine = (along * west).sum(axis=1) / np.linalg.norm(along, axis=1)
    # triangles are flat, and 6° wide
    assert (cosine / np.linalg.norm(west, axis=1))[near].min() > np.cos(np.radians(6))


def test_texture_coordinates_are_kept(run, tmp_path):
    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    positions = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    faces = grid_faces(np.arange(25).reshape(5, 5))[:, ::-1]
    uv = positions[:, 1::-1] * 3  # u runs along y
    normals = np.tile([0.0, 0.0, 1.0], (25, 1))
    write_ply(tmp_path / "in.ply", TriangleMesh(positions, normals, uv, faces))
    ran = run("tangents", tmp_path / "in.ply", "-o", tmp_path / "out.ply", "--along", "x")
    assert "texture coordinates kept" in ran.out
    got = load_mesh(tmp_path / "out.ply")
    np.testing.assert_allclose(got.uv, got.positions[:, 1::-1] * 3, atol=1e-6)
    mesh = mi.load_dict({"type": "ply", "filename": str(tmp_path / "out.ply")})
    turn = np.array(mi.traverse(mesh)["vertex_orientation"]).reshape(-1, 3)
    # from y, where dp/du points, to x
    np.testing.assert_allclose(turn, np.tile([0, -1, 0], (len(turn), 1)), atol=1e-6)


def test_a_field_that_breaks_along_lines_is_said_with_their_length(run, here):
    """Along z, a ring breaks along its top and its bottom, 2 · 2π in all; its size is 2.8."""
    obj_of(here / "ring.obj", *ring(48, 24, radii=(1.0, 0.4))[::2])
    ran = run("tangents", "ring.obj", "-o", "field.ply", "--along", "z")
    assert ran.code == 0
    assert "smooth everywhere" not in ran.out
    assert "no singular points, but breaks (turns by over 60 degrees) along lines of 1" in ran.out
    assert "warning: the patch's direction breaks" in ran.err
    assert "another guide of the command 'tangents', --along smooth or body" in ran.err
    data = json.loads(run("info", "field.ply", "--json").out)
    assert not data["usable"]
    # half a cell of 2π · 0.4 / 24 beside the circle of radius 1
    lines = data["lines along which the direction breaks"]
    assert lines["length"] == pytest.approx(4 * np.pi, rel=0.06)
    assert lines["length / mesh size"] == pytest.approx(lines["length"] / 2.8, rel=0.01)
    assert "breaks" in data["problems"][0]
    smooth = run("tangents", "ring.obj", "-o", "field.ply")
    assert "the field is smooth everywhere" in smooth.out
    assert not smooth.err
    assert json.loads(run("info", "field.ply", "--json").out)["usable"]


def test_triangles_too_coarse_for_a_field_are_said(run, here):
    """On each end of this cylinder the field runs outwards, within one ring of triangles."""
    angle = 2 * np.pi * np.arange(24) / 24
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    places = np.concatenate([circle, circle + np.array([0, 0, 2]), [[0, 0, 0], [0, 0, 2]]])
    here_, there = np.arange(24), (np.arange(24) + 1) % 24
    faces = [(here_, there, there + 24), (here_, there + 24, here_ + 24),
             (there, here_, 0 * here_ + 48), (here_ + 24, there + 24, 0 * here_ + 49)]  # fmt: skip
    obj_of(here / "can.obj", places, np.concatenate([np.stack(f, 1) for f in faces]))
    ran = run("tangents", "can.obj", "-o", "field.ply", "--along", "z")
    assert "warning: the patch's direction breaks" in ran.err
    assert "use a finer mesh, or choose another guide" in ran.err
    assert not json.loads(run("info", "field.ply", "--json").out)["usable"]
