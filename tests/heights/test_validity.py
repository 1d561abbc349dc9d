"""Tilt and seams of patches that were cut out of a surface are said; gratings have neither."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.seams import seam_step
from mitsuba_diffraction.heights.validity import edge_lines
from tests.support.directions import rough_patch

SHORTEST = 0.36
Y, X = np.mgrid[0:128, 0:128]
# Two incommensurate waves: no edge meets the opposite one.
SCALE = 0.06 * np.cos(0.17 * X + 0.05 * Y) + 0.03 * np.cos(0.11 * Y + 0.07 * X + 1)
# A wave longer than the patch, without tilt, and one edge 0.24 µm above the opposite one.
BENT = SCALE + 0.3 * ((X / 63.5 - 1) ** 3 - 0.6 * (X / 63.5 - 1))


def cut_out(heights, pixel_size=0.05):
    return HeightField(heights, pixel_size, name="scan", cut_out=True)


def test_a_ramp_is_found_and_said_with_its_rise():
    lines = cut_out(SCALE + 0.01 * X).validity()
    (tilt,) = [line for line in lines if "not levelled" in line]
    # 0.01 µm a pixel over 128, and the chance slope of the waves
    assert float(tilt.split("rises ")[1].split()[0]) == pytest.approx(1.28, abs=0.05)
    assert "level=plane: " in tilt
    level = cut_out(SCALE + 0.01 * X).treated(level="plane")
    assert not any("not levelled" in line for line in level.validity())


@pytest.mark.parametrize("turned", [False, True])
def test_seams_are_said_until_they_are_mended(turned):
    field = cut_out(BENT.T if turned else BENT)
    (line,) = edge_lines(field, SHORTEST)
    assert line.startswith("scan: use periodic=trend: ")
    for how in ("trend", "smooth", "taper"):
        assert edge_lines(field.treated(periodic=how), SHORTEST) == []


def test_ridges_that_the_edge_cuts_are_let_be():
    ridges = 0.06 * np.sin(0.31 * X)  # 6.3 periods
    assert seam_step(cut_out(ridges)) > 0.04
    for heights in (SCALE, ridges, ridges.T):
        assert edge_lines(cut_out(heights), SHORTEST) == []


def test_the_seams_of_a_tilted_patch_are_those_that_levelling_leaves():
    _, line = edge_lines(cut_out(BENT + 0.01 * X), SHORTEST)
    assert "even after levelling" in line
    (alone,) = edge_lines(cut_out(BENT + 0.01 * X).treated(level="plane"), SHORTEST)
    assert line.replace(" even after levelling", "") == alone


def test_a_tilt_below_a_quarter_wave_is_left_alone():
    smooth = rough_patch((64, 64), (0.05, 0.05), 0.02).heights
    for share, said in ((0.9, False), (1.3, True)):
        tilt = share * SHORTEST / 8 * np.arange(64) / 63
        lines = edge_lines(cut_out(0.1 * smooth + tilt), SHORTEST)
        assert any("not levelled" in line for line in lines) is said, share


@pytest.mark.parametrize("periods", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", [gratings.blazed, gratings.sinusoidal, gratings.lamellar])
@pytest.mark.parametrize("levels", [None, 255])
def test_whole_periods_of_a_grating_are_let_be(kind, periods, levels):
    heights = kind(period=2.5, depth=0.6, periods=periods, pixels_per_period=40).heights
    if levels:  # as an 8-bit image holds it
        heights = np.rint(heights * levels / heights.max()) * heights.max() / levels
    assert edge_lines(cut_out(heights, 2.5 / 40), SHORTEST) == []
    assert edge_lines(cut_out(heights.T, 2.5 / 40), SHORTEST) == []


MADE = {
    "elaphe_like": lambda: gratings.elaphe_like(extent=12.0, pixels=240, seed=3),
    "xenopeltis_like": lambda: gratings.xenopeltis_like(extent=12.0, pixels=240, seed=3),
    "rough": lambda: rough_patch((64, 64), (0.05, 0.05), 0.1),
    "noise": lambda: HeightField(np.random.default_rng(1).normal(size=(64, 48)), 0.05),
    "flat": lambda: HeightField(np.full((8, 8), 0.3), 0.05),
}


@pytest.mark.parametrize("name", MADE)
def test_surfaces_that_fit_themselves_are_let_be(name):
    made = MADE[name]()
    assert edge_lines(made, SHORTEST) == []  # even if they were taken for a scan


def test_what_is_made_is_not_asked_and_what_is_cut_is(tmp_path):
    made = HeightField(SCALE + 0.01 * X, 0.05)
    assert not any("level=" in line or "periodic=" in line for line in made.validity())
    np.save(tmp_path / "tilt.npy", made.heights)
    loaded = HeightField.load(tmp_path / "tilt.npy", pixel_size=0.05, level="none", periodic="none")
    assert sum("level=plane" in line for line in loaded.validity()) == 1
    tiling = rough_patch((64, 64), (0.05, 0.05), 0.05)
    assert not any("periodic=" in line for line in tiling.validity())
    bent = HeightField(BENT, 0.05, periodic=True)
    assert not any("periodic=" in line for line in bent.validity())
    assert any("periodic=trend" in line for line in bent.treated(crop=6.0).validity())


def test_measured_patches(shared_afm):
    scale = HeightField.load(shared_afm / "elaphe-65um.png", pixel_size=65 / 1332, max_height=0.375)
    assert not any("not levelled" in line for line in scale.validity())
    period = HeightField.load(
        shared_afm / "blazed-one-period-100px.bmp", pixel_size=0.025, max_height=0.25
    )
    assert edge_lines(period, SHORTEST) == []
    pytest.importorskip("SurfaceTopography")
    scan = HeightField.load(shared_afm / "nanoscope-10um.di", periodic="none")
    assert any("periodic=trend" in line for line in scan.validity())
    assert edge_lines(HeightField.load(shared_afm / "nanoscope-10um.di"), SHORTEST) == []


def test_files_are_mended_by_default_and_left_alone_where_nothing_shows(tmp_path):
    def loaded(heights, **options):
        np.save(tmp_path / "a.npy", heights)
        return HeightField.load(tmp_path / "a.npy", pixel_size=0.05, **options)

    tilted = BENT + 0.01 * X
    mended = loaded(tilted)
    assert edge_lines(mended, SHORTEST) == []
    assert [line.split()[0] for line in mended.history] == ["plane", "made"]
    asked = loaded(tilted, level="plane", periodic="trend")
    np.testing.assert_array_equal(mended.heights, asked.heights)
    np.testing.assert_array_equal(loaded(tilted, level="none", periodic="none").heights, tilted)
    np.testing.assert_array_equal(loaded(tilted, periodic="exact").heights, tilted)
    for name in ("rough", "noise", "flat"):
        np.testing.assert_array_equal(loaded(MADE[name]().heights).heights, MADE[name]().heights)
    teeth = gratings.blazed(2.5, 0.3, periods=2, pixels_per_period=40).heights
    np.testing.assert_array_equal(loaded(teeth).heights, teeth)
