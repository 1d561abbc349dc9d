"""Pairs of directions that are not both above the surface (Dr.Jit)."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from ...optics.coat import refracted
from ..directions import Pair, PatchFrame, TablePoint
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
        """Return the coordinates to look up; 0 where not `reached`."""
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
        self.inside = self.below
        if thin:
            x, y, z = refracted(self.below, n)
            self.inside = mi.Vector3f(x, y, -z)
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
