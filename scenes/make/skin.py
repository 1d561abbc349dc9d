"""The smooth skin under the scales: from (u, v) to a point, with heights along its normal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from .anatomy import Anatomy

Floats = NDArray[np.float64]
Placement = Callable[[Floats, Floats], tuple[Floats, Floats, Floats]]

STEP = 5e-4  # of the finite differences, in circumferences: a twentieth of a millimetre


class Skin:
    """A tube around a spine.

    u runs from snout to tail in local circumferences (`Anatomy.conformal`), v once around from
    the middle of the belly (0 and 1) over the back (0.5). dp/du × dp/dv points outwards.
    """

    def __init__(self, anatomy: Anatomy, spine: Floats) -> None:
        self.anatomy = anatomy
        self.spine = CubicSpline(np.linspace(0, anatomy.length, len(spine)), spine)
        self.arc, self.u_max = anatomy.conformal()

    def tangent(self, u: Floats) -> Floats:
        """Unit vectors along the spine, towards the tail, (n, 3)."""
        direction = self.spine(np.clip(self.arc(u), 0, self.anatomy.length), 1)
        return direction / np.linalg.norm(direction, axis=-1, keepdims=True)

    def circumference(self, u: Floats) -> Floats:
        """Length around the body, the unit of relief heights; cm."""
        return 2 * np.pi * self.anatomy.mean_radius(self.arc(u))

    def points(self, u: Floats, v: Floats) -> Floats:
        """Points of the smooth skin, (n, 3)."""
        s = np.clip(self.arc(u), 0, self.anatomy.length)
        along = self.tangent(u)
        # the belly always faces the ground, as gravity has it: the frame never twists
        up = np.array([0.0, 0.0, 1.0]) - along[:, 2:] * along
        up /= np.linalg.norm(up, axis=-1, keepdims=True)
        side = np.cross(along, up)
        wide, above, below = self.anatomy.profile(s)
        sine, cosine = np.sin(2 * np.pi * v), -np.cos(2 * np.pi * v)
        n = self.anatomy.squareness(s)
        bulge = (np.abs(sine) ** n + np.abs(cosine) ** n) ** (-1 / n)
        across = wide * bulge * sine
        height = np.where(cosine > 0, above, below) * bulge * cosine
        return self.spine(s) + across[:, None] * side + height[:, None] * up

    def raised(self, u: Floats, v: Floats, height: Floats) -> Floats:
        """Points at a height over the skin, given in local circumferences, (n, 3)."""
        offset = height * self.circumference(u)
        return self.points(u, v) + offset[:, None] * self.normals(u, v)

    def normals(self, u: Floats, v: Floats) -> Floats:
        """Outward unit normals of the smooth skin, (n, 3)."""
        ahead, behind = np.minimum(u + STEP, self.u_max), np.maximum(u - STEP, 0)
        du = self.points(ahead, v) - self.points(behind, v)
        dv = self.points(u, v + STEP) - self.points(u, v - STEP)
        normal = np.cross(du, dv)
        # snout and tail tip are poles, where nothing changes with v
        pole = (u < STEP) | (u > self.u_max - STEP)
        normal[pole] = self.tangent(u[pole]) * np.where(u[pole] < STEP, -1, 1)[:, None]
        return normal / np.linalg.norm(normal, axis=-1, keepdims=True)

    def patch(self, place: Placement, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Points and unit normals of a surface given as (a, b) -> (u, v, height).

        Normals follow from central differences, and point outwards where (a, b) and (u, v) have
        the same sense of rotation.
        """

        def surface(a: Floats, b: Floats) -> Floats:
            return self.raised(*place(a, b))

        step = 1e-3
        da = surface(a + step, b) - surface(a - step, b)
        db = surface(a, b + step) - surface(a, b - step)
        normal = np.cross(da, db)
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        return surface(a, b), normal / np.maximum(length, 1e-30)  # zero at a pole
