"""Deviations of the model from rigorous solutions of gratings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cases import PROFILES, Grating, order_sines
from .model import order_efficiencies, order_shares
from .solutions import KEY, LIGHTS, Solutions, shipped

#: Orders that leave closer to the surface than this are not counted: the model has no limit there.
GRAZING = 75.0  # degrees


@dataclass(frozen=True)
class Comparison:
    """Converged solutions of one material, and the model's efficiency of each row.

    `by_light` are the model's for TE and TM light, (n, 2), whose mean is `model`.
    """

    material: str
    solutions: Solutions
    model: NDArray[np.float64]
    by_light: NDArray[np.float64]

    @cached_property
    def rigorous(self) -> NDArray[np.float64]:
        """Efficiency for unpolarised light, (n,)."""
        return self.solutions.mean

    @cached_property
    def sine(self) -> NDArray[np.float64]:
        """sinθo of each row, (n,)."""
        rows = self.solutions.rows
        step = rows["wavelength"].astype(float) / 1000 / rows["period"].astype(float)
        return rows["order"] * step - np.sin(np.radians(rows["theta"].astype(float)))

    @cached_property
    def counted(self) -> NDArray[np.bool_]:
        """Rows that do not leave along the surface (`GRAZING`), (n,)."""
        return np.abs(self.sine) <= np.sin(np.radians(GRAZING))

    def select(self, keep: NDArray[np.bool_]) -> Comparison:
        """Some of the rows."""
        part = Solutions(self.solutions.rows[keep], self.solutions.about)
        return Comparison(self.material, part, self.model[keep], self.by_light[keep])

    def where(self, **values: Any) -> Comparison:
        """The rows with these values, as `Solutions.where`."""
        return self.select(self.solutions.having(**values))

    def deviation(self, *, colours: bool = False, light: str | None = None) -> float:
        """Σ|η − η_rigorous| / Σ η_rigorous over the counted rows; NaN if there are none.

        The measure of the project's other accuracy figures. With `colours` order 0 is left out,
        which would hide the others where it is much the strongest. `light` is "te", "tm" or both.
        """
        keep = self.counted & (self.solutions.rows["order"] != 0) if colours else self.counted
        model, exact = self.model, self.rigorous
        if light is not None:
            model = self.by_light[:, LIGHTS.index(light)]
            exact = self.solutions.rows[light].astype(float)
        return misplaced(model, exact, keep)

    def change(self) -> float:
        """Change by the last refinement of the solver, in the measure of `deviation` of colours."""
        rows = self.solutions.rows
        keep = self.counted & (rows["order"] != 0)
        changed = rows["te_change"][keep].astype(float) + rows["tm_change"][keep]
        return float(0.5 * changed.sum() / self.rigorous[keep].sum())

    def largest_relative(self, orders: int = 2) -> float:
        """Largest |η/η_rigorous − 1| among the counted rows with |m| up to `orders`."""
        keep = self.counted & (np.abs(self.solutions.rows["order"]) <= orders)
        return float(np.max(np.abs(self.model[keep] / self.rigorous[keep] - 1)))

    def gain(self) -> float:
        """Σ η / Σ η_rigorous over all rows: how much light the model makes or loses altogether."""
        return float(self.model.sum() / self.rigorous.sum())


def misplaced(
    values: NDArray[np.float64],
    exact: NDArray[np.float64],
    keep: NDArray[np.bool_] | slice = slice(None),
) -> float:
    """Return Σ|values − exact| / Σ exact over the rows that are kept; NaN without light in them."""
    total = float(exact[keep].sum())
    return float(np.abs(values - exact)[keep].sum()) / total if total else np.nan


def compare(
    material: str,
    solutions: Solutions | None = None,
    model: str = "kirchhoff",
    **layer: Any,
) -> Comparison:
    """Evaluate a model (`model.MODELS`) for the converged solutions, by default the stored ones.

    layer : over the gratings, `coat` or `film` of `reference.brdf`; `by_light` is NaN then.

    Raises
    ------
    DiffractionError
        If there are no solutions for this material.
    """
    trusted = (solutions or shipped(material)).trusted()
    rows = trusted.rows
    unpolarised, lights = np.full(len(rows), np.nan), np.full((len(rows), 2), np.nan)
    for grating, theta, wavelength, members in scans_of(rows):
        orders, _ = order_sines(grating.period, wavelength, theta)
        efficiencies = order_efficiencies(grating, material, theta, wavelength, model, **layer)
        place = np.searchsorted(orders, rows["order"][members])
        unpolarised[members] = efficiencies[place]
        if not layer:
            share = order_shares(grating, material, theta, wavelength, model)
            lights[members] = (efficiencies[:, None] * share)[place]
    return Comparison(material, trusted, unpolarised, lights)


def scans_of(
    rows: NDArray[np.void],
) -> Iterator[tuple[Grating, float, float, NDArray[np.intp]]]:
    """Grating, angle in degrees, wavelength in nm and rows of every solution."""
    unique, inverse = np.unique(rows[KEY], return_inverse=True)
    starts = np.argsort(inverse.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(inverse.ravel()))
    for key, members in zip(unique, np.split(starts, ends[:-1]), strict=True):
        profile, period, depth, theta, wavelength = (_decimal(value) for value in key)
        yield Grating(PROFILES[int(profile)], period, depth), theta, wavelength, members


def gratings_of(comparison: Comparison, profile: str) -> list[Grating]:
    """Solved gratings of a profile, gentlest slope first."""
    rows = comparison.solutions.rows
    rows = rows[rows["profile"] == PROFILES.index(profile)]
    pairs = {(_decimal(p), _decimal(d)) for p, d in zip(rows["period"], rows["depth"], strict=True)}
    return sorted(
        (Grating(profile, period, depth) for period, depth in pairs),
        key=lambda grating: (grating.depth / grating.period, grating.period),
    )


def angles_of(comparison: Comparison) -> list[float]:
    """Angles of incidence among the rows, ascending, degrees."""
    return [float(theta) for theta in np.unique(comparison.solutions.rows["theta"])]


def table_of(
    comparison: Comparison,
    gratings: Sequence[Grating],
    angles: Sequence[float],
    measure: Callable[[Comparison], float],
) -> NDArray[np.float64]:
    """A measure for each grating and angle, (gratings, angles); NaN where nothing was solved."""
    result = np.full((len(gratings), len(angles)), np.nan)
    for row, grating in enumerate(gratings):
        of_grating = comparison.where(grating=grating)
        for column, theta in enumerate(angles):
            part = of_grating.where(theta=theta)
            if len(part.model):
                result[row, column] = measure(part)
    return result


def _decimal(value: np.floating) -> float:
    """A number as it was written before it was stored in single precision."""
    return float(f"{float(value):.6g}")
