"""docs/validation/solutions.md: how the comparison is made, and how exact the solutions are."""

from __future__ import annotations

import numpy as np

from .. import crossed, rayleigh
from ..agreement import on_cells, on_gratings
from ..cases import MATERIALS, PERIODS
from ..solutions import CONVERGED, shipped
from .markdown import joined, percent, table
from .measurements import Measurements


def write(_: Measurements) -> str:
    """Write the page."""
    parts = [_method(), _gratings(), _two_solvers(), _cells()]
    return "\n\n".join(parts)


def _method() -> str:
    return r"""# The rigorous solutions

## Efficiency of an order

The power of order m is the integral of $f \cos\theta_o$ over its lobe. Through a window much wider
than the period it is

$$
\eta_m = \frac{4 \cos\theta_i \cos\theta_m N}{w^2} \, |a_m(k w)|^2, \qquad
w = \cos\theta_i + \cos\theta_m ,
$$

with N of [theory.md](../theory.md). Comparisons have $\eta_m$ from `md.reference.brdf` at the
centre of the lobe, before energy is conserved.

`python -m docs.make.validation.solve` (extra `validation`) computes the solutions in
docs/make/validation/data."""


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
    return f"""## Gratings

Sinusoidal, lamellar (half high) and blazed gratings; periods {joined(PERIODS)} µm, depths 0.05 to
0.4 µm, light from 0° to 75° in both polarisations, on blazed gratings from both sides. Solver:
{shipped("perfect").about["solver"]}.

*Change* is the last change of an efficiency when the mesh is refined. *Energy missed* is the
deviation of orders and absorption from 1. Solutions whose change is above {CONVERGED:g} are left
out.

{table(header, rows)}

![Every order: blend against rigorous efficiency](../images/validation_materials.png)"""


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
    return f"""## Two solvers on gratings

The second solver is {shipped("keratin", "coupled_wave").about["solver"]}. On slopes of metal they
do not converge for TM light, which is left out. Differences of efficiencies, and the second
solver's change when its orders and layers doubled:

{table(["case", "orders", "strongest", "difference: median", "largest", "own change"], pairs)}"""


def _cells() -> str:
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
    other = shipped("keratin", "patches_coupled_wave").about["solver"]
    return f"""## Two solvers in two dimensions

Rayleigh's expansion, whose solutions the comparisons use, beside {other}. *Difference* is the
deviation of colours, *change* that of each solution from {coarse} to {fine} and from {first} to
{second} harmonics: the largest of all directions.

{table(header, rows)}

On aluminium coupled waves do not converge. There Rayleigh's expansion agrees with the integral
method within 3e-5 of an efficiency on sinusoids of depth/period up to 0.09. On keratin R + T is 1
within 1e-6 (crossed grating) and 1e-3 (low pits of a CD)."""
