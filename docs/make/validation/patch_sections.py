"""The section of docs/validation.md on surfaces in two dimensions and any plane of incidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .compare import GRAZING
from .markdown import percent, table
from .model import efficiencies, jones_of, shares
from .patch_solutions import RESOLUTIONS, Solved, solved
from .patches import KINDS, PatchCase, cell, patch_index, ratios_of

_MODELS = ("kirchhoff", "small_slope_alone", "first_order", "small_slope")
_SHOWN = ("kirchhoff", "small_slope_alone", "small_slope")
_POLARISED = ("kirchhoff", "first_order", "small_slope")
_ANGLES = (0.0, 30.0, 60.0)


@dataclass(frozen=True)
class PatchComparison:
    """One case: deviations of colours of each model, of s and p light, and the solution's change.

    `by_model` has Kirchhoff, small slope alone, the default in the first order and the default;
    `polarised` all but the second of them for incident s, then p light.
    """

    case: PatchCase
    by_model: dict[str, float]
    polarised: dict[str, tuple[float, float]]
    change: float


def compared(material: str, kinds: Sequence[str] = KINDS) -> list[PatchComparison]:
    """The cases that are kept of surfaces of these kinds."""
    return [
        _compare(solution)
        for solution in solved(material)[0]
        if solution.case.surface.kind in kinds
    ]


def section(comparisons: Sequence[PatchComparison]) -> str:
    """The tables."""
    rows, polarised = [], []
    for material, surface, wavelength in dict.fromkeys(
        (c.case.material, c.case.surface, c.case.wavelength) for c in comparisons
    ):
        same = [
            c
            for c in comparisons
            if (c.case.material, c.case.surface, c.case.wavelength)
            == (material, surface, wavelength)
        ]
        label = f"{material}, {surface.name}"
        rows.append(
            [label, f"{surface.slope:.2g}", f"{wavelength:g}", *_by_angle(same), _most(same)]
        )
        polarised.append([label, f"{wavelength:g}", *_polarised(same)])
    header = ["surface", "RMS slope", "nm", *(f"{theta:g}°" for theta in _ANGLES), "change"]
    return f"""## Two dimensions, and any plane of incidence

Small periodic cells: sinusoids in conical mounts, a crossed grating, and cuts of 2.6 µm of a
measured scale (*Elaphe*), of its look-alike, and of 3.2 µm of a CD, made periodic, smoothed and
scaled to a given RMS slope. Solved by Rayleigh's expansion (docs/make/validation/rayleigh.py);
steeper metals than these it does not solve. Deviation of colours, mean over the planes of incidence
(along x, along y, between), Kirchhoff / small slope alone / the default; *change* is what more
harmonics changed, at most, in the same measure. On keratin the default has the second order: of
gratings from each order's own ratios, as tables of short periods do, of cuts from those of the
whole patch, 20 to 65 µm wide, that they are of.

{table(header, rows)}

{goal(comparisons)}

The same for s- and p-polarised light at 60°, mean over the planes of incidence, Kirchhoff / the
default in the first order / the default, whose second order multiplies both alike:

{table(["surface", "nm", "s", "p"], polarised)}

The factor is the mean's: {_nearer(comparisons)}."""


def goal(comparisons: Sequence[PatchComparison]) -> str:
    """Mean and worst of the cuts of scales of slope 0.2 on keratin."""
    cuts = [
        c.by_model
        for c in comparisons
        if c.case.surface.kind in ("elaphe", "elaphe_like")
        and c.case.surface.slope == 0.2
        and c.case.material == "keratin"
    ]
    found = [[one[model] for one in cuts] for model in ("small_slope", "first_order", "kirchhoff")]
    default, first, kirchhoff = (f"{percent(_mean(one))}, {percent(max(one))}" for one in found)
    return (
        f"Cuts of scales of RMS slope 0.2 on keratin, {len(cuts)} directions and wavelengths, mean "
        f"and worst: {default} (goals 7 %, 10 %; first order {first}; Kirchhoff {kirchhoff})."
    )


def _nearer(comparisons: Sequence[PatchComparison]) -> str:
    """On how many directions of keratin the second order is better for s, and for p light."""
    oblique = [
        c.polarised for c in comparisons if c.case.material == "keratin" and c.case.theta == 60.0
    ]
    found = []
    for n, light in enumerate("sp"):
        gains = [100.0 * (one["first_order"][n] - one["small_slope"][n]) for one in oblique]
        found.append(
            f"{light} light is nearer in {sum(gain > 0.0 for gain in gains)} of {len(gains)} "
            f"directions, by {max(gains, default=0.0):.2g} points at most, and else off by "
            f"{-min(gains, default=0.0):.2g} more at most"
        )
    return "; ".join(found)


def second_solver() -> str:
    """Rayleigh's expansion beside coupled waves."""
    found = agreements()
    rows = []
    for surface, wavelength in dict.fromkeys((a.case.surface, a.case.wavelength) for a in found):
        same = [a for a in found if (a.case.surface, a.case.wavelength) == (surface, wavelength)]
        worst = (
            max(getattr(a, name) for a in same)
            for name in ("deviation", "first_change", "second_change")
        )
        rows.append([surface.name, f"{wavelength:g}", len(same), *map(percent, worst)])
    (coarse,), (fine,) = RESOLUTIONS["rayleigh"][1]
    (first, _), (second, _) = RESOLUTIONS["coupled_wave"][1]
    header = ["keratin", "nm", "directions", "difference", "change", "change, coupled waves"]
    other = solved("keratin", "coupled_wave")[1]["solver"]
    return f"""In two dimensions: Rayleigh's expansion beside {other}. *Difference* is the
deviation of colours from each other, *change* what either solution still changed from {coarse} to
{fine} and from {first} to {second} harmonics; the largest of all directions. The two differ by less
than coupled waves still change. On aluminium coupled waves do not converge; there Rayleigh's
expansion is held against the integral method on sinusoids, whose efficiencies agree within 3e-5 up
to a depth/period of 0.09; on keratin what goes through, solved from equations of its own, adds up
with what is reflected to 1 (crossed grating 1e-6, the CD's low pits 1e-3;
tests/docs/validation/test_patches.py).

{table(header, rows)}"""


@dataclass(frozen=True)
class PatchAgreement:
    """Both solvers on one case: their deviation of colours, and what either still changed."""

    case: PatchCase
    deviation: float
    first_change: float
    second_change: float


def agreements() -> list[PatchAgreement]:
    """Rayleigh's expansion beside coupled waves, on keratin."""
    second = {solution.case: solution for solution in solved("keratin", "coupled_wave")[0]}
    found = []
    for first in solved("keratin")[0]:
        if first.case not in second:
            continue
        field, other = cell(first.case.surface), second[first.case]
        powers, others = (
            dict(zip(_numbers(one), one.efficiency(field), strict=True)) for one in (first, other)
        )
        coloured = [number for number in powers if number != (0, 0)]
        truth = sum(powers[number] for number in coloured)
        deviation = sum(abs(powers[number] - others[number]) for number in coloured) / truth
        changes = (
            float(one.rows["change"][[number != (0, 0) for number in _numbers(one)]].sum() / truth)
            for one in (first, other)
        )
        found.append(PatchAgreement(first.case, float(deviation), *changes))
    return found


def _numbers(solution: Solved) -> list[tuple[int, int]]:
    return [(int(mx), int(my)) for mx, my in solution.rows[["mx", "my"]]]


def _compare(solution: Solved) -> PatchComparison:
    case, field = solution.case, cell(solution.case.surface)
    wi, wo = solution.wi, solution.wo(field)
    index = patch_index(case.material, case.wavelength)
    coloured = (solution.rows["mx"] != 0) | (solution.rows["my"] != 0)
    keep = coloured & (wo[:, 2] >= np.cos(np.radians(GRAZING)))
    truth = solution.efficiency(field)[keep]
    light, sigma = (field, index, wi, wo, case.wavelength), max(field.extent)  # lobes are separate
    found = {
        model: efficiencies(*light, model, sigma=sigma, ratios=ratios_of(case.surface))
        for model in _MODELS
    }
    found = {model: power[keep] for model, power in found.items()}
    by_model = {model: _deviation(power, truth) for model, power in found.items()}
    exact = np.sum(np.abs(solution.rows["jones"]) ** 2, axis=1) * (wo[:, 2] / wi[2])[:, None]
    polarised = {}
    for model in _POLARISED:
        jones = jones_of(*light, model)
        power = found[model][:, None] * shares(jones)[keep]
        s, p = (_deviation(power[:, n], exact[keep, n]) for n in range(2))
        polarised[model] = (s, p)
    return PatchComparison(
        case, by_model, polarised, float(solution.rows["change"][keep].sum() / truth.sum())
    )


def _deviation(power: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    return float(np.abs(power - truth).sum() / truth.sum())


def _by_angle(same: Sequence[PatchComparison]) -> list[str]:
    cells = []
    for theta in _ANGLES:
        chosen = [c.by_model for c in same if c.case.theta == theta]
        means = [_mean([c[model] for c in chosen]) for model in _SHOWN]
        cells.append(" / ".join(percent(mean) for mean in means))
    return cells


def _polarised(same: Sequence[PatchComparison]) -> list[str]:
    oblique = [c.polarised for c in same if c.case.theta == 60.0]
    return [
        " / ".join(percent(_mean([c[model][n] for c in oblique])) for model in _POLARISED)
        for n in range(2)
    ]


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else np.nan


def _most(same: Sequence[PatchComparison]) -> str:
    return percent(max(c.change for c in same))
