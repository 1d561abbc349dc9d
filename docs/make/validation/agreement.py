"""Two rigorous solvers of gratings beside each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cases import PROFILES
from .solutions import KEY, Solutions, shipped


@dataclass(frozen=True)
class Agreement:
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


def agreement() -> list[Agreement]:
    """Compare the solvers for each material, profile and polarisation that both can solve."""
    agreements = []
    for material in ("aluminium", "keratin"):
        first, second = shipped(material), shipped(material, "coupled_wave")
        partner = _partners(first, second)
        for profile in PROFILES:
            for polarisation in ("te", "tm"):
                rows = second.rows
                keep = (rows["profile"] == PROFILES.index(profile)) & ~np.isnan(rows[polarisation])
                if not keep.any():
                    continue
                values = rows[polarisation][keep].astype(float)
                difference = np.abs(values - first.rows[polarisation][partner[keep]])
                agreements.append(
                    Agreement(
                        f"{material}, {profile}, {polarisation.upper()}",
                        int(keep.sum()),
                        float(values.max()),
                        float(np.median(difference)),
                        float(difference.max()),
                        float(rows[f"{polarisation}_change"][keep].max()),
                    )
                )
    return agreements


def _partners(first: Solutions, second: Solutions) -> NDArray[np.intp]:
    """Index of the row of `first` for each row of `second`, (n,)."""
    key = [*KEY, "order"]
    index = {tuple(row): n for n, row in enumerate(first.rows[key].tolist())}
    return np.array([index[tuple(row)] for row in second.rows[key].tolist()])
