"""Arguments of the reference, checked and brought to one shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError, quoted
from ..optics.fresnel import Filmed
from ..optics.geometry import wavenumber
from ..settings import SURFACE, checked

MODELS = ("kirchhoff", "small_slope")


def width_of(value: float) -> float:
    """A coherence width: unlike a table, an integral may have any."""
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not (number and 0.0 < value < np.inf):
        shown = f"{value:g}" if number else quoted(value)
        raise DiffractionError(f"coherence_width={shown} must be a positive number of µm")
    return float(value)


def places_of(coherence: str, place: ArrayLike | None, n: int) -> NDArray[np.float64] | None:
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


def index_of(
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


def require_dielectric(
    model: str, coherence: str, index: NDArray[np.complex128] | Filmed | None
) -> None:
    """Refuse what the second order is not for."""
    if model != "small_slope" or coherence != "ensemble":
        raise DiffractionError(
            "second_order=True is for model='small_slope' and coherence='ensemble'; got "
            f"model='{model}', coherence='{coherence}'"
        )
    if not isinstance(index, np.ndarray) or np.any(index.imag > 0.0):
        raise DiffractionError("second_order=True is for dielectrics: leave k and film out")


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


def directions_of(
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
