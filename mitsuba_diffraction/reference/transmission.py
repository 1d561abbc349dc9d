"""Wrapper of the model: light that goes through a dielectric (`optics.through`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError
from ..heights import HeightField
from ..optics import through as formulas
from ..settings import checked
from . import boundary, mirror, through
from .arguments import directions_of, index_of, model_of, sigmas_of
from .coat import refracted
from .integral import all_orders, sums_of
from .model import Light, ensemble_power, share


def btdf(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    eta: float,
    thin: bool = False,
    coherence_width: str | float = "auto",
    coherence: str = "ensemble",
    model: str | None = None,
) -> NDArray[np.float64]:
    """BTDF of a dielectric with these heights over n², symmetric in both directions, (n,), 1/sr.

    Radiance in the dielectric over n² is transmitted by the BTDF over n² (`optics.through`).
    Arguments and errors as for `brdf`, except:

    wi, wo : above and below the surface, in any order; below, in the dielectric.
    eta : real index of the dielectric, above 1.
    thin : whether the direction below is outside of a thin sheet, beyond its flat other side.
    """
    checked("coherence", coherence)
    sigmas = sigmas_of(coherence_width, field, coherence)
    sigma = sigmas.orders
    first, second, lam = directions_of(wi, wo, wavelength)
    model = model_of(model, index_of(eta, 0.0, lam, None), formulas.MODELS)
    if not 1.0 < float(eta) < np.inf:
        raise DiffractionError(f"eta={eta} must be one real index above 1")
    swapped = first[:, 2:] < 0
    above, below = np.where(swapped, second, first), np.where(swapped, first, second)
    lit = (above[:, 2] > 0) & (below[:, 2] < 0)
    above, below = (
        np.where(lit[:, None], w, [0.0, 0.0, side]) for w, side in ((above, 1.0), (below, -1.0))
    )
    inside = below
    if thin:
        inside = refracted(below * [1, 1, -1], eta) * [1, 1, -1]
    # k times their sum is (q, κ) of (1)
    optical = Light(-above, -eta * inside, lam)
    jones = through.kirchhoff(above, inside, eta)
    if model == "small_slope":
        s = share(field, optical, np.asarray(eta))[:, None, None]
        jones = (1 - s) * jones + s * through.small_slope(above, inside, eta)
    if thin:
        jones = through.out_of_sheet(jones, above, below, eta)
    sums = sums_of(coherence, 0.5 * np.array(field.extent))
    powers = ensemble_power(field, optical, sigmas, sums)
    power = all_orders(powers)
    # order 0 has the flat surface's transmittance; speckle may be darker than its mean
    zeroth = np.minimum(powers[1], power)
    w_square = np.maximum((optical.wi + optical.wo)[:, 2] ** 2, 1e-12)
    cosines = -4 * optical.wi[:, 2] * optical.wo[:, 2] / w_square
    orders = cosines * boundary.unpolarised(jones) * (power - zeroth)
    # a mirror's lobe of both directions above the surface transmits what it does not reflect
    outside, leaves = below * [1, 1, -1], np.ones(len(below), bool)
    if not thin:
        tangential = eta * below[:, :2]
        square = 1.0 - np.sum(tangential**2, axis=1)
        leaves = square > 0.0
        outside = np.column_stack([tangential, np.sqrt(np.maximum(square, 0.0))])
    light = Light(above, outside, lam)
    passed = through.flat_transmittances(
        mirror.mirror_cosine(light, sigmas.zeroth), float(eta), thin
    )
    flat = boundary.unpolarised(through.order_0(above, below, passed)) * zeroth
    flat *= leaves * mirror.horizon_correction(light, sigmas.zeroth)
    return np.where(lit, (orders + flat) / ((lam * 1e-3) ** 2 * np.pi * sigma**2), 0.0)
