"""Shadowing and masking of the surface by itself, geometrically (Dr.Jit)."""

from __future__ import annotations

import drjit as dr
import numpy as np

from .roles import Float

SHADOWINGS = ("none", "vcavity")

_SMALLEST = float(np.finfo(np.float32).tiny)


def vcavity(cos_i: Float, cos_o: Float, one_plus_dot: Float) -> Float:
    """min(1, 2(n·h)(n·ωi)/(ωo·h), 2(n·h)(n·ωo)/(ωo·h)): long V-shaped grooves, edges level.

    Torrance and Sparrow 1967 (the form is Blinn's, 1977; Stam 1999, appendix, uses it for
    diffraction). With ωi + ωo = |ωi + ωo| h and |ωi + ωo|² = 2(1 + ωi·ωo) =: 2·one_plus_dot,
    (n·h)/(ωo·h) = (cosθi + cosθo)/(1 + ωi·ωo). Symmetric in the two directions.
    """
    least = dr.minimum(cos_i, cos_o)
    edge = dr.maximum(one_plus_dot, _SMALLEST)
    return dr.minimum(1.0, 2.0 * (cos_i + cos_o) * least / edge)
