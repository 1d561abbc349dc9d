"""Gradients with respect to the heights: against the reference and differences; what they find."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import ndimage

from mitsuba_diffraction import HeightField, design, reference
from tests.support.directions import Array, polar, rough_patch, uniform_directions

#: Odd and even numbers of pixels that are not square; heights of several radians of phase.
SMALL = rough_patch((12, 15), (0.13, 0.15), 0.3)
RNG = np.random.default_rng(3)
PAIRS = np.stack([uniform_directions(9, RNG), uniform_directions(9, RNG)])
# of unit length in double precision: in single precision R and (1 + ωi·ωo)² differ by 3e-8
PAIRS /= np.linalg.norm(PAIRS, axis=-1, keepdims=True)
LIGHT = *PAIRS, RNG.uniform(400, 700, 9)


def smooth_heights(n: int, pixels: float, rms: float, seed: int) -> Array:
    noise = np.random.default_rng(seed).normal(size=(n, n))
    heights = ndimage.gaussian_filter(noise, pixels, mode="wrap")
    return np.asarray(rms * (heights - heights.mean()) / heights.std())


@pytest.mark.parametrize("material", [{}, {"eta": 1.56}, {"eta": 0.65, "k": 5.6}])
@pytest.mark.parametrize("width", [1.0, 4.0])
def test_the_brdf_is_the_reference_s(width, material):
    views = design.Views(SMALL, *LIGHT, coherence_width=width, **material)
    expected = reference.brdf(SMALL, *LIGHT, coherence_width=width, model="kirchhoff", **material)
    # rounding: sums of 180 terms
    assert views.brdf(SMALL.heights) == pytest.approx(expected, rel=1e-9, abs=0)


def test_nothing_is_seen_from_below():
    views = design.Views(SMALL, polar(0), [polar(10), polar(110)], 500.0, coherence_width=2.0)
    found = views.brdf(SMALL.heights)
    assert found[0] > 0.0
    assert found[1] == 0.0
    assert not views.loss(SMALL.heights, lambda f: (float(f[1]), np.array([0.0, 1.0])))[1].any()


def test_the_gradient_is_that_of_differences():
    views = design.Views(SMALL, *LIGHT, coherence_width=2.0, eta=1.56)
    weights = np.random.default_rng(1).normal(size=len(views))

    def of(f: Array) -> tuple[float, Array]:
        return float(weights @ f**2), 2 * weights * f

    _, gradient = views.loss(SMALL.heights, of)
    scale, step = np.abs(gradient).max(), 1e-5
    for iy, ix in [(0, 0), (5, 14), (11, 7)]:
        change = np.zeros(SMALL.shape)
        change[iy, ix] = step
        there, back = (views.loss(SMALL.heights + sign * change, of)[0] for sign in (1, -1))
        # central differences: (κ·step)² = 1e-8 of truncation, 1e-11 of rounding
        assert abs((there - back) / (2 * step) - gradient[iy, ix]) < 1e-6 * scale


def test_the_symmetries_have_one_brdf_and_are_undone():
    views = design.Views(SMALL, *LIGHT, coherence_width=2.0)
    turned = SMALL.changed(0.7 - np.roll(SMALL.heights[::-1, ::-1], (3, 4), (0, 1)), "turned")
    assert views.brdf(turned.heights) == pytest.approx(views.brdf(SMALL.heights), rel=1e-9)
    back = design.aligned(turned, SMALL)
    np.testing.assert_allclose(back.heights, SMALL.heights, atol=1e-12)  # µm, rounding
    # turned alone it is another surface
    other = views.brdf(SMALL.heights[::-1, ::-1])
    assert np.abs(other / views.brdf(SMALL.heights) - 1).max() > 0.1


def test_a_patch_is_recovered_from_its_brdf():
    true = HeightField(smooth_heights(12, 1.2, 0.05, seed=1), 0.25, name="true")
    x, y = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-0.8, 0.8, 7)]))
    inside = np.hypot(x, y) < 0.85
    hemisphere = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)[inside]
    pairs = product((polar(0), polar(50, 20)), hemisphere, (420.0, 530.0, 650.0))
    views = design.Views(true, *map(np.array, zip(*pairs, strict=True)), coherence_width=3.0)
    asked = views.brdf(true.heights)
    # a guess that is off by 40 % of the heights, shifted and lifted
    guess = true.heights + smooth_heights(12, 0.8, 0.02, seed=2)
    start = HeightField(np.roll(guess, (2, 5), axis=(0, 1)) + 0.3, 0.25)
    before = np.abs(views.brdf(start.heights) / asked - 1)
    found = design.recover(views, asked, start, smoothing=0.2, iterations=300)
    off = np.abs(views.brdf(found.heights) / asked - 1)
    assert np.median(before) > 0.1
    assert off.max() < 0.01
    # 1 % of powers is 0.5 % of amplitudes; heights no view sees well may be off by more
    assert np.std(design.aligned(found, true).heights - true.heights) < 0.02 * true.rms_height


WO, ASKED = np.stack([polar(30), polar(30, 180)]), np.array([[4.0, 0.3, 0.3], [0.3, 0.3, 4.0]])
SEEN = {"coherence_width": 7.0, "wavelengths": range(400, 701, 25)}
TINY = {"pixels": 48, "pixel_size": 0.2, **SEEN}


def test_a_relief_shows_what_it_was_designed_for():
    first, found = (design.relief(polar(0), WO, ASKED, **TINY, iterations=n) for n in (1, 40))
    before, after = (
        np.sum((design.shown(field, polar(0), WO, **SEEN) - ASKED) ** 2) for field in (first, found)
    )
    assert after < 1e-6 * before
    np.testing.assert_allclose(design.shown(found, polar(0), WO, **SEEN), ASKED, atol=0.01)
    assert 0.0 <= found.heights.min() < found.heights.max() <= 0.2
    for axis in (0, 1):
        steps = np.diff(found.heights, axis=axis, append=found.heights.take([0], axis))
        assert np.abs(steps).max() <= 0.35 * 0.2


def test_one_seed_is_one_relief():
    one, same, other = (
        design.relief(polar(0), WO, ASKED, **TINY, iterations=3, seed=seed) for seed in (4, 4, 5)
    )
    assert np.array_equal(one.heights, same.heights)
    assert not np.array_equal(one.heights, other.heights)


def test_colours_are_counted_in_those_of_a_white_diffuser():
    flat = HeightField(np.zeros((4, 4)), 0.2)
    mirror = reference.brdf(flat, polar(0), polar(0), 550.0, coherence_width=1.0)[0]
    ((red, green, blue),) = design.shown(
        flat, polar(0), polar(0), coherence_width=1.0, wavelengths=range(360, 831, 5)
    )
    # a mirror's lobe is brighter where light is short-waved, as 1/λ²
    assert red < green < blue
    assert green == pytest.approx(np.pi * mirror, rel=0.05)  # green light is about 550 nm
