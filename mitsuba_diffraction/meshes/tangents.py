"""Does a mesh have the tangents that a measured patch needs?

A patch is laid along dp/du, which Mitsuba takes from the texture coordinates of each triangle. So a
mesh needs texture coordinates, they must span an area in every triangle, and dp/du must not jump
between neighbours: where it does, the patch turns suddenly and the colours show a seam.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

KINDS = {".ply": "ply", ".obj": "obj", ".serialized": "serialized"}
TURN = 30.0  # degrees between neighbours from which on a seam shows
FLAT = 1e-3  # of the typical ratio of texture area to surface area: as good as none


@dataclass(frozen=True)
class TangentReport:
    """What `check_tangents` found; shares are of the surface area, 0 to 1.

    Attributes
    ----------
    triangles : number of triangles with an area.
    has_uv, has_normals : whether the mesh carries them.
    degenerate : share whose texture coordinates span no area: no tangent there.
    mirrored : share where u × v runs the other way round: the patch is seen mirrored.
    turning : share beside an edge across which dp/du turns by more than 30 degrees.
    stretch : median ratio of |dp/du| to |dp/dv| (1: no direction is stretched).
    """

    triangles: int
    has_uv: bool
    has_normals: bool
    degenerate: float
    mirrored: float
    turning: float
    stretch: float

    @property
    def usable(self) -> bool:
        """True where a patch can follow nearly all of the surface."""
        return self.has_uv and self.degenerate < 0.01 and self.turning < 0.05

    def problems(self) -> list[str]:
        """One line for each thing that speaks against this mesh, with what to do."""
        if not self.has_uv:
            return [
                "no texture coordinates, so the patch has no direction: give the mesh one with "
                "'mitsuba-diffraction tangents', or unwrap it so that u runs the way the patch's x "
                "axis shall"
            ]
        lines = []
        if not self.has_normals:
            lines.append("no vertex normals: every triangle reflects like a flat mirror")
        if self.degenerate >= 0.01:
            lines.append(
                f"{self.degenerate:.0%} of the surface has texture coordinates without area, hence "
                "no tangent: unwrap those parts"
            )
        if self.turning >= 0.05:
            lines.append(
                f"dp/du turns by over {TURN:g} degrees between neighbours on {self.turning:.0%} of "
                "the surface: colours will show seams; unwrap along the body in one piece"
            )
        if 0.01 < self.mirrored < 0.99:
            lines.append(
                f"{self.mirrored:.0%} of the surface shows the patch mirrored: flip those parts"
            )
        return lines

    def summary(self) -> dict[str, int | bool | float | list[str]]:
        """Plain numbers and strings, for printing."""
        return {
            "triangles": self.triangles,
            "texture coordinates": self.has_uv,
            "normals": self.has_normals,
            "without tangent": self.degenerate,
            "mirrored": self.mirrored,
            "turning tangent": self.turning,
            "stretch": self.stretch,
            "usable": self.usable,
            "problems": self.problems(),
        }


def load_mesh(
    path: str | os.PathLike[str],
) -> tuple[Floats, Floats | None, Floats | None, Ints]:
    """Positions (n, 3), normals (n, 3) or None, texture coordinates (n, 2) or None, faces (m, 3).

    Reads what Mitsuba reads: .ply, .obj, .serialized.

    Raises
    ------
    DiffractionError
        If there is no such file, or it is no mesh of these kinds.
    """
    file = Path(path)
    kind = KINDS.get(file.suffix.lower())
    if kind is None:
        raise DiffractionError(f"mesh '{file}': its name must end in {', '.join(KINDS)}")
    if not file.is_file():
        raise DiffractionError(f"mesh '{file}': there is no such file")
    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    # without normals first: making them, Mitsuba follows indices that point nowhere
    mesh = _load(file, kind, face_normals=True)
    faces = np.array(mi.traverse(mesh)["faces"], dtype=np.int64).reshape(-1, 3)
    if not len(faces):
        raise DiffractionError(f"mesh '{file}': it has no triangles")
    if faces.max() >= mesh.vertex_count():
        raise DiffractionError(
            f"mesh '{file}': a triangle names vertex {faces.max()}, but there are only "
            f"{mesh.vertex_count()}; export the mesh again"
        )
    mesh = _load(file, kind, face_normals=False)
    values = mi.traverse(mesh)

    def array(name: str, width: int) -> Floats:
        return np.array(values[name], dtype=np.float64).reshape(-1, width)

    normals = array("vertex_normals", 3) if mesh.has_vertex_normals() else None
    uv = array("vertex_texcoords", 2) if mesh.has_vertex_texcoords() else None
    return array("vertex_positions", 3), normals, uv, faces


def _load(file: Path, kind: str, face_normals: bool) -> mi.Mesh:
    try:
        return mi.load_dict({"type": kind, "filename": str(file), "face_normals": face_normals})
    # what Mitsuba throws, text that is not UTF-8, and sizes beyond the memory
    except (RuntimeError, ValueError, MemoryError) as error:
        lines = str(error).split(": ", 1)[-1].split()
        reason = " ".join(lines)[-200:] or type(error).__name__
        raise DiffractionError(f"mesh '{file}': cannot be read: {reason}") from error


def check_tangents(
    positions: Floats, normals: Floats | None, uv: Floats | None, faces: Ints
) -> TangentReport:
    """Judge the tangents of a mesh, as Mitsuba will compute them; arrays as from `load_mesh`."""
    sides = positions[faces[:, 1:]] - positions[faces[:, :1]]  # (m, 2, 3)
    across = np.cross(sides[:, 0], sides[:, 1])
    area = np.linalg.norm(across, axis=1) / 2
    real = area > 0
    faces, sides, across, area = faces[real], sides[real], across[real], area[real]
    total = area.sum()
    if uv is None or not len(faces):
        return TangentReport(len(faces), uv is not None, normals is not None, 1.0, 0.0, 0.0, 0.0)

    dp_du, dp_dv, signed = tangents(sides, uv[faces[:, 1:]] - uv[faces[:, :1]])
    ratio = np.abs(signed) / area
    outward = across if normals is None else normals[faces].sum(axis=1)
    mirrored = (np.cross(dp_du, dp_dv) * outward).sum(axis=1) < 0
    flat = ~(ratio > FLAT * np.median(ratio))
    good = ~flat
    tangent = np.zeros_like(dp_du)
    tangent[good] = dp_du[good] / np.linalg.norm(dp_du[good], axis=1, keepdims=True)
    turning = _turning(positions, faces, across / (2 * area[:, None]), tangent, good)
    lengths = np.linalg.norm(dp_du[good], axis=1), np.linalg.norm(dp_dv[good], axis=1)
    return TangentReport(
        triangles=len(faces),
        has_uv=True,
        has_normals=normals is not None,
        degenerate=float(area[flat].sum() / total),
        mirrored=float(area[good & mirrored].sum() / total),
        turning=float(area[turning].sum() / total),
        stretch=float(np.median(lengths[0] / lengths[1])) if good.any() else 0.0,
    )


def tangents(sides: Floats, uv_sides: Floats) -> tuple[Floats, Floats, Floats]:
    """dp/du and dp/dv of triangles, (m, 3) each, and the signed areas of their (u, v), (m,).

    Solves sides = uv_sides · (dp/du, dp/dv); where (u, v) span no area the result is zero.
    """
    (du0, dv0), (du1, dv1) = uv_sides[:, 0].T, uv_sides[:, 1].T
    determinant = du0 * dv1 - dv0 * du1
    safe = np.where(determinant == 0, np.inf, determinant)[:, None]
    dp_du = (dv1[:, None] * sides[:, 0] - dv0[:, None] * sides[:, 1]) / safe
    dp_dv = (du0[:, None] * sides[:, 1] - du1[:, None] * sides[:, 0]) / safe
    return dp_du, dp_dv, determinant / 2


def carried(vectors: Floats, before: Floats, after: Floats) -> Floats:
    """Vectors (n, 3) turned by the smallest rotation of one unit normal to another (Rodrigues)."""
    axis = np.cross(before, after)
    cosine = (before * after).sum(axis=1, keepdims=True)
    along = (axis * vectors).sum(axis=1, keepdims=True) / np.maximum(1 + cosine, 1e-3)
    return vectors * cosine + np.cross(axis, vectors) + axis * along


def _turning(
    positions: Floats, faces: Ints, normals: Floats, tangent: Floats, good: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Triangles next to an edge across which the tangent turns, the fold of the surface apart."""
    # vertices are split along seams of the texture, so neighbours are found by position
    welded = np.unique(positions, axis=0, return_inverse=True)[1].reshape(-1)[faces]
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort(np.sort(edges, axis=1).T)
    edges, owner = np.sort(edges, axis=1)[order], owner[order]
    pair = (edges[1:] == edges[:-1]).all(axis=1)
    one, two = owner[:-1][pair], owner[1:][pair]

    # sharp folds (scale edges, corners of a box) are edges of the surface, not of the texture
    smooth = good[one] & good[two] & ((normals[one] * normals[two]).sum(axis=1) > 0.5)
    one, two = one[smooth], two[smooth]
    laid_over = carried(tangent[one], normals[one], normals[two])  # a fold alone is no turn
    turn = (laid_over * tangent[two]).sum(axis=1) < np.cos(np.radians(TURN))
    marked = np.zeros(len(faces), dtype=bool)
    marked[one[turn]] = marked[two[turn]] = True
    return marked
