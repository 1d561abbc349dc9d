"""Wide scans: the mean over windows is the whole scan's, within its own standard error."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, gratings
from mitsuba_diffraction.heights import field as field_module
from mitsuba_diffraction.heights.validity import edge_lines
from mitsuba_diffraction.tables.build import windows as module
from mitsuba_diffraction.tables.build.windows import Windows
from tests.support.scans import PIXEL, SETTINGS, rough


@pytest.fixture(scope="module")
def scan():
    return HeightField(rough(), PIXEL, name="scan", cut_out=True)


@pytest.fixture(scope="module")
def table(scan):
    return DiffractionTable.build(scan, windows="auto", **SETTINGS)


def test_windows_agree_with_the_whole_scan_within_their_standard_error(scan, table):
    whole = DiffractionTable.build(scan, taps=40, **SETTINGS)
    error = table.source["windows"]["standard_error"]
    qx, qy = np.meshgrid(np.linspace(-8, 8, 33), np.linspace(-8, 8, 33))
    near = np.hypot(qx, qy) <= 3.0 / table.sigma
    kappa = 4 * np.pi / 0.55
    found, exact = (one.window_sum(qx, qy, kappa) for one in (table, whole))
    # a normal deviate is 0.8 standard errors from 0 on average, and both are of the same heights
    for part, name in ((near, "glossy"), (~near, "colours")):
        assert np.abs(found - exact)[part].sum() < error[name] * exact[part].sum()
    # the light of all orders together: single directions scatter, their sum hardly
    assert found.sum() == pytest.approx(exact.sum(), rel=0.02)
    assert table.coefficients.size < 0.1 * whole.coefficients.size


def test_every_window_is_levelled_of_its_own():
    n = 480
    bent = 4e-5 * np.square(PIXEL * (np.arange(n) - n / 2))  # slopes to ±0.002
    plain, waved = (HeightField(rough() + a * bent, PIXEL) for a in (0.0, 1.0))
    straight, other = (Windows([one], 12.0) for one in (plain, waved))
    difference = other[0].heights - straight[0].heights
    assert np.ptp(bent[: straight.shape[1]]) > 10 * np.ptp(difference[0])


def test_the_mean_over_noise_scatters_as_welch_has_it():
    axis = module._Axis.of(256, 64.0)
    rng = np.random.default_rng(2)
    noise = rng.standard_normal((4000, 256)) + 1j * rng.standard_normal((4000, 256))
    parts = [axis.taper * noise[:, s : s + axis.length] for s in axis.starts]
    powers = np.array([np.abs(np.fft.fft(p, axis=1)[:, 5:25:2]) ** 2 for p in parts])
    ratio = powers.mean(axis=0).var(axis=0) / powers[0].var(axis=0)
    # 4000 draws of ten bins: 1 %
    assert ratio.mean() == pytest.approx(axis.variance_factor, rel=0.05)


def test_memory_is_of_one_window(monkeypatch):
    scan = HeightField(rough(240), PIXEL)
    alive = []
    made = Windows.__getitem__

    def counted(self, n):
        result = made(self, n)
        alive.append(result.heights.size)
        return result

    monkeypatch.setattr(Windows, "__getitem__", counted)
    found = DiffractionTable.build(scan, windows="auto", **SETTINGS)
    assert found.source["windows"]["number"] == 9
    assert max(alive) <= 0.25 * scan.heights.size


def test_a_grating_narrow_along_one_axis_has_windows_along_the_other():
    grating = gratings.sinusoidal(period=1.6, depth=0.05, periods=40, pixels_per_period=16, rows=4)
    table = DiffractionTable.build(grating, windows="auto", **SETTINGS)
    (along_x, along_y) = table.source["windows"]["along x, y"][0]
    assert along_x > 5
    assert along_y == 1
    order = 2 * np.pi / 1.6
    first = table.window_sum(order, 0.0, 12.0)
    # what is between orders is below the tolerance, 2 %
    assert first > 50 * table.window_sum(0.5 * order, 0.0, 12.0)


def test_several_scans_of_other_sizes_make_one_table():
    small, other = (HeightField(rough(n, seed=3), PIXEL) for n in (180, 240))
    table = DiffractionTable.build([small, other], windows=12, **SETTINGS)
    assert table.source["windows"]["along x, y"] == [(2, 2), (3, 3)]
    with pytest.raises(DiffractionError, match="crop them to one size"):
        DiffractionTable.build([small, other], **SETTINGS)


def test_a_narrow_patch_is_no_scan_to_be_cut():
    patch = HeightField(rough(120), PIXEL)
    table = DiffractionTable.build(patch, windows="auto", **SETTINGS)
    assert "windows" not in table.source


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"windows": "some"}, "must be auto, none, or a positive number"),
        ({"windows": -1}, "must be auto"),
        ({"windows": "auto", "coherence": "patch"}, "coherence='patch'"),
    ],
)
def test_windows_that_cannot_be(scan, more, words):
    with pytest.raises(DiffractionError, match=words):
        DiffractionTable.build(scan, **{**SETTINGS, **more})


def test_a_scan_that_is_too_wide_is_told_of_windows(scan):
    with pytest.raises(DiffractionError, match="windows=auto"):
        DiffractionTable.build(scan, **{**SETTINGS, "coherence_width": 1.2, "tolerance": 1e-4})


def test_a_saved_table_keeps_its_windows(table, tmp_path):
    table.save(tmp_path / "table.exr")
    again = DiffractionTable.load(tmp_path / "table.exr")
    assert again.settings.windows == "auto"
    assert again.source["windows"]["standard_error"] == table.source["windows"]["standard_error"]
    assert again.digest() == table.digest()


def test_large_fields_have_the_same_statistics_in_parts(monkeypatch, tmp_path):
    heights = rough(300).astype(np.float32)
    np.save(tmp_path / "scan.npy", heights)
    whole = HeightField.load(tmp_path / "scan.npy", pixel_size=PIXEL)
    monkeypatch.setattr(field_module, "LARGE", 1)
    parts = HeightField.load(tmp_path / "scan.npy", pixel_size=PIXEL)
    np.testing.assert_array_equal(parts.heights, heights)
    assert parts.rms_slope == pytest.approx(whole.rms_slope, rel=1e-12)
    assert parts.rms_height == pytest.approx(whole.rms_height, rel=1e-12)
    level = parts.treated(level="plane")
    assert "RMS change" in level.history[-1]
    lines = edge_lines(parts, 0.4)
    monkeypatch.undo()
    assert level.history == whole.treated(level="plane").history
    assert lines == edge_lines(whole, 0.4)
