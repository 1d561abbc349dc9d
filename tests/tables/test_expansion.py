"""Series in κ: they interpolate, and keep their relative accuracy where light fades."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import factorial, jv

from mitsuba_diffraction.tables.expansion import Expansion, series_sum


def chebyshev(terms=8, intervals=3, kind="power", kappa_max=30.0):
    return Expansion("chebyshev", kind, terms, intervals, kappa_max, 0.2)


def series(expansion, function, kappa, specular):
    """A function's series at κ; `specular` says whether it is that of order 0."""
    kappa = np.asarray(kappa, float)
    result = np.empty_like(kappa)
    for n, k in enumerate(kappa):
        interval = int(expansion.interval(k))
        taken_out = float(expansion.order_0_offset(interval)) if specular else 0.0
        values = function(expansion.nodes(interval)) - taken_out
        result[n] = expansion.weights(k) @ (values @ expansion.fit(interval)) + taken_out
    return result


@given(st.integers(1, 40), st.integers(1, 50), st.sampled_from(["power", "amplitude"]))
def test_a_series_goes_through_its_nodes(terms, intervals, kind):
    expansion = chebyshev(terms, intervals, kind)
    for interval in {0, intervals // 2, intervals - 1}:
        nodes = expansion.nodes(interval)
        values = np.cos(np.arange(terms))
        if interval == 0:  # light that leaves the mirror direction fades as κ², its amplitude as κ
            values *= (nodes / expansion.length) ** (2 if kind == "power" else 1)
        coefficients = values @ expansion.fit(interval)
        # κ is known to ε of itself, that is 2·ε·intervals of [−1, 1], where a polynomial of n terms
        # that is at most 3 (Lebesgue's constant) changes by up to 3·n² times that (Markov)
        rounding = 1e-14 + 6 * terms**2 * intervals * np.finfo(float).eps
        assert expansion.weights(nodes) @ coefficients == pytest.approx(values, abs=rounding)


def test_intervals_tile_the_range_of_kappa():
    expansion = chebyshev(intervals=4, kappa_max=8.0)
    assert list(expansion.interval([0.0, 1.9, 2.1, 7.9, 8.0, 9.0])) == [0, 0, 1, 3, 3, 3]
    for interval in range(4):
        for points in (expansion.nodes(interval), expansion.extrema(interval)):
            assert np.all(expansion.interval(points) == interval)
            assert np.all((points > 2.0 * interval) & (points < 2.0 * (interval + 1)))


def test_the_error_is_looked_for_between_the_nodes():
    expansion = chebyshev()
    nodes, extrema = np.sort(expansion.nodes(1)), np.sort(expansion.extrema(1))
    assert np.all(extrema[:-1] < nodes)
    assert np.all(nodes < extrema[1:])


@pytest.mark.parametrize("order", [0, 1, 3])
def test_orders_of_a_sinusoid_are_met_at_every_depth(order):
    # |a_m|² = J_m²(κh₀), with κh₀ up to 6
    def power(kappa):
        return jv(order, 0.2 * kappa) ** 2

    kappa = np.linspace(0.0, 30.0, 400)
    approximate = series(chebyshev(terms=10, intervals=4), power, kappa, specular=order == 0)
    # J² oscillates by up to e^{2iκh₀}: x = 1.5 an interval, so T₁₀ has a weight 2J₁₀(1.5)·½ = 2e-8
    assert np.abs(approximate - power(kappa)).max() < 3e-7


def test_what_leaves_the_specular_order_keeps_its_relative_accuracy_as_it_fades():
    def power(kappa):
        return jv(1, 0.2 * kappa) ** 2

    kappa = np.array([1e-6, 1e-4, 1e-2, 1.0])  # down to powers of 1e-14
    approximate = series(chebyshev(terms=10, intervals=4), power, kappa, specular=False)
    assert approximate == pytest.approx(power(kappa), rel=1e-6)  # 3e-7 of it, as above


def test_at_kappa_zero_there_is_only_the_mirror():
    for basis in ("taylor", "chebyshev"):
        expansion = Expansion(basis, "amplitude", 6, 1, 30.0, 0.2)
        assert np.array_equal(expansion.weights(0.0), np.zeros(6))
        assert expansion.order_0_offset(0) == 1.0


def test_taylor_weights_are_powers_over_factorials():
    expansion = Expansion("taylor", "amplitude", 30, 1, 50.0, 0.2)
    for kappa in (0.01, 3.0, 50.0):
        n = np.arange(1, 31)
        expected = (0.2 * kappa) ** n / factorial(n)
        # logarithms of up to 70 are exact to 1e-14
        assert expansion.weights(kappa) == pytest.approx(expected, rel=1e-13)


def test_weights_keep_the_shape_of_kappa():
    assert chebyshev().weights(np.ones((2, 5))).shape == (2, 5, 8)
    assert chebyshev().weights(3.0).shape == (8,)


@pytest.mark.parametrize("kappas", [(), (1,), (4,)])
def test_series_of_all_bins_are_summed_at_each_kappa(kappas):
    generator = np.random.default_rng(0)
    coefficients = generator.random((3, 7, 2, 5), np.float32)
    weights = generator.random((*kappas, 5), np.float32)
    sums = series_sum(coefficients, weights)
    exact = np.moveaxis(coefficients.astype(float) @ weights.astype(float).T, -1, 0)
    expected = exact if kappas else coefficients.astype(float) @ weights.astype(float)
    assert sums.shape == (*kappas, 3, 7, 2)
    np.testing.assert_allclose(sums, expected, rtol=1e-6)  # single precision
