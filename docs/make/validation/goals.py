"""Goals of the default model, and its deviations from rigorous solutions beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.arrays import Real

from .cases import PROFILES, Grating
from .compare import Comparison, Sides, angles_of, compare, gratings_of, table_of
from .models import ANGLES, BANDS, BOTH, banded, of_colours, within

#: Largest deviation of colours on keratin at 60°, by profile and band of depth/period.
KERATIN = {
    ("sinusoidal", BANDS[0]): 0.01,
    ("sinusoidal", BANDS[1]): 0.05,
    ("lamellar", BANDS[0]): 0.04,
    ("lamellar", BANDS[1]): 0.22,
    ("blazed", BANDS[0]): 0.09,
    ("blazed", BANDS[1]): 0.18,
}

# Enough for a hundredth of a point
_SHARES = np.linspace(0.0, 1.0, 101)


@dataclass(frozen=True)
class Selection:
    """Deviation of colours at one angle, of a grating or of all gratings of a band.

    Attributes
    ----------
    sides : comparisons by model, of these gratings and others.
    """

    label: str
    theta: float
    gratings: Sequence[Grating]
    sides: Sides

    def deviation(self, model: str) -> float:
        """Mean over the gratings."""
        return self._mean(model, of_colours)

    @property
    def change(self) -> float:
        """Change by the last refinement of the solver, in the same measure."""
        return self._mean("kirchhoff", Comparison.change)

    @property
    def gain(self) -> float:
        """Deviation of Kirchhoff minus that of the blend."""
        return self.deviation("kirchhoff") - self.deviation("small_slope")

    def _mean(self, model: str, measure: Callable[[Comparison], float]) -> float:
        return float(table_of(self.sides[model], self.gratings, [self.theta], measure).mean())

    def with_one_share(self) -> tuple[float, float]:
        """Share of small slope, equal for all orders, with the least deviation, which is second."""
        by_share = [list(map(part.colours_of, models)) for part, models in self._shared()]
        mean = np.mean(by_share, axis=0)
        return float(_SHARES[mean.argmin()]), float(mean.min())

    def with_any_shares(self) -> float:
        """Deviation if each order had its own best share: the lower bound of any blend."""
        deviations = []
        for part, models in self._shared():
            exact = part.rigorous
            nearest = np.abs(models - exact).argmin(axis=0)
            deviations.append(part.colours_of(models[nearest, np.arange(len(exact))]))
        return float(np.mean(deviations))

    def _shared(self) -> Iterator[tuple[Comparison, Real]]:
        """Yield Kirchhoff's comparison of each grating, and the efficiencies by `_SHARES`."""
        for grating in self.gratings:
            lit = {"grating": grating, "theta": self.theta}
            sides = {model: every.where(**lit) for model, every in self.sides.items()}
            yield sides["kirchhoff"], _by_share(sides)


def _by_share(sides: Sides) -> Real:
    """Efficiencies (shares, n) by `_SHARES` of small slope in every order.

    They are quadratic in the share s, and so given by those at s = 0, 1/2 and 1.
    """
    none, half, whole = (
        sides[name].model for name in ("kirchhoff", "half_and_half", "small_slope_alone")
    )
    s = _SHARES[:, None]
    lower, upper = (1 - s) * (1 - 2 * s) * none, s * (2 * s - 1) * whole
    return np.asarray(lower + 4 * s * (1 - s) * half + upper)


class Goal(NamedTuple):
    """Goal on keratin at 60° for a profile and range of depth/period, and the deviations."""

    profile: str
    band: tuple[float, float]
    goal: float
    kirchhoff: float
    default: float


def keratin_goals(sides: Sides) -> list[Goal]:
    """Goals on gratings of keratin beside what each model reaches."""
    kirchhoff, default = (
        {(profile, band): values[0] for profile, band, values in banded(part, [60.0])}
        for part in (sides[name] for name in BOTH)
    )
    return [
        Goal(*key, goal, kirchhoff[key], default[key])
        for key, goal in KERATIN.items()
        if key in default
    ]


def much_worse(sides: Sides) -> list[Selection]:
    """Gratings and angles that are worse than Kirchhoff by more than a tenth.

    Differences below the last refinement of the solver are left out.
    """
    return [
        case
        for case in singles(sides)
        if -case.gain > max(case.change, 0.1 * case.deviation("kirchhoff"))
    ]


def with_half(sides: Sides) -> Sides:
    """Comparisons by model, and by equal parts of both matrices."""
    return {**sides, "half_and_half": compare(sides["kirchhoff"], "half_and_half")}


def singles(sides: Sides) -> list[Selection]:
    """Every grating and angle of a material."""
    every = sides["kirchhoff"]
    return [
        Selection(str(grating), theta, [grating], sides)
        for profile in PROFILES
        for grating in gratings_of(every, profile)
        for theta in angles_of(every.where(profile=profile))
    ]


def whole_bands(sides: Sides) -> Iterator[Selection]:
    """Every profile and band of depth/period at `models.ANGLES`."""
    for profile in PROFILES:
        for low, high in BANDS:
            if gratings := within(sides["kirchhoff"], profile, (low, high)):
                for theta in ANGLES:
                    label = f"all {profile}, {low:g} to {high:g}"
                    yield Selection(label, theta, gratings, sides)
