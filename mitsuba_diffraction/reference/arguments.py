"""Arguments of the reference: checks, and one shape for all."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError, quoted
from ..heights import HeightField
from ..heights.coherence import widths_of
from ..optics.boundary import MODELS, checked_model
from ..optics.fresnel import Filmed
from ..optics.geometry import sigma_of, wavenumber
from ..settings import COHERENCES, SURFACE, TableSettings, checked
from .model import Light
from .screens import LOOKUP, Sigmas

#: Most by which a unit vector's length may differ from 1: vectors of four digits do by less.
_UNIT = 1e-3


def sigmas_of(value: str | float, field: HeightField, coherence: str) -> Sigmas:
    """Return σ and σ₀ of a checked coherence width; unlike a table's, it has no largest value."""
    if value != "auto":
        number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
        if not (number and 0.0 < float(value) < np.inf):
            shown = f"{value:g}" if number else quoted(value)
            raise DiffractionError(
                f"coherence_width={shown} must be a positive number of µm, or auto"
            )
        value = float(value)
    settings = TableSettings(coherence=coherence if coherence in COHERENCES else COHERENCES[1])
    width, light, taper = widths_of(settings, [field], value)
    if taper is None:
        return Sigmas(sigma_of(width), sigma_of(light))
    return Sigmas(LOOKUP * sigma_of(width), sigma_of(light), width)


class Window(NamedTuple):
    """Coherence window: σ and σ₀, coherence, and centres (n, 2) in µm or None for the patch's."""

    sigmas: Sigmas
    coherence: str
    centres: NDArray[np.float64] | None

    def at(self, chosen: NDArray[np.bool_]) -> Window:
        """Window of the chosen direction pairs, (n,)."""
        return self if self.centres is None else self._replace(centres=self.centres[chosen])


def window_of(
    coherence_width: str | float,
    field: HeightField,
    coherence: str,
    place: ArrayLike | None,
    count: int,
) -> Window:
    """Check a window's width, µm, coherence and place, for so many direction pairs."""
    sigmas = sigmas_of(coherence_width, field, coherence)
    if coherence != SURFACE:
        checked("coherence", coherence)
    if (place is None) == (coherence == SURFACE):
        text = "needs a place: (x, y) on the patch in µm" if place is None else "takes no place"
        raise DiffractionError(f"coherence='{coherence}' {text}")
    if place is None:
        return Window(sigmas, coherence, None)
    try:
        centres = np.broadcast_to(np.asarray(place, np.float64), (count, 2))
    except ValueError as error:
        raise DiffractionError(
            f"place has shape {np.shape(place)}; it must be ({count}, 2) or (2,), in µm"
        ) from error
    if not np.all(np.isfinite(centres)):
        raise DiffractionError("place must be finite, in µm")
    return Window(sigmas, coherence, centres)


def model_of(
    model: str | None,
    index: NDArray[np.complex128] | Filmed | None,
    models: Iterable[str] = MODELS,
    coat: float | None = None,
) -> str:
    """Return the name of the model, one of `models`; with an index the default is "small_slope".

    coat : index of a coat over the surface, which is checked.
    """
    if coat is not None:
        if index is None:
            raise DiffractionError(f"coat={coat} needs an index beneath it: give eta (and k)")
        if isinstance(index, Filmed):
            raise DiffractionError(
                f"coat={coat} and a film exclude each other: leave one of them out"
            )
        if not (np.isfinite(coat) and coat >= 1.0):
            raise DiffractionError(f"coat={coat} must be an index of at least 1")
    if model is None:
        return "kirchhoff" if index is None else "small_slope"
    if checked_model(model, models) != "kirchhoff" and index is None:
        raise DiffractionError(
            f"model='{model}' needs an index: give eta (and k of a conductor), or "
            "model='kirchhoff' for a perfect reflector"
        )
    return model


def index_of(
    eta: ArrayLike | None,
    k: ArrayLike,
    wavelength: NDArray[np.float64],
    film: tuple[complex, float] | None,
) -> NDArray[np.complex128] | Filmed | None:
    """Return the index eta + ik (n,), with the film if any; None for a perfect reflector."""
    if eta is None:
        if film is not None:
            raise DiffractionError(f"film={film} needs an index beneath it: give eta (and k)")
        return None
    real, imaginary = np.asarray(eta, np.float64), np.asarray(k, np.float64)
    if not (np.all(np.isfinite(real)) and np.all(real > 0)):
        raise DiffractionError(f"eta={real} must be positive and finite")
    if not (np.all(np.isfinite(imaginary)) and np.all(imaginary >= 0)):
        raise DiffractionError(
            f"k={imaginary} must be finite and at least 0: the index is eta + ik"
        )
    try:
        index = np.broadcast_to(real + 1j * imaginary, wavelength.shape)
    except ValueError as error:
        raise DiffractionError(
            f"eta {real.shape} and k {imaginary.shape} do not fit {len(wavelength)} directions"
        ) from error
    if film is None:
        return index
    layer, thickness = complex(film[0]), float(film[1])
    if not (0.0 < layer.real < np.inf and 0.0 <= layer.imag < np.inf and 0.0 <= thickness < np.inf):
        raise DiffractionError(
            f"film={film} must be a finite index n + ik, n above 0 and k at least 0, and a finite "
            "thickness of at least 0 nm"
        )
    return Filmed(index, layer, wavenumber(wavelength) * thickness * 1e-3)


def directions_of(wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike) -> Light:
    """Check that directions are unit vectors; broadcast them and wavelengths to one length."""
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
    for name, vectors in (("wi", incident), ("wo", outgoing)):
        lengths = np.linalg.norm(vectors, axis=-1).ravel()
        wrong = lengths[~(np.abs(lengths - 1.0) <= _UNIT)]
        if wrong.size:
            raise DiffractionError(
                f"{name} must be unit vectors, one has the length {wrong[0]:g}; divide each by its "
                "length"
            )
    return Light(
        np.broadcast_to(incident, (*n, 3)),
        np.broadcast_to(outgoing, (*n, 3)),
        np.broadcast_to(lam, n),
    )
