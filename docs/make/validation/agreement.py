"""Two rigorous solvers beside each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .cases import PROFILES, Case
from .compare import Comparison, beside, misplaced
from .solutions import LIGHTS, shipped


class Agreement(NamedTuple):
    """Absolute differences of efficiencies in one polarisation of one kind of grating.

    `strongest` is the largest efficiency among them, `own_change` how much the second solver's
    largest changed at its last refinement.
    """

    label: str
    orders: int
    strongest: float
    median: float
    largest: float
    own_change: float


def on_gratings() -> list[Agreement]:
    """Compare the solvers for each material, profile and polarisation that both can solve."""
    agreements = []
    for material in ("aluminium", "keratin"):
        both = beside(shipped(material), shipped(material, "coupled_wave"))
        for profile in PROFILES:
            part = both.where(profile=profile)
            change = np.concatenate([solved.change for solved in part.solved])
            for n, light in enumerate(LIGHTS):
                values = part.exact[:, n]
                keep = ~np.isnan(values)
                if not keep.any():
                    continue
                difference = np.abs(values - part.by_light[:, n])[keep]
                agreements.append(
                    Agreement(
                        f"{material}, {profile}, {light.upper()}",
                        int(keep.sum()),
                        float(values[keep].max()),
                        float(np.median(difference)),
                        float(difference.max()),
                        float(change[keep, n].max()),
                    )
                )
    return agreements


class CellAgreement(NamedTuple):
    """Both solvers on one case: their deviation of colours, and what either still changed."""

    case: Case
    deviation: float
    first_change: float
    second_change: float


def on_cells() -> list[CellAgreement]:
    """Rayleigh's expansion beside coupled waves, on keratin."""
    waves, rayleigh = (shipped("keratin", f"patches_{n}") for n in ("coupled_wave", "rayleigh"))
    pairs = zip(beside(waves, rayleigh).each(), beside(rayleigh, waves).each(), strict=True)
    return [
        CellAgreement(
            first.solved[0].case,
            misplaced(first.model, first.rigorous, first.coloured),
            *(_change(part) / first.rigorous[first.coloured].sum() for part in (first, second)),
        )
        for first, second in pairs
    ]


def _change(part: Comparison) -> float:
    """Sum of the last changes of all orders but 0 of a case."""
    return float(part.solved[0].change.mean(axis=1)[part.coloured].sum())
