"""Meshes of glTF and USD files: all of a file as one, placed as its scene has them.

Texture coordinates are Mitsuba's, whose v runs downwards in a picture, as Mitsuba reads OBJ files.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DiffractionError, one_line
from ...extras import optional
from ...files import GLTF, USD
from ..meshes import Floats, Ints, MeshArrays


def interchange_mesh(file: Path) -> MeshArrays:
    """Read all triangles of a glTF or USD file.

    Normals and texture coordinates exist where all meshes of the file have them.

    Raises
    ------
    DiffractionError
        If the file cannot be read or has no triangles, or the format's package is missing.
    """
    reader = _gltf_parts if file.suffix.lower() in GLTF else _usd_parts
    package = optional("trimesh" if reader is _gltf_parts else "pxr.UsdGeom", f"mesh '{file}'")
    try:
        parts = [part for part in reader(package, file) if len(part.faces)]
    except DiffractionError:
        raise
    except Exception as error:  # whatever the packages make of damaged files
        reason = one_line(str(error))[-200:] or type(error).__name__
        raise DiffractionError(
            f"mesh '{file}': cannot be read: {reason}; export it again, without compression"
        ) from error
    if not parts:
        raise DiffractionError(f"mesh '{file}': it has no triangles")
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    return MeshArrays(
        np.concatenate([part.positions for part in parts]),
        _joined([part.normals for part in parts]),
        _joined([part.uv for part in parts]),
        np.concatenate(faces),
    )


def stated_up(file: Path) -> str | None:
    """Return the axis that points upwards, y or z, if the format or the file states it."""
    suffix = file.suffix.lower()
    if suffix in USD:
        geometry = optional("pxr.UsdGeom", f"mesh '{file}'")
        return str(geometry.GetStageUpAxis(_stage(file))).lower()
    return "y" if suffix in GLTF else None


def _joined(parts: list[Floats | None]) -> Floats | None:
    """Return rows of all parts, or None if one has none."""
    present = [part for part in parts if part is not None]
    return np.concatenate(present) if len(present) == len(parts) else None


def _placed(
    matrix: Floats, positions: Floats, normals: Floats | None, uv: Floats | None, faces: Ints
) -> MeshArrays:
    """Transform a mesh by a matrix (4, 4); faces stay counter-clockwise from outside."""
    linear = matrix[:3, :3]
    if np.linalg.det(linear) < 0.0:
        faces = faces[:, ::-1]
    if normals is not None:
        normals = normals @ np.linalg.inv(linear)
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return MeshArrays(positions @ linear.T + matrix[:3, 3], normals, uv, faces)


def _gltf_parts(trimesh: Any, file: Path) -> Iterator[MeshArrays]:
    """Yield the meshes of a glTF file; `trimesh` turns v upwards."""
    scene = trimesh.load_scene(file, process=False)
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh):  # points and lines
            continue
        uv = getattr(mesh.visual, "uv", None)
        # computed normals appear there at the first access
        stored = "vertex_normals" in mesh._cache  # noqa: SLF001 - of no public attribute
        yield _placed(
            np.array(matrix, np.float64),
            np.array(mesh.vertices, np.float64),
            np.array(mesh.vertex_normals, np.float64) if stored else None,
            None if uv is None else np.array(uv, np.float64) * [1.0, -1.0] + [0.0, 1.0],
            np.array(mesh.faces, np.int64),
        )


def _stage(file: Path) -> Any:
    """Open a USD file."""
    usd = optional("pxr.Usd", f"mesh '{file}'")
    try:
        return usd.Stage.Open(str(file))
    except Exception as error:  # Tf.ErrorException, over several lines
        raise DiffractionError(f"mesh '{file}': cannot be read as USD") from error


def _usd_parts(geometry: Any, file: Path) -> Iterator[MeshArrays]:
    """Yield the meshes of a USD file, polygons cut into fans, with a vertex for each corner."""
    stage, usd = _stage(file), optional("pxr.Usd")
    cache = geometry.XformCache()
    for prim in usd.PrimRange.Stage(stage, usd.TraverseInstanceProxies()):
        if (
            not prim.IsA(geometry.Mesh)
            or geometry.Imageable(prim).ComputeVisibility() == "invisible"
        ):
            continue
        mesh = geometry.Mesh(prim)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
        corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
        points = np.array(mesh.GetPointsAttr().Get() or [], np.float64)
        starts = np.cumsum(counts) - counts
        fans = [
            (start, start + n, start + n + 1)
            for start, count in zip(starts, counts, strict=True)
            for n in range(1, count - 1)
        ]
        faces = np.array(fans, np.int64).reshape(-1, 3)
        if mesh.GetOrientationAttr().Get() == "leftHanded":
            faces = faces[:, ::-1]
        own = geometry.Primvar(mesh.GetNormalsAttr())
        normals = _of_corners(own, mesh.GetNormalsInterpolation(), corners, counts)
        st = geometry.PrimvarsAPI(prim).GetPrimvar("st")
        uv = _of_corners(st, st.GetInterpolation(), corners, counts) if st else None
        yield _placed(
            np.array(cache.GetLocalToWorldTransform(prim), np.float64).T,
            points.reshape(-1, 3)[corners],
            normals,
            None if uv is None else uv * [1.0, -1.0] + [0.0, 1.0],
            faces,
        )


def _of_corners(values: Any, interpolation: str, corners: Ints, counts: Ints) -> Floats | None:
    """Return a primvar's value at each corner of the polygons, or None without values."""
    flat = values.ComputeFlattened()
    if not flat:
        return None
    rows = np.array(flat, np.float64)
    index = {
        "faceVarying": np.arange(len(corners)),
        "vertex": corners,
        "varying": corners,
        "uniform": np.repeat(np.arange(len(counts)), counts),
    }
    return rows[index[interpolation]] if interpolation in index else rows[np.zeros_like(corners)]
