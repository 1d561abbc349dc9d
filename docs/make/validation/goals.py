"""Goals of the default model, and its deviations from rigorous solutions beside them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.arrays import Real

from .cases import PROFILES, Grating
from .compare import Comparison, Sides, angles_of, compare, gratings_of
from .models import ANGLES, BANDS, banded, of_cells, of_colours, within
from .solutions import Solutions

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
    gratings : comparisons by model, for each grating.
    """

    label: str
    theta: float
    gratings: Sequence[Mapping[str, Comparison]]

    def deviation(self, model: str) -> float:
        """Mean over the gratings."""
        return float(np.mean([of_colours(by_model[model]) for by_model in self.gratings]))

    @property
    def change(self) -> float:
        """Change by the last refinement of the solver, in the same measure."""
        return float(np.mean([by_model["kirchhoff"].change() for by_model in self.gratings]))

    @property
    def gain(self) -> float:
        """Deviation of Kirchhoff minus that of the blend."""
        return self.deviation("kirchhoff") - self.deviation("small_slope")

    def with_one_share(self) -> tuple[float, float]:
        """Share of small slope, equal for all orders, with the least deviation, which is second."""
        by_share = [
            [by_model["kirchhoff"].colours_of(model) for model in _by_share(by_model)]
            for by_model in self.gratings
        ]
        mean = np.mean(by_share, axis=0)
        return float(_SHARES[mean.argmin()]), float(mean.min())

    def with_any_shares(self) -> float:
        """Deviation if each order had its own best share: the lower bound of any blend."""
        deviations = []
        for by_model in self.gratings:
            models, exact = _by_share(by_model), by_model["kirchhoff"].rigorous
            nearest = np.abs(models - exact).argmin(axis=0)
            best = models[nearest, np.arange(len(exact))]
            deviations.append(by_model["kirchhoff"].colours_of(best))
        return float(np.mean(deviations))


def _by_share(models: Mapping[str, Comparison]) -> Real:
    """Efficiencies (shares, n) by `_SHARES` of small slope in every order.

    They are quadratic in the share s, and so given by those at s = 0, 1/2 and 1.
    """
    none, half, whole = (
        models[name].model for name in ("kirchhoff", "half_and_half", "small_slope_alone")
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
        for part in (sides["keratin", name] for name in ("kirchhoff", "small_slope"))
    )
    return [
        Goal(*key, goal, kirchhoff[key], default[key])
        for key, goal in KERATIN.items()
        if key in default
    ]


class Cuts(NamedTuple):
    """Mean and largest deviation of colours on cuts of scales by one model."""

    mean: float
    worst: float


def cuts_of_scales(cells: Sides, model: str) -> Cuts | None:
    """Deviation on cuts of scales of keratin with slope 0.2; None where none are stored."""
    deviations = of_cells(cells["keratin", model], kind=["elaphe", "elaphe_like"], slope=0.2)
    return Cuts(float(np.mean(deviations)), max(deviations)) if deviations else None


def much_worse(sides: Sides, material: str) -> list[Selection]:
    """Gratings and angles that are worse than Kirchhoff by more than a tenth.

    Differences below the last refinement of the solver are left out.
    """
    return [
        case
        for case in singles(models_of(sides, material))
        if -case.gain > max(case.change, 0.1 * case.deviation("kirchhoff"))
    ]


def with_half(sides: Sides, material: str) -> dict[str, Comparison]:
    """Comparisons of one material by model, and by equal parts of both matrices."""
    models = models_of(sides, material)
    half = compare(Solutions(models["kirchhoff"].solved), "half_and_half")
    return {**models, "half_and_half": half}


def models_of(sides: Sides, material: str) -> dict[str, Comparison]:
    """Comparisons of one material by model."""
    return {model: part for (name, model), part in sides.items() if name == material}


def singles(models: Mapping[str, Comparison]) -> list[Selection]:
    """Every grating and angle of one material, from its comparisons by model."""
    every = models["kirchhoff"]
    return [
        _case(models, str(grating), theta, [grating])
        for profile in PROFILES
        for grating in gratings_of(every, profile)
        for theta in angles_of(every.where(profile=profile))
    ]


def whole_bands(models: Mapping[str, Comparison]) -> Iterator[Selection]:
    """Every profile and band of depth/period at `models.ANGLES`."""
    for profile in PROFILES:
        for low, high in BANDS:
            if gratings := within(models["kirchhoff"], profile, (low, high)):
                for theta in ANGLES:
                    yield _case(models, f"all {profile}, {low:g} to {high:g}", theta, gratings)


def _case(
    models: Mapping[str, Comparison], label: str, theta: float, gratings: Sequence[Grating]
) -> Selection:
    parts = [
        {name: every.where(grating=grating, theta=theta) for name, every in models.items()}
        for grating in gratings
    ]
    return Selection(label, theta, parts)
