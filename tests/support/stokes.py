"""Axes of Stokes vectors, and rotations between them."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from tests.support.directions import Array

#: Reversed light has the same s, so the other p.
REVERSAL = np.diag([1.0, 1.0, -1.0, 1.0])


def bases(direction: Array) -> Array:
    """Mitsuba's axes of Stokes vectors of light along directions (n, 3)."""
    axes = [mi.mueller.stokes_basis(mi.Vector3f(*d)) for d in direction.tolist()]
    return np.array([np.array(basis, float).ravel() for basis in axes])


def rotation(start: Array, to: Array, direction: Array) -> Array:
    """What takes Stokes vectors about axes `start` to those about `to`, (n, 4, 4)."""
    cosine = np.sum(to * start, axis=-1)
    sine = np.sum(to * np.cross(direction, start), axis=-1)
    double = 2.0 * np.arctan2(sine, cosine)
    turned = np.tile(np.eye(4), (len(start), 1, 1))
    turned[:, 1, 1] = turned[:, 2, 2] = np.cos(double)
    turned[:, 1, 2], turned[:, 2, 1] = np.sin(double), -np.sin(double)
    return turned
