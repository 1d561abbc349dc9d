"""Rigorous solutions by the boundary integral method of `gratinglab` (extra `validation`)."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from .cases import FEW_WAVELENGTHS, WAVELENGTHS, Case, Grating, index_of
from .solutions import LIGHTS, Orders, imported, version

#: Points on the boundary that a solution begins with, at least.
POINTS = 200
#: Corners get a graded mesh (Kress), of the order that gratinglab recommends.
_GRADING = 4
#: gratinglab asks for six points a wavelength, in the material too, where the mesh is coarsest.
_POINTS_PER_WAVELENGTH = 7


def name() -> str:
    """The solver's name and version."""
    return f"gratinglab {version('gratinglab')}, integral method"


def solve(case: Case, boundary_points: int) -> Orders:
    """Efficiencies of every order of a grating in light across the grooves.

    Parameters
    ----------
    boundary_points : nodes on one period of the boundary, see `resolutions`.

    Raises
    ------
    DiffractionError
        If gratinglab is not installed.
    """
    illumination = imported("gratinglab.illumination").Illumination
    integral = imported("gratinglab.solvers.integral").integral
    grating, wavelength = case.surface, case.light.wavelength
    assert isinstance(grating, Grating)
    options: dict[str, Any] = {
        "boundary_points": boundary_points,
        "corner_grading": 0 if grating.profile == "sinusoidal" else _GRADING,
    }
    powers, balance = [], []
    with _material(case) as coating:
        if coating:
            options["conductivity"] = "tabulated"
        problem = _problem(grating, coating)
        for polarisation in LIGHTS:
            light = illumination.classical(case.light.theta, polarisation.upper())
            found = integral.solve(problem, light, (wavelength,), **options)
            columns = np.searchsorted(found.orders, case.orders[:, 0])
            powers.append(found.efficiency[0, columns])
            absorbed = 0.0 if found.absorption is None else found.absorption[0]
            balance.append(found.efficiency[0].sum() + absorbed - 1.0)
    return Orders(case.orders, np.stack(powers, axis=1), balance)


def _problem(grating: Grating, coating: str | None) -> Any:
    """gratinglab's own profiles, which are exact polygons where there are corners; in nm."""
    from gratinglab import profiles
    from gratinglab.problem import Problem

    ratio = grating.depth / grating.period
    make: dict[str, Callable[[], Any]] = {
        "sinusoidal": lambda: profiles.Sinusoidal(depth_fraction=ratio),
        "lamellar": lambda: profiles.Lamellar(depth_fraction=ratio),
        "blazed": lambda: profiles.Blazed(blaze_angle=float(np.degrees(np.arctan(ratio)))),
    }
    profile = make[grating.profile]()
    return Problem(period=1000 * grating.period, profile=profile, coating=coating)


def resolutions(case: Case) -> tuple[int, int, int]:
    """Points on the boundary: at first, then, and where that is not enough.

    The first is as many as the shortest wavelength on either side of the boundary takes, at least
    `POINTS`; the second is twice as many, or 1.4 times where that would be above 800, since the
    time grows with the third power; the third twice as many again.
    """
    grating, material = case.surface, case.media.material
    assert isinstance(grating, Grating)
    arc = grating.period + 2 * grating.depth
    perfect = material == "perfect"
    # all wavelengths of a material have the mesh of the shortest
    wavelengths = {case.light.wavelength, *(WAVELENGTHS if perfect else FEW_WAVELENGTHS)}
    in_material = [
        w / 1000 / (1.0 if perfect else max(1.0, abs(index_of(material, w)))) for w in wavelengths
    ]
    # a graded mesh is twice as coarse in the middle of a side
    graded = 1 if grating.profile == "sinusoidal" else 2
    first = max(POINTS, int(np.ceil(_POINTS_PER_WAVELENGTH * graded * arc / min(in_material))))
    second = 2 * first if 2 * first <= 800 else int(np.ceil(1.4 * first))
    return first, second, 2 * second


@contextmanager
def _material(case: Case) -> Iterator[str | None]:
    """A library of one material while solving: gratinglab reads the index from a file by name."""
    if case.index is None:
        yield None
        return
    from gratinglab import materials

    name, wavelength = case.media.material, case.light.wavelength
    # a table's ends are rounded
    table = materials.OpticalConstants(
        name,
        wavelength + np.arange(-1.0, 2.0),
        np.full(3, 1 - case.index.real),
        np.full(3, case.index.imag),
    )
    with tempfile.TemporaryDirectory() as folder:
        materials.write_ari(table, Path(folder) / f"{name}.ari")
        with mock.patch.dict(os.environ, {materials.LIBRARY_ENV: folder}):
            yield name
