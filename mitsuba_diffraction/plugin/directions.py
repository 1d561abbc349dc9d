"""Pairs of directions in the patch's frame (Dr.Jit)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import drjit as dr
import mitsuba as mi

from .types import Float, Interaction, Mask, Rotation, Vector2f, Vector3f

SHADOWINGS = ("none", "vcavity")


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
    si : the interaction.
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
    uv : tangential part of ωi + ωo, in the coordinates of the table.
    w : normal part of ωi + ωo.
    one_plus_dot : 1 + ωi·ωo.
    above : whether light stays above the surface; else both directions are mirrored from below.
    """

    above = True

    def __init__(self, si: Interaction, wo: Vector3f, frame: PatchFrame, active: Mask) -> None:
        self.wi, self.wo, self.frame = si.wi, wo, frame
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

    @cached_property
    def incident(self) -> Vector2f:
        """Tangential part of ωi, in the patch's frame."""
        return self.frame.turned(self.wi)

    @property
    def cos_half(self) -> Float:
        """Cosine of the angle between either direction and the half vector."""
        return dr.safe_sqrt(0.5 * self.one_plus_dot)


@dataclass(frozen=True)
class TablePoint:
    """The part of a `Pair` that tables of power and roughness are looked up at."""

    uv: Vector2f
    w: Float
    cos_i: Float = 1.0
    cos_o: Float = 1.0
