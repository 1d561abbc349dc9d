"""Discs have the tracks and run lengths of their standards."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.heights.gratings import cd, dvd
from mitsuba_diffraction.heights.spectra import frequencies, order_powers

# track pitch, channel bit, pit width and depth in µm (ECMA-130, ECMA-267, AFM images of discs)
STANDARD = {cd: (1.6, 0.2777, 0.5, 0.12), dvd: (0.74, 0.1333, 0.32, 0.105)}


@pytest.fixture(scope="module", params=STANDARD, ids=lambda make: make.__name__)
def make(request):
    return request.param


@pytest.fixture(scope="module")
def smooth(make):
    """Eight tracks without irregularity, finely sampled."""
    pitch = STANDARD[make][0]
    return make(extent=(60.0, 8 * pitch), pixels=(3000, 256), seed=5, irregularity=0)


def track_lines(make, field):
    """Pit or not, along the middle of every track, each rolled to begin with a pit."""
    ny = field.shape[0]
    rows = ((np.arange(8) + 0.5) * ny / 8).astype(int)
    lines = field.heights[rows] < STANDARD[make][3] / 2
    starts = [np.flatnonzero(line & ~np.roll(line, 1))[0] for line in lines]
    return [np.roll(line, -start) for line, start in zip(lines, starts, strict=True)]


def runs_of(line):
    """Lengths of pits and lands that follow one another, in pixels."""
    changes = np.flatnonzero(line != np.roll(line, 1))
    return np.diff(np.append(changes, line.size))


def test_run_lengths_are_3_to_11_channel_bits(make, smooth):
    bit = STANDARD[make][1]
    for line in track_lines(make, smooth):
        runs = runs_of(line) * smooth.pixel_size[0] / bit
        # whole bits, but that a whole number of them fits (0.3 %) and for a pixel, 0.15 bit, twice
        assert np.abs(runs - np.round(runs)).max() < 0.4
        assert runs.min() > 2.6
        assert runs.max() < 11.4


def test_short_runs_are_frequent(make, smooth):
    bit = STANDARD[make][1]
    runs = np.concatenate([runs_of(line) for line in track_lines(make, smooth)])
    bits = np.round(runs * smooth.pixel_size[0] / bit)
    # P(n) = λ⁻ⁿ of the code of largest entropy has mean 5.2 and P(3) = 0.32; 300 to 700 runs
    assert bits.mean() == pytest.approx(5.2, abs=0.5)
    assert np.mean(bits == 3) == pytest.approx(0.32, abs=0.08)


def test_pits_are_as_wide_and_deep_as_they_should_be(make, smooth):
    _, _, width, depth = STANDARD[make]
    assert smooth.range == pytest.approx(depth, abs=2e-6)  # rounding
    ny = smooth.shape[0] // 8
    line = smooth.heights[ny // 2] < depth / 2
    ends = np.flatnonzero(line != np.roll(line, 1))
    ends = ends[np.flatnonzero(line[ends])[0] :]  # from the first pit's beginning on
    middles = (ends[:-1:2] + ends[1::2][: len(ends[:-1:2])]) // 2
    measured = (smooth.heights[:ny, middles] < depth / 2).sum(axis=0) * smooth.pixel_size[1]
    # to a pixel, an eighth of a pit or finer
    assert np.abs(measured - width).max() <= 1.01 * smooth.pixel_size[1]


def test_tracks_throw_light_along_y(make):
    """Orders at multiples of 1/pitch along y stand far above everything between them."""
    pitch = STANDARD[make][0]
    field = make(extent=20 * pitch, pixels=400, seed=1)
    fx, fy = frequencies(field)
    line = order_powers(field, 550.0)[:, np.abs(fx) < 1e-9][:, 0]
    order = fy[:, 0] * pitch
    first = line[np.abs(np.abs(order) - 1) < 1e-6]
    between = line[(np.abs(order) > 0.2) & (np.abs(order) < 0.8)]
    assert first.size == 2
    assert first.min() > 20 * between.max()


def test_whole_tracks_fit(make):
    pitch = STANDARD[make][0]
    field = make(extent=(10.0, 4.3 * pitch + 4), pixels=(100, 400), seed=2)
    low = field.heights.mean(axis=1) < field.heights.mean()  # rows within a track's width of pits
    tracks = np.count_nonzero(low & ~np.roll(low, 1))
    assert tracks == round(field.extent[1] / pitch)
