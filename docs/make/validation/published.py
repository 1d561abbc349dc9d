"""Efficiencies printed by others, beside the solvers of the package and `chandezon`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.solve.coupled import CoupledWaves
from mitsuba_diffraction.solve.integral import IntegralSolver
from mitsuba_diffraction.solve.profiles import Profile, lamellar, sinusoidal
from mitsuba_diffraction.solve.stations import Solver, Station

from .chandezon import Chandezon

#: Metal of the lamellar gratings.
_METAL = 0.22 + 6.71j


class Published(NamedTuple):
    """Printed efficiencies of one grating in one direction of light.

    source : where they are printed.
    grating : in words.
    station : of the light, which comes in through channel 0; order −q leaves through channel q.
    printed : efficiencies by order and polarisation, s or p in the plane across the grooves.
    tolerance : error of the printed numbers: their digits, or of the method that made them.
    points, harmonics : of the integral method and of coupled waves.
    """

    source: str
    grating: str
    profile: Profile
    station: Station
    printed: dict[tuple[int, str], float]
    tolerance: float
    points: int
    harmonics: int

    def solvers(self) -> Iterator[Solver]:
        """Yield the integral method, coupled waves and, for slopes, Chandezon's method."""
        yield IntegralSolver(self.profile, self.points)
        yield CoupledWaves(self.profile, self.harmonics)
        if len(self.profile.x) > 4:
            yield Chandezon(self.profile, 20)

    def solved(self, solver: Solver) -> dict[tuple[int, str], float]:
        """Return the efficiencies that are printed, by a solver."""
        powers = (np.abs(solver.amplitudes(self.station)[0, 0]) ** 2).sum(axis=-1)
        return {(m, name): float(powers["sp".index(name), -m]) for m, name in self.printed}


class Light(NamedTuple):
    """Station of some light, and the channel of its mirror direction."""

    station: Station
    channel: int


def light_of(period: float, wavelength: float, index: complex, x: float, y: float) -> Light:
    """Return light of one wavelength (µm) whose mirror direction has the cosines x and y."""
    c = np.sqrt(1.0 - y * y)
    extent = 2.0 * c * period / wavelength
    place = 0.5 * extent * (1.0 - x / c)
    fraction = place % 1.0
    channels = int(np.floor(extent - fraction)) + 1
    arrays = np.array([wavelength]), np.array([index]), np.array([abs(y)])
    return Light(Station(extent, fraction, channels, *arrays), int(place))


def _lamellar(source: str, depth: float, printed: dict[tuple[int, str], float]) -> Published:
    # four digits, or five; a depth of one wavelength is a resonance
    tolerance, points = (1e-4, 300) if depth < 0.5 else (7e-4, 450)
    grating = f"lamellar 1/{depth:g} µm, duty 0.5, n = 0.22 + 6.71i, 1 µm at 30°"
    station = light_of(1.0, 1.0, _METAL, 0.5, 0.0).station
    profile = lamellar(1.0, depth)
    return Published(source, grating, profile, station, printed, tolerance, points, 60)


_ANGLE = np.radians(75.0)

#: Published efficiencies. Granet and Guizal have the exact values from Li's modal method.
PUBLISHED = (
    Published(
        "Johnson 2005, GD-Calc, gdc_demo1a, for table 2 of Li 1993 (J. Opt. Soc. Am. A 10, 2581)",
        "sinusoidal 1/0.3 µm, n = 2, 0.5 µm, 75° to the grooves and 60° across them: conical",
        sinusoidal(1.0, 0.3),
        light_of(1.0, 0.5, 2.0, np.sin(_ANGLE) * np.sin(np.radians(60.0)), np.cos(_ANGLE)).station,
        {
            (0, "s"): 0.10292, (-1, "s"): 0.038523, (-2, "s"): 0.037459, (-3, "s"): 0.011242,
            (0, "p"): 0.010815, (-1, "p"): 0.0069991, (-2, "p"): 0.03552, (-3, "p"): 0.020764,
        },
        4e-4,  # 50 steps instead of the sinusoid, and 41 harmonics
        200,
        40,
    ),
    _lamellar(
        "Granet and Guizal 1996 (J. Opt. Soc. Am. A 13, 1019), table 1",
        0.1,
        {(0, "p"): 0.6312, (-1, "p"): 0.3408},
    ),
    _lamellar(
        "Lalanne and Hugonin 2000 (J. Opt. Soc. Am. A 17, 1033), tables 1 and 2",
        1.0,
        {(0, "p"): 0.84848, (-1, "s"): 0.73428},
    ),
)  # fmt: skip
