"""Shipped tables of solved orders, and the default model, beside solvers that made neither.

| table | solver beside it |
| --- | --- |
| cd, dvd | coupled waves in layers, which suit vertical walls |
| sinusoidal | Rayleigh's expansion, reduced |
| blazed | integral method at twice the points: coupled waves converge too slowly on sloped metal |
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import OrderTable
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.solve.coupled import CoupledWaves
from mitsuba_diffraction.solve.integral import IntegralSolver
from mitsuba_diffraction.solve.materials import material_of
from mitsuba_diffraction.solve.profiles import Profile
from mitsuba_diffraction.solve.recipes import SolvedRecipe
from mitsuba_diffraction.solve.stations import Grating
from mitsuba_diffraction.tables.orders import cells

from . import rayleigh
from .cases import PIXELS
from .model import efficiencies

Real = NDArray[np.float64]

FOLDER = Path(__file__).parents[3] / "precompute" / "orders"
#: Tables, and (θ, φ) of the light in degrees: across the grooves, oblique and along them.
TABLES = ("cd", "dvd", "blazed", "sinusoidal")
MOUNTS = ((0, 0), (30, 0), (30, 50), (30, 90), (60, 0), (60, 50), (60, 90))
WAVELENGTHS = (450.0, 530.0, 610.0)
# orders beyond are left out, as in `compare`: an error of little light
_HORIZON = np.cos(np.radians(75.0))
_HARMONICS, _COUPLED, _POINTS = 41, 60, 320


class Deviation(NamedTuple):
    """Deviation from the solver beside, in light from one direction, over `WAVELENGTHS`.

    colours : of all orders but 0 that leave within 75°, as a share of their light.
    sum : of the sum over all orders, largest.
    """

    colours: float
    sum: float


@dataclass(frozen=True)
class Case:
    """A shipped table, its recipe, and the grating."""

    name: str

    @cached_property
    def recipe(self) -> SolvedRecipe:
        """Recipe of the table."""
        return SolvedRecipe.load(FOLDER / f"{self.name}.toml")

    @cached_property
    def table(self) -> OrderTable:
        """The shipped table."""
        return OrderTable.load(FOLDER / f"{self.name}.nc")

    @cached_property
    def field(self) -> HeightField:
        """Heights of one period."""
        profile = self.recipe.profile
        place = (np.arange(PIXELS) + 0.5) / PIXELS * profile.period
        heights = np.interp(place, *profile.closed)
        return HeightField(
            np.stack([heights, heights]), profile.period / PIXELS, name=self.name, periodic=True
        )

    def deviations(self, theta: float, phi: float) -> list[Deviation]:
        """Return the deviations of the default model and of the table.

        theta, phi : of the light in air, degrees; a superstrate refracts it.
        """
        rows = [self._efficiencies(theta, phi, lam) for lam in WAVELENGTHS]
        missed = np.array([[row.missed(row.model), row.missed(row.table)] for row in rows])
        light = sum(row.light for row in rows)
        sums = np.array(
            [[abs(np.sum(m) - np.sum(row.truth)) for m in (row.model, row.table)] for row in rows]
        )
        if light < 1e-6:
            light = np.nan  # no order but 0 propagates
        return [
            Deviation(float(m), float(s))
            for m, s in zip(missed.sum(axis=0) / light, sums.max(axis=0), strict=True)
        ]

    def _efficiencies(self, theta: float, phi: float, wavelength: float) -> _Row:
        recipe, table = self.recipe, self.table
        sine, turn = np.sin(np.radians(theta)) / recipe.superstrate, np.radians(phi)
        wi = np.array([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - sine**2)])
        truth = self.truth(wi, wavelength)
        inside = wavelength / recipe.superstrate
        order = np.array(sorted(truth))
        x = order * inside / 1e3 / table.period - wi[0]
        wo = np.stack([x, np.full(len(x), -wi[1]), np.sqrt(1 - x**2 - wi[1] ** 2)], axis=-1)
        index = self._index(wavelength)
        model = efficiencies(self.field, index, wi, wo, inside, "small_slope", sigma=table.period)
        solved = table.efficiency(-wi[0], wi[1], wavelength, order)
        return _Row(order, wo[:, 2], np.array([truth[m] for m in order]), model, solved)

    def _index(self, wavelength: float) -> complex:
        """Return the index over that of the superstrate."""
        recipe = self.recipe
        index = material_of(recipe.material, recipe.settings.wavelengths).index(wavelength)
        assert index is not None
        return complex(index) / recipe.superstrate

    def truth(self, wi: Real, wavelength: float) -> dict[int, float]:
        """Return the efficiencies of all orders by the solver beside, for unpolarised light."""
        recipe = self.recipe
        if self.name == "sinusoidal":
            index, inside = self._index(wavelength), wavelength / recipe.superstrate
            orders = rayleigh.solve(self.field, index, inside, wi, _HARMONICS)
            power = boundary.unpolarised(orders.jones) * orders.wo[:, 2] / wi[2]
            return dict(zip(orders.order[:, 0].tolist(), power.tolist(), strict=True))
        solver = _solver(recipe.profile, self.name)
        alone = (wavelength, wavelength)
        grating = Grating(
            recipe.profile, material_of(recipe.material, alone), recipe.superstrate, alone
        )
        cell = cells.to_cell(-wi[0], wi[1], wavelength, grating.optical_period)
        station = grating.station(
            int(cell.band), int(cell.kind), float(cell.tau), float(cell.rho), [0.0]
        )
        channel = int(cell.channel)
        power = (np.abs(solver.amplitudes(station)[0, channel]) ** 2).mean(axis=0).sum(axis=-1)
        return {channel - q: float(value) for q, value in enumerate(power)}


class _Row(NamedTuple):
    """Efficiencies at one wavelength, (n,) each: orders, cosines, truth, model and table."""

    order: NDArray[np.int64]
    cosine: Real
    truth: Real
    model: Real
    table: Real

    @property
    def coloured(self) -> NDArray[np.bool_]:
        return (self.order != 0) & (self.cosine > _HORIZON)

    @property
    def light(self) -> float:
        return float(self.truth[self.coloured].sum())

    def missed(self, values: Real) -> float:
        return float(np.abs(values - self.truth)[self.coloured].sum())


def _solver(profile: Profile, name: str) -> CoupledWaves | IntegralSolver:
    return IntegralSolver(profile, _POINTS) if name == "blazed" else CoupledWaves(profile, _COUPLED)
