"""The section of docs/validation.md on surfaces in two dimensions and any plane of incidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.optics import blend, boundary
from mitsuba_diffraction.optics.geometry import wavenumber

from .compare import GRAZING
from .markdown import percent, table
from .model import efficiencies
from .patch_solutions import RESOLUTIONS, Solved, solved
from .patches import KINDS, MEASURED, PatchCase, cell, patch_index

_MODELS = ("kirchhoff", "small_slope_alone", "small_slope")
_ANGLES = (0.0, 30.0, 60.0)


@dataclass(frozen=True)
class PatchComparison:
    """One case: deviations of colours of each model, of s and p light, and the solution's change.

    `by_model` has Kirchhoff, small slope alone and the blend; `polarised` those of Kirchhoff and
    the blend for incident s, then p light.
    """

    case: PatchCase
    by_model: dict[str, float]
    polarised: dict[str, tuple[float, float]]
    change: float


def compared(material: str, kinds: Sequence[str] = KINDS) -> list[PatchComparison]:
    """The cases that are kept of surfaces of these kinds, without those of the measured patch where
    that is not here."""
    return [
        _compare(solution)
        for solution in solved(material)[0]
        if solution.case.surface.kind in kinds and _is_here(solution.case)
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
    (coarse, _), (fine, _) = RESOLUTIONS["keratin"][1]
    header = ["surface", "RMS slope", "nm", *(f"{theta:g}°" for theta in _ANGLES), "change"]
    return f"""## Two dimensions, and any plane of incidence

Small periodic cells: sinusoids in conical mounts, a crossed grating, and cuts of 2.6 µm of a
measured scale (*Elaphe*), of its look-alike, and of 3.2 µm of a CD, made periodic, smoothed and
scaled to a given RMS slope. Solved by `grcwa` (coupled waves). Deviation of colours, mean over the
planes of incidence (along x, along y, between), Kirchhoff / small slope alone / the blend; *change*
is what more harmonics and layers ({coarse} to {fine}) changed, at most, in the same measure: at
460 nm the first are hardly more than there are orders. Cut 3 at 60° with 241 harmonics and 24
layers moved the default's deviation by 0.5 % and Kirchhoff's by 0.8 %.

{table(header, rows)}

The same for s- and p-polarised light at 60°, mean over the planes of incidence:

{table(["surface", "nm", "s: Kirchhoff", "s: blend", "p: Kirchhoff", "p: blend"], polarised)}"""


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
        if first.case not in second or not _is_here(first.case):
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


def _is_here(case: PatchCase) -> bool:
    return case.surface.kind != "elaphe" or MEASURED.is_file()


def _compare(solution: Solved) -> PatchComparison:
    case, field = solution.case, cell(solution.case.surface)
    wi, wo = solution.wi, solution.wo(field)
    index = patch_index(case.material, case.wavelength)
    coloured = (solution.rows["mx"] != 0) | (solution.rows["my"] != 0)
    keep = coloured & (wo[:, 2] >= np.cos(np.radians(GRAZING)))
    truth = solution.efficiency(field)[keep]
    # a window through which the lobes of the cell are separate
    sigma = max(field.extent)
    found = {
        model: efficiencies(field, index, wi, wo, case.wavelength, model, sigma=sigma)[keep]
        for model in _MODELS
    }
    by_model = {model: _deviation(power, truth) for model, power in found.items()}
    exact = _by_polarisation(solution.rows["jones"]) * (wo[:, 2] / wi[2])[:, None]
    polarised = {}
    for model, jones in _matrices(solution, wo).items():
        # efficiencies for unpolarised light, shared out
        share = _by_polarisation(jones)[keep] / boundary.unpolarised(jones)[keep, None]
        power = found[model][:, None] * share
        s, p = (_deviation(power[:, n], exact[keep, n]) for n in range(2))
        polarised[model] = (s, p)
    return PatchComparison(
        case, by_model, polarised, float(solution.rows["change"][keep].sum() / truth.sum())
    )


def _matrices(solution: Solved, wo: NDArray[np.float64]) -> dict[str, NDArray[np.complex128]]:
    """Jones matrices of Kirchhoff and of the blend."""
    case, field = solution.case, cell(solution.case.surface)
    index, k = patch_index(case.material, case.wavelength), float(wavenumber(case.wavelength))
    total = solution.wi + wo
    roughness = blend.ScaleRoughness.of(field.heights, field.pixel_size)
    s = blend.weight(k * total[:, 2], roughness.at(k * np.hypot(total[:, 0], total[:, 1])), index)
    return {
        "kirchhoff": boundary.kirchhoff(solution.wi, wo, index),
        "small_slope": blend.jones(solution.wi, wo, index, s),
    }


def _by_polarisation(jones: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Power of incident s and p light after Jones matrices, (n, 2)."""
    return np.sum(np.abs(jones) ** 2, axis=1)


def _deviation(power: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    return float(np.abs(power - truth).sum() / truth.sum())


def _by_angle(same: Sequence[PatchComparison]) -> list[str]:
    cells = []
    for theta in _ANGLES:
        chosen = [c.by_model for c in same if c.case.theta == theta]
        means = [_mean([c[model] for c in chosen]) for model in _MODELS]
        cells.append(" / ".join(percent(mean) for mean in means))
    return cells


def _polarised(same: Sequence[PatchComparison]) -> list[str]:
    oblique = [c.polarised for c in same if c.case.theta == 60.0]
    return [
        percent(_mean([c[model][n] for c in oblique]))
        for n in range(2)
        for model in ("kirchhoff", "small_slope")
    ]


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else np.nan


def _most(same: Sequence[PatchComparison]) -> str:
    return percent(max(c.change for c in same))
