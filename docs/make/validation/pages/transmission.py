"""Parts of docs/validation/transmission.md: orders that go through a dielectric, and R + T."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from .. import transmitted
from ..compare import GRAZING, table_of
from ..models import of_colours
from .markdown import angle, both_models, percent, table
from .measurements import Measurements

#: Largest depth over period of a sinusoid of slope 0.1.
_GENTLE = 0.033


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    sums = list(transmitted.sums_of_surfaces(list(transmitted.SURFACES)[: measured.most(1)]))
    rows = [
        [
            one.surface,
            f"{one.medium}, {one.side}",
            *(f"{_span(one.model[at])} → {_span(one.conserved[at])}" for at in one.model),
        ]
        for one in sums
    ]
    return {
        **_orders(measured),
        "index": f"{transmitted.INDEX:g}",
        "reflected-and-transmitted-light": table(["surface", "light", *sums[0].model], rows),
        "recipes": _recipes(measured),
    }


def _orders(measured: Measurements) -> dict[str, str]:
    chosen = transmitted.GRATINGS[: measured.most(1)]
    sides = transmitted.compared(chosen)
    by_azimuth = {
        phi: {model: part.where(phi=phi) for model, part in sides.items()}
        for phi in transmitted.AZIMUTHS
    }
    rows = [
        [f"{grating.period:g}/{grating.depth:g} µm", angle(phi),
         *both_models(turned, grating, transmitted.ANGLES)]
        for grating in chosen
        for phi, turned in by_azimuth.items()
    ]  # fmt: skip
    gentle = [grating for grating in chosen if grating.depth / grating.period < _GENTLE]
    default = [
        table_of(turned["small_slope"], gentle, transmitted.ANGLES, of_colours)
        for turned in by_azimuth.values()
    ]
    normal, worst = float(np.max(default, axis=(0, 1))[0]), float(np.max(default))
    header = ["sinusoid", "azimuth", *map(angle, transmitted.ANGLES)]
    return {
        "grazing": f"{GRAZING:g}°",
        "transmitted-orders": table(header, rows),
        "gentle": f"{percent(normal)} in light along the normal, and within {percent(worst)}",
    }


def _recipes(measured: Measurements) -> str:
    rows = []
    recipes = [p for p in transmitted.PRECOMPUTE if not measured.quick or p.stem == "cd"]
    sums = transmitted.sums_of_recipes(recipes)
    for (name, medium), group in groupby(sums, key=lambda one: (one.surface, one.medium)):
        sides = list(group)
        spans = (
            [span for one in sides for span in getattr(one, kind).values()]
            for kind in ("model", "conserved")
        )
        rows.append([name, medium, *(_span([s for span in part for s in span]) for part in spans)])
    header = ["recipe", "medium", "model", "`energy_conserving`"]
    return table(header, rows)


def _span(values: Sequence[float]) -> str:
    return f"{min(values):.3f}–{max(values):.3f}"
