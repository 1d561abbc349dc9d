"""Ideal gratings: extent, axes, refusals; and what any maker of patches does with any value."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.gratings import (
    blazed,
    cd,
    dvd,
    elaphe_like,
    lamellar,
    sinusoidal,
    xenopeltis_like,
)


def test_axis_y_is_the_transpose():
    along_x = blazed(2.0, 0.2, periods=2, rows=5)
    along_y = blazed(2.0, 0.2, periods=2, rows=5, axis="y")
    assert np.array_equal(along_y.heights, along_x.heights.T)
    assert np.ptp(along_x.heights, axis=0).max() == 0


def test_default_patch_is_square_and_about_as_wide_as_the_window():
    field = sinusoidal(2.5, 0.1)
    assert field.extent == pytest.approx((65, 65), rel=1e-12)
    assert field.shape[0] == field.shape[1]


def test_duty_is_the_share_of_high_pixels():
    field = lamellar(1.0, 0.5, duty=0.25, periods=1, rows=2)
    assert (field.heights == 0.5).mean() == 0.25


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: sinusoidal(0, 1), "period"),
        (lambda: sinusoidal(-1, 1), "period"),
        (lambda: sinusoidal(float("nan"), 1), "period"),
        (lambda: sinusoidal("1", 1), "period"),
        (lambda: sinusoidal(1, -1), "depth"),
        (lambda: sinusoidal(1, 1, axis="z"), "axis"),
        (lambda: sinusoidal(1, 1, pixels_per_period=1), "pixels_per_period"),
        (lambda: sinusoidal(1, 1, pixels_per_period=2.5), "pixels_per_period"),
        (lambda: sinusoidal(1, 1, periods=0), "periods"),
        (lambda: sinusoidal(1, 1, rows=1), "rows"),
        (lambda: sinusoidal(1, 1, periods=10**5), "more than"),
        (lambda: blazed(1, 1, direction="left"), "direction"),
        (lambda: blazed(1, 1, pixels_per_period=10**10), "pixels_per_period"),
        (lambda: lamellar(1, 1, duty=0), "duty"),
        (lambda: lamellar(1, 1, duty=0.001), "duty"),
        (lambda: lamellar(1, 1, duty=2), "duty"),
    ],
)
def test_parameters_that_do_not_fit_are_named(make, word):
    with pytest.raises(DiffractionError, match=word) as caught:
        make()
    assert "\n" not in str(caught.value)


AMOUNTS = ("irregularity", "bending", "roughness", "dirt")
ONE_OF_EACH = [elaphe_like, xenopeltis_like, cd, dvd]
DISCS = ONE_OF_EACH[2:]
#: Makers with arguments of a small patch.
SMALL = {make: {"period": 1.0, "depth": 0.1, "pixels_per_period": 8, "periods": 1, "rows": 2}
         for make in (sinusoidal, blazed, lamellar)}  # fmt: skip
SMALL |= {make: {"extent": 5.0, "pixels": 16, "seed": 0, "depth": 0.1, "irregularity": 1.0}
          for make in ONE_OF_EACH}  # fmt: skip
ANYTHING = (
    st.none() | st.integers() | st.integers(-2, 9) | st.floats() | st.text(max_size=5)
    | st.booleans() | st.lists(st.floats(), max_size=3) | st.just(np.zeros(2))
)  # fmt: skip


@settings(max_examples=300)
@given(data=st.data(), make=st.sampled_from(list(SMALL)), value=ANYTHING)
def test_any_value_works_or_is_one_clear_line(data, make, value):
    own = AMOUNTS[1:] if make in ONE_OF_EACH[:2] else ("track_pitch",) if make in DISCS else ()
    name = data.draw(st.sampled_from([*SMALL[make], *own]))
    if name.startswith("pixels") and isinstance(value, int) and value > 64:
        return  # allowed, and slow
    try:
        field = make(**SMALL[make] | {name: value})
    except DiffractionError as error:
        assert "\n" not in str(error)
        assert name in str(error)
    else:
        assert np.isfinite(field.rms_slope)


@settings(max_examples=80)
@given(
    make=st.sampled_from(ONE_OF_EACH),
    extent=st.floats(4, 12) | st.tuples(st.floats(4, 12), st.floats(4, 12)),
    pixels=st.integers(8, 64) | st.tuples(st.integers(8, 64), st.integers(8, 64)),
    seed=st.integers(0, 2**63 - 1),
    depth=st.floats(0, 10),
    pitch=st.floats(0.7, 2.0),
    amounts=st.fixed_dictionaries({name: st.floats(0, 3) for name in AMOUNTS}),
)
def test_parameters_in_range_give_a_patch(make, extent, pixels, seed, depth, pitch, amounts):
    disc, irregularity = make in DISCS, amounts["irregularity"]
    own = {"irregularity": irregularity, "track_pitch": pitch} if disc else amounts
    field = make(extent, pixels, seed, depth=depth, **own)
    # six standard deviations of a disc's roughness on both sides
    beyond = 6 * irregularity * 0.002 if disc else 0.0
    assert -beyond <= field.heights.min()
    assert field.heights.max() <= depth + beyond
    if not disc:  # whole tracks fit into a disc
        assert field.extent == pytest.approx(np.broadcast_to(extent, 2))


@pytest.mark.parametrize("make", ONE_OF_EACH)
def test_a_seed_gives_one_patch(make):
    same, again, other = (make(extent=8.0, pixels=120, seed=seed) for seed in (3, 3, 4))
    assert same.digest() == again.digest()
    assert np.corrcoef(same.heights.ravel(), other.heights.ravel())[0, 1] < 0.9


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("make", ONE_OF_EACH)
def test_the_seam_is_a_place_like_any_other(make, axis):
    heights = np.moveaxis(make(extent=20.0, pixels=400, seed=3).heights, axis, 0)
    steps = np.sqrt(np.mean((np.roll(heights, -1, axis=0) - heights) ** 2, axis=1))
    # 399 steps inside: one more of the same kind lies beyond their extremes once in 200 times
    assert steps[:-1].min() <= steps[-1] <= steps[:-1].max()
