"""Mesh files put on the stage of `scenes/own_mesh.xml`: upright, centred, standing on the floor."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from ..arrays import Real
from ..errors import DiffractionError, check_choice
from .orientation.directions import direction_field
from .orientation.interchange import stated_up
from .orientation.tangents import check_tangents
from .orientation.trimesh import TriangleMesh, check_finite, oriented_mesh

#: Values of `up`: the axis of the file that points upwards on the stage.
UPS = ("auto", "x", "y", "z", "-x", "-y", "-z")
#: Radius and height of the cylinder around the z axis that the camera of the stage sees whole.
STAGE_RADIUS, STAGE_HEIGHT = 4.2, 6.0
#: Values of `frame`: the camera moves until it sees the mesh, the mesh at all turns, or not at all.
FRAMES = ("none", "still", "turning")
# Part of the picture's width or height that the mesh fills, and azimuths of a mesh that turns.
_FILLED, _AZIMUTHS = 0.86, 48
# Least distance of a camera from the mesh, as a part of its longest side: off the tip of a needle.
_FREE = 0.1
# Vertices of the lowest 2 % count as feet: soles and bases are rarely flatter.
_FEET = 0.02
# A resting area that is twice as large overrules the convention of the file format.
_CLEARLY = 2.0
# Thickness of flat meshes and width of lines, as a part of their length; height of flat meshes over
# the floor, with which they would else coincide, and degrees by which they lean back: upright ones
# mirror the dark floor.
_FLAT, _LINE, _ABOVE, _LEANS = 1e-4, 1e-6, 0.01, 40.0


class MeshPlacement(NamedTuple):
    """Rotation, scale and shift that put a mesh on the stage.

    Attributes
    ----------
    up : axis of the file that points upwards.
    rotation : (3, 3), of determinant 1.
    scale : factor on all lengths.
    shift : (3,), added after rotation and scale.
    size : (3,) lengths of the fitted mesh along x, y and z.
    """

    up: str
    rotation: Real
    scale: float
    shift: Real
    size: Real

    def summary(self) -> dict[str, Any]:
        """Plain numbers, for printing."""
        return {
            "up": self.up,
            "factor on lengths": self.scale,
            "size on the stage, x y z": " x ".join(f"{length:.3g}" for length in self.size),
        }


def fit_of(mesh: TriangleMesh, file: Path, up: str = "auto") -> MeshPlacement:
    """Compute how a mesh is put on the stage.

    Raises a DiffractionError if `up` is not one of these, a vertex is not finite, or all are on a
    line.

    Parameters
    ----------
    mesh : vertices and normals.
    file : file of the mesh, whose format suggests an axis and whose name is quoted in errors.
    up : one of `UPS`; `auto` takes y or z, whichever the mesh stands on more firmly; a flat mesh
        leans back and faces the camera.
    """
    check_choice("up", up, UPS)
    positions = mesh.positions
    check_finite(positions, f"mesh '{file}'")
    centred = positions - positions.mean(axis=0)
    squares, axes = np.linalg.eigh(centred.T @ centred)
    if squares[1] <= _LINE**2 * squares[2]:
        raise DiffractionError(
            f"mesh '{file}': all its vertices are on a line, so it has no surface; export it again"
        )
    flat, guessed = bool(squares[0] <= _FLAT**2 * squares[2]), up == "auto"
    if guessed:
        up = _guessed_up(positions, file, flat)
    rotation = _upright(up)
    if guessed and flat:
        front = axes[:, 0] * (-1.0 if axes[:, 0] @ mesh.normals.sum(axis=0) < 0.0 else 1.0)
        rotation = _leaning(rotation @ front) @ rotation
    turned = positions @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    middle = (low + high) / 2
    radius = float(np.hypot(*(turned - middle)[:, :2].T).max())
    scale = STAGE_RADIUS / radius
    if (height := float(high[2] - low[2])) * scale > STAGE_HEIGHT:
        scale = STAGE_HEIGHT / height
    shift = -scale * np.array([middle[0], middle[1], low[2]])
    shift[2] += _ABOVE * flat
    return MeshPlacement(up, rotation, scale, shift, scale * (high - low))


def fitted_mesh(
    mesh: TriangleMesh, file: Path, *, fit: bool = True, up: str = "auto"
) -> TriangleMesh:
    """Return a mesh put on the stage, whose patch has a direction.

    The direction is the file's `vertex_orientation`; else ∂p/∂u where texture coordinates suit a
    patch; else the smoothest field of directions.

    Raises a DiffractionError if the mesh does not fit.
    """
    placed = fit_of(mesh, file, up)
    if mesh.orientation is None and check_tangents(mesh).usable:
        mesh = replace(mesh, orientation=np.tile([1.0, 0.0], (len(mesh.positions), 1)))
    if fit:
        positions = placed.scale * (mesh.positions @ placed.rotation.T) + placed.shift
        mesh = replace(mesh, positions=positions, normals=mesh.normals @ placed.rotation.T)
    if mesh.orientation is not None and mesh.uv is not None:
        return mesh
    field = direction_field(mesh.positions, mesh.normals, mesh.faces)
    made = oriented_mesh(mesh.positions, mesh.normals, mesh.faces, field.directions, mesh.uv)
    return replace(made, materials=mesh.materials)


def framing(positions: Real, camera: Real, tangents: tuple[float, float]) -> Real:
    """Return where a camera sees all vertices as large as possible, its direction unchanged.

    Parameters
    ----------
    positions : (n, 3) vertices.
    camera : (3, 3), columns are the camera's axes; the third points forwards.
    tangents : of half the angles of view along the first two axes.

    Each edge of the picture is a plane through the camera, which the outermost vertex touches: in
    the camera's axes |x − c_x| ≤ t (z − c_z) for all vertices. A tip narrower than the angle of
    view would touch all of them where the camera is: the camera stays a tenth of the mesh away.
    """
    local = positions @ camera
    t = _FILLED * np.array(tangents)
    across, away = local[:, :2], t * local[:, 2:]
    upper, lower = (across - away).max(axis=0), (-across - away).max(axis=0)
    free = local[:, 2].min() - _FREE * float(np.ptp(local, axis=0).max())
    depth = min((-(upper + lower) / (2.0 * t)).min(), free)
    return np.asarray(camera @ [*(upper - lower) / 2.0, depth])


def turned_around(positions: Real) -> Real:
    """Return vertices (m, 3) of the solid that a mesh sweeps when it turns around the z axis."""
    radius, z = np.hypot(positions[:, 0], positions[:, 1]), positions[:, 2]
    layer = np.floor(63.999 * (z - z.min()) / max(float(np.ptp(z)), 1e-12)).astype(np.intp)
    widest = np.zeros(64)
    np.maximum.at(widest, layer, radius)
    heights = z.min() + np.ptp(z) * np.arange(65) / 64
    around = 2 * np.pi * np.arange(_AZIMUTHS) / _AZIMUTHS
    circle = np.stack([np.cos(around), np.sin(around)], axis=-1)
    ends = np.column_stack([heights[:-1], heights[1:]]).ravel()
    rings = widest.repeat(2)[:, None, None] * circle
    return np.column_stack([rings.reshape(-1, 2), ends.repeat(_AZIMUTHS)])


def _upright(up: str) -> Real:
    """Return the rotation (3, 3) that turns an axis of the file to z."""
    axis = {"x": 0, "y": 1, "z": 2}[up[-1]]
    rotation = np.roll(np.eye(3), 2 - axis, axis=0)
    if up[-1] == "y":  # x stays, so that the front of a y-up mesh looks towards the camera
        rotation = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    if up[0] == "-":
        rotation = np.diag([1.0, -1.0, -1.0]) @ rotation
    return rotation


def _leaning(front: Real) -> Real:
    """Return the rotation (3, 3) after which a unit normal looks to the camera and upwards."""
    azimuth = math.atan2(-front[0], -front[1]) if np.hypot(*front[:2]) > _LINE else 0.0
    lean = math.radians(_LEANS) - math.asin(np.clip(front[2], -1.0, 1.0))
    return np.asarray(Rotation.from_euler("zx", [azimuth, -lean]).as_matrix())


def _guessed_up(positions: Real, file: Path, flat: bool) -> str:
    """Return y or z: the convention of the format, unless the mesh stands better on the other.

    Blender, scanners and CAD write PLY with z up; OBJ has y up in most programs. glTF and USD state
    the axis.
    """
    if (stated := stated_up(file)) is not None:
        return stated
    usual, other = ("z", "y") if file.suffix.lower() == ".ply" else ("y", "z")
    if flat:
        return usual
    areas = {up: _resting_area(positions @ _upright(up).T) for up in (usual, other)}
    return other if areas[other] > _CLEARLY * areas[usual] else usual


def _resting_area(positions: Real) -> float:
    """Area of the convex hull of the feet, as a share of the bounding box seen from above."""
    low, sides = positions.min(axis=0), np.ptp(positions, axis=0)
    feet = positions[positions[:, 2] <= low[2] + _FEET * sides[2], :2]
    try:
        return float(ConvexHull(feet).volume / (sides[0] * sides[1]))
    except (QhullError, ValueError):  # fewer than three feet, or all on a line
        return 0.0
