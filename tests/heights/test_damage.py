"""Damage of scans is named with what to do; sound scans and gratings have none."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.validity import damage
from tests.support.directions import rough_patch

NORMAL = gaussian_filter(np.random.default_rng(1).normal(0.0, 0.03, (128, 128)), 3, mode="wrap")
ROUGH = rough_patch((128, 128), (0.05, 0.05), 0.02).heights


def scan(heights):
    return HeightField(heights, 0.05, name="scan", cut_out=True)


@pytest.mark.parametrize("level", ["none", "plane"])
@pytest.mark.parametrize(
    ("rows", "named"), [(slice(90, None), "last 38"), (slice(0, 30), "first 30")]
)
def test_an_aborted_scan_is_named_with_what_is_left(rows, named, level):
    aborted = ROUGH.copy()
    aborted[rows] = 0.0
    (line,) = damage(scan(aborted).treated(level=level))
    assert named in line
    crop = re.search(r"use crop=([\d.,]+):", line)[1]
    assert damage(scan(aborted).treated(level=level, crop=crop)) == []


def test_rows_that_filled_a_rim_are_not_a_stuck_scanner(tmp_path):
    rim = ROUGH.copy()
    rim[:6] = rim[-6:] = np.nan
    np.save(tmp_path / "rim.npy", rim)
    field = HeightField.load(tmp_path / "rim.npy", pixel_size=0.05, fill="nearest")
    assert not any("stuck" in line for line in damage(field))


def test_repeated_rows_are_counted():
    stuck = ROUGH.copy()
    stuck[60:66] = stuck[59]
    (line,) = damage(scan(stuck))
    assert "6 of 128 rows repeat" in line


def test_a_bow_is_named_and_removed():
    y, x = np.mgrid[-1:1:128j, -1:1:128j]
    bent = scan(ROUGH + 0.1 * x**2 + 0.05 * y * x - 0.07 * x)
    (line,) = damage(bent)
    assert "level=quadratic" in line
    even = bent.treated(level="quadratic")
    assert damage(even) == []
    # a paraboloid takes 6 of the some hundred independent heights of the rough waves
    left = even.heights - even.heights.mean() - (ROUGH - ROUGH.mean())
    assert left.std() < 0.3 * ROUGH.std()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_dust_is_named_and_clipped(sign):
    dusty = NORMAL.copy()
    for x, y in ((20, 31), (77, 80), (101, 12)):
        dusty[y : y + 4, x : x + 4] = sign * 0.15
    (line,) = damage(scan(dusty))
    assert "clip=5" in line
    assert damage(scan(dusty).treated(clip=5.0)) == []


@pytest.mark.parametrize("turned", [False, True])
def test_sound_scans_and_gratings_have_no_damage(turned):
    made = (gratings.lamellar(2.5, 0.3, periods=4, rows=64), gratings.sinusoidal(1.6, 0.1, rows=64))
    for heights in (ROUGH, NORMAL, *(one.heights for one in made), np.zeros((32, 32))):
        assert damage(scan(heights.T if turned else heights)) == []
