"""Orders of one mount by the model and by a solver, unpolarised unless said.

Each function takes wavelengths in nm and returns efficiencies of the same shape.
"""

from __future__ import annotations

import numpy as np

from docs.make.validation.cases import Case, Light, Media, Sampled
from docs.make.validation.light import heights_of, index_at, solved_by
from docs.make.validation.model import modelled
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.orders.solve import Chandezon, IntegralSolver, Solver
from mitsuba_diffraction.orders.solve.profiles import Profile

_MODEL = "small_slope"


def mirror_reflectance(material: str, wavelengths: Real) -> Real:
    """Return the reflectance of a flat face along its normal."""
    index = np.array([index_at(material, lam) for lam in wavelengths])
    return np.asarray(np.abs((index - 1) / (index + 1)) ** 2)


def littrow_solved(
    material: str, profile: Profile, wavelengths: Real, solver: Solver | None = None
) -> Real:
    """Order −1 that returns along its own light, by Chandezon's method or another solver."""
    solver = solver or Chandezon(profile, 10 + round(1.6 * profile.period))
    found = [solved_by(solver, case) for case in _littrow(material, profile, wavelengths)]
    return np.array([orders.powers[orders.order[:, 0] == -1].mean() for orders in found])


def littrow_modelled(material: str, profile: Profile, wavelengths: Real) -> Real:
    """Order −1 that returns along its own light, by the model."""
    cases = _littrow(material, profile, wavelengths)
    return np.array([modelled(case, np.array([[-1, 0]]), _MODEL).mean() for case in cases])


def _littrow(material: str, profile: Profile, wavelengths: Real) -> list[Case]:
    angles = -np.degrees(np.arcsin(0.5e-3 * wavelengths / profile.period))
    return _cases(material, profile, wavelengths, angles)


def _cases(
    material: str | float, profile: Profile, wavelengths: Real, angles: Real | float,
    through: bool = False,
) -> list[Case]:  # fmt: skip
    surface = Sampled(heights_of(profile))
    lights = np.broadcast_arrays(wavelengths, angles)
    return [
        Case(surface, Light(lam, theta), Media(index_at(material, lam), through=through))
        for lam, theta in zip(*(each.tolist() for each in lights), strict=True)
    ]


def normal_pair(profile: Profile, material: str, wavelengths: Real) -> tuple[Real, Real]:
    """Orders ±1 together, p-polarised along the normal: by Chandezon's method and by the model."""
    solver, pair = Chandezon(profile, 20), np.array([[-1, 0], [1, 0]])
    solved, model = [], []
    for case in _cases(material, profile, wavelengths, -1e-7):
        found = solved_by(solver, case)
        solved.append(found.powers[np.abs(found.order[:, 0]) == 1, 1].sum())
        model.append(modelled(case, pair, _MODEL).mean(axis=1).sum())
    return np.array(solved), np.array(model)


def face(index: float) -> float:
    """Return the transmittance of a flat face along its normal."""
    return 1.0 - ((index - 1.0) / (index + 1.0)) ** 2


def through_solved(
    index: float,
    outwards: bool,
    profile: Profile,
    wavelengths: Real,
    solver: Solver | None = None,
) -> Real:
    """Order −1 of light along the normal through the grooves; outwards : from glass into air.

    solver : by default the integral method, as fine as 1e-3 needs.
    """
    solver = solver or IntegralSolver(profile, 120)
    found = [solved_by(solver, case) for case in _through(index, outwards, profile, wavelengths)]
    powers = [orders.powers[orders.order[:, 0] == 1].mean() for orders in found]
    return np.array(powers) * face(index)


def through_modelled(index: float, outwards: bool, profile: Profile, wavelengths: Real) -> Real:
    """Order −1 of light along the normal through the grooves, by the model."""
    cases = _through(index, outwards, profile, wavelengths)
    values = [modelled(case, np.array([[1, 0]]), _MODEL).mean() for case in cases]
    return np.array(values) * face(index)


def _through(index: float, outwards: bool, profile: Profile, wavelengths: Real) -> list[Case]:
    return _cases(index, profile, wavelengths, 180.0 if outwards else 0.0, through=True)
