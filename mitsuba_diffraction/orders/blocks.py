"""Tables of blocks: a profile between a rarer medium above and a clear dielectric below.

Channels belong to the dielectric, of index n, in which more orders propagate: with tangential parts
(x, y) of wave vectors over 2π/λ, `cells` have x/n, y/n and the optical period n d.
Port j is channel j within, port count + j the same tangential part above, which has light if
x² + y² < 1. Nodes are even in τ, ρ and w, from 0 to 1.

Efficiencies have further kinks where channels above become propagating: at the critical angle of
total reflection. They vanish in reduced efficiencies e, which are interpolated linearly:

    order m:  η = G_j G_q e,    order 0 through the face:  η = F e,

with G of `optics.orders.port_power`, and the flat face's transmittance F of unpolarised light. A
block loses no light: order 0 of the reflection has 1 − Σ η, which is exact for the flat face.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arrays import Real
from ..optics.coat import face_transmittance
from ..optics.orders import port_power
from .cells import Counts
from .rows import Kind, lights
from .table import OrderTable

#: Least normal parts, within over n and above, from which on reduced efficiencies are known at a
#: node; nearer to grazing they have the next node's.
_LEAST_WITHIN, _LEAST_ABOVE = 0.04, 0.05


def factors(x: Real, y: Real, index: float) -> tuple[Real, NDArray[np.bool_]]:
    """Return factors between ports from e to η, (…, 2n, 2n), and whether both are known.

    Factors are 0 in order 0 of the reflection, and where a port has no light. Known ones are far
    enough from grazing.

    x, y : of channels, (…, n) and (…, 1) or (…, n), over 2π/λ.
    """
    above = 1.0 - x * x - y * y
    within = above + (index**2 - 1.0)
    z_within, z_above = (np.sqrt(np.maximum(square, 0.0)) for square in (within, above))
    power = np.concatenate([port_power(z_within, above), port_power(z_above, within)], -1)
    scale = power[..., :, None] * power[..., None, :]
    lower = np.arange(count := x.shape[-1])
    upper = count + lower
    scale[..., lower, lower] = scale[..., upper, upper] = 0.0
    scale[..., lower, upper] = scale[..., upper, lower] = face_transmittance(z_above, index)
    far = np.concatenate([z_within > _LEAST_WITHIN * index, z_above > _LEAST_ABOVE], -1)
    return scale, far[..., :, None] & far[..., None, :] & (scale > 0.0)


def reduced(table: OrderTable, of: Kind) -> Real:
    """Return the reduced efficiencies e (τ, ρ, w, j, q); 0 in order 0 of the reflection."""
    index = table.block
    assert index is not None
    values = table.bands[of.band].kinds[of.kind][..., 0].astype(np.float64)
    light = lights(table, of, Counts(*(n - 1 for n in values.shape[:3])), coated=False)
    return divided(values, *factors(index * light.x, index * light.y, index))


def divided(values: Real, scale: Real, known: NDArray[np.bool_]) -> Real:
    """Return ratios (a, b, c, …, n) of values at the nodes of a grid to factors (a, b, c, …).

    known : (a, b, c, …) whether ratios are known; elsewhere they are the nearest node's, 0 without
        any. Without the axis n, values have the shape of the factors.
    """
    extra = (1,) * (values.ndim - known.ndim)
    lit = known.reshape(*known.shape, *extra)
    ratios = np.where(lit, values / np.where(lit, scale.reshape(lit.shape), 1.0), 0.0)
    for place in np.ndindex(known.shape[3:]):
        here = known[(..., *place)]
        if here.any() and not here.all():
            nearest = scipy.ndimage.distance_transform_edt(
                ~here, return_distances=False, return_indices=True
            )
            ratios[(slice(None),) * 3 + place] = ratios[(*nearest, *place)]
    return np.asarray(ratios)
