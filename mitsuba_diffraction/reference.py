"""The diffraction BRDF straight from its integral: float64, slow and obviously right (NumPy only).

No series, no table and no interpolation: for every direction pair the phase screen exp(iκh) is
formed from all heights and projected on plane waves. Everything else is measured against this.

The patch tiles the plane. Its phase screen, known at the pixels, is the band-limited function

    exp(iκh(r)) = Σ_j a_j(κ) exp(−i q_j·r),   a_j(κ) = mean over pixels of exp(iκh) exp(i q_j·r),

with |q_j| up to the Nyquist frequency π/dx: a sampled surface says nothing beyond. Under a window
g(r − x₀) = exp(−|r − x₀|²/2σ²) the integral over the plane is then a sum of the window's spectrum
ĝ(q) = 2πσ² exp(−σ²q²/2) around every order,

    P(q) = Σ_j a_j ĝ(q − q_j) exp(−i q_j·x₀)   (up to a phase common to all orders),

and its power averaged over every window position x₀ keeps the diagonal alone:

    ⟨|P|²⟩ = 4π²σ⁴ Σ_j |a_j|² exp(−σ²|q − q_j|²).

What the material makes of the light is a factor outside the integral, `optics.boundary`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import DiffractionError, quoted
from .heights.field import HeightField
from .optics import blend, boundary, through
from .optics.coat import refracted, transmitted
from .optics.fresnel import Filmed
from .optics.geometry import diffraction_coordinates, kirchhoff_factor, sigma_of, wavenumber
from .settings import COHERENCES as COHERENCES
from .settings import SURFACE, checked

MODELS = ("kirchhoff", "small_slope")

# exp(−8.6²/2) = 9e-17: further orders are below the last bit of the sum
_REACH = 8.6


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
        coherent with the surface (`optics.fresnel.Filmed`); it needs eta, and no coat.

    Raises
    ------
    DiffractionError
        For an unknown coherence or model, a width that is not positive and finite, an index or a
        place that is missing or none, or arrays whose shapes do not fit.
    """
    width = _width(coherence_width)
    light = _broadcast(wi, wo, wavelength)
    window = sigma_of(width), coherence, _places(coherence, place, len(light[2]))
    index = _index(model, eta, k, light[2], film)
    if index is not None:
        return _measured(boundary.unpolarised, field, light, model, index, coat, window)
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
) -> NDArray[np.float64]:
    """Mueller matrices of the BRDF, in 1/sr, shape (n, 4, 4); arguments and errors as `brdf`.

    They take Stokes vectors of light along −ωi to those of light along ωo, both about the axes of
    `optics.boundary.polarisation_axes`. Entry (0, 0) is `brdf`.
    """
    width = _width(coherence_width)
    light = _broadcast(wi, wo, wavelength)
    window = sigma_of(width), coherence, _places(coherence, place, len(light[2]))
    index = _index(model, eta, k, light[2], film)
    if index is None:
        raise DiffractionError("polarisation needs an index: give eta (and k of a conductor)")
    return _measured(boundary.mueller, field, light, model, index, coat, window)


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
    width = _width(coherence_width)
    checked("coherence", coherence)
    first, second, lam = _broadcast(wi, wo, wavelength)
    _index(model, eta, 0.0, lam, None)
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
    power = [
        screen_power(np.exp(1j * one * field.heights), field.pixel_size, x, y, sigma, coherence)
        for one, (x, y) in zip(kappa, -k[:, None] * total[:, :2], strict=True)
    ]
    cosines = -4 * above[:, 2] * eta * inside[:, 2]
    factor = cosines / ((lam * 1e-3) ** 2 * np.pi * sigma**2 * total[:, 2] ** 2)
    return np.where(lit, factor * boundary.unpolarised(jones) * power, 0.0)


def window_power(
    field: HeightField,
    wi: NDArray[np.float64],
    wo: NDArray[np.float64],
    wavelength: NDArray[np.float64],
    sigma: float,
    coherence: str,
    places: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """⟨|P|²⟩ in µm⁴, shape (n,), one explicit integral per direction pair.

    places : (n, 2), centres of the windows in µm, instead of the patch's.
    """
    k = wavenumber(wavelength)
    u, v, w = diffraction_coordinates(wi, wo)
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    power = np.zeros(len(k))
    for n in np.flatnonzero(above):
        phase_screen = np.exp(1j * (k[n] * w[n]) * field.heights)
        place = None if places is None else (places[n, 0], places[n, 1])
        power[n] = screen_power(
            phase_screen, field.pixel_size, k[n] * u[n], k[n] * v[n], sigma, coherence, place
        )
    return power


def screen_power(
    phase_screen: NDArray[np.complex128],
    pixel_size: tuple[float, float],
    alpha: float,
    beta: float,
    sigma: float,
    coherence: str,
    place: tuple[float, float] | None = None,
) -> float:
    """⟨|P|²⟩ in µm⁴ of one phase screen (ny, nx) at the spatial frequency (α, β) in rad/µm.

    place : centre of the window in µm, instead of the patch's.
    """
    ny, nx = phase_screen.shape
    qx, waves_x = _plane_waves(nx, pixel_size[0], alpha, sigma)
    qy, waves_y = _plane_waves(ny, pixel_size[1], beta, sigma)
    amplitude = waves_y @ phase_screen @ waves_x.T / (nx * ny)
    window_x = np.exp(-0.5 * (sigma * (alpha - qx)) ** 2)
    window_y = np.exp(-0.5 * (sigma * (beta - qy)) ** 2)
    if coherence == "ensemble":
        total = window_y**2 @ np.abs(amplitude) ** 2 @ window_x**2
    else:
        x, y = place or (0.5 * nx * pixel_size[0], 0.5 * ny * pixel_size[1])
        centre_x, centre_y = np.exp(-1j * qx * x), np.exp(-1j * qy * y)
        total = np.abs((window_y * centre_y) @ amplitude @ (window_x * centre_x)) ** 2
    return float(4 * np.pi**2 * sigma**4 * total)


def _measured(
    measure: Callable[[NDArray[np.complex128]], NDArray[np.float64]],
    field: HeightField,
    light: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    model: str,
    index: NDArray[np.complex128] | Filmed,
    coat: float | None,
    window: tuple[float, str, NDArray[np.float64] | None],
) -> NDArray[np.float64]:
    """The BRDF as a measure of its Jones matrices; under a coat, that of its face too.

    light : wi, wo, wavelength; window : sigma, coherence, places.
    """
    sigma = window[0]

    def weighed(factor: NDArray[np.float64], jones: NDArray[np.complex128]) -> NDArray[np.float64]:
        found = measure(jones)
        return factor.reshape(factor.shape + (1,) * (found.ndim - 1)) * found

    wi, wo, wavelength = light
    if coat is None:
        power = window_power(field, *light, *window)
        return weighed(_order_factor(*light, sigma) * power, _jones(field, *light, model, index))
    if isinstance(index, Filmed):
        raise DiffractionError(f"coat={coat} and a film exclude each other: leave one of them out")
    if not (np.isfinite(coat) and coat >= 1.0):
        raise DiffractionError(f"coat={coat} must be an index of at least 1")
    below, above = refracted(wi, coat), refracted(wo, coat)
    below, above = (np.where(w[:, 2:] > 0, r, -r) for w, r in ((wi, below), (wo, above)))
    inside = below, above, wavelength / coat
    power = window_power(field, *inside, *window) / coat**2
    lit = _lit(wi, wo)
    jones = transmitted(_jones(field, *inside, model, index / coat), *lit, coat, index / coat)
    structure = weighed(_order_factor(*inside, sigma) * power, jones)
    flat = np.exp(-((sigma * wavenumber(wavelength)) ** 2) * np.sum((wi + wo)[:, :2] ** 2, axis=1))
    face = _order_factor(*light, sigma) * 4 * np.pi**2 * sigma**4 * flat
    return structure + weighed(face, boundary.kirchhoff(*lit, coat))


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
    u, v, w = diffraction_coordinates(incident, outgoing)
    wave = wavenumber(wavelength)
    roughness = blend.ScaleRoughness.of(field.heights, field.pixel_size)
    s = blend.weight(wave * w, roughness.at(wave * np.hypot(u, v)), index)
    return blend.jones(incident, outgoing, index, s)


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


def _width(value: float) -> float:
    """A coherence width: unlike a table, an integral may have any."""
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not (number and 0.0 < value < np.inf):
        shown = f"{value:g}" if number else quoted(value)
        raise DiffractionError(f"coherence_width={shown} must be a positive number of µm")
    return float(value)


def _places(coherence: str, place: ArrayLike | None, n: int) -> NDArray[np.float64] | None:
    """Centres (n, 2) of windows on the surface, µm."""
    if coherence != SURFACE:
        checked("coherence", coherence)
    if (place is None) == (coherence == SURFACE):
        given = "needs a place: (x, y) on the patch in µm" if place is None else "takes no place"
        raise DiffractionError(f"coherence='{coherence}' {given}")
    if place is None:
        return None
    try:
        found = np.broadcast_to(np.asarray(place, np.float64), (n, 2))
    except ValueError as error:
        raise DiffractionError(
            f"place has shape {np.shape(place)}; it must be ({n}, 2) or (2,), in µm"
        ) from error
    if not np.all(np.isfinite(found)):
        raise DiffractionError("place must be finite, in µm")
    return found


def _index(
    model: str,
    eta: ArrayLike | None,
    k: ArrayLike,
    wavelength: NDArray[np.float64],
    film: tuple[complex, float] | None,
) -> NDArray[np.complex128] | Filmed | None:
    """The index eta + ik, (n,), under a film where there is one; or none, which is R = 1."""
    if model not in MODELS:
        raise DiffractionError(f"model='{model}' is unknown; choose one of {', '.join(MODELS)}")
    if eta is None:
        if film is not None:
            raise DiffractionError(f"film={film} needs an index beneath it: give eta (and k)")
        if model == "small_slope":
            raise DiffractionError(
                "model='small_slope' needs an index: give eta (and k of a conductor), or "
                "model='kirchhoff' for a perfect reflector"
            )
        return None
    index = _complex(eta, k, wavelength.shape)
    if film is None:
        return index
    layer, thickness = complex(film[0]), float(film[1])
    if not (0.0 < layer.real < np.inf and 0.0 <= layer.imag < np.inf and 0.0 <= thickness < np.inf):
        raise DiffractionError(
            f"film={film} must be a finite index n + ik, n above 0 and k at least 0, and a finite "
            "thickness of at least 0 nm"
        )
    return Filmed(index, layer, wavenumber(wavelength) * thickness * 1e-3)


def _complex(eta: ArrayLike, k: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.complex128]:
    real, imaginary = np.asarray(eta, np.float64), np.asarray(k, np.float64)
    if not (np.all(np.isfinite(real)) and np.all(real > 0)):
        raise DiffractionError(f"eta={real} must be positive and finite")
    if not (np.all(np.isfinite(imaginary)) and np.all(imaginary >= 0)):
        raise DiffractionError(
            f"k={imaginary} must be finite and at least 0: the index is eta + ik"
        )
    try:
        return np.broadcast_to(real + 1j * imaginary, shape)
    except ValueError as error:
        raise DiffractionError(
            f"eta {real.shape} and k {imaginary.shape} do not fit {shape[0]} directions"
        ) from error


def _plane_waves(
    n: int, pixel: float, frequency: float, sigma: float
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies q_j within the window's reach of `frequency`, and exp(i q_j x) at the pixels."""
    spacing = 2 * np.pi / (n * pixel)
    first = np.ceil((frequency - _REACH / sigma) / spacing)
    last = np.floor((frequency + _REACH / sigma) / spacing)
    # The frequencies of a DFT of n points: an even n has −n/2 but not +n/2
    j = np.arange(max(first, -(n // 2)), min(last, (n - 1) // 2) + 1)
    turns = np.outer(j, np.arange(n)) % n  # exact integers keep the phase exact
    return j * spacing, np.exp(2j * np.pi / n * turns)


def _broadcast(
    wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    incident, outgoing = np.atleast_2d(np.asarray(wi, float)), np.atleast_2d(np.asarray(wo, float))
    lam = np.atleast_1d(np.asarray(wavelength, float))
    if incident.shape[-1] != 3 or outgoing.shape[-1] != 3:
        raise DiffractionError(
            f"wi has shape {np.shape(wi)} and wo {np.shape(wo)}; both must be (n, 3) or (3,)"
        )
    if not np.all(lam > 0):
        raise DiffractionError("wavelength must be positive, in nm")
    try:
        n = np.broadcast_shapes(incident.shape[:-1], outgoing.shape[:-1], lam.shape)
    except ValueError as error:
        raise DiffractionError(
            f"wi {np.shape(wi)}, wo {np.shape(wo)} and wavelength {np.shape(wavelength)} "
            "do not broadcast to one length n"
        ) from error
    return (
        np.broadcast_to(incident, (*n, 3)),
        np.broadcast_to(outgoing, (*n, 3)),
        np.broadcast_to(lam, n),
    )
