"""Deviations of the model, or of another solver, from rigorous solutions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.arrays import Real, Whole

from .cases import Grating
from .model import modelled
from .solutions import LIGHTS, Solutions

#: Orders that leave closer to the surface than this are not counted: the model has no limit there.
GRAZING = 75.0  # degrees


class Comparison(Solutions):
    """Solved cases, with other efficiencies of the orders of each."""

    @cached_property
    def order(self) -> Whole:
        """Orders of all cases, (n, 2)."""
        return self.column("order")

    @cached_property
    def exact(self) -> Real:
        """Their rigorous efficiencies for s and p light, (n, 2)."""
        return self.column("powers")

    @cached_property
    def by_light(self) -> Real:
        """Their other efficiencies for s and p light, (n, 2)."""
        return self.column("other")

    @property
    def rigorous(self) -> Real:
        """Rigorous efficiencies for unpolarised light, (n,)."""
        return self.exact.mean(axis=1)

    @property
    def model(self) -> Real:
        """Other efficiencies for unpolarised light, (n,)."""
        return self.by_light.mean(axis=1)

    @property
    def coloured(self) -> NDArray[np.bool_]:
        """Orders but 0, (n,)."""
        return (self.order != 0).any(axis=1)

    @cached_property
    def counted(self) -> NDArray[np.bool_]:
        """Orders that do not leave along the surface (`GRAZING`), (n,)."""
        wo = self.column("wo")
        # light from this angle is reflected at it
        return np.hypot(*wo[:, :2].T) <= np.sin(np.radians(GRAZING)) + 1e-9

    def deviation(self, *, colours: bool = False, light: str | None = None) -> float:
        """Σ|η − η_rigorous| / Σ η_rigorous over the counted orders; NaN if there are none.

        The measure of the project's other accuracy figures. With `colours` order 0 is left out,
        which would hide the others where it is much the strongest. `light` is "te", "tm" or both.
        """
        if not self.solved:
            return np.nan
        keep = self.counted & self.coloured if colours else self.counted
        if light is None:
            return misplaced(self.model, self.rigorous, keep)
        n = LIGHTS.index(light)
        return misplaced(self.by_light[:, n], self.exact[:, n], keep)

    def colours_of(self, model: Real) -> float:
        """Deviation of colours of other efficiencies (n,) for unpolarised light."""
        return misplaced(model, self.rigorous, self.counted & self.coloured)

    def change(self) -> float:
        """Change by the last refinement of the solver, in the measure of `deviation` of colours."""
        keep = self.counted & self.coloured
        changed = self.column("change").mean(axis=1)
        return float(changed[keep].sum() / self.rigorous[keep].sum())

    def largest_relative(self, orders: int = 2) -> float:
        """Largest |η/η_rigorous − 1| among the counted orders |m| up to `orders`."""
        keep = self.counted & (np.abs(self.order[:, 0]) <= orders)
        return float(np.max(np.abs(self.model[keep] / self.rigorous[keep] - 1)))

    def gain(self) -> float:
        """Σ η / Σ η_rigorous of all orders: how much light the model makes or loses altogether."""
        return float(self.model.sum() / self.rigorous.sum())


#: Comparisons of the same solutions, by model.
Sides = Mapping[str, Comparison]


def misplaced(
    values: Real,
    exact: Real,
    keep: NDArray[np.bool_] | slice = slice(None),
) -> float:
    """Return Σ|values − exact| / Σ exact over the rows that are kept; NaN without light in them."""
    total = float(exact[keep].sum())
    return float(np.abs(values - exact)[keep].sum()) / total if total else np.nan


def compare(solutions: Solutions, model: str = "kirchhoff") -> Comparison:
    """Evaluate a model (`model.MODELS`) for the solutions that have converged."""
    solved = solutions.trusted().solved
    return Comparison([replace(s, other=modelled(s.case, s.order, model)) for s in solved])


def beside(first: Solutions, second: Solutions) -> Comparison:
    """The cases that two solvers solved: the `second` one's orders, the first one's as others."""
    known = {s.case: dict(zip(map(tuple, s.order), s.powers, strict=True)) for s in first.solved}
    both = (s for s in second.solved if s.case in known)
    return Comparison(
        [replace(s, other=np.array([known[s.case][tuple(m)] for m in s.order])) for s in both]
    )


def gratings_of(comparison: Comparison, profile: str) -> list[Grating]:
    """Solved gratings of a profile, gentlest slope first."""
    surfaces = {solved.case.surface for solved in comparison.where(profile=profile).solved}
    gratings = [surface for surface in surfaces if isinstance(surface, Grating)]
    return sorted(gratings, key=lambda grating: (grating.depth / grating.period, grating.period))


def angles_of(comparison: Comparison) -> list[float]:
    """Angles of incidence of the cases, ascending, degrees."""
    return sorted({solved.case.light.theta for solved in comparison.solved})


def table_of(
    comparison: Comparison,
    gratings: Sequence[Grating],
    angles: Sequence[float],
    measure: Callable[[Comparison], float],
) -> Real:
    """A measure for each grating and angle, (gratings, angles); NaN where nothing was solved."""
    result = np.full((len(gratings), len(angles)), np.nan)
    for row, grating in enumerate(gratings):
        of_grating = comparison.where(grating=grating)
        for column, theta in enumerate(angles):
            part = of_grating.where(theta=theta)
            if part.solved:
                result[row, column] = measure(part)
    return result
