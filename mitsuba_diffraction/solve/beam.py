"""`solve_beam`: orders of some directions of light alone, as of an echelle in its mount.

A grating with tens of orders has too many directions for a table of all. In an instrument light
comes from one of them: the efficiencies there, wavelength by wavelength, make a table as a file's
efficiencies do (`measured`), with the same warning.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError
from ..tables.orders import OrderTable, cells
from ..tables.orders.lookup import turned_axes
from ..tables.orders.polarised import mueller_of
from ..tables.orders.table import check_outline
from .efficiencies import Efficiencies, check_light
from .films import Layers, Substance, material_text, structure_of
from .grating_index import Material, material_of
from .jobs import Jobs, problem_of, solver_of
from .measured import table_of
from .nodes import Place
from .orders import MOST_EXCESS, Estimate, Settings, announce_stage, silent
from .profiles import Profile
from .resolution import Chosen, chosen_resolution, resolution_error
from .stations import Complex, Grating, Real

#: Lights of which the resolution is chosen, and solutions at most.
_COMPARED, _MOST = 5, 100_000


def solve_beam(
    profile: Profile,
    material: str | float | complex | Material = "Al",
    *,
    theta: ArrayLike,
    phi: ArrayLike = 0.0,
    step: float = 5.0,
    superstrate: float = 1.0,
    layers: Layers = (),
    beneath: Layers = (),
    substrate: Substance | None = None,
    settings: Settings | None = None,
    jobs: Jobs | None = None,
    announce: Callable[[Estimate], None] = silent,
) -> OrderTable:
    """Solve the orders of light from some directions.

    Raises a DiffractionError if an argument is out of its range, polarised or too many lights are
    asked for, or the solver is not installed or does not converge.

    Parameters
    ----------
    theta, phi : directions to the light, degrees, within the superstrate: from the normal, and from
        x towards y; a grid of both.
    step : between wavelengths, nm; the ends of the settings' wavelengths are solved exactly.
    profile, material, superstrate, layers, beneath, substrate, settings, jobs, announce : as for
        `solve_orders`; the tolerance bounds the solver's error.
    """
    how, work = settings or Settings(), jobs or Jobs()
    low, high = how.wavelengths
    check_outline(profile.period, how.wavelengths, superstrate)
    if how.polarised:
        raise DiffractionError(
            "polarised: a table of some directions has efficiencies alone; leave out polarised, or "
            "the directions"
        )
    count = max(int(np.ceil((high - low) / step - 1e-9)), 1) + 1 if high > low else 1
    lam = np.linspace(low, high, count)
    polar, azimuth = (np.unique(np.asarray(angle, np.float64)) for angle in (theta, phi))
    check_light(lam, polar, azimuth, "solve_beam")
    if lam.size * polar.size * azimuth.size > _MOST:
        raise DiffractionError(
            f"{lam.size} wavelengths x {polar.size} theta x {azimuth.size} phi are over {_MOST} "
            "solutions; choose fewer directions, or a larger step"
        )
    substance = material_of(material, how.wavelengths)
    structure = structure_of(
        profile, substance, how.wavelengths, layers=layers, beneath=beneath, substrate=substrate
    )
    grating = Grating(profile, substance, superstrate, how.wavelengths, structure=structure)
    light = _Lights(grating, lam, polar, azimuth)
    problem = problem_of(grating, how.method, how.resolution or 0)
    middle = light.places[:: max(len(light.places) // _COMPARED, 1)]
    if how.resolution is None:
        chosen = chosen_resolution(problem, work, middle, how.tolerance / 2)
    else:
        chosen = Chosen(problem, resolution_error(problem, work, middle))
    announce_stage(announce, "solving", chosen.problem, work, light.places)
    solved = work.amplitudes(chosen.problem, light.places, "solving orders")
    values, orders = light.efficiencies(solved)
    header: dict[str, Any] = {
        "solver": solver_of(chosen.problem).name,
        "material": material_text(grating),
        "profile": profile.name,
        "depth": profile.depth,
        "solver_error": chosen.error,
        "tolerance": how.tolerance,
        "directions": [[float(t), float(p)] for t in polar for p in azimuth],
        "processor_seconds": round(work.processor_seconds, 1),
    }
    grid = Efficiencies(lam, polar, azimuth, orders, values)
    return table_of(grid, profile.period, superstrate, f"the table of {profile.name}", header)


class _Lights:
    """Grid of light (a wavelengths, b θ, c φ) in the coordinates of stations.

    places : of each light, in the order of the grid.
    """

    def __init__(self, grating: Grating, lam: Real, theta: Real, phi: Real) -> None:
        grid = np.meshgrid(lam, theta, phi, indexing="ij")
        self._shape = grid[0].shape
        lam, theta, phi = (part.ravel() for part in grid)
        sine = np.sin(np.radians(theta))
        # solvers take y ≥ 0, the mirror image
        self._x, self._y = -sine * np.cos(np.radians(phi)), np.abs(sine * np.sin(np.radians(phi)))
        optical = grating.optical_period
        self._cell = cell = cells.to_cell(self._x, self._y, lam, optical)
        w = cells.w_of(cell.k_continuous, lam, grating.wavelengths, optical)
        rows = zip(cell.band, cell.kind, cell.tau, cell.rho, w, strict=True)
        self.places = [
            Place(int(k), int(kind), float(tau), float(rho), (float(at),))
            for k, kind, tau, rho, at in rows
        ]

    def efficiencies(self, solved: dict[Place, Complex]) -> tuple[Real, NDArray[np.int64]]:
        """Return efficiencies (a, b, c, m, 2) of s and p light, NaN where none, and the orders."""
        last = np.max(self._cell.channel)
        first = np.min(self._cell.channel - self._cell.channels + 1)
        orders = np.arange(int(first), int(last) + 1)
        values = np.full((len(self.places), len(orders), 2), np.nan)
        axes = turned_axes(self._x, self._y)
        for n, place in enumerate(self.places):
            j = int(self._cell.channel[n])
            row = mueller_of(solved[place])[0, j, :, 0]  # (q, 4): M00 … M03
            part = axes.cosine[n] * row[:, 1] + axes.sine[n] * row[:, 2]
            both = np.stack([row[:, 0] + part, row[:, 0] - part], axis=-1)
            total = float(row[:, 0].sum())
            if total > MOST_EXCESS:
                raise DiffractionError(
                    f"efficiencies of a solution sum to {total:.4g}; use a higher resolution, or "
                    "another method"
                )
            both /= np.maximum(both.sum(axis=0), 1.0)
            values[n, j - np.arange(len(row)) - orders[0]] = np.maximum(both, 0.0)
        return values.reshape(*self._shape, len(orders), 2), orders
