"""Model and solvers beside each other on periodic cells in two dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .cases import index_of
from .compare import GRAZING, misplaced
from .model import efficiencies, jones_of, shares
from .patch_solutions import Solved, solved
from .patches import KINDS, PatchCase, cell

_MODELS = ("kirchhoff", "small_slope_alone", "small_slope")
_POLARISED = ("kirchhoff", "small_slope")


@dataclass(frozen=True)
class PatchComparison:
    """Deviations of colours of each model, of s and p light, and the change of the solution.

    `by_model` has Kirchhoff, small slope alone and the default; `polarised` the first and the last
    of them for incident s, then p light.
    """

    case: PatchCase
    by_model: dict[str, float]
    polarised: dict[str, tuple[float, float]]
    change: float


def compared(material: str, kinds: Sequence[str] = KINDS) -> list[PatchComparison]:
    """Compare the stored solutions of surfaces of these kinds."""
    return [
        _compare(solution)
        for solution in solved(material)[0]
        if solution.case.surface.kind in kinds
    ]


def chosen(
    comparisons: Sequence[PatchComparison], kinds: Sequence[str], slope: float, material: str
) -> list[PatchComparison]:
    """Return the cases of surfaces of some kinds, a slope and a material."""
    return [
        c
        for c in comparisons
        if c.case.surface.kind in kinds
        and c.case.surface.slope == slope
        and c.case.material == material
    ]


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
    compared = []
    for first in solved("keratin")[0]:
        if first.case not in second:
            continue
        field, other = cell(first.case.surface), second[first.case]
        powers, others = (
            dict(zip(_numbers(solved_by), solved_by.efficiency(field), strict=True))
            for solved_by in (first, other)
        )
        coloured = [number for number in powers if number != (0, 0)]
        truth, values = (np.array([of[n] for n in coloured]) for of in (powers, others))
        changes = (
            float(
                solved_by.rows["change"][[number != (0, 0) for number in _numbers(solved_by)]].sum()
                / truth.sum()
            )
            for solved_by in (first, other)
        )
        compared.append(PatchAgreement(first.case, misplaced(values, truth), *changes))
    return compared


def _numbers(solution: Solved) -> list[tuple[int, int]]:
    return [(int(mx), int(my)) for mx, my in solution.rows[["mx", "my"]]]


def _compare(solution: Solved) -> PatchComparison:
    case, field = solution.case, cell(solution.case.surface)
    wi, wo = solution.wi, solution.wo(field)
    index = index_of(case.material, case.wavelength)
    coloured = (solution.rows["mx"] != 0) | (solution.rows["my"] != 0)
    keep = coloured & (wo[:, 2] >= np.cos(np.radians(GRAZING)))
    truth = solution.efficiency(field)[keep]
    light, sigma = (field, index, wi, wo, case.wavelength), max(field.extent)  # lobes are separate
    powers = {model: efficiencies(*light, model, sigma=sigma)[keep] for model in _MODELS}
    by_model = {model: misplaced(power, truth) for model, power in powers.items()}
    exact = np.sum(np.abs(solution.rows["jones"]) ** 2, axis=1) * (wo[:, 2] / wi[2])[:, None]
    polarised = {}
    for model in _POLARISED:
        jones = jones_of(*light, model)
        power = powers[model][:, None] * shares(jones)[keep]
        s, p = (misplaced(power[:, n], exact[keep, n]) for n in range(2))
        polarised[model] = (s, p)
    return PatchComparison(
        case, by_model, polarised, float(solution.rows["change"][keep].sum() / truth.sum())
    )
