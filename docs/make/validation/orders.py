"""Shipped tables of solved orders, and the default model, beside solvers that made neither.

| table | solver beside it |
| --- | --- |
| cd, dvd | coupled waves in layers, which suit vertical walls |
| blazed, sinusoidal | Chandezon's method, which suits slopes |
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from mitsuba_diffraction import OrderTable
from mitsuba_diffraction.orders import solve

from .cases import Case, Light, Media, Sampled
from .compare import Comparison, compare
from .light import heights_of, index_at, light_on, powers_of, solved_by
from .solutions import Solved

FOLDER = Path(__file__).parents[3] / "precompute" / "orders"
#: Tables, and (θ, φ) of the light in degrees: across the grooves, oblique and along them.
TABLES = ("cd", "dvd", "blazed", "sinusoidal")
MOUNTS = ((0, 0), (30, 0), (30, 50), (30, 90), (60, 0), (60, 50), (60, 90))
WAVELENGTHS = (460.0, 530.0, 610.0)
#: Harmonics on either side, of coupled waves and of Chandezon's method.
COUPLED, CHANDEZON = 60, 20
#: Wavelength of the efficiencies side by side, nm.
SHOWN = 530.0
#: Random directions and wavelengths where absorption is compared.
SAMPLES = 200


@dataclass(frozen=True)
class Shipped:
    """A shipped table, its recipe, and the grating."""

    name: str

    @cached_property
    def recipe(self) -> solve.SolvedRecipe:
        """Recipe of the table."""
        return solve.SolvedRecipe.load(FOLDER / f"{self.name}.toml")

    @cached_property
    def table(self) -> OrderTable:
        """The shipped table."""
        return OrderTable.load(FOLDER / f"{self.name}.nc")

    @cached_property
    def surface(self) -> Sampled:
        """Heights of one period."""
        return Sampled(heights_of(self.recipe.profile))

    def side_by_side(self, theta: float, phi: float) -> Iterator[tuple[int, list[float]]]:
        """Yield order 0 and the strongest other one, and its efficiencies at `SHOWN`.

        They are by the default model, the table and the other solver.
        """
        model, table = self.compared(theta, phi, (SHOWN,))
        truth, order = model.rigorous, model.order[:, 0]
        # +m and −m of light in the plane of the grooves are equal but for rounding
        colours = np.where(model.coloured & model.counted, truth.round(6), -1.0)
        shown = [
            int(np.flatnonzero(order == 0)[0]),
            *([colours.argmax()] if colours.max() >= 0 else []),
        ]
        for n in shown:
            yield int(order[n]), [model.model[n], table.model[n], truth[n]]

    def compared(
        self, theta: float, phi: float, wavelengths: Sequence[float] = WAVELENGTHS
    ) -> tuple[Comparison, Comparison]:
        """Return the default model and the table beside the other solver.

        theta, phi : of the light in air, degrees; a superstrate refracts it.
        """
        superstrate, solved = self.recipe.superstrate, []
        inside = float(np.degrees(np.arcsin(np.sin(np.radians(theta)) / superstrate)))
        for wavelength in wavelengths:
            light = Light(wavelength / superstrate, inside, phi)
            index = index_at(self.recipe.material, wavelength) / superstrate
            case = Case(self.surface, light, Media(index))
            found = solved_by(self.solver, case)
            x, y, _ = case.wi
            values = self.table.efficiency(-x, y, wavelength, found.order[:, 0])
            by_table = np.repeat(values[:, None], 2, axis=1)
            solved.append(replace(Solved.between(case, found, found), other=by_table))
        table = Comparison(solved)
        return compare(table, "small_slope"), table

    def diffuse(self, samples: int = SAMPLES) -> Iterator[tuple[str, list[float]]]:
        """Yield each kind of light, and the deviations from the table's own solver in it.

        The numbers are: deviations of the colours, as a share of their light; the mean absorbed
        share, and its deviation as a share of this mean; of the absorbed shares the mean deviation,
        the deviation that 95 % of directions keep, and the largest.
        """
        most = 1.0 / self.recipe.superstrate
        if most == 1.0:
            yield "all", self._diffuse(samples, 0.0, 1.0)
        else:
            yield "through the face", self._diffuse(samples, 0.0, most)
            yield "trapped by the face", self._diffuse(samples, most, 1.0)

    def _diffuse(self, samples: int, least: float, most: float) -> list[float]:
        """Compare light of these sines, in random directions and wavelengths."""
        rng, table = np.random.default_rng(1), self.table
        radius = np.sqrt(rng.uniform(least**2, most**2, samples))
        turn = rng.uniform(0.0, 2.0 * np.pi, samples)
        x, y = radius * np.cos(turn), radius * np.sin(turn)
        lam = rng.uniform(*table.wavelengths, samples)
        resolution = self.recipe.settings.resolution
        assert resolution is not None
        solver = solve.IntegralSolver(self.recipe.profile, resolution)
        absorbed, deviation, missed, colours = np.zeros((4, samples))
        for n in range(samples):
            by_order = self._by_solver(solver, x[n], y[n], lam[n])
            order, truth = np.array(list(by_order)), np.array(list(by_order.values()))
            values = table.efficiency(x[n], y[n], lam[n], order)
            absorbed[n], deviation[n] = 1.0 - truth.sum(), truth.sum() - values.sum()
            missed[n] = np.abs(values - truth)[order != 0].sum()
            colours[n] = truth[order != 0].sum()
        size = np.abs(deviation)
        mean = absorbed.mean()
        return [
            missed.sum() / colours.sum(), mean, deviation.mean() / mean,
            size.mean(), np.quantile(size, 0.95), size.max(),
        ]  # fmt: skip

    def _by_solver(self, solver: solve.Solver, x: float, y: float, lam: float) -> dict[int, float]:
        """Return the efficiencies of all orders by the table's solver."""
        recipe, alone = self.recipe, (lam, lam)
        material = solve.material_of(recipe.material, alone)
        grating = solve.Grating(recipe.profile, material, recipe.superstrate, alone)
        powers = powers_of(solver, light_on(grating, x, y, lam))
        return {m: float(power.mean()) for m, power in powers.items()}

    @cached_property
    def solver(self) -> solve.Solver:
        """The solver beside."""
        if self.name in ("cd", "dvd"):
            return solve.CoupledWaves(self.recipe.profile, COUPLED)
        return solve.Chandezon(self.recipe.profile, CHANDEZON)
