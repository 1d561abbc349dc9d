"""Mueller matrices of BSDFs and of the reference, and axes of Stokes vectors."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from mitsuba_diffraction import HeightField, reference
from tests.support.directions import Array, turned
from tests.support.lanes import interaction, vectors

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


def matrices(
    bsdf: Any, wi: Array, wo: Array, wavelengths: ArrayLike, mode: str = "Radiance", **where: Any
) -> Array:
    """f·|cosθo| of pairs (n, 3), Mueller matrices (n, wavelengths, 4, 4).

    wavelengths : nm, four, or (n, 4).
    where : further attributes of the surface interactions.
    """
    context = mi.BSDFContext(getattr(mi.TransportMode, mode))

    def values(wi: Array, wo: Array, wavelengths: Array) -> Array:
        si = interaction(wi, wavelengths)
        for name, value in where.items():
            setattr(si, name, value)
        return np.array(bsdf.eval(context, si, vectors(wo)), float)

    lam = np.broadcast_to(wavelengths, (len(wi), 4))
    if dr.is_jit_v(mi.Float):
        return np.moveaxis(values(wi, wo, lam), (3, 2), (0, 1))
    return np.moveaxis(np.array([values(*one) for one in zip(wi, wo, lam, strict=True)]), 3, 1)


def reference_matrices(
    field: HeightField,
    wi: Array,
    wo: Array,
    wavelengths: ArrayLike,
    turn: float = 0.0,
    **model: Any,
) -> Array:
    """The same by the reference, of light that arrives along ωo, as where radiance is followed.

    A perfect conductor, which has no `eta`, depolarises.

    turn : of the patch, degrees.
    """
    s_in, s_out = reference.boundary.polarisation_axes(wo, wi)
    before, after = rotation(bases(-wo), s_in, -wo), rotation(s_out, bases(wi), wi)
    lam = np.broadcast_to(wavelengths, (len(wi), 4))
    light = field, turned(wo, -turn), turned(wi, -turn)
    if "eta" in model:
        known = [after @ reference.mueller(*light, one, **model) @ before for one in lam.T]
    else:
        powers = (reference.brdf(*light, one, **model) for one in lam.T)
        known = [power[:, None, None] * np.diag([1.0, 0.0, 0.0, 0.0]) for power in powers]
    return np.stack(known, axis=1) * wo[:, None, 2, None, None]
