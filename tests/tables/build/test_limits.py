"""Tables with a frequency limit: exact within it, dark beyond, and smaller."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable
from tests.support.directions import rough_patch

#: 19.2 µm wide; Nyquist's frequency is 10.5 rad/µm.
PATCH = rough_patch((64, 64), (0.3, 0.3), 0.25, correlation=0.2)
WIDTH, LIMIT = 18.0, (8.0, 3.0)


@pytest.fixture(scope="module")
def whole():
    """A table of all that light can probe."""
    return DiffractionTable.build(PATCH, coherence_width=WIDTH)


@pytest.fixture(scope="module", params=["ensemble", "patch"])
def limited(request):
    """A table that ends at `LIMIT`, for heights as they are."""
    return DiffractionTable.build(
        PATCH,
        coherence_width=WIDTH,
        coherence=request.param,
        frequency_limit=LIMIT,
        height_scale_max=1.0,
    )


def frequencies(count, farthest):
    """Random frequencies (n,), (n,) in an ellipse, in units of the limits."""
    rng = np.random.default_rng(0)
    angle, radius = rng.uniform(0, 2 * np.pi, count), farthest * np.sqrt(rng.uniform(0, 1, count))
    return LIMIT[0] * radius * np.cos(angle), LIMIT[1] * radius * np.sin(angle)


def test_within_the_limit_the_tolerance_is_met(limited):
    assert limited.largest_error <= 1e-3
    full = DiffractionTable.build(
        PATCH, coherence_width=WIDTH, coherence=limited.coherence, tolerance=1e-4
    )
    x, y = frequencies(4000, 1.0)
    assert limited.covers(x, y, 30.0).all()
    for kappa in (1.0, 8.0, 30.0):
        exact = full.window_sum(x, y, kappa)
        difference = np.abs(limited.window_sum(x, y, kappa) - exact)
        # Its own tolerance, and that of what it is compared with
        assert difference.sum() <= 1.1e-3 * exact.sum()


def test_beyond_the_limit_it_is_dark_and_never_guessed(limited):
    x, y = frequencies(2000, 2.0)
    beyond = np.hypot(x / LIMIT[0], y / LIMIT[1]) > 1.0 + 1e-5
    assert np.all(limited.window_sum(x[beyond], y[beyond], 20.0) == 0.0)
    # as in any table: what its wavelengths and heights cannot probe is not a number
    assert np.isnan(limited.window_sum(limited.q_limit * 1.01, 0.0, 20.0))
    assert np.isnan(limited.window_sum(1.0, 1.0, limited.q_limit * 1.01))


def test_it_takes_less_memory(whole, limited):
    components = limited.coefficients.shape[3]
    assert limited.nbytes < 0.5 * components * whole.nbytes


@pytest.mark.parametrize("limit", [-1.0, (1.0, 0.0), float("nan"), (1.0, 2.0, 3.0), "none"])
def test_a_limit_of_nothing_is_refused(limit):
    with pytest.raises(DiffractionError, match=r"frequency_limit=.* must be a positive number"):
        DiffractionTable.build(PATCH, coherence_width=WIDTH, frequency_limit=limit)


def test_a_limit_beyond_what_light_can_probe_is_none(whole):
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH, frequency_limit=1e3)
    assert not table.limited
    assert table.digest() == whole.digest()
