"""The trade: errors against the integral, budgets kept, series that break down where stated."""

from __future__ import annotations

import pytest

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.analysis.tradeoff.accuracy import (
    TERMS,
    Sample,
    measure_wavelengths,
    taylor_error,
    window_sums,
)
from mitsuba_diffraction.analysis.tradeoff.measuring import (
    MeasuredSetting,
    TradeoffSetting,
)
from mitsuba_diffraction.analysis.tradeoff.report import Budget, recommended
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

PATCH = rough_patch((48, 48), (0.1, 0.1), 0.25)
WIDTH = 4.5


def quiet(done: int, total: int, text: str) -> None:
    """No progress."""


@pytest.fixture(scope="module")
def sample() -> Sample:
    return Sample.draw(PATCH, WIDTH, "ensemble", 120, quiet)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_the_error_found_is_below_the_tolerance_that_was_asked_for(sample, tolerance):
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH, tolerance=tolerance)
    error = max(sample.error(window_sums(table, *sample.pairs[:3])))
    assert 0.0 < error <= tolerance


def result(tolerance: float, relative: float, megabytes: float) -> MeasuredSetting:
    setting = TradeoffSetting("tolerance", {"tolerance": tolerance})
    return MeasuredSetting(setting, error=tolerance, relative=relative, megabytes=megabytes)


COARSE, MIDDLE, FINE = (f"--tolerance 1e-0{digits}" for digits in (2, 3, 5))
RESULTS = [result(1e-2, 2.0, 4.0), result(1e-3, 3.0, 8.0), result(1e-5, 5.0, 30.0)]


@pytest.mark.parametrize(
    ("budget", "expected"),
    [
        (Budget(tolerance=1e-3), MIDDLE),
        (Budget(tolerance=2e-2), COARSE),
        (Budget(tolerance=1e-4), FINE),
        (Budget(megabytes=10.0), MIDDLE),
        (Budget(relative=2.5), COARSE),
        (Budget(), FINE),
    ],
)
def test_the_recommended_setting_is_the_best_within_the_budget(budget, expected):
    assert recommended(RESULTS, budget).setting.name == expected


def test_taylor_s_series_holds_for_shallow_surfaces_and_not_for_deep_ones():
    heights = PATCH.heights - PATCH.heights.min()
    kappa = 30.0  # κH/2 = 3.75: 37 terms leave 3.75³⁷/37! = 1e-22 of it, rounding e^3.75·6e-8
    assert taylor_error(heights - 0.5 * PATCH.range, kappa, TERMS) < 1e-4
    # κH = 60: the largest term is e⁶⁰, of which single precision keeps seven digits
    assert taylor_error(8.0 * heights, kappa, TERMS) > 1.0


def test_fine_sums_are_better_than_coarse_ones_and_more_wavelengths_less_noisy(sample):
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH)
    found = measure_wavelengths(table, *sample.pairs[:2])
    assert found.steps[2.0] < 0.1 < found.steps[40.0] + 0.1
    assert found.counts[1] > found.counts[4] > found.counts[16]
