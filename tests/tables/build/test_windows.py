"""Scans seen through windows, and tables that end at a frequency: exact within, dark beyond."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField
from mitsuba_diffraction.heights.coherence import LOOKUP, resolved
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.settings import TableSettings
from mitsuba_diffraction.tables.build import powers as powers_module
from mitsuba_diffraction.tables.build import screens as module
from mitsuba_diffraction.tables.build.screens import Screens
from tests.support.directions import rough_patch
from tests.support.scans import PIXEL, SETTINGS, rough

#: Width of a window, µm.
WIDTH = 12.0


@pytest.fixture(scope="module")
def scan():
    return HeightField(rough(360), PIXEL, name="scan", cut_out=True)


@pytest.fixture(scope="module")
def table(scan):
    return DiffractionTable.build(scan, **SETTINGS)


def sinusoid(periods, turn, side=10.0, pixels=128):
    """A scan of a sinusoid 0.03 µm high, whose crests are turned by degrees."""
    x, y = np.meshgrid(*(np.arange(pixels) * side / pixels,) * 2)
    along = np.cos(np.radians(turn)) * x + np.sin(np.radians(turn)) * y
    heights = 0.015 * np.sin(2 * np.pi * along * periods / side + 1.0)
    return HeightField(heights, side / pixels, name="sinusoid", cut_out=True)


@pytest.mark.parametrize("periods", [8.0, 10.5, 13.77])
@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_a_grating_s_order_is_where_its_equation_says_however_many_periods_the_scan_has(
    periods, turn
):
    table = DiffractionTable.build(sinusoid(periods, turn), wavelength_range=(380, 800))
    frequency = 2 * np.pi * periods / 10.0
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    along = np.linspace(0.8, 1.2, 401)
    power = table.window_sum(frequency * along * cos, frequency * along * sin, 12.0)
    upper = power > 0.5 * power.max()
    # look-ups of orders π/W apart have ripples of some per cent, which move the peak alone
    assert np.average(along[upper], weights=power[upper]) == pytest.approx(1.0, abs=4e-3)
    # as wide as under the light's window alone, exp(−σ²Δ²), within what is asked of scans
    width = np.ptp(along[upper]) * frequency
    expected = 2 * np.sqrt(np.log(2)) / sigma_of(table.window_width)
    assert width == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize(
    ("side", "light", "window", "count"),
    [
        (10.0, 65.0, 10.0, 1), (32.0, 65.0, 32.0, 1), (36.0, 65.0, 32.0, 1), (50.0, 65.0, 32.0, 4),
        (65.0, 65.0, 32.5, 5), (100.0, 65.0, 50.0, 5), (200.0, 65.0, 65.0, 13), (10.0, 4.0, 4.0, 8),
    ],
)  # fmt: skip
def test_the_width_of_windows_follows_the_scan_and_the_light(side, light, window, count):
    heights = rough(64)
    field = HeightField(heights, side / 64, cut_out=True)
    settings = resolved(TableSettings(light), [field])
    assert settings.width == pytest.approx(window)
    assert settings.lookup_width == pytest.approx(LOOKUP * window)
    assert len(Screens([field], settings.width)) == count


def test_windows_agree_with_the_whole_scan_within_their_standard_error(scan, table):
    whole = DiffractionTable.build(
        HeightField(scan.heights, PIXEL, periodic=True), taps=40, **SETTINGS
    )
    error = table.source["windows"]["standard_error"]
    qx, qy = np.meshgrid(np.linspace(-8, 8, 33), np.linspace(-8, 8, 33))
    near = np.hypot(qx, qy) <= 3.0 / sigma_of(table.window_width)
    kappa = 4 * np.pi / 0.55
    found, exact = (one.window_sum(qx, qy, kappa) * one.sigma**2 for one in (table, whole))
    # a normal deviate is 0.8 standard errors from 0 on average, and both are of the same heights
    assert np.abs(found - exact)[~near].sum() < 2.0 * error["colours"] * exact[~near].sum()
    # light of waves longer than a window is in the mirror's lobe, some per cent of it here
    assert np.abs(found - exact)[near].sum() < 0.12 * exact[near].sum()
    # the light of all orders together: single directions scatter, their sum hardly
    assert found.sum() == pytest.approx(exact.sum(), rel=0.03)
    assert table.coefficients.size < 0.1 * whole.coefficients.size


def test_several_windows_are_levelled_each_and_a_single_one_is_as_it_is():
    n = 480
    bent = 4e-5 * np.square(PIXEL * (np.arange(n) - n / 2))  # slopes to ±0.002
    plain, waved = (HeightField(rough() + a * bent, PIXEL) for a in (0.0, 1.0))
    straight, other = (Screens([one], WIDTH) for one in (plain, waved))
    difference = other[0].heights - straight[0].heights
    assert np.ptp(bent[: straight.shape[1]]) > 10 * np.ptp(difference[0])
    (alone,) = Screens([waved], 48.0)
    np.testing.assert_array_equal(alone.heights, waved.heights)


def test_the_table_is_the_same_with_any_number_of_threads(monkeypatch, scan, table):
    monkeypatch.setattr(module.Screens, "batches", lambda self: [self])
    monkeypatch.setattr(powers_module, "_MOST_THREADS", 1)
    again = DiffractionTable.build(scan, **SETTINGS)
    np.testing.assert_array_equal(again.coefficients, table.coefficients)


def test_several_scans_of_other_sizes_make_one_table():
    small, other = (HeightField(rough(n, seed=3), PIXEL, cut_out=True) for n in (180, 240))
    table = DiffractionTable.build(
        [small, other], windows=12, **{**SETTINGS, "coherence_width": 65}
    )
    assert table.source["windows"]["along x, y"] == [(2, 2), (3, 3)]
    tiles = [HeightField(field.heights, PIXEL) for field in (small, other)]
    with pytest.raises(DiffractionError, match="crop them to one size"):
        DiffractionTable.build(tiles, **SETTINGS)


def test_a_patch_without_edges_tiles():
    heights = rough(120)
    for flags in ({}, {"periodic": True}):
        table = DiffractionTable.build(HeightField(heights, PIXEL, **flags), **SETTINGS)
        assert "windows" not in table.source
        assert table.settings.taper_width is None
        assert table.sigma == sigma_of(6.0)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"windows": "some"}, "must be auto, or a positive number"),
        ({"windows": -1}, "must be auto"),
        ({"windows": 8, "coherence": "patch"}, "coherence='patch'"),
        ({"windows": 8, "basis": "taylor"}, "basis='taylor'"),
    ],
)
def test_windows_that_cannot_be(scan, more, words):
    with pytest.raises(DiffractionError, match=words):
        DiffractionTable.build(scan, **{**SETTINGS, **more})


def test_a_tile_that_is_too_wide_is_told_of_windows(scan):
    tile = HeightField(scan.heights, PIXEL, periodic=True)
    settings = {**SETTINGS, "coherence_width": 1.2, "tolerance": 1e-4}
    with pytest.raises(DiffractionError, match=r"windows=1\.2, or crop"):
        DiffractionTable.build(tile, **settings)
    with pytest.raises(DiffractionError, match=r"; crop .*crop=1\.2") as refused:
        DiffractionTable.build(tile, **settings, coherence="patch")
    assert "windows" not in str(refused.value)  # which coherence='patch' refuses


def test_batches_are_of_neighbours_and_hold_every_window_once(scan, monkeypatch):
    ny, nx = Screens([scan], 6.0, 7.0).shape
    monkeypatch.setattr(module, "BATCH_POINTS", 3 * ny * nx)
    whole = Screens([scan, scan], 6.0, 7.0)
    batches = whole.batches()
    assert {len(batch) for batch in batches} <= {1, 2, 3}
    # workers are sent the part of the scan that their windows lie in
    sent = [pickle.loads(pickle.dumps(batch)) for batch in batches]
    assert max(batch.scans[0].heights.size for batch in sent) <= 3.01 * ny * nx
    found = [batch[n].heights for batch in sent for n in range(len(batch))]
    np.testing.assert_array_equal(found, [one.heights for one in whole])


#: 19.2 µm wide; Nyquist's frequency is 10.5 rad/µm.
PATCH = rough_patch((64, 64), (0.3, 0.3), 0.25, correlation=0.2)
BROAD, LIMIT = 18.0, (8.0, 3.0)


@pytest.fixture(scope="module")
def whole():
    """A table of all that light can probe."""
    return DiffractionTable.build(PATCH, coherence_width=BROAD)


@pytest.fixture(scope="module", params=["ensemble", "patch"])
def limited(request):
    """A table that ends at `LIMIT`, for heights as they are."""
    return DiffractionTable.build(
        PATCH,
        coherence_width=BROAD,
        coherence=request.param,
        frequency_limit=LIMIT,
        height_scale_max=1.0,
    )


def frequencies(count, farthest):
    """Random frequencies (n,), (n,) in an ellipse, in units of the limits."""
    rng = np.random.default_rng(0)
    angle, radius = rng.uniform(0, 2 * np.pi, count), farthest * np.sqrt(rng.uniform(0, 1, count))
    return LIMIT[0] * radius * np.cos(angle), LIMIT[1] * radius * np.sin(angle)


def test_within_the_limit_the_tolerance_is_met(limited):
    assert limited.largest_error <= 1e-3
    full = DiffractionTable.build(
        PATCH, coherence_width=BROAD, coherence=limited.coherence, tolerance=1e-4
    )
    x, y = frequencies(4000, 1.0)
    assert limited.covers(x, y, 30.0).all()
    for kappa in (1.0, 8.0, 30.0):
        exact = full.window_sum(x, y, kappa)
        difference = np.abs(limited.window_sum(x, y, kappa) - exact)
        # Its own tolerance, and that of what it is compared with
        assert difference.sum() <= 1.1e-3 * exact.sum()


def test_beyond_the_limit_it_is_dark_and_never_guessed(limited):
    x, y = frequencies(2000, 2.0)
    beyond = np.hypot(x / LIMIT[0], y / LIMIT[1]) > 1.0 + 1e-5
    assert np.all(limited.window_sum(x[beyond], y[beyond], 20.0) == 0.0)
    # as in any table: what its wavelengths and heights cannot probe is not a number
    assert np.isnan(limited.window_sum(limited.q_limit * 1.01, 0.0, 20.0))
    assert np.isnan(limited.window_sum(1.0, 1.0, limited.q_limit * 1.01))


def test_it_takes_less_memory(whole, limited):
    components = limited.coefficients.shape[3]
    assert limited.nbytes < 0.5 * components * whole.nbytes


@pytest.mark.parametrize("limit", [-1.0, (1.0, 0.0), float("nan"), (1.0, 2.0, 3.0), "none"])
def test_a_limit_of_nothing_is_refused(limit):
    with pytest.raises(DiffractionError, match=r"frequency_limit=.* must be a positive number"):
        DiffractionTable.build(PATCH, coherence_width=BROAD, frequency_limit=limit)


def test_a_limit_beyond_what_light_can_probe_is_none(whole):
    table = DiffractionTable.build(PATCH, coherence_width=BROAD, frequency_limit=1e3)
    assert not table.limited
    assert table.digest() == whole.digest()
