"""What is asked of the default model, and what it reaches against the rigorous solutions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .cases import PROFILES, Grating
from .compare import Comparison, angles_of, compare, gratings_of
from .markdown import percent, table
from .models import ANGLES, BANDS, banded, of_colours, within

#: Largest deviation of colours on keratin at 60°, by profile and band of depth/period.
KERATIN = {
    ("sinusoidal", BANDS[0]): 0.01,
    ("sinusoidal", BANDS[1]): 0.05,
    ("lamellar", BANDS[0]): 0.04,
    ("lamellar", BANDS[1]): 0.22,
    ("blazed", BANDS[0]): 0.09,
    ("blazed", BANDS[1]): 0.18,
}

#: A comparison for each (material, model).
Sides = Mapping[tuple[str, str], Comparison]

# Enough for a hundredth of a point
_SHARES = np.linspace(0.0, 1.0, 101)


@dataclass(frozen=True)
class Case:
    """One angle on a grating, or on all of a band, by each model; deviations are of colours.

    Attributes
    ----------
    gratings : of each grating its comparisons by model.
    """

    label: str
    theta: float
    gratings: Sequence[Mapping[str, Comparison]]

    def deviation(self, model: str) -> float:
        """Mean over the gratings."""
        return float(np.mean([of_colours(one[model]) for one in self.gratings]))

    @property
    def change(self) -> float:
        """What the solver's last refinement changed, in the same measure."""
        return float(np.mean([one["kirchhoff"].change() for one in self.gratings]))

    @property
    def gain(self) -> float:
        """By how much the default model is better than Kirchhoff."""
        return self.deviation("kirchhoff") - self.deviation("small_slope")

    def with_one_share(self) -> tuple[float, float]:
        """The share of small slope, the same in all orders, that deviates least, and how much."""
        by_share = [
            [of_colours(replace(one["kirchhoff"], model=model)) for model in _by_share(one)]
            for one in self.gratings
        ]
        found = np.mean(by_share, axis=0)
        return float(_SHARES[found.argmin()]), float(found.min())

    def with_any_shares(self) -> float:
        """The deviation if each order had the share that is best for it: the bound of any blend."""
        found = []
        for one in self.gratings:
            models, exact = _by_share(one), one["kirchhoff"].rigorous
            nearest = np.abs(models - exact).argmin(axis=0)
            best = models[nearest, np.arange(len(exact))]
            found.append(of_colours(replace(one["kirchhoff"], model=best)))
        return float(np.mean(found))


def _by_share(models: Mapping[str, Comparison]) -> NDArray[np.float64]:
    """Efficiencies (shares, n) by `_SHARES` of small slope in every order.

    They are quadratic in the share s, and so given by those at s = 0, 1/2 and 1.
    """
    none, half, whole = (
        models[name].model for name in ("kirchhoff", "half_and_half", "small_slope_alone")
    )
    s = _SHARES[:, None]
    lower, upper = (1 - s) * (1 - 2 * s) * none, s * (2 * s - 1) * whole
    return np.asarray(lower + 4 * s * (1 - s) * half + upper)


def section(sides: Sides) -> str:
    """The goals, and where they are missed."""
    parts = [keratin(sides)] if ("keratin", "small_slope") in sides else []
    return "\n\n".join(["## Goals", *parts, no_worse(sides, "aluminium")])


def keratin(sides: Sides) -> str:
    """Goal and figure by profile and depth/period."""
    kirchhoff, default = (
        {(profile, band): values[0] for profile, band, values in banded(part, [60.0])}
        for part in (sides["keratin", "kirchhoff"], sides["keratin", "small_slope"])
    )
    rows = [
        [profile, f"{low:g} to {high:g}", *map(percent, (goal, default[key], kirchhoff[key]))]
        for key, goal in KERATIN.items()
        for profile, (low, high) in [key]
        if key in default
    ]
    every = singles(models_of(sides, "keratin"))
    worse = sum(_is_worse(case) for case in every)
    return f"""Deviation of colours on keratin at 60° that was asked of the default model:

{table(["grating", "depth/period", "goal", "default", "Kirchhoff"], rows)}

Nowhere on keratin was it to be worse than Kirchhoff by more than a tenth; beyond what the solver's
last refinement changed it is in {worse} of {len(every)} gratings and angles."""


def _is_worse(case: Case) -> bool:
    """Than Kirchhoff, by more than a tenth and what the solver's last refinement changed."""
    return -case.gain > max(case.change, 0.1 * case.deviation("kirchhoff"))


def no_worse(sides: Sides, material: str) -> str:
    """Where the default model is worse than Kirchhoff on a metal."""
    models = models_of(sides, material)
    solutions = models["kirchhoff"].solutions
    models["half_and_half"] = compare(material, solutions, "half_and_half")
    every, bands = singles(models), whole_bands(models)
    gains = [case.gain for case in every]
    better = sum(case.gain > case.change for case in every)
    worse = [case for case in every if case.gain < -case.change]
    rows = []
    for case in [*(case for case in bands if case.gain < -case.change), *worse]:
        share, best = case.with_one_share()
        both = case.deviation("kirchhoff"), case.deviation("small_slope")
        values = [f"{100 * x:.2f} %" for x in (*both, case.change, best, case.with_any_shares())]
        angle = f"{case.theta:g}°".replace("-", "−")
        rows.append([case.label, angle, *values[:3], f"{share:.2f}", *values[3:]])
    header = ["", "light from", "Kirchhoff", "default", "change", "one share", "with it", "any"]
    most, least = 100 * max(gains), -100 * min(gains)
    return f"""On {material} it was to be no worse than Kirchhoff. Of {len(every)} gratings and
angles it is better in {better} by more than the solver's last refinement changed (*change*), at
best by {most:.1f} points, and worse in {len(worse)}, at worst by {least:.2f}; half of them were
solved after the blend had been chosen. Bands of depth/period that are worse in the mean, then
these:

{table(header, rows)}

*One share* is the share of small slope, the same in all orders, that deviates least; *any* is what
each order's own best share would leave, which no blend is below. Where one share is 0 Kirchhoff's
errors cancel: both matrices lack light that is diffracted twice
([second order](#what-the-second-order-would-bring)), and Kirchhoff is the brighter."""


def models_of(sides: Sides, material: str) -> dict[str, Comparison]:
    """By model."""
    return {name: one for (of, name), one in sides.items() if of == material}


def singles(models: Mapping[str, Comparison]) -> list[Case]:
    """Every grating and angle of `models_of` a material."""
    every = models["kirchhoff"]
    return [
        _case(models, str(grating), theta, [grating])
        for profile in PROFILES
        for grating in gratings_of(every, profile)
        for theta in angles_of(every.where(profile=profile))
    ]


def whole_bands(models: Mapping[str, Comparison]) -> Iterator[Case]:
    """Every profile and band of depth/period at `models.ANGLES`."""
    for profile in PROFILES:
        for low, high in BANDS:
            if gratings := within(models["kirchhoff"], profile, (low, high)):
                for theta in ANGLES:
                    yield _case(models, f"all {profile}, {low:g} to {high:g}", theta, gratings)


def _case(
    models: Mapping[str, Comparison], label: str, theta: float, gratings: Sequence[Grating]
) -> Case:
    parts = []
    for one in gratings:
        chosen = {"profile": one.profile, "period": one.period, "depth": one.depth}
        parts.append({name: every.where(theta=theta, **chosen) for name, every in models.items()})
    return Case(label, theta, parts)
