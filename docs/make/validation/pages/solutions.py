"""Parts of docs/validation/solutions.md: how exact the rigorous solutions are."""

from __future__ import annotations

import numpy as np

from .. import crossed, rayleigh
from ..agreement import on_cells, on_gratings
from ..cases import MATERIALS, PERIODS
from ..solutions import CONVERGED, shipped
from .markdown import joined, percent, table
from .measurements import Measurements


def parts(_: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    solvers = shipped("perfect"), shipped("keratin", "coupled_wave")
    first, second = (solved.about["solver"] for solved in solvers)
    return {
        "periods": joined(PERIODS),
        "solver": first,
        "converged": f"{CONVERGED:g}",
        "gratings": _gratings(),
        "second-solver": second,
        "two-solvers-on-gratings": _two_solvers(),
        **_cells(),
    }


def _gratings() -> str:
    rows = []
    for material in MATERIALS:
        every = shipped(material)
        change = np.fmax(*every.column("change").T)
        balance = np.fmax(*np.abs(every.column("balance")).T)
        kept = sum(len(solved.order) for solved in every.trusted().solved) / len(change)
        rows.append(
            [
                f"{material} ({every.about['index']})",
                len({solved.case.surface for solved in every.solved}),
                len(change),
                *(f"{value:.0e}" for value in (*np.quantile(change, (0.5, 0.99)), change.max())),
                f"{balance.max():.0e}",
                percent(1 - kept),
            ]
        )
    header = [
        "material (index)", "gratings", "orders", "change: median", "99 %", "largest",
        "energy missed", "left out",
    ]  # fmt: skip
    return table(header, rows)


def _two_solvers() -> str:
    pairs = [
        [
            part.label,
            part.orders,
            f"{part.strongest:.2g}",
            *(f"{value:.0e}" for value in (part.median, part.largest, part.own_change)),
        ]
        for part in on_gratings()
    ]
    header = ["case", "orders", "strongest", "difference: median", "largest", "own change"]
    return table(header, pairs)


def _cells() -> dict[str, str]:
    compared = on_cells()
    rows = []
    for surface, wavelength in dict.fromkeys(
        (a.case.surface, a.case.light.wavelength) for a in compared
    ):
        same = [a for a in compared if a.case.has(surface=surface, wavelength=wavelength)]
        worst = (
            max(getattr(a, name) for a in same)
            for name in ("deviation", "first_change", "second_change")
        )
        rows.append([surface, f"{wavelength:g}", len(same), *map(percent, worst)])
    crossing = next(a.case for a in compared if a.case.has(kind="crossed"))
    coarse, fine = rayleigh.resolutions(crossing)
    (first, _), (second, _) = crossed.resolutions(crossing)
    header = ["keratin", "nm", "directions", "difference", "change", "change, coupled waves"]
    return {
        "coupled-waves": shipped("keratin", "patches_coupled_wave").about["solver"],
        "harmonics": f"{coarse} to {fine} and from {first} to {second}",
        "two-solvers-in-two-dimensions": table(header, rows),
    }
