"""Tables of blocks and thin sheets: light on both sides, and what they refuse."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.coat import face_transmittance
from mitsuba_diffraction.orders import Band, CellResponse, OrderTable
from mitsuba_diffraction.orders.cells import Counts
from mitsuba_diffraction.orders.listing import list_orders
from tests.orders.kinds import BLOCK, INDEX, light, sides_of
from tests.support.orders import SHARES, thin_grating

COUNTS = Counts(5, 4, 2)
SHEET = thin_grating(0.9, counts=COUNTS, thin=True)


def orders(x, y, from_below, transmitted):
    m = np.arange(-4, 5)[:, None]
    return BLOCK.efficiency(x, y, 550.0, m, from_below=from_below, transmitted=transmitted)


def test_order_0_vanishes_at_the_critical_angle_and_other_orders_go_on():
    x, y = np.array([0.3, 0.999, 1.001, 1.4]), 0.0
    zeroth = orders(x, y, True, True)[4]
    cosine = np.sqrt(np.maximum(1.0 - x * x, 0.0))
    # 8 % of the light that a flat face transmits is in other orders
    assert zeroth == pytest.approx(0.92 * face_transmittance(cosine, INDEX), rel=2e-3)
    assert np.all(zeroth[2:] == 0.0)
    assert np.all(orders(x, y, True, True).sum(axis=0)[2:] > 0.0)
    for from_below in (False, True):
        inside = x if from_below else x[:2]
        total = sum(orders(inside, y, from_below, side).sum(axis=0) for side in (False, True))
        assert total == pytest.approx(1.0, abs=1e-9)


def test_the_index_of_a_block_is_in_its_digest():
    assert BLOCK.digest() != dataclasses.replace(BLOCK, block=1.5001).digest()


def test_orders_of_both_faces_are_listed():
    above = list_orders(BLOCK, 550.0, [0.0, 30.0]).rows
    within = list_orders(BLOCK, 550.0, [0.0, 60.0], from_below=True).rows
    for rows in (above, within):
        for theta in np.unique(rows[:, 1]):  # a block loses no light
            assert rows[rows[:, 1] == theta, 4:].sum() / 2.0 == pytest.approx(1.0, abs=1e-6)
    assert (within[within[:, 1] == 60.0, 6:] > 0.0).sum() < (within[:, 4:6] > 0.0).sum()


def test_blocks_have_unpolarised_light_alone_and_no_other_medium():
    for call in (BLOCK.polarised_efficiency, BLOCK.groove_efficiency):
        with pytest.raises(DiffractionError, match="unpolarised"):
            call(0.1, 0.0, 550.0, 0)
    for change in ({"superstrate": 1.2}, {"thin": True}, {"block": 1.001}, {"block": 7.0}):
        with pytest.raises(DiffractionError, match="block="):
            dataclasses.replace(BLOCK, **change)


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


def test_light_below_needs_a_sheet():
    with pytest.raises(DiffractionError, match="thin"):
        OrderTable.mirror(0.5).efficiency(0.0, 0.0, 500.0, 0, transmitted=True)
    with pytest.raises(DiffractionError, match="both sides"):
        dataclasses.replace(OrderTable.mirror(0.5, superstrate=1.5), thin=True)
