"""Tables of crossed gratings: look-up between nodes, files, damage."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, OrderTable
from mitsuba_diffraction.orders.listed import Lights, listed_table
from tests.support import crossed


@pytest.fixture(scope="module")
def table():
    return crossed.table()


def lights(count=4000, oblique=0.65, seed=0):
    """Random directions, wavelengths and orders."""
    rng = np.random.default_rng(seed)
    x, y = oblique * (2.0 * rng.random((2, count)) - 1.0)
    return x, y, rng.uniform(*crossed.RANGE, count), *rng.integers(-2, 3, (2, count))


def test_it_has_the_closed_form_s_light_between_its_nodes(table):
    light = lights()
    truth, found = np.nan_to_num(crossed.efficiency(*light)), table.efficiency(*light)
    # directions of 0.08 apart, linear between them: 1.6 %
    assert np.abs(found - truth).sum() < 0.02 * truth.sum()
    assert (found[truth == 0.0] == 0.0).all()


def test_a_clear_material_s_orders_begin_as_shallow_heights_have_them():
    light, table = lights(oblique=0.7), crossed.clear_table()
    truth = np.nan_to_num(crossed.clear_efficiency(*light))
    # half floats
    assert table.efficiency(*light) == pytest.approx(truth, rel=2e-3, abs=1e-7)
    x, y, lam, *_ = lights(seed=1, oblique=0.99)
    m, n = np.mgrid[-4:5, -5:6].reshape(2, -1, 1)
    inside = x * x + y * y < 1.0
    assert table.efficiency(x[inside], y[inside], lam[inside], m, n).sum(axis=0).max() <= 1.0


def test_it_makes_no_light(table):
    x, y, lam, *_ = lights(seed=1, oblique=0.99)
    m, n = np.mgrid[-4:5, -5:6].reshape(2, -1, 1)
    inside = x * x + y * y < 1.0
    total = table.efficiency(x[inside], y[inside], lam[inside], m, n).sum(axis=0)
    # orders at their Rayleigh anomalies may add what the mirror absorbs
    assert total.max() <= 1.0
    assert total.mean() == pytest.approx(crossed.REFLECTANCE, abs=0.06)


def test_light_beyond_its_wavelengths_is_not_reflected(table):
    near, far = crossed.RANGE[0] * 2.0**-0.09, crossed.RANGE[0] * 2.0**-0.11
    assert table.efficiency(0.0, 0.0, near, 0, 0) == table.efficiency(0.0, 0.0, 450.0, 0, 0)
    assert table.efficiency(0.0, 0.0, far, 0, 0) == 0.0


@pytest.mark.parametrize("place", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("cut", [False, True])
def test_a_damaged_file_is_refused(table, tmp_path, place, cut):
    file = tmp_path / "crossed.nc"
    table.save(file)
    content = bytearray(file.read_bytes())
    content[int(place * len(content))] ^= 0x40
    file.write_bytes(content[: int(place * len(content))] if cut else content)
    with pytest.raises(DiffractionError, match=r"crossed\.nc"):
        OrderTable.load(file)


def lights_of(value):
    """One light with order (0, 0) and (1, 0)."""
    values = np.full((1, 1, 1, 1, 1, 2, 1), value)
    one = np.array([500.0]), np.zeros(1), np.zeros(1)
    return Lights(*one, np.array([[0, 0], [1, 0]]), values)


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
    with pytest.raises(DiffractionError, match=message):
        listed_table(lights_of(value), periods, {}, **options)
