"""Spectra of patches: their gratings are found, and rough mirrors scatter as closed forms say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from mitsuba_diffraction import (
    DiffractionError,
    DiffractionTable,
    DiffractionWarning,
    HeightField,
    gratings,
)
from mitsuba_diffraction.heights.gratings import blazed, sinusoidal
from mitsuba_diffraction.heights.scatter import abg_model, power_spectrum, rayleigh_rice_scatter
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
from mitsuba_diffraction.tables.powers import order_0_power
from tests.support.directions import rough_patch


def test_the_spectrum_integrates_to_the_variance():
    rng = np.random.default_rng(0)
    field = HeightField(rng.standard_normal((96, 160)), (0.1, 0.2))
    (fx, fy), density = frequencies(field), height_spectrum(field)
    total = density.sum() * (fx[1] - fx[0]) * (fy[1, 0] - fy[0, 0])
    # the window leaves 15360·(2/3)² independent values, whose variance scatters by 2 %
    assert total == pytest.approx(field.rms_height**2, rel=0.05)


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


def test_crossed_gratings_are_two_the_stronger_first():
    found = dominant_periods(waves((400, 380), (1.2, 80.0, 0.05), (0.8, -5.0, 0.1)))
    assert [one.period for one in found] == pytest.approx([0.8, 1.2], rel=0.01)
    assert [one.share for one in found] == pytest.approx([0.8, 0.2], abs=0.02)


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


@pytest.mark.parametrize("shape", [(2, 2), (2, 400), (400, 2), (3, 5)])
def test_tiny_and_flat_patches_are_answered(shape):
    assert dominant_periods(HeightField(np.zeros(shape), 0.1)) == []
    found = dominant_periods(waves(shape, (2.0, 0.0 if shape[1] > 5 else 90.0, 0.1)))
    if max(shape) > 5:
        assert [one.period for one in found] == pytest.approx([2.0], rel=0.01)


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


def test_a_shallow_sinusoid_s_orders_follow_from_rayleigh_and_rice():
    """Two orders of (2πa/λ)² cosθ each, a the amplitude, θ their angle."""
    field = gratings.sinusoidal(period=2.0, depth=0.004, periods=8, rows=8)
    cosine = np.sqrt(1 - (0.6328 / 2.0) ** 2)
    expected = 2 * (2 * np.pi * 0.002 / 0.6328) ** 2 * cosine
    assert rayleigh_rice_scatter(field, 632.8).share == pytest.approx(expected, rel=1e-3)


def test_the_table_s_scatter_is_that_of_rayleigh_and_rice():
    field = gratings.rough(40.0, 192, rms=0.003, band=(4.0, 20.0))
    table = DiffractionTable.build(field, coherence_width=10.0, wavelength_range=(630.0, 640.0))
    scatter = 1.0 - float(order_0_power(table, 4e3 * np.pi / 632.8))
    # the table is scalar, without cosines (5 %), and has heights in all powers
    assert scatter == pytest.approx(rayleigh_rice_scatter(field, 632.8).share, rel=0.05)


def test_an_abg_model_is_found_again():
    """K-correlation with C = 1 is an ABg model with g = 2 and B = (λ/2πl)²."""
    field = gratings.rough(240.0, 768, rms=0.003, correlation=1.0, slope=1.0)
    model = abg_model(power_spectrum(field), 632.8)
    assert model.g == pytest.approx(2.0, abs=0.15)
    assert model.b == pytest.approx((0.6328 / (2 * np.pi)) ** 2, rel=0.1)
    assert model.error < 0.1
    with pytest.raises(DiffractionError, match="the model needs"):
        abg_model(power_spectrum(HeightField(np.eye(8) * 0.01, 0.2)), 632.8)
    with pytest.raises(DiffractionError, match="flat"):
        abg_model(power_spectrum(HeightField(np.zeros((24, 24)), 0.1)), 632.8)


def test_heights_that_are_not_far_below_the_wavelength_are_named():
    with pytest.warns(DiffractionWarning, match="Rayleigh-Rice"):
        rayleigh_rice_scatter(gratings.sinusoidal(period=2.0, depth=0.4, periods=2), 632.8)


def test_profiles_separate_directions():
    field = sinusoidal(1.0, 0.2, periods=20, rows=640)
    edges = np.array([0.5, 0.9, 1.1, 2.0])
    density = height_spectrum(field)
    along, across = (profile(density, field, edges, d) for d in ("x", "y"))
    assert along.argmax() == 1
    assert across.max() < 1e-6 * along.max()  # the window's side lobes
