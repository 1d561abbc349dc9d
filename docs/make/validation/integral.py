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

from .cases import Grating, Scan, index_of, order_sines
from .solutions import LIGHTS, Efficiencies, imported, version

#: Points on the boundary that a solution begins with, at least.
POINTS = 200
#: Corners get a graded mesh (Kress), of the order that gratinglab recommends.
_GRADING = 4
#: gratinglab asks for six points a wavelength, in the material too, where the mesh is coarsest.
_POINTS_PER_WAVELENGTH = 7


def name() -> str:
    """The solver's name and version."""
    return f"gratinglab {version('gratinglab')}, integral method"


def solve(scan: Scan, boundary_points: int) -> Efficiencies:
    """Efficiencies of every order at each wavelength of a scan, by polarisation.

    Parameters
    ----------
    scan : what to solve.
    boundary_points : nodes on one period of the boundary, see `resolutions`.

    Raises
    ------
    DiffractionError
        If gratinglab is not installed.
    """
    illumination = imported("gratinglab.illumination").Illumination
    integral = imported("gratinglab.solvers.integral").integral
    options: dict[str, Any] = {
        "boundary_points": boundary_points,
        "corner_grading": 0 if scan.grating.profile == "sinusoidal" else _GRADING,
    }
    result = Efficiencies(len(scan.wavelengths))
    with _material(scan) as coating:
        if coating:
            options["conductivity"] = "tabulated"
        problem = _problem(scan.grating, coating)
        for polarisation in LIGHTS:
            light = illumination.classical(scan.theta, polarisation.upper())
            efficiencies = integral.solve(problem, light, scan.wavelengths, **options)
            for n, wavelength in enumerate(scan.wavelengths):
                orders, _ = order_sines(scan.grating.period, wavelength, scan.theta)
                columns = np.searchsorted(efficiencies.orders, orders)
                result.orders[polarisation].append(efficiencies.efficiency[n, columns])
                absorbed = 0.0 if efficiencies.absorption is None else efficiencies.absorption[n]
                result.balance[polarisation][n] = efficiencies.efficiency[n].sum() + absorbed - 1.0
    return result


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


def resolutions(scan: Scan) -> tuple[int, int, int]:
    """Points on the boundary: at first, then, and where that is not enough.

    The first is as many as the shortest wavelength on either side of the boundary takes, at least
    `POINTS`; the second is twice as many, or 1.4 times where that would be above 800, since the
    time grows with the third power; the third twice as many again.
    """
    arc = scan.grating.period + 2 * scan.grating.depth
    perfect = scan.material == "perfect"
    in_material = [
        w / 1000 / (1.0 if perfect else max(1.0, abs(index_of(scan.material, w))))
        for w in scan.wavelengths
    ]
    # a graded mesh is twice as coarse in the middle of a side
    graded = 1 if scan.grating.profile == "sinusoidal" else 2
    first = max(POINTS, int(np.ceil(_POINTS_PER_WAVELENGTH * graded * arc / min(in_material))))
    second = 2 * first if 2 * first <= 800 else int(np.ceil(1.4 * first))
    return first, second, 2 * second


@contextmanager
def _material(scan: Scan) -> Iterator[str | None]:
    """A library of one material while solving: gratinglab reads the index from a file by name."""
    if scan.material == "perfect":
        yield None
        return
    from gratinglab import materials

    wavelengths = np.array(sorted(scan.wavelengths))
    index = np.array([index_of(scan.material, w) for w in wavelengths])
    # a table's ends are rounded
    table = materials.OpticalConstants(
        scan.material,
        np.concatenate([[wavelengths[0] - 1], wavelengths, [wavelengths[-1] + 1]]),
        1 - np.pad(index.real, 1, mode="edge"),
        np.pad(index.imag, 1, mode="edge"),
    )
    with tempfile.TemporaryDirectory() as folder:
        materials.write_ari(table, Path(folder) / f"{scan.material}.ari")
        with mock.patch.dict(os.environ, {materials.LIBRARY_ENV: folder}):
            yield scan.material
