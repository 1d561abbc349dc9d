"""A coiled snake with overlapping scales, as meshes whose first tangent runs along the body."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.scene.orientation import TriangleMesh

from . import head as ends
from .anatomy import Anatomy
from .pelt import pelt
from .scales import Scales
from .skin import Skin
from .spine import coil


@dataclass(frozen=True)
class Snake:
    """A snake's meshes, and the skin and scales that made them (textures need both)."""

    body: TriangleMesh
    eyes: TriangleMesh
    skin: Skin
    scales: Scales


def build(
    anatomy: Anatomy | None = None,
    scales: Scales | None = None,
    *,
    coils: float = 2.35,
    squeeze: float = 0.82,
    heading: float = -75.0,
    head_detail: int = 72,
) -> Snake:
    """Make a snake that lies coiled on the plane z = 0, its head on top; lengths in cm.

    In the body's texture coordinates u runs from snout to tail and v around from the belly, both
    in local circumferences; the seam lies under the belly. The orientation has the scales' `turn`
    and `fan`.

    Parameters
    ----------
    anatomy, scales : proportions; None means the defaults.
    coils, squeeze, heading : how it lies, see `spine.coil`.
    head_detail : rows of cells on the head.

    Raises
    ------
    DiffractionError
        If a parameter is out of its range, or the body does not fit into its coils.
    """
    anatomy, scales = anatomy or Anatomy(), scales or Scales()
    if not 8 <= head_detail <= 1000:
        raise DiffractionError(f"snake: head_detail = {head_detail} is outside 8 to 1000")
    skin = Skin(anatomy, coil(anatomy, coils, squeeze, heading))
    pitch = scales.pitch
    u_head = _where(skin, 0.90 * anatomy.head_length)
    first = int(np.ceil(u_head / pitch))
    last = int((skin.u_max - 0.25) / pitch)
    covered = pelt(skin, scales, first, last)

    # a head's shields lie over the first scales, the last scales over the tail tip
    step = 0.25 * pitch
    columns = 2 * head_detail
    front = ends.head(skin, first * pitch - step, 0.3 * scales.relief * pitch, head_detail, columns)
    rear = ends.tail(skin, last * pitch + step, 0.1 * scales.relief * pitch, 12, 32)
    body = ends.join([front, covered.mesh, rear])
    n_front, n_covered = len(front.positions), len(covered.mesh.positions)
    head_ring = np.arange(n_front - columns - 1, n_front)
    tail_ring = n_front + n_covered + np.arange(33)
    strips = [
        ends.strip(body.uv, head_ring, n_front + covered.front),
        ends.strip(body.uv, n_front + covered.rear, tail_ring),
    ]
    angle = np.radians(scales.turn)
    turns = np.tile([np.cos(angle), np.sin(angle)], (len(body.positions), 1))
    turns[n_front : n_front + n_covered] = covered.mesh.orientation
    body = dataclasses.replace(
        body,
        faces=np.concatenate([body.faces, *strips]),
        orientation=turns,
    )
    return Snake(body, ends.eyes(skin), skin, scales)


def _where(skin: Skin, arc: float) -> float:
    """The u at an arc length from the snout."""
    u: NDArray[np.float64] = np.linspace(0, skin.u_max, 20001)
    return float(np.interp(arc, skin.arc(u), u))
