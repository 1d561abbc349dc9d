"""Meshes of glTF and USD files: all of a file as one, placed as its scene has them.

Texture coordinates are Mitsuba's, whose v runs downwards in a picture, as Mitsuba reads OBJ files.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real, Whole
from ...errors import DiffractionError, one_line, quoted
from ...extras import optional
from ...files import GLTF, USD, path_beside, readable_file, refuse_pipe
from ...gltf import load_gltf
from ...inputs import note_input
from ...limits import MOST_PLACED, bounded_memory, check_content, check_count
from .mesh_indices import check_indices, fans
from .trimesh import MeshArrays, unit


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
    shown, size = f"mesh '{file}'", readable_file(file).stat().st_size
    try:
        with bounded_memory(size, shown):
            parts = list(_checked_parts(reader(package, file), size, shown))
    except (DiffractionError, MemoryError):
        raise
    except Exception as error:  # whatever the packages make of damaged files
        reason = one_line(str(error))[-200:] or type(error).__name__
        raise DiffractionError(
            f"mesh '{file}': cannot be read: {reason}; export it again, without compression"
        ) from error
    if not parts:
        raise DiffractionError(f"mesh '{file}': it has no triangles")
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    parts = [p._replace(faces=p.faces + start) for p, start in zip(parts, starts, strict=False)]
    arrays: list[Any] = [_joined(each) for each in zip(*parts, strict=True)]
    return MeshArrays(*arrays)


def _checked_parts(parts: Iterable[MeshArrays], size: int, shown: str) -> Iterator[MeshArrays]:
    """Yield the parts that have triangles.

    Raises a DiffractionError if a triangle names no vertex, or parts grow beyond the file's limit.
    """
    claimed = 0.0
    for number, part in enumerate(parts, 1):
        check_count(number, MOST_PLACED, shown, "placed meshes or more")
        claimed += sum(array.nbytes for array in part if array is not None)
        check_content(claimed, size, shown)
        check_indices(part.faces, len(part.positions), shown)
        if len(part.faces):
            yield part


def stated_up(file: Path) -> str | None:
    """Return the axis that points upwards, y or z, if the format or the file states it."""
    suffix = file.suffix.lower()
    if suffix in USD:
        geometry = optional("pxr.UsdGeom", f"mesh '{file}'")
        return str(geometry.GetStageUpAxis(_stage(file))).lower()
    return "y" if suffix in GLTF else None


def _joined(parts: Sequence[NDArray[Any] | None]) -> NDArray[Any] | None:
    """Return rows of all parts, or None if one has none."""
    present = [part for part in parts if part is not None]
    return np.concatenate(present) if len(present) == len(parts) else None


def _placed(
    matrix: Real, positions: Real, normals: Real | None, uv: Real | None, faces: Whole
) -> MeshArrays:
    """Transform a mesh by a matrix (4, 4); faces stay counter-clockwise from outside."""
    linear = matrix[:3, :3]
    if np.linalg.det(linear) < 0.0:
        faces = faces[:, ::-1]
    if normals is not None:
        normals = unit(normals @ np.linalg.inv(linear))
    return MeshArrays(positions @ linear.T + matrix[:3, 3], normals, uv, faces)


def _gltf_parts(trimesh: Any, file: Path) -> Iterator[MeshArrays]:
    """Yield the meshes of a glTF file; `trimesh` turns v upwards."""
    scene = load_gltf(file, f"mesh '{file}'")
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
        )._replace(materials=np.full(len(mesh.faces), int(mesh.visual.material.name)))


def _stage(file: Path) -> Any:
    """Open a USD file."""
    usd, sdf = optional("pxr.Usd", f"mesh '{file}'"), optional("pxr.Sdf", f"mesh '{file}'")
    try:
        _check_layers(sdf, file)
        return usd.Stage.Open(str(file))
    except DiffractionError:
        raise
    except Exception as error:  # Tf.ErrorException, over several lines
        raise DiffractionError(f"mesh '{file}': cannot be read as USD") from error


def _check_layers(sdf: Any, file: Path) -> None:
    """Refuse a USD file that is composed of files outside of its folder, before they are opened."""
    waiting, seen = [file], set()
    while waiting:
        layer_file = waiting.pop()
        if layer_file in seen:
            continue
        seen.add(layer_file)
        note_input(layer_file)
        refuse_pipe(layer_file)
        layer = sdf.Layer.FindOrOpen(str(layer_file)) if layer_file.is_file() else None
        if layer is None:
            continue  # USD warns of it
        for name in layer.GetCompositionAssetDependencies():
            if name.startswith("`"):
                raise DiffractionError(
                    f"mesh '{file}': its name of a file {quoted(name)} is an expression; write the "
                    "name itself"
                )
            # a file in an archive: archive.usdz[file.usda]
            path = layer_file.parent / name.partition("[")[0]
            path_beside(file, str(path.absolute()))
            waiting.append(path)


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
        if (counts < 0).any() or counts.sum() != len(corners):
            raise DiffractionError(
                f"mesh '{file}': faceVertexCounts of {prim.GetPath()} are {counts.sum()} corners, "
                f"and faceVertexIndices {len(corners)}; export the mesh again"
            )
        check_indices(corners, len(points.reshape(-1, 3)), f"mesh '{file}'")
        faces = fans(counts)
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


def _of_corners(values: Any, interpolation: str, corners: Whole, counts: Whole) -> Real | None:
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
