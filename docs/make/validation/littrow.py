"""Measured efficiencies of a spectrograph's grating, beside the default model and solutions.

The gratings of the Gemini telescopes' spectrograph GMOS were measured by their maker, Richardson.
The files of the exposure calculator print them: gemini-hlsw/ocs, bundle/edu.gemini.itc/src/main/
resources/gmos/gmos_n_B600_G5303.dat (Allington-Smith 2000, Jørgensen 2001). Their wavelengths are
the laboratory's times cos 25°. Neither the blaze angle nor the mount is printed: light is taken to
return along itself (Littrow), unpolarised, from a sawtooth of a right angle, whose blaze angle is
fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.solve.chandezon import Chandezon
from mitsuba_diffraction.solve.materials import material_of
from mitsuba_diffraction.solve.profiles import Profile

from .cases import PIXELS
from .model import efficiencies
from .published import light_of

Real = NDArray[np.float64]

#: Period, µm: 600 lines/mm.
PERIOD = 1e3 / 600.0
#: Wavelengths in the laboratory, nm, and efficiencies of order −1; extrapolated ones are left out.
WAVELENGTHS = np.arange(400.0, 776.0, 25.0)
MEASURED = np.array(
    [
        0.562, 0.662, 0.729, 0.772, 0.806, 0.826, 0.826, 0.810,
        0.788, 0.758, 0.731, 0.713, 0.688, 0.652, 0.618, 0.610,
    ]
)  # fmt: skip
#: Blaze angles that are tried, degrees.
ANGLES = (8.6, 8.8, 9.0, 9.2, 9.4, 9.6, 9.8)
_HARMONICS = 12


class Littrow(NamedTuple):
    """Efficiencies (16,) of order −1 at `WAVELENGTHS`, at the fitted blaze angle in degrees."""

    angle: float
    model: Real
    solved: Real

    def missed(self, values: Real) -> float:
        """Return the mean deviation of some efficiencies from the measured ones."""
        return float(np.abs(values - MEASURED).mean())


def compare(angles: Sequence[float] = ANGLES) -> Littrow:
    """Fit the blaze angle to the measured efficiencies, and return those of the model too."""
    curves = [_solved(_sawtooth(angle)) for angle in angles]
    best = int(np.argmin([np.abs(curve - MEASURED).mean() for curve in curves]))
    return Littrow(angles[best], _modelled(_sawtooth(angles[best])), curves[best])


def _sawtooth(angle: float) -> Profile:
    """Return grooves with a right angle at their ridges; steep sides face light of x > 0."""
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    x = PERIOD * np.array([0.0, cosine**2])
    return Profile(x, PERIOD * sine * np.array([0.0, cosine]), PERIOD, f"blazed at {angle:g}°")


def _solved(profile: Profile) -> Real:
    solver, values = Chandezon(profile, _HARMONICS), []
    for lam in WAVELENGTHS:
        # mirror direction of light that order −1 sends back
        light = light_of(PERIOD, 1e-3 * lam, _index(lam), _sine(lam), 0.0)
        powers = np.abs(solver.amplitudes(light.station)[0, light.channel]) ** 2
        values.append(powers.mean(axis=0).sum(axis=-1)[light.channel + 1])
    return np.array(values)


def _modelled(profile: Profile) -> Real:
    heights = np.interp((np.arange(PIXELS) + 0.5) / PIXELS * PERIOD, *profile.closed)
    field = HeightField(np.stack([heights] * 2), PERIOD / PIXELS, name="blazed", periodic=True)
    values = []
    for lam in WAVELENGTHS:
        wi = np.array([-_sine(lam), 0.0, np.sqrt(1.0 - _sine(lam) ** 2)])
        powers = efficiencies(field, _index(lam), wi, wi[None], lam, "small_slope", sigma=PERIOD)
        values.append(float(powers[0]))
    return np.array(values)


def _sine(wavelength: float) -> float:
    return 0.5e-3 * wavelength / PERIOD


def _index(wavelength: float) -> complex:
    index = material_of("Al", (wavelength, wavelength)).index(wavelength)
    assert index is not None
    return complex(index)
