"""Tables of blocks and thin sheets: light on both sides, and what they refuse."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mitsuba_diffraction.orders import Band, CellResponse
from mitsuba_diffraction.orders.cells import Counts
from mitsuba_diffraction.orders.listing import list_orders
from tests.orders.kinds import BLOCK, light, sides_of
from tests.support.orders import SHARES, thin_grating

COUNTS = Counts(5, 4, 2)
SHEET = thin_grating(0.9, counts=COUNTS, thin=True)


def test_the_index_of_a_block_is_in_its_digest():
    assert BLOCK.digest() != dataclasses.replace(BLOCK, block=1.5001).digest()


def test_orders_of_both_faces_are_listed():
    above = list_orders(BLOCK, 550.0, [0.0, 30.0]).rows
    within = list_orders(BLOCK, 550.0, [0.0, 60.0], from_below=True).rows
    for rows in (above, within):
        for theta in np.unique(rows[:, 1]):  # a block loses no light
            assert rows[rows[:, 1] == theta, 4:].sum() / 2.0 == pytest.approx(1.0, abs=1e-6)
    assert (within[within[:, 1] == 60.0, 6:] > 0.0).sum() < (within[:, 4:6] > 0.0).sum()


def test_each_side_has_its_share_of_the_light():
    mirror, at = thin_grating(0.9, counts=COUNTS), light(50, 0.8)
    for sides in sides_of(SHEET):
        from_below, transmitted = sides.values()
        share = SHARES[int(from_below), int(from_below != transmitted)]
        for m in (-1, 0, 1):
            expected = share * mirror.efficiency(*at, m)
            assert SHEET.efficiency(*at, m, **sides) == pytest.approx(expected, abs=1e-6)


def test_reversed_light_is_compared_with_the_side_that_it_comes_from():
    assert SHEET.reciprocity < 1e-6  # single precision

    def one_way(values):
        changed = values.copy()
        ports = values.shape[3]
        changed[:, :, :, : ports // 2, ports // 2 :] *= 0.5
        return changed

    bands = tuple(Band(band.k, *(one_way(kind) for kind in band.kinds)) for band in SHEET.bands)
    assert dataclasses.replace(SHEET, response=CellResponse(bands)).reciprocity > 0.1
