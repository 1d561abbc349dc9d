"""Lines along which a field breaks: as long on coarse meshes as on fine ones."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.scene.orientation.directions import direction_field
from mitsuba_diffraction.scene.orientation.tangents import check_tangents
from mitsuba_diffraction.scene.orientation.trimesh import grid_faces, oriented_mesh


def report_of(positions, normals, faces, along, smoothing=0.03):
    """What is found on a mesh that `tangents` makes."""
    field = direction_field(positions, normals, faces, along, smoothing=smoothing)
    mesh = oriented_mesh(positions, normals, faces, field.directions)
    return check_tangents(mesh.positions, mesh.normals, mesh.uv, mesh.faces, mesh.orientation)


def ring(n, m):
    """A torus around z of radii 1 and 0.42."""
    i, j = (
        2 * np.pi * k.ravel() / most for k, most in zip(np.indices((n, m)), (n, m), strict=True)
    )
    out = np.stack([np.cos(i), np.sin(i), 0 * i], axis=1)
    normals = np.cos(j)[:, None] * out + np.sin(j)[:, None] * [0.0, 0.0, 1.0]
    number = np.pad(np.arange(n * m).reshape(n, m), ((0, 1), (0, 1)), mode="wrap")
    return out + 0.42 * normals, normals, grid_faces(number)


def tube(n, m):
    """An open cylinder around z of radius 1 and height 3; the x axis is between vertices."""
    i, j = (k.ravel() for k in np.indices((n, m + 1)))
    angle = 2 * np.pi * (i + 0.5) / n
    normals = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    number = np.pad(np.arange(n * (m + 1)).reshape(n, m + 1), ((0, 1), (0, 0)), mode="wrap")
    return normals + np.outer(3.0 * j / m, [0.0, 0.0, 1.0]), normals, grid_faces(number)


def ball(n):
    """Of radius 1, with one vertex at each pole."""
    i, j = (k.ravel() for k in np.indices((n + 1, 2 * n + 1)))
    theta, phi = np.pi * i / n, np.pi * (j % (2 * n)) / n
    p = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
    p = np.round(p, 12) + 0.0
    return p, p, grid_faces(np.arange(len(p)).reshape(n + 1, 2 * n + 1))


# a field that is smooth over 0.28 breaks where it is smallest: measured, 0.06 further in
@pytest.mark.parametrize(("smoothing", "moved"), [(0.001, 0.0), (0.03, 0.0), (0.1, 0.06)])
@pytest.mark.parametrize("cells", [(24, 16), (60, 40)])
def test_a_ring_along_its_axis_breaks_along_two_circles(cells, smoothing, moved):
    report = report_of(*ring(*cells), "z", smoothing)
    # half a cell beside the circles of radius 1, which are polygons
    assert report.broken < 4 * np.pi
    assert report.broken == pytest.approx(4 * np.pi, rel=0.42 * np.pi / cells[1] + 0.01 + moved)
    assert report.size == pytest.approx(2.84)
    assert not report.usable
    assert "lines of 1" in report.problems()[0]


@pytest.mark.parametrize("cells", [(12, 1), (48, 20)])
def test_a_tube_across_its_axis_breaks_along_two_lines(cells):
    # in the middle of a strip of quadrangles, which are cut into triangles
    assert report_of(*tube(*cells), "x").broken == pytest.approx(6.0, rel=1e-6)


@pytest.mark.parametrize("mesh", [ring(48, 24), tube(48, 20)])
def test_a_smooth_field_does_not_break(mesh):
    report = report_of(*mesh, "smooth")
    assert report.broken == 0.0
    assert report.usable


@pytest.mark.parametrize("cells", [20, 32])
@pytest.mark.parametrize("along", ["z", "smooth", "body"])
def test_singular_points_are_no_lines(cells, along):
    assert report_of(*ball(cells), along).broken == 0.0


@pytest.mark.parametrize("cells", [8, 64])
def test_a_seam_of_the_texture_is_as_long_however_fine_the_mesh(cells):
    grid = (g.ravel() for g in np.meshgrid(*2 * [np.linspace(0, 1, cells + 1)], indexing="ij"))
    x, y = grid
    positions = np.stack([x, y, 0 * x], axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    faces = grid_faces(np.arange(len(x)).reshape(cells + 1, cells + 1))
    right = positions[faces].mean(axis=1)[:, 0] > 0.5
    faces[right] += len(x)  # where u runs along y
    uv = np.concatenate([np.stack([x, y], axis=1), np.stack([y, -x], axis=1)])
    two = np.tile(positions, (2, 1)), np.tile(normals, (2, 1))
    report = check_tangents(*two, uv, faces)
    assert report.broken == pytest.approx(1.0)
    assert not report.usable
    # turned back by the orientation, nothing is left of it
    back = np.repeat([[1.0, 0.0], [0.0, -1.0]], len(x), axis=0)
    assert check_tangents(*two, uv, faces, back).usable
