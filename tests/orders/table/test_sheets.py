"""Tables of thin sheets: light on both sides."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.orders import Band, CellResponse, OrderTable
from mitsuba_diffraction.orders.cells import Counts
from tests.support.orders import SHARES, thin_grating

COUNTS = Counts(5, 4, 2)
SHEET = thin_grating(0.9, counts=COUNTS, thin=True)
SIDES = tuple(itertools.product((False, True), (False, True)))


def test_each_side_has_its_share_of_the_light():
    rng = np.random.default_rng(1)
    x, y, lam = rng.uniform(-0.6, 0.6, 50), rng.uniform(-0.6, 0.6, 50), rng.uniform(400, 700, 50)
    mirror = thin_grating(0.9, counts=COUNTS)
    for from_below, transmitted in SIDES:
        share = SHARES[int(from_below), int(from_below != transmitted)]
        for m in (-1, 0, 1):
            light = SHEET.efficiency(x, y, lam, m, from_below=from_below, transmitted=transmitted)
            expected = share * mirror.efficiency(x, y, lam, m)
            assert light == pytest.approx(expected, abs=1e-6)


def test_reversed_light_is_compared_with_the_side_that_it_comes_from():
    assert SHEET.reciprocity < 1e-6  # single precision

    def one_way(values):
        changed = values.copy()
        ports = values.shape[3]
        changed[:, :, :, : ports // 2, ports // 2 :] *= 0.5
        return changed

    bands = tuple(Band(band.k, *(one_way(kind) for kind in band.kinds)) for band in SHEET.bands)
    assert dataclasses.replace(SHEET, response=CellResponse(bands)).reciprocity > 0.1


def test_files_keep_sheets(tmp_path):
    path = tmp_path / "sheet.nc"
    SHEET.save(path)
    loaded = OrderTable.load(path)
    assert loaded.thin
    assert loaded.digest() == SHEET.digest()


def test_light_below_needs_a_sheet():
    with pytest.raises(DiffractionError, match="thin"):
        OrderTable.mirror(0.5).efficiency(0.0, 0.0, 500.0, 0, transmitted=True)
    with pytest.raises(DiffractionError, match="both sides"):
        dataclasses.replace(OrderTable.mirror(0.5, superstrate=1.5), thin=True)
