"""Triangles of Mitsuba's shapes, with the tangents that Mitsuba shades them with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.orientation.trimesh import grid_faces, texture_tangents

Array = NDArray[np.float64]

_RINGS, _SEGMENTS = 192, 384  # of a sphere: 3e-5 of its radius away from it


@dataclass(frozen=True)
class Triangles:
    """Vertices in world space, three after another making a triangle.

    Attributes
    ----------
    positions, normals, tangents : (n, 3); tangents are ∂p/∂u, of any length.
    texcoords : (n, 2).
    vertices : (n,) index of each in the mesh that it comes from, or None.
    """

    positions: Array
    normals: Array
    tangents: Array
    texcoords: Array
    vertices: NDArray[np.int64] | None = None


def triangles_of(shape: Any) -> Triangles | None:
    """A shape's triangles, or None for a kind that cannot be shown."""
    maker = _ANALYTIC.get(shape.class_name())
    if maker is not None:
        import mitsuba as mi

        to_world = np.array(mi.traverse(shape)["to_world"].matrix, np.float64).reshape(4, 4)
        return _placed(maker(), to_world, *a_normal(shape))
    return _of_mesh(shape) if shape.is_mesh() else None


def a_normal(shape: Any) -> tuple[Array, Array]:
    """A place on a shape and its normal there, (3,) each: which way `flip_normals` has it."""
    import mitsuba as mi

    found = shape.sample_position(0.0, mi.Point2f(0.3, 0.4))
    place, normal = (np.array(x, np.float64).reshape(3, -1)[:, 0] for x in (found.p, found.n))
    return place, normal


def _placed(local: Triangles, to_world: Array, place: Array, normal: Array) -> Triangles:
    """In the world, with normals on the side that this one at a place is on."""
    linear = to_world[:3, :3]
    positions = local.positions @ linear.T + to_world[:3, 3]
    normals = local.normals @ np.linalg.inv(linear)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nearest = ((positions - place) ** 2).sum(axis=1).argmin()
    return Triangles(
        positions=positions,
        normals=-normals if normals[nearest] @ normal < 0.0 else normals,
        tangents=local.tangents @ linear.T,
        texcoords=local.texcoords,
    )


def _of_mesh(shape: Any) -> Triangles:
    """Mitsuba shades a triangle with one tangent, that of its texture coordinates."""

    def buffer(values: Any, width: int) -> Array:
        return np.array(values, np.float64).reshape(-1, width)[corners]

    corners = np.array(shape.faces_buffer(), np.int64).ravel()
    positions = buffer(shape.vertex_positions_buffer(), 3)
    sides = positions.reshape(-1, 3, 3)[:, 1:] - positions[::3, None]
    flat = np.cross(sides[:, 0], sides[:, 1])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
    normals = np.repeat(flat, 3, axis=0)
    if shape.has_vertex_normals():
        normals = buffer(shape.vertex_normals_buffer(), 3)
    tangents = across(flat)
    texcoords = np.zeros((len(corners), 2))
    if shape.has_vertex_texcoords():
        texcoords = buffer(shape.vertex_texcoords_buffer(), 2)
        uv_sides = texcoords.reshape(-1, 3, 2)[:, 1:] - texcoords[::3, None]
        dp_du, _, area = texture_tangents(sides, uv_sides)
        tangents = np.where(area[:, None] != 0.0, dp_du, tangents)
    return Triangles(positions, normals, np.repeat(tangents, 3, axis=0), texcoords, corners)


def across(normals: Array) -> Array:
    """Mitsuba's tangent where there are no texture coordinates (Duff et al. 2017)."""
    x, y, z = normals.T
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    return np.stack([1.0 + sign * x * x * a, sign * x * y * a, -sign * x], axis=1)


def _grid(rows: int, columns: int, point: Callable[[Array, Array], tuple[Array, ...]]) -> Triangles:
    """Triangles of a parametrisation (u, v) ↦ position, normal, tangent."""
    s, t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    position, normal, tangent = point(s.ravel(), t.ravel())
    index = grid_faces(np.arange(s.size).reshape(s.shape).T).ravel()
    uv = np.stack([s.ravel(), t.ravel()], axis=1)
    return Triangles(position[index], normal[index], tangent[index], uv[index])


def _rectangle() -> Triangles:
    def point(u: Array, v: Array) -> tuple[Array, ...]:
        p = np.stack([2.0 * u - 1.0, 2.0 * v - 1.0, 0.0 * u], axis=1)
        return p, np.tile([0.0, 0.0, 1.0], (len(u), 1)), np.tile([2.0, 0.0, 0.0], (len(u), 1))

    return _grid(1, 1, point)


def _sphere() -> Triangles:
    def point(u: Array, v: Array) -> tuple[Array, ...]:
        phi, theta = 2 * np.pi * u, np.pi * v
        p = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], 1)
        return p, p, np.stack([-np.sin(phi), np.cos(phi), 0.0 * phi], axis=1)

    return _grid(_RINGS, _SEGMENTS, point)


def _disk() -> Triangles:
    def point(u: Array, v: Array) -> tuple[Array, ...]:
        # Mitsuba's u is the radius, v the azimuth
        phi = 2 * np.pi * v
        radial = np.stack([np.cos(phi), np.sin(phi), 0.0 * phi], axis=1)
        return u[:, None] * radial, np.tile([0.0, 0.0, 1.0], (len(u), 1)), radial

    return _grid(_SEGMENTS, 8, point)


def _cylinder() -> Triangles:
    def point(u: Array, v: Array) -> tuple[Array, ...]:
        phi = 2 * np.pi * u
        p = np.stack([np.cos(phi), np.sin(phi), v], axis=1)
        normal = np.stack([np.cos(phi), np.sin(phi), 0.0 * phi], axis=1)
        return p, normal, np.stack([-np.sin(phi), np.cos(phi), 0.0 * phi], axis=1)

    return _grid(1, _SEGMENTS, point)


_ANALYTIC = {"Rectangle": _rectangle, "Sphere": _sphere, "Disk": _disk, "Cylinder": _cylinder}
