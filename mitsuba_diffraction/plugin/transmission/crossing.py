"""Pairs of directions that are not both above the surface, and their Jones matrices (Dr.Jit).

The matrices are the twin of `optics.through`, which gives the formulas and their sources.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from ..boundary import LEVEL, Jones, turn, turned
from ..directions import Pair, PatchFrame, TablePoint
from ..fresnel import root
from ..layers import transmittances
from ..types import Float, Interaction, Mask, Vector3f

#: Least |w|: where n cosθt and cosθi are alike the power of an order other than 0 over w² has a
#: limit, which single precision loses in the difference of all orders and order 0.
_LEAST_W = 0.01
#: Sums of directions that tables reach, in units of k.
_FARTHEST = 2.0 - 1e-5


class Turned(Pair):
    """Two directions below the surface, turned over: as if above a surface of negative heights.

    n : optical index of the medium that both are in.
    """

    above = False

    def __init__(self, si: Interaction, wo: Vector3f, frame: PatchFrame, active: Mask, n: Float):
        side = mi.Vector3f(1.0, 1.0, -1.0)
        turned = mi.SurfaceInteraction3f(si)
        turned.wi = si.wi * side
        super().__init__(turned, wo * side, frame, active)
        self.uv, self.w = -n * self.uv, n * self.w

    @property
    def place(self) -> TablePoint:
        """Return the point of tables to look up; see `reached`."""
        return TablePoint(dr.select(self.reached, self.uv, 0.0), self.w)

    @property
    def reached(self) -> Mask:
        """Whether tables hold these frequencies."""
        return dr.squared_norm(self.uv) < _FARTHEST**2


class Crossing:
    """A pair of directions, one above and the other below the surface, in any order.

    Attributes
    ----------
    above, below : directions where they are measured; inside : the one in the dielectric.
    place : of the look-up.
    uv, w, cos_i, cos_o, frame : what `PowerModel.density` asks of a pair.
    """

    def __init__(
        self,
        si: Interaction,
        wo: Vector3f,
        frame: PatchFrame,
        active: Mask,
        n: Float,
        thin: bool,
    ) -> None:
        down = mi.Frame3f.cos_theta(si.wi) > 0.0
        level = mi.Vector3f(0.0, 0.0, 1.0)
        self.above = dr.select(active, dr.select(down, si.wi, wo), level)
        self.below = dr.select(active, dr.select(down, wo, si.wi), -level)
        self.n, self.frame = n, frame
        self.inside = _inside(self.below, n) if thin else self.below
        self.q0, self.q = self.above.z, -n * self.inside.z
        total = frame.to_table(self.above + n * self.inside)
        w = self.q - self.q0
        reached = dr.squared_norm(total) < _FARTHEST**2
        self.active = active & reached
        self.place = TablePoint(
            dr.select(self.active, dr.select(w > 0.0, -total, total), 0.0),
            dr.maximum(dr.abs(w), _LEAST_W),
        )
        sides = Sides.of(n, thin, down)
        self.cos_i = sides.cosine(dr.abs(si.wi.z), n, down, thin)
        self.cos_o = dr.select(active, dr.abs(wo.z), 1.0)
        self.uv, self.w = -frame.to_table(sides.into * si.wi + sides.out * wo), self.place.w


@dataclass(frozen=True)
class Sides:
    """Optical indices of the sides that light comes from and goes to."""

    into: Float
    out: Float

    @classmethod
    def of(cls, n: Float, thin: bool, down: Mask) -> Sides:
        """Return the indices of light that goes through, downwards where `down`."""
        outside = mi.Float(1.0)
        if thin:
            return cls(outside, outside)
        return cls(dr.select(down, outside, n), dr.select(down, n, outside))

    @staticmethod
    def cosine(cosine: Float, n: Float, down: Mask, thin: bool) -> Float:
        """Half of w of the refracted direction, which is what tables sample from as cosθi."""
        square = n * n - 1.0
        deeper = dr.sqrt(dr.fma(cosine, cosine, square)) - cosine
        if thin:
            return 0.5 * deeper
        inside = n * cosine
        outer = inside - dr.safe_sqrt(dr.fma(inside, inside, -square))
        return 0.5 * dr.select(down, deeper, outer)


def _inside(below: Vector3f, n: Float) -> Vector3f:
    """Return a direction below a sheet, refracted into the sheet."""
    x, y = below.x / n, below.y / n
    return mi.Vector3f(x, y, -dr.sqrt(1.0 - dr.fma(x, x, y * y)))


def crossing_axes(came: Vector3f, left: Vector3f) -> tuple[Vector3f, Vector3f]:
    """Return the axes s of light along two directions (`optics.boundary`)."""
    axes = []
    for direction in (came, left):
        square = dr.square(direction.x) + dr.square(direction.y)
        slanted = square > LEVEL
        inverse = dr.rsqrt(dr.select(slanted, square, 1.0))
        axes.append((slanted, mi.Vector3f(-direction.y * inverse, direction.x * inverse, 0.0)))
    (is_came, s_came), (is_left, s_left) = axes
    s_came = dr.select(is_came, s_came, dr.select(is_left, s_left, mi.Vector3f(0.0, 1.0, 0.0)))
    return s_came, dr.select(is_left, s_left, s_came)


def out_of_sheet(jones: Jones, crossing: Crossing) -> Jones:
    """See `optics.through.out_of_sheet`."""
    left, came = (
        transmittances(cosine, crossing.n) for cosine in (-crossing.below.z, crossing.above.z)
    )
    shares = [t * dr.rcp(dr.fma(-(1.0 - t), 1.0 - other, 1.0)) for t in left for other in came]
    return tuple(entry * dr.sqrt(share) for entry, share in zip(jones, shares, strict=True))


def order_0(crossing: Crossing, axes: tuple[Vector3f, Vector3f], thin: bool) -> Jones:
    """Jones matrix of order 0 (`optics.through.order_0`)."""
    n = crossing.n
    ends = [
        [t * dr.rcp(2.0 - t) if thin else t for t in transmittances(cosine, n)]
        for cosine in (crossing.above.z, _outer_cosine(crossing, thin))
    ]
    dot = dr.dot(*axes)
    cross = dr.fma(axes[0].x, axes[1].y, -axes[0].y * axes[1].x)
    # at the critical angle and beyond, the root's derivative would be infinite
    roots = [[dr.sqrt(dr.sqrt(dr.maximum(t, 1e-14))) for t in end] for end in ends]
    (s_in, p_in), (s_out, p_out) = roots
    return s_out * s_in * dot, -s_out * p_in * cross, p_out * s_in * cross, p_out * p_in * dot


def _outer_cosine(crossing: Crossing, thin: bool) -> Float:
    """Cosine above the surface of the light below it; 0 beyond the critical angle."""
    if thin:
        return -crossing.below.z
    inside = crossing.inside
    sine = dr.square(crossing.n) * (dr.square(inside.x) + dr.square(inside.y))
    return dr.safe_sqrt(1.0 - sine)


def first_order(crossing: Crossing, axes: tuple[Vector3f, Vector3f], thin: bool) -> Jones:
    """Return 2 cosθi cosθt B (`optics.through.small_slope`)."""
    n, above, inside = crossing.n, crossing.above, crossing.inside
    squares = [dr.square(d.x) + dr.square(d.y) for d in (above, inside)]
    epsilon = n * n
    outer = 1.0 - epsilon * squares[1]
    # Beyond the critical angle light fades outside; from outside it never is there
    q = root(outer if thin else mi.Complex2f(outer, 0.0))
    q0_inside = dr.sqrt(epsilon - squares[0])
    dot = dr.dot(*axes)
    cross = dr.fma(axes[0].x, axes[1].y, -axes[0].y * axes[1].x)
    contrast = (epsilon - 1.0) * -2.0 * above.z * inside.z
    s0, p0 = dr.rcp(crossing.q0 + q0_inside), dr.rcp(epsilon * crossing.q0 + q0_inside)
    s, p = contrast * dr.rcp(q + crossing.q), contrast * n * dr.rcp(epsilon * q + crossing.q)
    sines = n * dr.safe_sqrt(squares[0] * squares[1])
    return (
        s * (s0 * dot),
        -(s * (q0_inside * p0 * cross)),
        q * p * (s0 * cross),
        p * p0 * (q * (q0_inside * dot) + sines),
    )


def tangent_plane(crossing: Crossing, axes: tuple[Vector3f, Vector3f]) -> Jones:
    """Return 2 cosθi cosθt K (`optics.through.kirchhoff`)."""
    n, above, inside = crossing.n, crossing.above, crossing.inside
    total = -(above + n * inside)
    length = dr.norm(total)
    normal = total * dr.rcp(dr.maximum(length, 1e-6))
    cos_in, cos_out = dr.dot(above, normal), -dr.dot(inside, normal)
    refracts = (cos_in > 0.0) & (cos_out > 0.0)
    cos_in = dr.select(refracts, cos_in, 1.0)
    scale = dr.select(refracts, 2.0 * cos_in * cos_out * length, 0.0)
    t_s, t_p = scale * dr.rcp(cos_in + n * cos_out), scale * dr.rcp(n * cos_in + cos_out)
    axis = dr.cross(inside, above)
    square = dr.squared_norm(axis)
    slanted = square > LEVEL
    axis = dr.select(slanted, axis * dr.rsqrt(dr.select(slanted, square, 1.0)), axes[0])
    zero = mi.Float(0.0)
    return turned((t_s, zero, zero, t_p), turn(axes[1], axis, inside), turn(axis, axes[0], -above))
