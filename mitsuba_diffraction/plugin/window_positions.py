"""Positions of the coherence window on the patch, for `coherence="surface"`.

A window centred on x turns the amplitude of order j by exp(−i q_j·x). x is the point's position on
the surface, from its UV coordinates, in the patch's axes. The patch tiles the plane; at random, it
is by-example noise (Heitz and Neyret 2018): the plane is cut into triangles, each of whose corners
c has a window of its own, shifted on the patch by a random s_c, and the fields P_c of the three are
blended to

    P = a_0 ĝ + Σ_c w_c (P_c − a_0 ĝ) / √(Σ_c w_c²),   w the barycentric coordinates.

All orders but order 0 have phases uniform over shifts, so that P_c − a_0 ĝ has no mean and the
blend the same mean power, and where P is a Gaussian random field, as on rough surfaces, its
statistics.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError
from ..heights.lengths import numbers_of
from ..settings import SURFACE
from ..tables import DiffractionTable
from .arithmetic import index_of
from .directions import PatchFrame
from .memory import index_between
from .properties import choice, coherence_of
from .types import Float, Interaction, Properties, Rotation, Vector2f

#: Parameters of coherence='surface'.
PLACING = ("uv_scale", "world_scale", "tiling")
TILINGS = ("periodic", "random")
#: µm a unit; beyond, single precision holds positions on the surface to no better than 1 µm.
MOST_UV_SCALE = 1e7
#: Corners are numbered from minus this on: single precision has twice as many whole numbers.
_MOST_CORNERS = 2.0**22


@dataclass  # not frozen: Dr.Jit assigns to it in loops
class PlacedWindow:
    """A window at a point of the surface, by the phases that it gives to orders.

    Attributes
    ----------
    turn : (x, y), the turns of an order's phase a bin, −½ … ½.
    steps : the same as (cos, sin) of 2π turn.
    weight : of its amplitude without order 0.
    """

    turn: Vector2f
    steps: tuple[Rotation, Rotation]
    weight: Float

    @classmethod
    def of(cls, turn: Vector2f, weight: Float) -> PlacedWindow:
        """Make the window of a turn of any size."""
        turn = turn - dr.round(turn)
        x, y = (dr.sincos(2.0 * dr.pi * part)[::-1] for part in turn)
        return cls(turn, (x, y), weight)


class WindowPositions:
    """Windows on a patch for points of the surface.

    Parameters
    ----------
    scale : µm a unit of u and of v; or, `in_world`, µm a unit of length of the scene.
    table : of the patch.
    tiling : of `TILINGS`.
    """

    def __init__(
        self, scale: tuple[float, float], in_world: bool, tiling: str, table: DiffractionTable
    ) -> None:
        self._name = f"{'world' if in_world else 'uv'}_scale = {scale[0]:g} {scale[1]:g}, {tiling}"
        self._in_world, self._random = in_world, tiling == "random"
        extent = [2.0 * math.pi / spacing for spacing in table.spacing]
        # Narrower tiles would change within a window, wider ones show the patch again
        self._side = max(table.coherence_width, 0.5 * max(extent))
        self._scale = mi.Vector2f(*scale)
        self._patches = mi.Vector2f(1.0 / extent[0], 1.0 / extent[1])  # a µm
        dr.make_opaque(self._scale, self._patches)

    def at(self, si: Interaction, frame: PatchFrame) -> list[PlacedWindow]:
        """Return the windows at points of the surface, one or three."""
        position = self._position(si)
        if not self._random:
            return [self._window(position, frame, mi.Vector2f(0.0), mi.Float(1.0))]
        corners, weights = _triangle(position / self._side)
        norm = dr.rsqrt(sum(dr.square(w) for w in weights))
        windows = []
        for corner, weight in zip(corners, weights, strict=True):
            offset = position - self._side * _unskewed(corner)
            windows.append(self._window(offset, frame, _shift(corner), weight * norm))
        return windows

    def _position(self, si: Interaction) -> Vector2f:
        """Return the position along the shading frame's tangents, µm; v may run either way."""
        uv, s, t = si.uv, si.sh_frame.s, si.sh_frame.t
        if self._in_world:
            along = si.dp_du * uv.x + si.dp_dv * uv.y
            return mi.Vector2f(dr.dot(along, s), dr.dot(along, t)) * self._scale
        return mi.Vector2f(uv.x, dr.mulsign(uv.y, dr.dot(si.dp_dv, t))) * self._scale

    def _window(
        self, position: Vector2f, frame: PatchFrame, shift: Vector2f, weight: Float
    ) -> PlacedWindow:
        """Return the window at a position (µm), shifted by so many patches."""
        return PlacedWindow.of(frame.position(position) * self._patches + shift - 0.5, weight)

    def __str__(self) -> str:
        return self._name


def window_positions(props: Properties, table: DiffractionTable) -> WindowPositions | None:
    """Positions of windows on the patch, from UV coordinates with a scale."""
    tiling = choice(props, "tiling", TILINGS)
    scales: dict[str, tuple[float, ...]] = {}
    # Checked in any case: one scene may be rendered with every coherence
    for name, most in ((PLACING[0], 2), (PLACING[1], 1)):
        if name not in props:
            continue
        numbers = numbers_of(props.get(name)) or ()
        if not (1 <= len(numbers) <= most and all(0.0 < n <= MOST_UV_SCALE for n in numbers)):
            expected = "one number" if most == 1 else "one number or two, 'u, v',"
            raise DiffractionError(
                f"{name}={props.get(name)!r} must be {expected} of µm, above 0 and at most "
                f"{MOST_UV_SCALE:g}"
            )
        scales[name] = tuple(numbers)
    if coherence_of(props) != SURFACE:
        return None
    if len(scales) != 1:
        raise DiffractionError(
            f"coherence='{SURFACE}' takes one of uv_scale, µm a unit of UV coordinates, and "
            f"world_scale, µm a unit of length of the scene; got {' and '.join(scales) or 'none'}"
        )
    ((name, numbers),) = scales.items()
    return WindowPositions((numbers[0], numbers[-1]), name == "world_scale", tiling, table)


def _triangle(position: Vector2f) -> tuple[list[Vector2f], list[Float]]:
    """Return the corners of the triangle of side 1 around a position, and its coordinates."""
    y = position.y * (2.0 / math.sqrt(3.0))
    skewed = mi.Vector2f(dr.fma(-0.5, y, position.x), y)
    base = dr.floor(skewed)
    a, b = skewed - base
    upper = a + b > 1.0
    inner = dr.select(upper, a + b - 1.0, 1.0 - a - b)
    opposite = base + dr.select(upper, mi.Vector2f(1.0), 0.0)
    right, left = base + mi.Vector2f(1.0, 0.0), base + mi.Vector2f(0.0, 1.0)
    weights = [inner, dr.select(upper, 1.0 - b, a), dr.select(upper, 1.0 - a, b)]
    return [opposite, right, left], weights


def _unskewed(corner: Vector2f) -> Vector2f:
    """Return the position of a corner, in sides of a triangle."""
    return mi.Vector2f(dr.fma(0.5, corner.y, corner.x), corner.y * (0.5 * math.sqrt(3.0)))


def _shift(corner: Vector2f) -> Vector2f:
    """A corner's shift in patches, 0 … 1."""
    numbers = [
        index_of(index_between(part + _MOST_CORNERS, 0.0, 2.0 * _MOST_CORNERS)) for part in corner
    ]
    return mi.Vector2f(*(mi.Float(bits >> 8) * 2.0**-24 for bits in mi.sample_tea_32(*numbers)))
