"""`solve_beam`: orders of some directions of light alone, as of an echelle in its mount.

A grating with tens of orders has too many directions for a table of all. In an instrument light
comes from one of them: the efficiencies there, wavelength by wavelength, make a table as a file's
efficiencies do (`measured`), with the same warning.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..errors import DiffractionError
from ..tables.orders import OrderTable
from ..tables.orders.lookup import turned_axes
from ..tables.orders.polarised import mueller_of
from ..tables.orders.table import check_outline
from .efficiencies import Efficiencies, check_light
from .films import Layers, Substance, structure_of
from .grating_index import TabulatedIndex, material_of
from .jobs import Jobs, problem_of
from .measured import table_of
from .nodes import places_at
from .orders import MOST_EXCESS, Estimate, Settings, announce_stage, header_of, silent
from .profiles import Profile
from .resolution import resolved
from .stations import Grating, Real

#: Lights of which the resolution is chosen, and solutions at most.
_COMPARED, _MOST = 5, 100_000


def solve_beam(
    profile: Profile,
    material: str | float | complex | TabulatedIndex = "Al",
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
    problem = problem_of(grating, how.method, how.resolution or 0)
    grid = [axis.ravel() for axis in np.meshgrid(lam, polar, azimuth, indexing="ij")]
    sine, turn = np.sin(np.radians(grid[1])), np.radians(grid[2])
    # solvers take y ≥ 0, the mirror image
    x, y = -sine * np.cos(turn), np.abs(sine * np.sin(turn))
    cell, places = places_at(x, y, grid[0], how.wavelengths, grating.optical_period)
    chosen = resolved(problem, work, places[:: max(len(places) // _COMPARED, 1)], how.tolerance / 2)
    announce_stage(announce, "solving", chosen.problem, work, places)
    solved = work.amplitudes(chosen.problem, places, "solving orders")
    first, last = int((cell.channel - cell.channels + 1).min()), int(cell.channel.max())
    axes = turned_axes(x, y)
    values = np.full((len(places), last - first + 1, 2), np.nan)
    for n, (place, j) in enumerate(zip(places, cell.channel.tolist(), strict=True)):
        both = _s_and_p(mueller_of(solved[place])[0, j], axes.cosine[n], axes.sine[n])
        values[n, j - np.arange(len(both)) - first] = both
    header = header_of(chosen, how) | {
        "directions": [[float(t), float(p)] for t in polar for p in azimuth],
        "processor_seconds": round(work.processor_seconds, 1),
    }
    shape = lam.size, polar.size, azimuth.size, *values.shape[1:]
    orders = np.arange(first, last + 1)
    lights = Efficiencies(lam, polar, azimuth, orders, values.reshape(shape))
    return table_of(lights, profile.period, superstrate, f"the table of {profile.name}", header)


def _s_and_p(matrices: Real, cosine: float, sine: float) -> Real:
    """Return the efficiencies (q, 2) of s and p light from the Mueller matrices (q, 4, 4).

    Raises a DiffractionError if they sum to more than a coarse solution may.

    cosine, sine : of the turn from the axes of the matrices to s and p.
    """
    row = matrices[:, 0]  # M00 … M03
    part = cosine * row[:, 1] + sine * row[:, 2]
    both = np.stack([row[:, 0] + part, row[:, 0] - part], axis=-1)
    total = float(row[:, 0].sum())
    if total > MOST_EXCESS:
        raise DiffractionError(
            f"efficiencies of a solution sum to {total:.4g}; use a higher resolution, or another "
            "method"
        )
    return np.maximum(both / np.maximum(both.sum(axis=0), 1.0), 0.0)
