"""Pairs of directions in the patch's frame, and the shadowing of grooves (Dr.Jit)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import drjit as dr
import mitsuba as mi
import numpy as np

from .types import Float, Interaction, Mask, Rotation, Vector2f, Vector3f

SHADOWINGS = ("none", "vcavity")

_SMALLEST = float(np.finfo(np.float32).tiny)


class Pair:
    """Directions ωi and ωo in front of the surface; inactive lanes have harmless ones.

    Attributes
    ----------
    wi, wo : ωi and ωo in the shading frame.
    cos_i, cos_o : cosines of their angles to the normal.
    uv : tangential part of ωi + ωo, in the patch's frame.
    w : normal part of ωi + ωo.
    one_plus_dot : 1 + ωi·ωo.
    above : whether light stays above the surface; else both directions are mirrored from below.
    """

    above = True

    def __init__(self, si: Interaction, wo: Vector3f, rotation: Rotation, active: Mask) -> None:
        self.wi, self.wo, self._rotation = si.wi, wo, rotation
        total = si.wi + wo
        self.uv = in_patch(total, rotation)
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
    def rotation(self) -> Rotation:
        """(cos, sin) of the angle from the first tangent to the patch's x axis."""
        return self._rotation

    @property
    def cos_half(self) -> Float:
        """Cosine of the angle between either direction and the half vector."""
        return dr.safe_sqrt(0.5 * self.one_plus_dot)

    @cached_property
    def incident(self) -> Vector2f:
        """Tangential part of ωi, in the patch's frame."""
        return in_patch(self.wi, self._rotation)

    @cached_property
    def outgoing(self) -> Vector2f:
        """Tangential part of ωo, in the patch's frame."""
        return in_patch(self.wo, self._rotation)


@dataclass(frozen=True)
class TablePoint:
    """The part of a `Pair` that tables of power and roughness are looked up at."""

    uv: Vector2f
    w: Float
    cos_i: Float = 1.0
    cos_o: Float = 1.0


def in_patch(direction: Vector2f | Vector3f, rotation: Rotation) -> Vector2f:
    """Return a vector's tangential part, turned from the shading frame to the patch's."""
    cos, sin = rotation
    return mi.Vector2f(
        dr.fma(cos, direction.x, sin * direction.y),
        dr.fma(cos, direction.y, -sin * direction.x),
    )


def from_patch(q: Vector2f, rotation: Rotation) -> Vector2f:
    """Turn a tangential part from the patch's frame to the shading frame."""
    cos, sin = rotation
    return mi.Vector2f(dr.fma(cos, q.x, -sin * q.y), dr.fma(cos, q.y, sin * q.x))


def vcavity(cos_i: Float, cos_o: Float, one_plus_dot: Float) -> Float:
    """Return the shadowing of long V-shaped grooves with level edges.

    It is min(1, 2(n·h)(n·ωi)/(ωo·h), 2(n·h)(n·ωo)/(ωo·h)).

    Torrance and Sparrow 1967 (the form is Blinn's, 1977; Stam 1999, appendix, uses it for
    diffraction). With ωi + ωo = |ωi + ωo| h and |ωi + ωo|² = 2(1 + ωi·ωo) =: 2·one_plus_dot,
    (n·h)/(ωo·h) = (cosθi + cosθo)/(1 + ωi·ωo). Symmetric in the two directions.
    """
    least = dr.minimum(cos_i, cos_o)
    edge = dr.maximum(one_plus_dot, _SMALLEST)
    return dr.minimum(1.0, 2.0 * (cos_i + cos_o) * least / edge)
