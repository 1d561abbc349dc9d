"""The BSDF from the integral over the heights, and what the material makes of the light.

The material is a factor outside the integral: `optics.boundary`, `optics.blend`, `optics.through`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError
from ..heights.field import HeightField
from ..optics import blend, boundary, through
from ..optics.coat import refracted, transmitted
from ..optics.fresnel import Filmed, Index
from ..optics.geometry import diffraction_coordinates, kirchhoff_factor, sigma_of, wavenumber
from ..optics.mean_second_order import mean_gain
from ..settings import checked
from .arguments import directions_of, index_of, places_of, require_dielectric, width_of
from .integral import screen_power, window_power
from .second_order import second_order_power


def brdf(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    coherence_width: float = 65.0,
    coherence: str = "ensemble",
    place: ArrayLike | None = None,
    model: str = "kirchhoff",
    eta: ArrayLike | None = None,
    k: ArrayLike = 0.0,
    coat: float | None = None,
    film: tuple[complex, float] | None = None,
    second_order: bool = False,
) -> NDArray[np.float64]:
    """BRDF of a surface with these heights for unpolarised light, in 1/sr, shape (n,).

    Stam 1999, eq. 7–11, with a normalised Gaussian window (see the package's theory page); the
    material as in `optics.blend`. By default Kirchhoff's of a perfect reflector, R = 1.

    Parameters
    ----------
    field : HeightField, heights in µm.
    wi, wo : (n, 3) or (3,), unit vectors in the patch's frame, pointing away from the surface;
        x runs along rows, y along columns, z is the normal. Below the surface the BRDF is 0.
    wavelength : (n,) or scalar, vacuum wavelength in nm.
    coherence_width : 4σ of the amplitude window, µm.
    coherence : "ensemble", the power averaged over every position of the window; "patch", the
        power under one window centred on the patch; "surface", under one centred on `place`.
    place : (n, 2) or (2,), µm along x and y from the patch's first pixel; it tiles the plane.
    model : "kirchhoff", or "small_slope", which needs an index.
    eta, k : (n,) or scalar, the index eta + ik of the material over that of the medium above it;
        without eta R = 1.
    coat : index of a flat clear coat over the surface, relative likewise (`optics.coat`); it needs
        eta, and its own reflection is the lobe of a flat patch.
    film : index n + ik, relative likewise, and thickness in nm of a film that follows the heights,
        coherent with the surface (`optics.fresnel.Filmed`); it needs eta, and no coat. Small slope
        has the mean of the second order then (`optics.mean_second_order`).
    second_order : whether to multiply orders by the second order of small slope
        (`optics.second_order`): of a dielectric, bare or under a coat, by model "small_slope", in
        an ensemble.

    Raises
    ------
    DiffractionError
        For an unknown coherence or model, a width that is not positive and finite, an index or a
        place that is missing or none, or arrays whose shapes do not fit.
    """
    width = width_of(coherence_width)
    light = directions_of(wi, wo, wavelength)
    window = sigma_of(width), coherence, places_of(coherence, place, len(light[2]))
    index = index_of(model, eta, k, light[2], film)
    if second_order:
        require_dielectric(model, coherence, index)
    if index is not None:
        made = model, index, coat, second_order
        return _measured(boundary.unpolarised, field, light, made, window)
    if coat is not None:
        raise DiffractionError(f"coat={coat} needs an index beneath it: give eta (and k)")
    power = window_power(field, *light, *window)
    return kirchhoff_factor(*light, sigma_of(width)) * power


def mueller(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    eta: ArrayLike,
    k: ArrayLike = 0.0,
    coherence_width: float = 65.0,
    coherence: str = "ensemble",
    place: ArrayLike | None = None,
    model: str = "small_slope",
    coat: float | None = None,
    film: tuple[complex, float] | None = None,
    second_order: bool = False,
) -> NDArray[np.float64]:
    """Mueller matrices of the BRDF, in 1/sr, shape (n, 4, 4); arguments and errors as `brdf`.

    They take Stokes vectors of light along −ωi to those of light along ωo, both about the axes of
    `optics.boundary.polarisation_axes`. Entry (0, 0) is `brdf`.
    """
    width = width_of(coherence_width)
    light = directions_of(wi, wo, wavelength)
    window = sigma_of(width), coherence, places_of(coherence, place, len(light[2]))
    index = index_of(model, eta, k, light[2], film)
    if index is None:
        raise DiffractionError("polarisation needs an index: give eta (and k of a conductor)")
    if second_order:
        require_dielectric(model, coherence, index)
    return _measured(boundary.mueller, field, light, (model, index, coat, second_order), window)


def btdf(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    eta: float,
    thin: bool = False,
    coherence_width: float = 65.0,
    coherence: str = "ensemble",
    model: str = "small_slope",
) -> NDArray[np.float64]:
    """BTDF of a dielectric with these heights over n², symmetric in both directions, (n,), 1/sr.

    Radiance in the dielectric over n² is what a BTDF over n² transmits (`optics.through`).
    Arguments and errors as `brdf`, but for:

    wi, wo : above and below the surface, in any order; below, in the dielectric.
    eta : real index of the dielectric, above 1.
    thin : below is outside of a thin sheet, beyond its other side, which is flat.
    """
    width = width_of(coherence_width)
    checked("coherence", coherence)
    first, second, lam = directions_of(wi, wo, wavelength)
    index_of(model, eta, 0.0, lam, None)
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
    k, total = wavenumber(lam), above + eta * inside
    kappa, sigma = -k * total[:, 2], sigma_of(width)
    roughness = blend.ScaleRoughness.of(field.heights, field.pixel_size)
    jones = through.kirchhoff(above, inside, eta)
    if model == "small_slope":
        s = blend.weight(kappa, roughness.at(k * np.hypot(*total[:, :2].T)), eta)[:, None, None]
        jones = np.asarray((1 - s) * jones + s * through.small_slope(above, inside, eta))
    if thin:
        jones = through.out_of_sheet(jones, above, below, eta)
    screens = [np.exp(1j * one * field.heights) for one in kappa]
    places = -k[:, None] * total[:, :2]
    power = [
        screen_power(screen, field.pixel_size, x, y, sigma, coherence)
        for screen, (x, y) in zip(screens, places, strict=True)
    ]
    lobe = 4 * np.pi**2 * sigma**4 * np.exp(-(sigma**2) * np.sum(places**2, axis=1))
    flat = np.minimum(np.abs([screen.mean() for screen in screens]) ** 2 * lobe, power)
    cosines = -4 * above[:, 2] * eta * inside[:, 2] / np.maximum(total[:, 2] ** 2, 1e-12)
    found = cosines * boundary.unpolarised(jones) * (power - flat)
    found += boundary.unpolarised(through.order_0(above, below, eta, thin=thin)) * flat
    return np.where(lit, found / ((lam * 1e-3) ** 2 * np.pi * sigma**2), 0.0)


def _measured(
    measure: Callable[[NDArray[np.complex128]], NDArray[np.float64]],
    field: HeightField,
    light: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    made: tuple[str, NDArray[np.complex128] | Filmed, float | None, bool],
    window: tuple[float, str, NDArray[np.float64] | None],
) -> NDArray[np.float64]:
    """The BRDF as a measure of its Jones matrices; under a coat, that of its face too.

    light : wi, wo, wavelength; made : model, index, coat, second order; window : sigma, coherence,
    places.
    """
    sigma, (model, index, coat, second) = window[0], made

    def weighed(factor: NDArray[np.float64], jones: NDArray[np.complex128]) -> NDArray[np.float64]:
        found = measure(jones)
        return factor.reshape(factor.shape + (1,) * (found.ndim - 1)) * found

    wi, wo, wavelength = light
    if coat is None:
        power = _power(field, light, index, window, second)
        return weighed(_order_factor(*light, sigma) * power, _jones(field, *light, model, index))
    if isinstance(index, Filmed):
        raise DiffractionError(f"coat={coat} and a film exclude each other: leave one of them out")
    if not (np.isfinite(coat) and coat >= 1.0):
        raise DiffractionError(f"coat={coat} must be an index of at least 1")
    below, above = refracted(wi, coat), refracted(wo, coat)
    below, above = (np.where(w[:, 2:] > 0, r, -r) for w, r in ((wi, below), (wo, above)))
    inside = below, above, wavelength / coat
    power = _power(field, inside, index / coat, window, second) / coat**2
    lit = _lit(wi, wo)
    jones = transmitted(_jones(field, *inside, model, index / coat), *lit, coat, index / coat)
    structure = weighed(_order_factor(*inside, sigma) * power, jones)
    flat = np.exp(-((sigma * wavenumber(wavelength)) ** 2) * np.sum((wi + wo)[:, :2] ** 2, axis=1))
    face = _order_factor(*light, sigma) * 4 * np.pi**2 * sigma**4 * flat
    return structure + weighed(face, boundary.kirchhoff(*lit, coat))


def _power(
    field: HeightField,
    light: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    index: NDArray[np.complex128] | Filmed,
    window: tuple[float, str, NDArray[np.float64] | None],
    second: bool,
) -> NDArray[np.float64]:
    """⟨|P|²⟩, with the second order if there is one."""
    if not second or isinstance(index, Filmed):
        return window_power(field, *light, *window)
    share = _share(field, *_lit(*light[:2]), light[2], index)
    return second_order_power(field, light, window[0], index.real, share)


def _lit(
    wi: NDArray[np.float64], wo: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both directions; the normal, where either is below the surface and there is no light."""
    above = ((wi[:, 2] > 0) & (wo[:, 2] > 0))[:, None]
    normal = np.array([0.0, 0.0, 1.0])
    return np.where(above, wi, normal), np.where(above, wo, normal)


def _jones(
    field: HeightField,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    model: str,
    index: NDArray[np.complex128] | Filmed,
) -> NDArray[np.complex128]:
    """Jones matrices (n, 2, 2) of a model; those of a mirror's normal where there is no light."""
    incident, outgoing = _lit(wi, wo)
    if model == "kirchhoff":
        return boundary.kirchhoff(incident, outgoing, index)
    share = _share(field, incident, outgoing, wavelength, index)
    jones = blend.jones(incident, outgoing, index, share)
    if isinstance(index, Filmed):
        both = _mean_gain(field, (incident[:, 2], outgoing[:, 2]), wavelength, index)
        jones = jones * np.sqrt(both)[:, None, None]
    return jones


def _mean_gain(
    field: HeightField,
    cosines: tuple[NDArray[np.float64], NDArray[np.float64]],
    wavelength: NDArray[np.float64],
    index: Filmed,
) -> NDArray[np.float64]:
    """g(ωi) g(ωo) of `mean_second_order`, (n,)."""
    roughness = blend.ScaleRoughness.of(field.heights, field.pixel_size)
    found = np.ones(len(wavelength))
    parts = np.stack(np.broadcast_arrays(wavelength, *index.parts), axis=1)
    for one in np.unique(parts, axis=0):
        at = (parts == one).all(axis=1)
        film, k = Filmed(*one[1:]), float(wavenumber(one[0].real))
        for cosine in cosines:
            found[at] *= mean_gain(cosine[at], film, roughness, k)
    return found


def _share(
    field: HeightField,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    index: Index,
) -> NDArray[np.float64]:
    """s of `blend.weight`, (n,)."""
    u, v, w = diffraction_coordinates(wi, wo)
    wave = wavenumber(wavelength)
    roughness = blend.ScaleRoughness.of(field.heights, field.pixel_size)
    return blend.weight(wave * w, roughness.at(wave * np.hypot(u, v)), index)


def _order_factor(
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    sigma: float,
) -> NDArray[np.float64]:
    """4 cosθi cosθo / (λ² A w²) in 1/µm⁴, λ in µm; zero below the surface (see `boundary`)."""
    cos_i, cos_o = wi[:, 2], wo[:, 2]
    above = (cos_i > 0) & (cos_o > 0)
    w = np.where(above, cos_i + cos_o, 1.0)
    lam = wavelength * 1e-3
    return np.where(above, 4 * cos_i * cos_o / (lam**2 * np.pi * sigma**2 * w**2), 0.0)
