"""The second order of the small-slope approximation, beside Rayleigh's expansion."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import rayleigh
from docs.make.validation.patch_solutions import solved
from docs.make.validation.patches import cell
from docs.make.validation.second_order import MODELS, amplitudes, cases_of_cells, coefficients
from docs.make.validation.second_order_factor import MODELS as FACTOR
from docs.make.validation.second_order_factor import compare_cells
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.reference import boundary

pytestmark = pytest.mark.thorough

WI = np.array([0.5, 0.3, np.sqrt(1 - 0.34)])
INDICES = [1.56, 1.2 + 6.5j]


def surface(height: float) -> HeightField:
    """A cell without any symmetry, ± about `height` (µm)."""
    y, x = 2 * np.pi / 16 * np.mgrid[:16, :16]
    heights = np.cos(x) + 0.7 * np.sin(y) + 0.5 * np.cos(x + y + 0.3) + 0.3 * np.sin(2 * x - y)
    return HeightField(height * heights, 1.5 / 16)


def errors(height: float, index: complex) -> np.ndarray:
    """Largest error of the roots of the orders' powers, of each model, (3,)."""
    field = surface(height)
    truth = rayleigh.solve(field, index, 550.0, WI, 101)
    found = amplitudes(field, index, 550.0, WI, truth.wo, truth.order)
    exact = np.linalg.norm(truth.jones, axis=(1, 2))
    return np.array(
        [np.abs(np.linalg.norm(found[model], axis=(1, 2)) - exact).max() for model in MODELS]
    )


@pytest.mark.parametrize("index", INDICES)
def test_its_error_falls_as_the_third_power_of_the_heights(index):
    coarse, fine = errors(0.004, index), errors(0.002, index)
    assert coarse[0] / fine[0] < 5.0  # of the first order as the second
    assert 7.0 < coarse[2] / fine[2] < 9.0
    assert fine[2] < 0.05 * fine[0]


@pytest.mark.parametrize("index", INDICES)
def test_its_first_coefficient_is_the_package_s_and_its_second_knows_a_shift(index):
    orders = np.array([[0, 0], [1, 0], [0, -1], [-1, 1]])
    waves = rayleigh.Waves(surface(0.01), index, 550.0, WI, 101)
    rows = [int((waves.orders == order).all(axis=1).argmax()) for order in orders]
    first, second = coefficients(waves, index, orders)
    wo = waves.above[rows].real
    powers = (
        np.sum(np.abs(b) ** 2, axis=(1, 2)) for b in (first, boundary.small_slope(WI, wo, index))
    )
    assert next(powers) == pytest.approx(next(powers), rel=1e-9)
    # heights that are moved up turn the phase: B₂(k, k0; k) + B₂(k, k0; k0) = −2 Q B
    kappa = (WI[2] + wo[:, 2])[:, None, None]
    both = second[range(len(rows)), rows] + second[:, waves.zeroth]
    assert both == pytest.approx(-2 * kappa * first, rel=1e-9, abs=1e-9)


def test_on_scales_it_leaves_half_of_the_first_order_and_puts_the_light_right():
    cases = [c for c in cases_of_cells("keratin", ["elaphe_like"]) if c.group.endswith("0.2")]
    assert len(cases) == 3
    for case in cases:
        assert case.deviation["second"] < 0.55 * case.deviation["first"]
    missed = {name: max(abs(case.light[name] - 1) for case in cases) for name in MODELS}
    assert missed["second"] < 0.5 * missed["first"]
    assert missed["mean"] < 0.5 * missed["first"]


def test_most_of_it_changes_sign_where_hills_are_made_pits():
    one = next(
        solution
        for solution in solved("keratin")[0]
        if solution.case.surface.kind == "elaphe_like" and solution.case.theta == 60.0
    )
    field = cell(one.case.surface)
    orders = np.stack([one.rows["mx"], one.rows["my"]], axis=1).astype(int)
    coloured = orders.any(axis=1)
    changes = []
    for sign in (1, -1):
        turned = HeightField(sign * field.heights, field.pixel_size)
        found = amplitudes(turned, 1.56, one.case.wavelength, one.wi, one.wo(field), orders)
        powers = [np.linalg.norm(found[name], axis=(1, 2)) ** 2 for name in ("first", "second")]
        changes.append((powers[1] - powers[0])[coloured])
    hills, pits = changes
    assert np.abs(hills - pits).sum() > 1.5 * np.abs(hills + pits).sum()


def test_as_a_factor_it_takes_most_of_the_error_on_a_cd():
    cases = list(compare_cells(["cd_pits"], FACTOR[:2]))
    for slope, first, left in ((0.2, 0.3, 0.08), (0.06, 0.07, 0.02)):
        same = [c for c in cases if c.group.endswith(f"slope {slope:g}, from 60°")]
        assert len(same) == 2
        assert np.mean([c.deviation[FACTOR[0]] for c in same]) > first
        assert np.mean([c.deviation[FACTOR[1]] for c in same]) < left
