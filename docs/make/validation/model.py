"""Efficiencies of a grating's orders by the package, from its BRDF.

Through a window much wider than the period every order is a narrow lobe of the BRDF,

    f = 4 cosθi cosθo N / (λ² A w²) · 4π²σ⁴ |a_m|² exp(−σ²|q − q_m|²),   A = πσ²,

and carries the power ∫ f cosθo dωo of a beam of unit power. With dωo = dα dβ/(k² cosθo) and
∬ exp(−σ²|q − q_m|²) dα dβ = π/σ², all else constant across the lobe,

    η_m = f(ωi, ω_m) · π/(σ²k²) = 4 cosθi cosθ_m N / w² · |a_m(k w)|².

For a mirror this is R; for m = 0 of any grating R·|a_0|², eq. 10 with C = 1. Kirchhoff's model has
R (1 + ωi·ω_m)²/(w² cosθi cosθ_m) for the factor, see `mitsuba_diffraction.reference.model`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.optics import blend
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber
from mitsuba_diffraction.reference import boundary
from mitsuba_diffraction.reference import model as models

from .cases import Grating, index_of, order_sines

#: σ (µm) of a window through which the lobes of gratings are separate, up to periods of 1 mm, and
#: order 0's lies above the horizon: √(kσ) cosθ is above 20 up to 75°, so C of eq. 10 is 1.
LOBE_SIGMA = 1000.0

#: As the plugin has them, and the small-slope matrix alone, or in equal parts with Kirchhoff.
MODELS = (*reference.MODELS, "small_slope_alone", "half_and_half")


def order_efficiencies(
    grating: Grating,
    material: str,
    theta: float,
    wavelength: float,
    model: str = "kirchhoff",
    **layer: Any,
) -> NDArray[np.float64]:
    """η_m of every propagating order, ordered as `cases.order_sines`, for unpolarised light.

    Parameters
    ----------
    grating : in the plane of incidence.
    material : of `cases.MATERIALS`; a perfect conductor is Kirchhoff's alone.
    theta : angle of incidence, degrees.
    wavelength : nm.
    model : of `MODELS`.
    layer : `coat` or `film` of `reference.brdf`, for models of `reference.MODELS`.
    """
    _, sines = order_sines(grating.period, wavelength, theta)
    wi, wo = in_plane(np.sin(np.radians(theta))), in_plane(sines)
    index = None if material == "perfect" else index_of(material, wavelength)
    return efficiencies(
        _period(grating), index, wi, wo, wavelength, model, sigma=LOBE_SIGMA, **layer
    )


def efficiencies(
    field: HeightField,
    index: complex | None,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: float,
    model: str,
    *,
    sigma: float,
    **layer: Any,
) -> NDArray[np.float64]:
    """η of the orders of a periodic surface that leave along `wo`, for unpolarised light.

    Parameters
    ----------
    index : n + ik; none is a perfect conductor, which is Kirchhoff's alone.
    wi, wo : (3,) and (n, 3), unit vectors away from the surface.
    model : of `MODELS`.
    sigma : of a window (µm) through which the lobes are separate.
    """
    width = WIDTHS_PER_SIGMA * sigma
    per_brdf = np.pi / (sigma * float(wavenumber(wavelength))) ** 2
    if index is None:
        return per_brdf * reference.brdf(field, wi, wo, wavelength, coherence_width=width)
    known = model if model in reference.MODELS else "kirchhoff"
    brdf = per_brdf * reference.brdf(
        field, wi, wo, wavelength,
        coherence_width=width, model=known, eta=index.real, k=index.imag, **layer,
    )  # fmt: skip
    if model == known:
        return brdf
    # what Kirchhoff's matrix weighs, replaced
    alone, tangent = (
        boundary.unpolarised(jones_of(field, index, wi, wo, wavelength, name))
        for name in (model, known)
    )
    return brdf * alone / tangent


def jones_of(
    field: HeightField,
    index: complex,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: float,
    model: str,
) -> NDArray[np.complex128]:
    """Jones matrices (n, 2, 2) of one of `MODELS`; arguments as `efficiencies`."""
    if model == "kirchhoff":
        return models.kirchhoff(wi, wo, index)
    if model == "small_slope_alone":
        return models.small_slope(wi, wo, index)
    if model == "half_and_half":
        return models.blended(wi, wo, index, 0.5)
    return models.blended(wi, wo, index, share_of(field, index, wi, wo, wavelength))


def share_of(
    field: HeightField,
    index: complex,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: float,
) -> NDArray[np.float64]:
    """s of small slope in the default, (n,); arguments as `efficiencies`."""
    k, total = float(wavenumber(wavelength)), wi + wo
    roughness = blend.ScaleRoughness.from_heights(field.heights, field.pixel_size)
    variance = roughness.at(k * np.hypot(total[:, 0], total[:, 1]))
    return np.asarray(models.small_slope_weight(k * total[:, 2], variance, index))


@cache
def _period(grating: Grating) -> HeightField:
    return grating.heights()


def shares(jones: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Power of incident s and p light after Jones matrices, over the mean of both, (n, 2)."""
    power = np.sum(np.abs(jones) ** 2, axis=1)
    return np.asarray(power / power.mean(axis=1, keepdims=True), np.float64)


def order_shares(
    grating: Grating, material: str, theta: float, wavelength: float, model: str
) -> NDArray[np.float64]:
    """`shares` of TE and TM light for every order; arguments as `order_efficiencies`."""
    _, sines = order_sines(grating.period, wavelength, theta)
    if material == "perfect":
        return np.ones((len(sines), 2))
    index, field = index_of(material, wavelength), grating.heights()
    wi, wo = in_plane(np.sin(np.radians(theta))), in_plane(sines)
    return shares(jones_of(field, index, wi, wo, wavelength, model))


def in_plane(sine: ArrayLike) -> NDArray[np.float64]:
    """Unit vectors (..., 3) in the x–z plane with this x component."""
    x = np.asarray(sine, np.float64)
    return np.stack([x, np.zeros_like(x), np.sqrt(np.maximum(1 - x * x, 0))], axis=-1)
