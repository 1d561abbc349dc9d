"""A piece of skin with a few scales, for close views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mitsuba_diffraction.scene.orientation import TriangleMesh

from .anatomy import Anatomy
from .limits import check_limits
from .pelt import pelt
from .scales import Scales
from .skin import Skin

_MARGIN = 4  # scales at each end whose relief is lower, as it is towards head and tail


def piece(
    anatomy: Anatomy | None = None,
    scales: Scales | None = None,
    *,
    columns: int = 6,
    rows: int = 9,
) -> TriangleMesh:
    """The middle of the back of a straight snake, whose tail points to +x; lengths in cm, z up.

    The highest place of the smooth skin lies at the origin. Texture coordinates are those of
    `snake.build`, in circumferences from the piece's middle: u runs to the tail, v around.

    Parameters
    ----------
    anatomy, scales : proportions; None means the defaults, with 12 subdivisions of a scale's edge.
    columns, rows : how many scales along and across.

    Raises
    ------
    DiffractionError
        If a number is out of its range.
    """
    anatomy, scales = anatomy or Anatomy(), scales or Scales(detail=12)
    check_limits({"columns": columns, "rows": rows},
                 {"columns": (2, 40), "rows": (3, scales.rows)}, "piece")  # fmt: skip
    spine = np.zeros((50, 3))
    spine[:, 0] = np.linspace(0, anatomy.length, len(spine))
    skin = Skin(anatomy, spine)
    middle = round(0.45 * skin.u_max / scales.pitch)
    first = middle - columns // 2 - _MARGIN
    mesh = pelt(skin, scales, first, first + columns + 2 * _MARGIN).mesh

    u, v = mesh.uv.T
    centre = middle * scales.pitch
    near = np.abs(u - centre) <= columns * scales.pitch / 2
    near &= np.abs(v - 0.5) <= rows * scales.row_pitch / 2
    faces = mesh.faces[near[mesh.faces].all(axis=1)]
    used, renumbered = np.unique(faces, return_inverse=True)
    top = skin.points(np.array([centre]), np.array([0.5]))
    return replace(
        mesh,
        positions=mesh.positions[used] - top,
        normals=mesh.normals[used],
        uv=mesh.uv[used] - [centre, 0.0],
        faces=renumbered.reshape(-1, 3),
        orientation=None if mesh.orientation is None else mesh.orientation[used],
    )
