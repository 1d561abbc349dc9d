"""Light as the package's solvers have it, and orders by these; gratings as these have them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.orders import cells, solve
from mitsuba_diffraction.orders.solve import Solver, Station
from mitsuba_diffraction.orders.solve.profiles import Profile, blazed, lamellar

from .cases import PIXELS, Case, Grating
from .solutions import Orders

#: Vertices of a sinusoid, whose secants are within 5e-7 of the depth: 1e-7 of an efficiency.
_VERTICES = 4096


class Beam(NamedTuple):
    """Station of some light, and the channel of its mirror direction."""

    station: Station
    channel: int


def light_of(
    period: float, wavelength: float, index: complex, x: float, y: float, *films: complex,
    thin: bool = False,
) -> Beam:  # fmt: skip
    """Return light of one wavelength (µm) whose mirror direction has the cosines x and y.

    films : indices of films on the profile, upwards.
    thin : whether light comes from within the material as well.
    """
    c = np.sqrt(1.0 - y * y)
    extent = 2.0 * c * period / wavelength
    place = 0.5 * extent * (1.0 - x / c)
    fraction = place % 1.0
    channels = int(np.floor(extent - fraction)) + 1
    arrays = np.array([wavelength]), np.array([complex(index)]), np.array([abs(y)])
    media = tuple(np.array([complex(film)]) for film in films)
    return Beam(Station(extent, fraction, channels, *arrays, thin, media), int(place))


def light_on(grating: solve.Grating, x: float, y: float, wavelength: float) -> Beam:
    """Return light of one wavelength (nm) as a table's solver has it; x and y as `light_of`."""
    period, limits = grating.optical_period, grating.wavelengths
    cell = cells.to_cell(x, y, wavelength, period)
    w = 0.0
    if limits[0] < limits[1]:
        w = float(cells.w_of(cell.k_continuous, wavelength, limits, period))
    place = int(cell.band), int(cell.kind), float(cell.tau), float(cell.rho)
    return Beam(grating.station(*place, [w]), int(cell.channel))


def powers_of(solver: Solver, light: Beam) -> dict[int, Real]:
    """Return the efficiencies (2,) of all orders, for s and p light across the grooves."""
    amplitudes = solver.amplitudes(light.station)[0, light.channel]
    powers = (np.abs(amplitudes) ** 2).sum(axis=-1)
    return {light.channel - q: powers[:, q] for q in range(powers.shape[1])}


def solved_by(solver: Solver, case: Case) -> Orders:
    """Return the orders of a case by a solver of the package."""
    assert case.index is not None
    (x, y, z), period, media = case.wi, case.field.extent[0], case.media
    films = () if media.film is None else media.film[:1]
    lit = period, 1e-3 * case.light.wavelength, case.index, -x, y, *films
    station, channel = light_of(*lit, thin=media.through)
    amplitudes, n = solver.amplitudes(station), station.channels
    powers = (
        solve.sheet_efficiencies(amplitudes, station) if media.thin else np.abs(amplitudes) ** 2
    )
    # ports below follow those above
    came = channel if z > 0.0 else n + int(np.argmax(station.inside == channel))
    left = slice(n, None) if media.through == (z > 0.0) else slice(0, n)
    ports = station.inside if left.start and not media.thin else np.arange(n)
    by_order = powers[0, came, :, left].sum(axis=-1)
    order = np.stack([channel - ports, 0 * ports], axis=1)
    return Orders(order[::-1], by_order.T[::-1])


def index_at(material: str | complex, wavelength: float) -> complex:
    """Return n + ik of a material that the solvers know, or of a number, at a wavelength (nm)."""
    index = solve.material_of(material, (wavelength, wavelength)).index(wavelength)
    assert index is not None
    return complex(index)


def heights_of(profile: Profile, pixels: int = PIXELS, rows: int = 2) -> HeightField:
    """Return one period of a profile as heights for the model."""
    places = (np.arange(pixels) + 0.5) / pixels * profile.period
    x, z = profile.closed
    row = np.interp((places - x[0]) % profile.period + x[0], x, z)
    pixel = profile.period / pixels
    return HeightField(np.stack([row] * rows), pixel, name=profile.name, periodic=True)


def profile_of(grating: Grating) -> Profile:
    """Return one period of a grating as a solver has it."""
    if grating.profile == "lamellar":
        return lamellar(grating.period, grating.depth)
    if grating.profile == "blazed":
        return blazed(grating.period, grating.depth, "ascending")
    heights = grating.heights(_VERTICES).heights[0]
    x = grating.period * np.arange(_VERTICES) / _VERTICES
    return Profile(x, heights - heights.mean(), grating.period, str(grating))
