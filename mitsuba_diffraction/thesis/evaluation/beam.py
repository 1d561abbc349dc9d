"""A virtual bench: a monochromatic beam, a detector that swings through its plane of incidence."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...analysis.maps.light import Light
from ...errors import DiffractionError
from ...progress import Progress

Array = NDArray[np.float64]
#: brdf(wi, wo, wavelength) in 1/sr for (n, 3), (n, 3) and (n,) nm.
Brdf = Callable[[Array, Array, Array], Array]

MOST_POINTS = 20_000_000


@dataclass(frozen=True)
class Beam(Light):
    """Direction of the light, and with it the plane of incidence; parameters as of `Light`."""

    theta: float = 75.0

    @property
    def sine(self) -> float:
        """sinθi."""
        return math.sin(math.radians(self.theta))

    def views(self, angles: Array) -> Array:
        """ωo, (n, 3), for viewing angles in degrees, positive on the light's side of the normal."""
        theta, phi = np.radians(angles), math.radians(self.phi)
        sine = np.sin(theta)
        return np.stack([sine * math.cos(phi), sine * math.sin(phi), np.cos(theta)], axis=-1)

    def grating_angles(self, wavelength: Array, period: float, order: int) -> Array:
        """Viewing angles where sinθo = mλ/d − sinθi, degrees; NaN where there is none.

        wavelength : nm. period : µm.
        """
        sine = order * wavelength * 1e-3 / period - self.sine
        return np.degrees(np.arcsin(np.where(np.abs(sine) <= 1.0, sine, np.nan)))


@dataclass(frozen=True, eq=False)
class Response:
    """What leaves the patch, by wavelength and viewing angle."""

    beam: Beam  # the light
    wavelengths: Array  # (L,), nm
    angles: Array  # (A,), degrees, rising
    # (L, A), angle-resolved scatter f·cosθo in 1/sr: the share of the beam's power that a small
    # detector gets, per solid angle
    values: Array
    sigma: float  # µm, of the window; sets how far order 0 reaches
    label: str  # which method


def measure(
    brdf: Brdf,
    beam: Beam,
    wavelengths: Array,
    angles: Array,
    *,
    sigma: float,
    label: str,
    progress: Progress | None = None,
) -> Response:
    """Evaluate a BRDF for every wavelength (nm) at every viewing angle (degrees).

    Raises
    ------
    DiffractionError
        If there are too few or too many of either, or an angle is beyond ±90°.
    """
    check_axes(wavelengths, angles)
    views = beam.views(angles)
    lights = np.broadcast_to(beam.direction, views.shape)
    values = np.empty((wavelengths.size, angles.size))
    for n, wavelength in enumerate(wavelengths):
        f = brdf(lights, views, np.full(angles.size, wavelength))
        values[n] = f * views[:, 2]
        if progress is not None:
            progress(n + 1, wavelengths.size, f"measuring {label}")
    return Response(beam, wavelengths, angles, values, sigma, label)


def check_axes(wavelengths: Array, angles: Array) -> None:
    """Refuse axes that make no plot."""
    if wavelengths.size < 2 or angles.size < 8:
        raise DiffractionError(
            f"{wavelengths.size} wavelengths and {angles.size} angles are too few; widen the ranges"
            " or make the steps smaller"
        )
    if not (np.all(wavelengths > 0.0) and np.all(np.abs(angles) < 90.0)):
        raise DiffractionError(
            "wavelengths must be above 0 nm, and viewing angles above -90 and below 90 degrees"
        )
    if wavelengths.size * angles.size > MOST_POINTS:
        raise DiffractionError(
            f"{wavelengths.size} wavelengths at {angles.size} angles are more than {MOST_POINTS} "
            "points; make the steps larger"
        )
