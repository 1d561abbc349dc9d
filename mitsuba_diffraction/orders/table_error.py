"""Error of a table, by efficiencies that are solved at random lights or given in a list."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real


class TableError(NamedTuple):
    """Error of the efficiencies of a table.

    mean : of the light in coloured orders, which the table has too much or too little in an order,
        unpolarised.
    most : the same of a direction, which 95 % of them keep; directions with hardly any light are
        judged by a twentieth of the mean.
    relative : of an order and a polarisation, relative to its efficiency, which 95 % of them keep.
    largest, place : largest of these, and its light.
    polarised : mean of ½‖ΔM‖ of the Mueller matrices, as a share of the light that `mean` is of
        (½‖M‖ is the efficiency); None without them.
    """

    mean: float
    most: float
    relative: float
    largest: float
    place: str
    polarised: float | None = None

    def facts(self) -> dict[str, Any]:
        """Return the entries of a header."""
        facts = {
            "error_mean": self.mean, "error_worst": self.most, "error_relative": self.relative,
            "error_largest": self.largest, "error_place": self.place,
        }  # fmt: skip
        return facts if self.polarised is None else facts | {"error_polarised": self.polarised}


def table_error(
    found: Real, truth: Real, coloured: NDArray[np.bool_], least: float,
    place: Callable[[int, int, int], str],
) -> TableError:  # fmt: skip
    """Compare efficiencies (lights, orders, polarisations) of a table with known ones.

    Parameters
    ----------
    found, truth : of the table, and known; 0 of orders that a light lacks.
    coloured : (lights, orders) orders of which the light counts.
    least : efficiency from which on the relative error counts.
    place : names a light, an order and a polarisation by their places.
    """
    missed = (np.abs(found.mean(axis=-1) - truth.mean(axis=-1)) * coloured).sum(axis=-1)
    light = (truth.mean(axis=-1) * coloured).sum(axis=-1)
    floor = max(0.05 * float(light.mean()), 1e-12)
    relative = np.where(truth > least, np.abs(found - truth) / np.maximum(truth, least), 0.0)
    each = relative[truth > least]
    worst = np.unravel_index(int(relative.argmax()), relative.shape)
    return TableError(
        float(missed.sum()) / max(float(light.sum()), 1e-12),
        float(np.quantile(missed / np.maximum(light, floor), 0.95)),
        float(np.quantile(each, 0.95)) if len(each) else 0.0,
        float(relative.max()),
        place(*map(int, worst)) if len(each) else "",
    )
