"""Pairs of directions in the patch's frame (Dr.Jit)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import drjit as dr
import mitsuba as mi

from ..optics.coat import cosine_within, refracted
from ..optics.mirror import (
    correction_within,
    horizon_correction,
    mirror_cosine,
    outside_square,
)
from .types import Float, Interaction, Mask, Rotation, Vector2f, Vector3f

#: (u, v) and w of a look-up in tables.
Place: TypeAlias = tuple[Vector2f, Float]
SHADOWINGS = ("none", "vcavity")
#: Least |w|: where n cosθt and cosθi are alike the power of an order other than 0 over w² has a
#: limit, which single precision loses in the difference of all orders and order 0.
_LEAST_W = 0.01
#: Sums of directions on the surface, in units of k, that tables reach at any stretch.
_FARTHEST = 2.0 - 1e-5


@dataclass(frozen=True)
class PatchFrame:
    """The patch at a point of the surface, turned and stretched in the tangent plane.

    The stretched patch has the orders of the table's patch at frequencies divided by `stretch`.

    Attributes
    ----------
    rotation : (cos, sin) of the angle from the first tangent to the patch's x axis.
    stretch : length in the plane over the same length of the table's patch. The plain number 1
        compiles to no multiplication.
    """

    rotation: Rotation
    stretch: Float = 1.0

    def turned(self, vector: Vector2f | Vector3f) -> Vector2f:
        """Return a vector's tangential part along the patch's axes."""
        cos, sin = self.rotation
        return mi.Vector2f(
            dr.fma(cos, vector.x, sin * vector.y), dr.fma(cos, vector.y, -sin * vector.x)
        )

    def to_table(self, direction: Vector2f | Vector3f) -> Vector2f:
        """Return (u, v) of the table from a sum of directions in the shading frame."""
        return self.turned(direction) * self.stretch

    def from_table(self, uv: Vector2f) -> Vector2f:
        """Return the tangential part, in the shading frame, of (u, v) of the table."""
        cos, sin = self.rotation
        x, y = uv.x, uv.y
        turned_back = mi.Vector2f(dr.fma(cos, x, -sin * y), dr.fma(cos, y, sin * x))
        return turned_back * dr.rcp(self.stretch)

    def position(self, vector: Vector2f) -> Vector2f:
        """Return the position on the table's patch of a vector in the tangent plane, µm."""
        return self.turned(vector) * dr.rcp(self.stretch)

    @property
    def area(self) -> Float:
        """Factor from densities over (u, v) of the surface to those over (u, v) of the table."""
        return dr.square(self.stretch)


@dataclass(frozen=True)
class Site:
    """Points of a surface: all that one evaluation shares there, looked up once.

    Attributes
    ----------
    si : the interaction, its wavelengths within those that are looked up.
    frame : the patch as it lies there.
    scale : factor on the heights.
    wavenumbers : 2π/λ of each channel, rad/µm.
    """

    si: Interaction
    frame: PatchFrame
    scale: Float = 1.0
    wavenumbers: list[Float] = field(default_factory=list)


class Pair:
    """Directions ωi and ωo in front of the surface; inactive lanes have harmless ones.

    Attributes
    ----------
    wi, wo : ωi and ωo in the shading frame.
    cos_i, cos_o : cosines of their angles to the normal.
    frame : the patch at the point of the surface.
    asked : lanes whose light is asked for.
    uv : tangential part of ωi + ωo, in the coordinates of the table.
    w : normal part of ωi + ωo.
    one_plus_dot : 1 + ωi·ωo.
    above : whether light stays above the surface; else both directions are mirrored from below.
    """

    above = True

    def __init__(self, si: Interaction, wo: Vector3f, frame: PatchFrame, active: Mask) -> None:
        self.wi, self.wo, self.frame, self.asked = si.wi, wo, frame, active
        total = si.wi + wo
        self.uv = frame.to_table(total)
        self.w = dr.select(active, total.z, 1.0)
        # from the sum's length: accurate for opposite grazing directions too
        self.one_plus_dot = 0.5 * dr.squared_norm(total)
        self.cos_i = dr.select(active, mi.Frame3f.cos_theta(si.wi), 1.0)
        self.cos_o = dr.select(active, mi.Frame3f.cos_theta(wo), 1.0)

    @property
    def outer(self) -> Pair:
        """The pair outside of a coat."""
        return self

    @property
    def place(self) -> Place:
        """Coordinates at which power and roughness are looked up."""
        return self.uv, self.w

    @cached_property
    def incident(self) -> Vector2f:
        """Tangential part of ωi, in the patch's frame."""
        return self.frame.turned(self.wi)

    @property
    def cos_half(self) -> Float:
        """Cosine of the angle between either direction and the half vector."""
        return dr.safe_sqrt(0.5 * self.one_plus_dot)

    def visible(self, sigma_0: Float, k: Float) -> Float:
        """Return C(X_i) C(X_o) of order 0 (`optics.mirror`)."""
        into, out = (dr.square(cosine) * sigma_0 for cosine in (self.cos_i, self.cos_o))
        return horizon_correction(into, out, k)

    def mirror_cosine(self, sharpness: Float) -> Float:
        """Return cosθm of order 0 by kσ₀ (`optics.mirror`)."""
        return mirror_cosine(self.cos_half, self.cos_i, self.cos_o, sharpness)


class CoatedPair(Pair):
    """Pair of the directions within a coat.

    `uv` and `w` are optical, for k in vacuum: `w` is n times the sum of the cosines. All else
    belongs to the refracted directions.

    n : index of the coat relative to the medium above it.
    """

    def __init__(self, outer: Pair, n: Float) -> None:
        self._outer, self.n = outer, n
        self.wi, self.wo = (mi.Vector3f(*refracted(w, n)) for w in (outer.wi, outer.wo))
        self.frame, self.uv, self.asked = outer.frame, outer.uv, outer.asked
        self.cos_i, self.cos_o = self.wi.z, self.wo.z
        self.w = n * (self.cos_i + self.cos_o)
        self.one_plus_dot = 0.5 * dr.squared_norm(self.wi + self.wo)

    @property
    def outer(self) -> Pair:
        """The pair outside."""
        return self._outer


class PairBelow(Pair):
    """Two directions below the surface, turned over: as if above a surface of negative heights."""

    above = False

    def __init__(self, si: Interaction, wo: Vector3f, frame: PatchFrame, active: Mask) -> None:
        side = mi.Vector3f(1.0, 1.0, -1.0)
        turned = mi.SurfaceInteraction3f(si)
        turned.wi = si.wi * side
        super().__init__(turned, wo * side, frame, active)
        self.uv = -self.uv


class PairWithin(PairBelow):
    """Two directions below the surface, within the dielectric.

    n : its index over that of the medium above.
    """

    def __init__(
        self, si: Interaction, wo: Vector3f, frame: PatchFrame, active: Mask, n: Float
    ) -> None:
        super().__init__(si, wo, frame, active)
        self.n, self.uv, self.w = n, n * self.uv, n * self.w

    @property
    def place(self) -> Place:
        """See `Pair.place`; 0 where not `reached`."""
        return dr.select(self.reached, self.uv, 0.0), self.w

    @property
    def reached(self) -> Mask:
        """Whether tables hold these frequencies."""
        return dr.squared_norm(self.uv) < dr.square(_FARTHEST * self.frame.stretch)

    def visible(self, sigma_0: Float, k: Float) -> Float:
        """See `Pair.visible`: within the cone of the critical angle, or between it and horizon."""
        return correction_within(self.cos_i, self.cos_o, self.n, sigma_0, k)

    def mirror_cosine(self, sharpness: Float) -> Float:
        """See `Pair.mirror_cosine`: of the directions above; beyond the critical angle within."""
        wi, wo = (outside(w, self.n) for w in (self.wi, self.wo))
        half = dr.safe_sqrt(0.25 * dr.squared_norm(wi + wo))
        cosine = cosine_within(mirror_cosine(half, wi.z, wo.z, sharpness), self.n)
        leaves = (wi.z > 0.0) & (wo.z > 0.0)
        critical = dr.safe_sqrt(1.0 - dr.rcp(dr.square(self.n)))
        return dr.select(leaves, cosine, dr.minimum(self.cos_half, critical))


def outside(direction: Vector3f, n: Float) -> Vector3f:
    """Return a direction within a dielectric as it is above; level beyond the critical angle."""
    square = outside_square(mi.Frame3f.cos_theta(direction), n)
    return mi.Vector3f(n * direction.x, n * direction.y, dr.safe_sqrt(square))


class PairThrough:
    """A pair of directions, one above and the other below the surface, in any order.

    Attributes
    ----------
    above, below : directions where they are measured; inside : the one in the dielectric.
    place : of the look-up.
    uv, w, cos_i, cos_o, frame, asked : what densities are asked at.
    out : index of the medium of ωo, over that of the medium above.
    leaves : whether the direction below is within the critical angle.
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
        self.n, self.frame, self.asked = n, frame, active
        self.inside = self.below
        if thin:
            x, y, z = refracted(self.below, n)
            self.inside = mi.Vector3f(x, y, -z)
        total = frame.to_table(self.above + n * self.inside)
        w = -n * self.inside.z - self.above.z
        reached = dr.squared_norm(total) < dr.square(_FARTHEST * frame.stretch)
        self.active = active & reached
        self.w = dr.maximum(dr.abs(w), _LEAST_W)
        at = dr.select(self.active, dr.select(w > 0.0, -total, total), 0.0)
        self.place: Place = at, self.w
        into, self.out = media(n, thin, down)
        self.cos_i = drawing_cosine(dr.abs(si.wi.z), n, thin, down)
        self.cos_o = dr.select(active, dr.abs(wo.z), 1.0)
        self.uv = -frame.to_table(into * si.wi + self.out * wo)
        turned = self.below * mi.Vector3f(1.0, 1.0, -1.0)
        self._beyond = turned if thin else outside(turned, n)
        self.leaves = self._beyond.z > 0.0

    @property
    def outer(self) -> PairThrough:
        """See `Pair.outer`."""
        return self

    def visible(self, sigma_0: Float, k: Float) -> Float:
        """See `Pair.visible`: of both directions above the surface."""
        into, out = (dr.square(w.z) * sigma_0 for w in (self.above, self._beyond))
        return horizon_correction(into, out, k)

    def mirror_cosine(self, sharpness: Float) -> Float:
        """See `Pair.mirror_cosine`: of both directions above the surface."""
        half = dr.safe_sqrt(0.25 * dr.squared_norm(self.above + self._beyond))
        return mirror_cosine(half, self.above.z, self._beyond.z, sharpness)


def media(n: Float, thin: bool, down: Mask) -> tuple[Float, Float]:
    """Return the indices of the media that light goes through, downwards where `down`: from, to."""
    above = mi.Float(1.0)
    if thin:
        return above, above
    return dr.select(down, above, n), dr.select(down, n, above)


def drawing_cosine(cosine: Float, n: Float, thin: bool, down: Mask) -> Float:
    """Return half of w of the refracted direction, which is what tables draw from as cosθi."""
    square = n * n - 1.0
    deeper = dr.sqrt(dr.fma(cosine, cosine, square)) - cosine
    if thin:
        return 0.5 * deeper
    inside = n * cosine
    outer = inside - dr.safe_sqrt(dr.fma(inside, inside, -square))
    return 0.5 * dr.select(down, deeper, outer)
