"""Decision whether the reference multiplies orders by the second order of small slope."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..heights.field import HeightField
from ..optics.blend import ScaleRoughness
from ..optics.colour import LONGEST, SHORTEST
from ..optics.fresnel import Filmed
from ..optics.geometry import wavenumber
from ..optics.second_order_change import AUTO_FROM, colour_change
from ..optics.slope_ratios import CellGrid, CellSums
from ..settings import checked


def resolved(
    second_order: str | bool,
    field: HeightField,
    model: str,
    coherence: str,
    index: NDArray[np.complex128] | Filmed | None,
    coat: float | None,
) -> bool:
    """Whether "auto", True or False applies the second order to this surface.

    Raises a DiffractionError if True is asked where the second order is not known.
    """
    asked = checked("second_order", second_order)
    if asked is False:
        return False
    known = model == "small_slope" and coherence == "ensemble"
    dielectric = isinstance(index, np.ndarray) and not np.any(index.imag > 0.0)
    if asked is True:
        if not known:
            raise DiffractionError(
                "second_order=True is for model='small_slope' and coherence='ensemble'; got "
                f"model='{model}', coherence='{coherence}'"
            )
        if not dielectric:
            raise DiffractionError("second_order=True is for dielectrics: leave k and film out")
        return True
    if not (known and isinstance(index, np.ndarray) and dielectric):
        return False
    denser = bool(np.all(index.real >= (coat or 1.0)))
    return denser and measured_change(field) >= AUTO_FROM


@lru_cache(maxsize=16)
def measured_change(field: HeightField) -> float:
    """Relative change of colours by the second order, as a table of these heights has it."""
    q_limit = 2.0 * float(wavenumber(SHORTEST))
    grid = CellGrid.for_patches(field.extent, field.rms_height, q_limit)
    sums = CellSums.of_patches([(field, np.ones((1, 1)))], grid)
    roughness = ScaleRoughness.from_heights(field.heights, field.pixel_size)
    return colour_change(sums, sums.ratios(), roughness, (SHORTEST, LONGEST))
