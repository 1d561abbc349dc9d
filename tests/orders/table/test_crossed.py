"""Tables of crossed gratings: look-up between nodes, files, damage."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, OrderTable
from mitsuba_diffraction.orders.listed import Lights, listed_response
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


def lights_of(value):
    """One light with order (0, 0) and (1, 0)."""
    values = np.full((1, 1, 1, 1, 1, 2, 1), value)
    one = np.array([500.0]), np.zeros(1), np.zeros(1)
    return Lights(*one, np.array([[0, 0], [1, 0]]), values, crossed=True)


@pytest.mark.parametrize(
    ("periods", "value", "options", "message"),
    [
        ((0.4, 2000.0), 0.1, {}, "period=2000"),
        ((0.4, float("nan")), 0.1, {}, "must be"),
        ((0.4, 0.4), 0.6, {}, "sum to 1.2"),
        ((0.4, 0.4), -0.1, {}, "at least 0"),
        ((0.4, 0.4), 0.1, {"superstrate": 1.5}, "in air"),
    ],
)
def test_what_is_no_table_is_refused(periods, value, options, message):
    response = listed_response(lights_of(value), periods, 1.0)
    with pytest.raises(DiffractionError, match=message):
        OrderTable(periods, (500.0, 500.0), response, **options)
