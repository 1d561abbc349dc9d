"""Tables of crossed gratings: look-up between nodes, files, damage."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, OrderTable
from tests.orders.kinds import light
from tests.support import crossed


@pytest.mark.parametrize(
    ("make", "closed_form", "error"),
    [
        # directions of 0.08 apart, linear between them: 1.6 %
        (crossed.table, crossed.efficiency, 0.02),
        # a clear material's orders begin as shallow heights have them: half floats
        (crossed.clear_table, crossed.clear_efficiency, 2e-3),
    ],
)
def test_it_has_the_closed_form_s_light_between_its_nodes(make, closed_form, error):
    order = np.random.default_rng(0).integers(-2, 3, (2, 4000))
    at = *light(4000, 0.9, crossed.RANGE), *order
    truth, found = np.nan_to_num(closed_form(*at)), make().efficiency(*at)
    assert np.abs(found - truth).sum() < error * truth.sum()
    assert (found[truth == 0.0] == 0.0).all()


@pytest.mark.parametrize("place", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("cut", [False, True])
def test_a_damaged_file_is_refused(tmp_path, place, cut):
    file = tmp_path / "crossed.nc"
    crossed.table().save(file)
    content = bytearray(file.read_bytes())
    content[int(place * len(content))] ^= 0x40
    file.write_bytes(content[: int(place * len(content))] if cut else content)
    with pytest.raises(DiffractionError, match=r"crossed\.nc"):
        OrderTable.load(file)
