"""Efficiencies of the orders of a periodic surface by the package, from its BRDF.

Through a window much wider than the period every order is a narrow lobe of the BRDF,

    f = 4 cosθi cosθo N / (λ² A w²) · 4π²σ⁴ |a_m|² exp(−σ²|q − q_m|²),   A = πσ²,

and carries the power ∫ f cosθo dωo of a beam of unit power. With dωo = dα dβ/(k² cosθo) and
∬ exp(−σ²|q − q_m|²) dα dβ = π/σ², all else constant across the lobe,

    η_m = f(ωi, ω_m) · π/(σ²k²) = 4 cosθi cosθ_m N / w² · |a_m(k w)|².

For a mirror this is R; for m = 0 of any grating R·|a_0|², eq. 10 with C = 1. Kirchhoff's model has
R (1 + ωi·ω_m)²/(w² cosθi cosθ_m) for the factor, see `mitsuba_diffraction.reference.model`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.arrays import Complex, Real, Whole
from mitsuba_diffraction.optics import blend
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber
from mitsuba_diffraction.reference import boundary
from mitsuba_diffraction.reference import model as models
from mitsuba_diffraction.reference.fresnel import amplitudes

from .cases import Case, in_plane, index_of

#: σ (µm) of a window through which the lobes of gratings are separate, up to periods of 1 mm, and
#: order 0's lies above the horizon: √(kσ) cosθ is above 20 up to 75°, so C of eq. 10 is 1.
LOBE_SIGMA = 1000.0

#: As the plugin has them, and the small-slope matrix alone, or in equal parts with Kirchhoff.
MODELS = (*reference.MODELS, "small_slope_alone", "half_and_half")


def efficiencies(
    field: HeightField,
    index: complex | None,
    wi: Real,
    wo: Real,
    wavelength: float,
    model: str,
    *,
    sigma: float = LOBE_SIGMA,
    **layer: Any,
) -> Real:
    """η of the orders of a periodic surface that leave along `wo`, for unpolarised light.

    Parameters
    ----------
    index : n + ik; none is a perfect conductor, which is Kirchhoff's alone.
    wi, wo : (3,) and (n, 3), unit vectors away from the surface.
    model : of `MODELS`.
    sigma : of a window (µm) through which the lobes are separate.
    layer : `coat` or `film` of `reference.brdf`, for models of `reference.MODELS`.
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
    wi: Real,
    wo: Real,
    wavelength: float,
    model: str,
) -> Complex:
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
    wi: Real,
    wo: Real,
    wavelength: float,
) -> Real:
    """s of small slope in the default, (n,); arguments as `efficiencies`."""
    k, total = float(wavenumber(wavelength)), wi + wo
    roughness = blend.ScaleRoughness.from_heights(field.heights, field.pixel_size)
    variance = roughness.at(k * np.hypot(total[:, 0], total[:, 1]))
    return np.asarray(models.small_slope_weight(k * total[:, 2], variance, index))


def shares(jones: Complex) -> Real:
    """Power of incident s and p light after Jones matrices, over the mean of both, (n, 2)."""
    power = np.sum(np.abs(jones) ** 2, axis=1)
    return np.asarray(power / power.mean(axis=1, keepdims=True), np.float64)


def modelled(case: Case, order: Whole, model: str) -> Real:
    """Efficiencies (n, 2) of orders (n, 2) of a case, for s and p light.

    Both are the mean for unpolarised light of a perfect conductor, under layers, and of light that
    goes through.

    Parameters
    ----------
    model : of `MODELS`; of `reference.MODELS` under layers and for light that goes through.
    """
    media, wavelength, index = case.media, case.light.wavelength, case.index
    wi, wo = case.wi, case.wo(order)
    if media.once:
        return _diffracted_once(case, wi, wo, model)
    light = case.field, index, wi, wo, wavelength, model
    if media.through:
        assert index is not None
        btdf = reference.btdf(
            case.field, wi, wo, wavelength,
            eta=index.real, coherence_width=WIDTHS_PER_SIGMA * LOBE_SIGMA, model=model,
            thin=media.thin,
        )  # fmt: skip
        mean = np.pi / (LOBE_SIGMA * float(wavenumber(wavelength))) ** 2 * btdf
    else:
        mean = efficiencies(*light, **media.layer)
    if index is None or media.layer or media.through:
        return np.repeat(mean[:, None], 2, axis=1)
    return mean[:, None] * shares(jones_of(case.field, index, *light[2:]))


def _diffracted_once(case: Case, wi: Real, wo: Real, model: str) -> Real:
    """Efficiencies of light diffracted once under a coat, without light its face reflects."""
    coat, wavelength = case.media.coat, case.light.wavelength
    assert coat is not None
    within = wavelength / coat
    index = index_of(f"{case.media.material} under polycarbonate", within)
    inside = case.field, index, in_plane(wi[0] / coat), in_plane(wo[:, 0] / coat), within, model
    by_light = efficiencies(*inside)[:, None] * shares(jones_of(*inside))
    there, back = (1 - np.abs(amplitudes(np.atleast_1d(v[..., 2]), coat)) ** 2 for v in (wi, wo))
    return np.asarray(by_light * (there * back).T)
