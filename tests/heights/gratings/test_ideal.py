"""Ideal gratings: extent, axes, refusals; and what any maker of patches does with any value."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
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


anything = st.one_of(st.none(), st.integers(), st.floats(), st.text(max_size=5), st.booleans())


@given(
    make=st.sampled_from([sinusoidal, blazed, lamellar]),
    period=anything,
    depth=anything,
    pixels=st.integers(-2, 64) | anything,
    periods=st.integers(-2, 9) | anything,
    rows=st.integers(-2, 9),
)
def test_any_parameters_work_or_are_one_clear_line(make, period, depth, pixels, periods, rows):
    try:
        field = make(period, depth, pixels_per_period=pixels, periods=periods, rows=rows)
    except DiffractionError as error:
        assert "\n" not in str(error)
    else:
        assert field.range <= depth


ALL = ("extent", "pixels", "seed", "depth", "irregularity")
anything_else = anything | st.lists(st.floats(), max_size=3) | st.just(np.zeros(2))


@pytest.mark.parametrize(
    ("makers", "names", "extent"),
    [
        ((elaphe_like, xenopeltis_like), (*ALL, "bending", "roughness", "dirt"), 3.0),
        ((cd, dvd), (*ALL, "track_pitch"), 5.0),
    ],
    ids=["scales", "discs"],
)
@given(data=st.data(), value=anything_else)
def test_any_value_of_other_patches_works_or_is_one_clear_line(makers, names, extent, data, value):
    make, name = data.draw(st.sampled_from(makers)), data.draw(st.sampled_from(names))
    arguments = {"extent": extent, "pixels": 16, name: value}
    if name == "pixels" and isinstance(value, int) and value > 64:
        return  # allowed, and slow
    try:
        make(**arguments)
    except DiffractionError as error:
        text = str(error)
        assert "\n" not in text
        assert text.startswith(f"{make.__name__}: {name}:")
        assert "got" in text
