"""Second order as a factor on the powers of orders, beside rigorous solutions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from .model import efficiencies, second_order
from .patch_solutions import Solved, solved
from .patches import GRATINGS, KINDS, cell, patch_index, ratios_of
from .second_order import GROUPS, Case, scored

#: The model without the factor, with ratios of each order, and with those that a table holds.
MODELS = ("`second_order=false`", "own orders", "`second_order=true`")


def compare_cells(kinds: Sequence[str] = KINDS, models: Sequence[str] = MODELS) -> Iterator[Case]:
    """Compare the stored solutions of keratin cells, all together and by angle of incidence.

    Parameters
    ----------
    kinds : of `patches.KINDS`.
    models : of `MODELS`; the ratios of a whole patch are slow to compute.
    """
    for solution in solved("keratin")[0]:
        surface = solution.case.surface
        if surface.kind in kinds:
            group = f"{GROUPS[surface.kind]}, slope {surface.slope:.2g}"
            case = _case(group, solution, models)
            yield case
            if surface.kind not in GRATINGS:
                yield replace(case, group=f"{group}, from {solution.case.theta:g}°")


def _case(group: str, solution: Solved, models: Sequence[str]) -> Case:
    surface, wavelength = solution.case.surface, solution.case.wavelength
    field, index = cell(surface), patch_index("keratin", wavelength).real
    orders = np.stack([solution.rows["mx"], solution.rows["my"]], axis=1).astype(np.int64)
    wi, wo = solution.wi, solution.wo(field)
    light = field, index, wi, wo, wavelength
    first = efficiencies(field, complex(index), *light[2:], "first_order", sigma=max(field.extent))
    powers = {MODELS[0]: first}
    for name, ratios in ((MODELS[1], None), (MODELS[2], ratios_of(surface))):
        if name in models:
            powers[name] = first * second_order(*light, ratios)
    return scored(group, powers, solution.efficiency(field), wo, orders)
