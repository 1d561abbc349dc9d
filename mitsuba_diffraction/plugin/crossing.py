"""Pairs of directions that are not both above the surface (Dr.Jit)."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from .pair import Pair, Place, in_patch
from .roles import Float, Interaction, Mask, Rotation, Vector3f

#: Least |w|: where n cosθt and cosθi are alike ⟨|P|²⟩/w² has a limit, but 0/0 has none.
_LEAST_W = 1e-3
#: Sums of directions that tables reach, in units of k.
_FARTHEST = 2.0 - 1e-5


class Turned(Pair):
    """Two directions below the surface, as those above one whose heights point down.

    n : optical index of the medium that both are in.
    """

    above = False

    def __init__(self, si: Interaction, wo: Vector3f, rotation: Rotation, active: Mask, n: Float):
        side = mi.Vector3f(1.0, 1.0, -1.0)
        turned = mi.SurfaceInteraction3f(si)
        turned.wi = si.wi * side
        super().__init__(turned, wo * side, rotation, active)
        self.uv, self.w = -n * self.uv, n * self.w

    @property
    def place(self) -> Place:
        """Of the look-up; see `reached`."""
        return Place(dr.select(self.reached, self.uv, 0.0), self.w)

    @property
    def reached(self) -> Mask:
        """Whether tables reach so far."""
        return dr.squared_norm(self.uv) < _FARTHEST**2


class Crossing:
    """One direction above and one below the surface, in any order.

    Attributes
    ----------
    above, below : directions where they are measured; inside : the one in the dielectric.
    place : of the look-up.
    uv, w, cos_i, cos_o : what `PowerModel.density` asks of a pair.
    """

    def __init__(
        self,
        si: Interaction,
        wo: Vector3f,
        rotation: Rotation,
        active: Mask,
        n: Float,
        thin: bool,
    ) -> None:
        down = mi.Frame3f.cos_theta(si.wi) > 0.0
        level = mi.Vector3f(0.0, 0.0, 1.0)
        self.above = dr.select(active, dr.select(down, si.wi, wo), level)
        self.below = dr.select(active, dr.select(down, wo, si.wi), -level)
        self.n = n
        self.inside = _inside(self.below, n) if thin else self.below
        self.q0, self.q = self.above.z, -n * self.inside.z
        total = in_patch(self.above + n * self.inside, rotation)
        w = self.q - self.q0
        reached = dr.squared_norm(total) < _FARTHEST**2
        self.active = active & reached
        self.place = Place(
            dr.select(self.active, dr.select(w > 0.0, -total, total), 0.0),
            dr.maximum(dr.abs(w), _LEAST_W),
        )
        sides = Sides.of(n, thin, down)
        self.cos_i = sides.cosine(dr.abs(si.wi.z), n, down, thin)
        self.cos_o = dr.select(active, dr.abs(wo.z), 1.0)
        self.uv, self.w = -in_patch(sides.into * si.wi + sides.out * wo, rotation), self.place.w


@dataclass(frozen=True)
class Sides:
    """Optical indices of the sides that light comes from and goes to."""

    into: Float
    out: Float

    @classmethod
    def of(cls, n: Float, thin: bool, down: Mask) -> Sides:
        """Of light that goes through, downwards where `down`."""
        one = mi.Float(1.0)
        return cls(one, one) if thin else cls(dr.select(down, one, n), dr.select(down, n, one))

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
    """A direction below a sheet as it is within."""
    x, y = below.x / n, below.y / n
    return mi.Vector3f(x, y, -dr.sqrt(1.0 - dr.fma(x, x, y * y)))
