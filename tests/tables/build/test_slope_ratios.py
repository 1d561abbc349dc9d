"""r of patches on a grid, against transforms of the heights."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField, gratings
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.slope_ratios import SlopeRatios, Slopes, along
from mitsuba_diffraction.settings import TableSettings
from mitsuba_diffraction.tables.build.describe import roughness_of, slope_ratios
from mitsuba_diffraction.tables.build.windows import windows_of
from mitsuba_diffraction.tables.document import document_of, parse_document, plain
from tests.support.directions import rough_patch

#: Of few orders, and of many; not square.
FEW = rough_patch((24, 30), (0.1, 0.11), 0.2)
MANY = gratings.elaphe_like(extent=20.0, pixels=100, seed=3)
SETTINGS = TableSettings(height_scale_max=1.0)
#: Only the change of colours depends on it.
ROUGHNESS = roughness_of([FEW], 40.0)
#: Half floats.
ROUNDED = 2e-3


def ratios(*patches: HeightField, **changed: object) -> SlopeRatios:
    return of_table(patches, TableSettings(**{"height_scale_max": 1.0, **changed}))


def of_table(patches, settings: TableSettings) -> SlopeRatios:
    return slope_ratios(patches, settings, ROUGHNESS)


def exact(field: HeightField, order: tuple[int, int], kappa: float) -> np.ndarray:
    """r_l, r_t of an order (x, y), by plane transforms."""
    slopes = Slopes.from_heights(field.heights, field.pixel_size)
    screen = np.exp(-1j * kappa * field.heights)
    a, *products = (np.fft.fft2(f * screen)[order[::-1]] for f in (1.0, *slopes.products))
    q = 2 * np.pi * np.array(order) / field.extent
    return slopes.gate * along(q, np.array(products)) / a


@pytest.mark.parametrize("order", [(1, 0), (-2, 3), (0, -4)])
def test_of_few_orders_each_has_its_own(order):
    found = ratios(FEW)
    assert found.orders == (True, True)
    nodes = np.linspace(*found.kappa, len(found.values))
    q = 2 * np.pi * np.array(order) / FEW.extent
    for kappa in nodes[[0, 3, -1]]:
        expected = exact(FEW, order, kappa)
        near = found.at(q * 1.001, kappa)  # as of any place in its lobe
        assert near == pytest.approx(expected, abs=ROUNDED * np.abs(expected).max())


def test_cells_of_many_orders_are_their_mean_by_power():
    found = ratios(MANY)
    assert found.orders == (False, False)
    kappa, place = found.kappa[1], np.array([2, 1])
    q = place * found.cell
    step = 2 * np.pi / np.array(MANY.extent)
    slopes = Slopes.from_heights(MANY.heights, MANY.pixel_size)
    screen = np.exp(-1j * kappa * MANY.heights)
    spectra = [np.fft.fft2(f * screen) for f in (1.0, *slopes.products)]
    total, power = np.zeros(2, complex), 0.0
    for x in range(30):
        for y in range(30):
            tent = np.prod(
                np.maximum(0.0, 1.0 - np.abs(np.array([x, y]) * step / found.cell - place))
            )
            if tent > 0.0:
                a, *products = (s[y, x] for s in spectra)
                total += tent * a.conj() * along(np.array([x, y]) * step, np.array(products))
                power += tent * abs(a) ** 2
    expected = slopes.gate * total / power
    assert found.at(q, kappa) == pytest.approx(expected, abs=ROUNDED * np.abs(expected).max())


def test_heights_that_are_moved_up_change_nothing():
    raised = HeightField(MANY.heights + 0.37, MANY.pixel_size)
    assert ratios(raised).values == pytest.approx(ratios(MANY).values, abs=2e-3)


def test_of_pits_it_is_that_of_hills_seen_from_the_other_side():
    pits = ratios(HeightField(-MANY.heights, MANY.pixel_size)).values
    expected = ratios(MANY).values.conj()[..., ::-1, ::-1]
    middle = (..., slice(10, 21), slice(10, 21))  # beyond, orders are rounding over rounding
    assert pits[middle] == pytest.approx(expected[middle], abs=5e-3)


def test_several_patches_and_windows_have_the_mean():
    twice = ratios(MANY, MANY)
    assert twice.values == pytest.approx(ratios(MANY).values, abs=2e-3)
    wide = HeightField(np.tile(MANY.heights, (4, 4)), MANY.pixel_size)
    cut = windows_of([wide], TableSettings(16.0, windows="auto"))
    assert len(cut) > 1
    found, whole = of_table(cut, SETTINGS), ratios(MANY)
    q = np.random.default_rng(1).uniform(-6.0, 6.0, (200, 2))
    expected = whole.at(q, 20.0)
    # seams fade; neighbouring orders are seen through the window's lobe
    assert np.abs(found.at(q, 20.0) - expected).mean() < 0.2 * np.abs(expected).mean()


def test_a_limited_table_has_it_as_far_as_it_has_orders():
    whole, cut = ratios(MANY), ratios(MANY, frequency_limit=(16.0, 9.0))
    assert cut.values.nbytes < 0.4 * whole.values.nbytes
    assert cut.kappa == whole.kappa
    for q in ([4.0, 1.0], [-5.0, 2.0], [0.0, -4.0]):  # and the cells about
        place = np.round(np.array(q) / whole.cell) * whole.cell
        expected = whole.at(place, whole.kappa[0])
        assert cut.at(place, cut.kappa[0]) == pytest.approx(expected, abs=ROUNDED)
    assert not cut.at([[25.0, 0.0], [0.0, -20.0]], 10.0).any()  # the first order alone


def test_ensembles_have_it_unless_told_otherwise():
    for given, expected in (
        ({}, "auto"),
        ({"coherence": "patch"}, False),
        ({"basis": "taylor"}, False),
    ):
        assert TableSettings(**given).second_order == expected
        for asked in (False, True):
            assert TableSettings(**given, second_order=asked).second_order is asked
    assert TableSettings(second_order="true").second_order is True


def test_a_table_keeps_it_in_its_file_unless_told_not_to(tmp_path):
    asked = {"coherence_width": 6.0, "tolerance": 0.01}
    table = DiffractionTable.build(FEW, **asked)
    plain = DiffractionTable.build(FEW, second_order=False, **asked)
    assert plain.slope_ratios is None
    assert np.array_equal(plain.coefficients, table.coefficients)
    table.save(tmp_path / "with.exr")
    plain.save(tmp_path / "without.exr")
    loaded = DiffractionTable.load(tmp_path / "with.exr")
    assert loaded.digest() == table.digest() != plain.digest()
    assert np.array_equal(loaded.slope_ratios.values, table.slope_ratios.values)
    again = DiffractionTable.load(tmp_path / "without.exr")
    assert again.slope_ratios is None
    assert again.settings == plain.settings
    assert again.digest() == plain.digest()
    text = (tmp_path / "without.exr").read_bytes()
    assert b"second_order" not in text
    assert b"slope_ratios" not in text


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("change", -0.1),
        ("cell", [0.0, 1.0]),
        ("orders", [1, 0]),
        ("kappa", [9.0, 3.0]),
        ("shape", [3, 2, 5]),
        ("values", "AAAA"),
        ("values", "no base 64!"),
        ("more", 1),
    ],
)
def test_of_a_damaged_file_it_is_refused(name, value):
    table = DiffractionTable.build(FEW, second_order=True, coherence_width=6.0, tolerance=0.01)
    document = document_of(table)
    assert table.summary()["second_order"]["applied"] is True
    parse_document(json.loads(json.dumps(document, default=plain)))
    document["slope_ratios"][name] = value
    with pytest.raises(ValueError, match=r".+"):
        parse_document(json.loads(json.dumps(document, default=plain)))


def test_other_words_than_true_and_false_are_refused():
    with pytest.raises(DiffractionError, match="must be auto, true or false"):
        TableSettings(second_order="yes")


def test_few_transforms_do_for_low_heights_whose_ratios_go_with_one_over_kappa(monkeypatch):
    low = HeightField(0.3 * MANY.heights, MANY.pixel_size)
    found = ratios(low)
    monkeypatch.setattr("mitsuba_diffraction.optics.slope_ratios.BETWEEN", 0.01)
    every = ratios(low)  # each node summed
    assert found.values.shape == every.values.shape
    inside = (..., slice(10, 21), slice(10, 21))
    off = np.abs(found.values - every.values)[inside].mean(axis=(1, 2, 3))
    # a tenth of what adds a few per cent; a straight line through r would be off threefold
    assert (off < 0.1 * np.abs(every.values)[inside].mean(axis=(1, 2, 3))).all()
