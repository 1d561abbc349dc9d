"""Random surfaces: rough mirrors, brushed lines, and discs with the tracks of their standards."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, gratings
from mitsuba_diffraction.heights.gratings import cd, dvd
from mitsuba_diffraction.heights.scatter import power_spectrum


def test_heights_have_the_rms_that_is_asked_for_and_a_k_correlation_spectrum():
    field = gratings.rough(40.0, 256, 3, rms=0.004, correlation=1.5, slope=1.6)
    # heights are rounded to a picometre
    assert field.heights.std() == pytest.approx(0.004, abs=1e-6)
    found = power_spectrum(field)
    model = (1.0 + (2.0 * np.pi * 1.5 * found.frequency) ** 2) ** -1.3
    ratio = found.density / model
    # rings above 1/µm have 600 independent modes and more, which scatter by 4 %; the last is cut
    wide = (found.frequency > 1.0) & (found.frequency < found.frequency[-1])
    assert ratio[wide].std() / ratio[wide].mean() < 0.06


def test_a_band_holds_all_of_the_power():
    field = gratings.rough(40.0, 256, rms=0.004, band=(1.0, 8.0))
    power = np.abs(np.fft.fft2(field.heights)) ** 2
    axis = np.fft.fftfreq(256, 40.0 / 256)
    radius = np.hypot(axis, axis[:, None])
    inside = (radius >= 1 / 8.0) & (radius <= 1.0)
    # but for rounding to a picometre
    assert power[inside].sum() > (1 - 1e-5) * power.sum()


def spectrum(**arguments):
    field = gratings.brushed(32.0, 256, **arguments)
    return field.heights, np.abs(np.fft.fft2(field.heights)) ** 2


def test_lines_run_along_y_with_the_height_that_is_asked_for():
    heights, _ = spectrum(rms=0.05, width=0.6, length=6.0)
    slopes = [np.diff(heights, axis=axis).std() for axis in (0, 1)]
    # slopes go as the reciprocal of the blur, here 10; 20 lines across give 0.2 of scatter
    assert 7 < slopes[1] / slopes[0] < 13
    # some 15 by 2 independent lines: the estimate scatters by 1 / sqrt(2 · 30)
    assert heights.std() == pytest.approx(0.05, rel=0.4)


def test_the_power_of_a_period_lies_around_its_frequency():
    _, power = spectrum(period=1.0, width=4.0, length=8.0)
    cut = power.sum(axis=0)[:128]
    # σ of the band is 1 / (2π·4 µm), 1.3 of the 1/32 µm between frequencies
    assert cut[28:37].sum() > 0.99 * cut.sum()


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (gratings.rough, {"slope": 9.0}), (gratings.rough, {"rms": -1.0}),
        (gratings.rough, {"band": (0.01, 0.02)}), (gratings.brushed, {"width": 0.1}),
        (gratings.brushed, {"length": 6.0, "period": 0.2}), (gratings.brushed, {"length": 20.0}),
        (gratings.brushed, {"rms": -1.0}),
    ],
)  # fmt: skip
def test_what_the_patch_cannot_hold_is_refused(make, wrong):
    with pytest.raises(DiffractionError, match=f"{make.__name__}: {list(wrong)[-1]}"):
        make(32.0, 256 if make is gratings.brushed else 64, **wrong)


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


def test_run_lengths_are_3_to_11_channel_bits_short_ones_most(make, smooth):
    runs = np.concatenate([runs_of(line) for line in track_lines(make, smooth)])
    bits = runs * smooth.pixel_size[0] / STANDARD[make][1]
    # whole bits, but that a whole number of them fits (0.3 %) and for a pixel, 0.15 bit, twice
    assert np.abs(bits - np.round(bits)).max() < 0.4
    assert 2.6 < bits.min() < bits.max() < 11.4
    # P(n) = λ⁻ⁿ of the code of largest entropy has mean 5.2 and P(3) = 0.32; 300 to 700 runs
    assert bits.mean() == pytest.approx(5.2, abs=0.5)
    assert np.mean(np.round(bits) == 3) == pytest.approx(0.32, abs=0.08)


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


def test_whole_tracks_fit(make):
    pitch = STANDARD[make][0]
    field = make(extent=(10.0, 4.3 * pitch + 4), pixels=(100, 400), seed=2)
    low = field.heights.mean(axis=1) < field.heights.mean()  # rows within a track's width of pits
    tracks = np.count_nonzero(low & ~np.roll(low, 1))
    assert tracks == round(field.extent[1] / pitch)
