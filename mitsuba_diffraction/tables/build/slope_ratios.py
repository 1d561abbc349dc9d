"""Slope ratios of a table's patches, and by how much they change its colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...heights.field import HeightField
from ...optics.blend import RoughnessTable
from ...optics.second_order_change import colour_change
from ...optics.slope_ratios import CellGrid, CellSums, SlopeRatios
from ...settings import TableSettings
from ..table import q_limit_of
from .describe import sections


def slope_ratios(
    patches: Sequence[HeightField], settings: TableSettings, roughness: RoughnessTable
) -> SlopeRatios:
    """Return the ratios as far as the table has orders.

    roughness : of the patches, as in the table.
    """
    q_limit = q_limit_of(settings.wavelength_range)
    x, y = settings.frequency_limit or (q_limit, q_limit)
    grid = CellGrid.for_patches(
        next(sections(patches))[0].extent,
        max(patch.rms_height for patch in patches),
        q_limit,
        (min(x, q_limit), min(y, q_limit)),
        q_limit * settings.height_scale_max,
    )
    sums = CellSums.of_patches(sections(patches), grid)
    ratios = sums.ratios()
    change = colour_change(sums, ratios, roughness, settings.wavelength_range)
    return replace(ratios, change=change)
