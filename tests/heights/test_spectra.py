"""Spectra are normalised, orders lie where gratings throw them, a patch's gratings are found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter, map_coordinates

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.heights.gratings import blazed, sinusoidal
from mitsuba_diffraction.heights.spectra import (
    dominant_periods,
    examine_periods,
    far_field,
    frequencies,
    height_spectrum,
    order_powers,
    profile,
    seen_slope,
)
from tests.support.directions import rough_patch


def test_the_spectrum_integrates_to_the_variance():
    rng = np.random.default_rng(0)
    field = HeightField(rng.standard_normal((96, 160)), (0.1, 0.2))
    (fx, fy), density = frequencies(field), height_spectrum(field)
    total = density.sum() * (fx[1] - fx[0]) * (fy[1, 0] - fy[0, 0])
    # the window leaves 15360·(2/3)² independent values, whose variance scatters by 2 %
    assert total == pytest.approx(field.rms_height**2, rel=0.05)


def test_orders_share_the_light():
    field = sinusoidal(2.5, 0.3, periods=3)
    assert order_powers(field, 550.0).sum() == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("axis", "direction"), [("x", "descending"), ("y", "ascending")])
def test_a_blaze_throws_light_its_way(axis, direction):
    # at 500 nm a blaze of 0.25 µm is a wavelength deep there and back: all in one order
    field = blazed(2.5, 0.25, direction=direction, axis=axis, periods=8, pixels_per_period=64)
    powers = order_powers(field, 500.0)
    y, x = np.unravel_index(powers.argmax(), powers.shape)
    fx, fy = frequencies(field)
    expected = 0.4 if direction == "descending" else -0.4  # 1/period, towards the descent
    assert (fx[x], fy[y, 0])[axis == "y"] == pytest.approx(expected)
    light = far_field(field, 500.0, 201)
    v, u = np.unravel_index(np.nanargmax(light), light.shape)
    sines = np.linspace(-1, 1, 201)
    assert (sines[u], sines[v])[axis == "y"] == pytest.approx(expected * 0.5, abs=0.011)  # a pixel


def test_profiles_separate_directions():
    field = sinusoidal(1.0, 0.2, periods=20, rows=640)
    edges = np.array([0.5, 0.9, 1.1, 2.0])
    density = height_spectrum(field)
    along, across = (profile(density, field, edges, d) for d in ("x", "y"))
    assert along.argmax() == 1
    assert across.max() < 1e-6 * along.max()  # the window's side lobes


def test_rings_without_frequencies_are_nan():
    field = sinusoidal(1.0, 0.2, periods=2, rows=8)
    assert np.isnan(profile(height_spectrum(field), field, np.array([1e-4, 1e-3]))).all()


def test_nothing_is_seen_beyond_the_horizon():
    light = far_field(sinusoidal(1.0, 0.2, periods=4, rows=32), 550.0, 51)
    sines = np.linspace(-1, 1, 51)
    radius = np.hypot(sines[None, :], sines[:, None])
    assert np.isnan(light[radius > 1.001]).all()  # the horizon itself is a matter of rounding
    assert np.isfinite(light[radius < 0.999]).all()


PIXEL = (0.05, 0.06)


def waves(shape, *gratings_, profile=np.cos):
    """Sum of gratings (period in µm, direction in degrees, depth in µm) on PIXEL."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    total = np.zeros(shape)
    for period, direction, depth in gratings_:
        turn = np.radians(direction)
        along = x * PIXEL[0] * np.cos(turn) + y * PIXEL[1] * np.sin(turn)
        total += depth * profile(2 * np.pi * along / period)
    return HeightField(total, PIXEL, cut_out=True)


def sawtooth(phase):
    return (phase / (2 * np.pi)) % 1.0


def lamellar(duty):
    return lambda phase: np.where(sawtooth(phase) < duty, 0.5, -0.5)


def track(extent, pixels, direction, seed):
    """A piece of a CD, cut out and turned; its track repeats every 1.6 µm in the direction."""
    disc, turn, pixel = (
        gratings.cd(64.0, 1024, seed=seed),
        np.radians(direction),
        extent / max(pixels),
    )
    y, x = pixel * np.mgrid[: pixels[0], : pixels[1]]
    across, along = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    places = [across / disc.pixel_size[1], along / disc.pixel_size[0]]
    heights = map_coordinates(disc.heights, places, order=1, mode="grid-wrap")
    return HeightField(heights, pixel, cut_out=True)


# The main lobe of a Hann window is four bins wide, and the centre of mass of what is in it is off
# by a few hundredths of a bin, more with noise: of four repeats and more, less than one per cent,
# and a hundredth of four is 0.6 degrees.
PERIOD, DIRECTION = 0.01, 1.0


def angle_between(one, other):
    return abs((one - other + 90) % 180 - 90)


@settings(max_examples=25)
@given(
    st.floats(0.5, 3.5), st.floats(-89.0, 90.0),
    st.one_of(st.sampled_from([np.cos, sawtooth]), st.floats(0.25, 0.75).map(lamellar)),
    st.tuples(st.integers(300, 400), st.integers(300, 400)), st.floats(0.0, 0.5),
)  # fmt: skip
def test_periods_to_one_per_cent_and_directions_to_a_degree(
    period, direction, profile, shape, noise
):
    field = waves(shape, (period, direction, 0.1), profile=profile)
    rough = np.random.default_rng(shape[0]).standard_normal(shape) * noise * field.rms_height
    found = dominant_periods(HeightField(field.heights + rough, PIXEL, cut_out=True))[0]
    assert found.period == pytest.approx(period, rel=PERIOD)
    assert angle_between(found.direction, direction) < DIRECTION
    if profile is np.cos:
        assert found.share == pytest.approx(1.0 / (1.0 + noise**2), abs=0.06)
    elif profile is sawtooth:  # whose harmonics hold 1 − 6/π² of its variance
        assert found.share == pytest.approx(6 / np.pi**2 / (1.0 + noise**2), abs=0.06)


@settings(max_examples=10)
@given(
    st.floats(-89.0, 90.0), st.integers(0, 20), st.floats(20.0, 40.0),
    st.tuples(st.integers(300, 400), st.integers(300, 400)),
)  # fmt: skip
def test_a_disc_s_track_is_found_in_whatever_direction(direction, seed, extent, shape):
    # a dozen tracks and more: the pits are random, and below their data outweigh some bins
    found = dominant_periods(track(extent, shape, direction, seed))[0]
    assert found.period == pytest.approx(1.6, rel=PERIOD)
    assert angle_between(found.direction, direction) < DIRECTION


def test_crossed_gratings_are_two_the_stronger_first():
    found = dominant_periods(waves((400, 380), (1.2, 80.0, 0.05), (0.8, -5.0, 0.1)))
    assert [one.period for one in found] == pytest.approx([0.8, 1.2], rel=0.01)
    assert [one.share for one in found] == pytest.approx([0.8, 0.2], abs=0.02)


def test_a_scale_s_bending_does_not_hide_its_fingers():
    scale = gratings.xenopeltis_like(32.0, 512)
    bending = rough_patch((512, 512), (0.0625, 0.0625), 0.1, correlation=3.0).heights
    for heights in (scale.heights, scale.heights + bending):
        found = dominant_periods(HeightField(heights, 0.0625))[0]
        assert found.period == pytest.approx(0.6, rel=0.05)  # stretched by some per cent
        assert abs(found.direction) < 2.0


@pytest.mark.parametrize("seed", range(8))
def test_waviness_beside_a_grating_has_no_period(seed):
    """Waviness does not stand out from frequencies that the grating explains."""
    rng = np.random.default_rng(seed)
    y, x = 0.1 * np.mgrid[:200, :200]
    heights = 0.1 * np.cos(2.0 * np.pi * x)
    for turn in np.radians(np.arange(0.0, 180.0, 9.0)):
        along = (np.cos(turn) * x + np.sin(turn) * y) * rng.uniform(0.15, 0.27)
        heights += 0.02 * np.cos(2.0 * np.pi * along + rng.uniform(0.0, 2.0 * np.pi))
    found = examine_periods(HeightField(heights, 0.1))
    assert [one.period for one in found.gratings] == pytest.approx([1.0], rel=0.01)
    assert found.weak is None


@pytest.mark.parametrize("seed", range(6))
def test_rough_surfaces_have_none(seed):
    rough = rough_patch((160, 200), (0.1, 0.1), 0.2, correlation=0.4 * (1 + seed % 3), seed=seed)
    assert dominant_periods(rough) == []


@pytest.mark.parametrize("shape", [(50, 500), (500, 50), (16, 1000)])
def test_rough_strips_have_none(shape):
    for seed in range(6):
        white = np.random.default_rng(seed).standard_normal(shape)
        rough = HeightField(gaussian_filter(white, 9.0, mode="wrap"), 0.08, cut_out=True)
        assert examine_periods(rough) == ([], None), seed


@pytest.mark.parametrize("direction", [0.0, 20.0])
@pytest.mark.parametrize(("profile", "repeats"), [(np.cos, 3.3), (sawtooth, 5.3), (sawtooth, 12.0)])
def test_a_grating_in_a_strip_is_found(profile, repeats, direction):
    size = np.array([500, 50]) * PIXEL
    turn = np.radians(direction)
    period = float(np.hypot(*(size * (np.cos(turn), np.sin(turn))))) / repeats
    found, *_ = dominant_periods(waves((50, 500), (period, direction, 0.1), profile=profile))
    # few repeats along a sloping strip are known to a tenth of one
    assert found.period == pytest.approx(period, rel=0.3 / repeats)


@pytest.mark.parametrize("shape", [(2, 2), (2, 400), (400, 2), (3, 5)])
def test_tiny_and_flat_patches_are_answered(shape):
    assert dominant_periods(HeightField(np.zeros(shape), 0.1)) == []
    found = dominant_periods(waves(shape, (2.0, 0.0 if shape[1] > 5 else 90.0, 0.1)))
    if max(shape) > 5:
        assert [one.period for one in found] == pytest.approx([2.0], rel=0.01)


def test_the_measured_scale_has_its_fingers_within_the_spread_of_its_windows(shared_afm):
    patch = HeightField.load(shared_afm / "elaphe-65um.png", pixel_size=65 / 1332, max_height=0.375)
    (whole,) = dominant_periods(patch)
    assert whole.period == pytest.approx(1.04, rel=0.03)  # a plain FFT shows some 1 µm
    assert abs(whole.direction) < 3.0
    width, step = 328, 251  # 16 µm, fifteen fingers
    found = []
    for top in range(0, 1332 - width + 1, step):
        for left in range(0, 1332 - width + 1, step):
            part = patch.heights[top : top + width, left : left + width]
            first = dominant_periods(HeightField(part, patch.pixel_size, cut_out=True))[0]
            found.append((first.period, first.direction))
    assert len(found) == 25
    for value, mean, spread in zip(
        (whole.period, whole.direction), np.mean(found, 0), np.std(found, 0), strict=True
    ):
        assert abs(value - mean) < spread


def scan(heights, noise=0.001):
    """A scan of 20 µm, 256 pixels wide, of heights(x, y) in µm with white noise."""
    y, x = np.mgrid[:256, :256] * (20.0 / 256)
    rough = np.random.default_rng(1).standard_normal(x.shape) * noise
    return HeightField(heights(x, y) + rough, 20.0 / 256, cut_out=True)


@pytest.mark.parametrize(
    "heights",
    [
        lambda x, y: 0.01 * x,
        lambda x, y: 0.001 * (x - 8) ** 2 + 0.02 * y,
        lambda x, y: 1e-4 * (x - 12) ** 3,
        lambda x, y: 0.05 * np.tanh(x - 9),
        lambda x, y: 0.05 * np.cos(2 * np.pi * x / 20),
    ],
    ids=["tilt", "bow", "third degree", "edge", "one wave"],
)
def test_a_scan_without_repeats_has_no_period(heights):
    assert examine_periods(scan(heights)) == ([], None)


@pytest.mark.parametrize("fundamental", [1.0, 0.5, 0.2])
@pytest.mark.parametrize("harmonic", [2, 3])
def test_a_harmonic_is_told_from_the_fundamental(fundamental, harmonic):
    def fringes(x, y):
        phase = 2 * np.pi * (x + 0.3 * y) / 4.0
        return 0.05 * (fundamental * np.cos(phase) + np.cos(harmonic * phase + 0.7)) + 0.01 * x

    (found,) = dominant_periods(scan(fringes))
    assert found.period == pytest.approx(4.0 / np.hypot(1, 0.3), rel=PERIOD)


@pytest.mark.parametrize(("depth", "is_grating"), [(0.02, True), (0.008, False)])
def test_a_weak_line_in_noise_is_a_grating_or_below_the_threshold(depth, is_grating):
    found = examine_periods(scan(lambda x, y: depth * np.cos(2 * np.pi * x / 2.6), 0.03))
    (line,) = found.gratings if is_grating else [found.weak]
    assert line.period == pytest.approx(2.6, rel=PERIOD)
    assert (line.share >= 0.1) == is_grating


@pytest.mark.parametrize("periods", [3, 4, 5, 8])
def test_a_scan_of_few_whole_periods_of_a_blaze_has_its_period(periods):
    blaze = blazed(2.5, 0.25, periods=periods, rows=48 * periods)
    (found,) = dominant_periods(HeightField(blaze.heights, blaze.pixel_size, cut_out=True))
    assert found.period == pytest.approx(2.5, rel=PERIOD)


def test_one_period_of_a_grating_is_known_only_where_it_repeats():
    blaze = blazed(2.5, 0.25, periods=1)
    (found,) = dominant_periods(blaze)
    assert found.period == pytest.approx(2.5)
    assert dominant_periods(HeightField(blaze.heights, blaze.pixel_size, cut_out=True)) == []


def test_noise_of_pixels_adds_nothing_to_the_slope_that_light_sees():
    even = sinusoidal(period=1.6, depth=0.06, periods=8, rows=64)
    noise = 0.002 * np.random.default_rng(2).normal(size=even.heights.shape)
    noisy = HeightField(even.heights + noise, even.pixel_size, periodic=True)
    assert noisy.rms_slope > 1.3 * even.rms_slope
    # of white noise the part below 2/λ remains, a tenth of the frequencies here
    assert seen_slope(noisy, 0.36) == pytest.approx(even.rms_slope, rel=0.1)
    assert seen_slope(even, 0.36) == pytest.approx(even.rms_slope, rel=0.01)


@pytest.mark.parametrize(("periods", "certain"), [(3, False), (8, True)])
def test_periods_with_few_repeats_are_perhaps_one(periods, certain):
    (grating, *_), _ = examine_periods(waves((256, 32 * periods), (1.6, 0.0, 0.03)))
    assert grating.repeats == pytest.approx(periods, rel=0.1)
    assert str(grating).startswith("perhaps") != certain
    assert "repeats" in str(grating)
