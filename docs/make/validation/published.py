"""Efficiencies printed by others, beside the solvers of the package and `chandezon`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.orders.solve import Chandezon, CoupledWaves, IntegralSolver, Solver
from mitsuba_diffraction.orders.solve.profiles import Profile, lamellar, sinusoidal

from .light import Beam, light_of, powers_of

#: Metal of the lamellar gratings.
_METAL = 0.22 + 6.71j


class Published(NamedTuple):
    """Printed efficiencies of one grating in one direction of light.

    source : where they are printed.
    grating : in words.
    light : as the solvers have it.
    printed : efficiencies by order and polarisation, s or p in the plane across the grooves, or "u"
        for unpolarised light.
    tolerance : error of the printed numbers: their digits, or of the method that made them.
    points, harmonics : of the integral method and of coupled waves.
    """

    source: str
    grating: str
    profile: Profile
    light: Beam
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
        powers = powers_of(solver, self.light)
        of_light = {"s": 0, "p": 1, "u": slice(None)}
        return {(m, name): float(powers[m][of_light[name]].mean()) for m, name in self.printed}


def _lamellar(
    source: str,
    depth: float,
    printed: dict[tuple[int, str], float],
    tolerance: float,
    resolutions: tuple[int, int],
    phi: float = 0.0,
) -> Published:
    """Return a case of grooves of metal, one wavelength wide, in light at 30°."""
    grating = f"lamellar 1/{depth:g} µm, duty 0.5, n = 0.22 + 6.71i, 1 µm at 30°, φ = {phi:g}°"
    turn = np.radians(phi)
    light = light_of(1.0, 1.0, _METAL, 0.5 * np.cos(turn), 0.5 * np.sin(turn))
    profile = lamellar(1.0, depth)
    return Published(source, grating, profile, light, printed, tolerance, *resolutions)


_RETICOLO = (
    "RETICOLO V10 (Hugonin and Lalanne 2021, arXiv:2101.00901) with 41 harmonics, in "
    "scripts/reference/reticolo.json of the repository PericleV/spr-forge"
)
_ANGLE = np.radians(75.0)

#: Published efficiencies. Granet and Guizal, and Lalanne and Hugonin, print those of modal methods.
PUBLISHED = (
    Published(
        "Johnson 2005, GD-Calc, gdc_demo1a, for table 2 of Li 1993 (J. Opt. Soc. Am. A 10, 2581)",
        "sinusoidal 1/0.3 µm, n = 2, 0.5 µm, 75° to the grooves and 60° across them: conical",
        sinusoidal(1.0, 0.3),
        light_of(1.0, 0.5, 2.0, np.sin(_ANGLE) * np.sin(np.radians(60.0)), np.cos(_ANGLE)),
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
        1e-4,
        (300, 60),
    ),
    _lamellar(
        "Lalanne and Hugonin 2000 (J. Opt. Soc. Am. A 17, 1033), tables 1 and 2",
        1.0,
        {(0, "p"): 0.84848, (-1, "s"): 0.73428},
        1e-5,
        (450, 60),
    ),
    # means of the printed 0.241297, 0.714287; 0.675345, 0.222996 and of those at 60°
    _lamellar(_RETICOLO, 1.0, {(0, "u"): 0.477792, (-1, "u"): 0.449170}, 2.5e-3, (300, 20), 30.0),
    _lamellar(_RETICOLO, 1.0, {(0, "u"): 0.622969, (-1, "u"): 0.279407}, 2.5e-3, (300, 20), 60.0),
)  # fmt: skip
