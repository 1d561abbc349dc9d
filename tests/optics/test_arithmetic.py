"""The arithmetics of formulas: one function, the same values for every kind of numbers."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.arithmetic import is_complex, of, squared

REALS = np.array([0.3, 1.0, 2.7])


def formula(x, n):
    """Every function of an arithmetic."""
    xp = of(x, n)
    y = xp.sqrt(x) + xp.exp(-x) * xp.exp2(x) - xp.log2(x) * xp.sin(x) + xp.cos(x) * xp.floor(x)
    y = xp.fma(y, x, xp.minimum(x, 1.5)) + xp.absolute(xp.maximum(-x, -2.0))
    z = xp.reciprocal(n * y + xp.complex(x, 1.0)) + xp.reciprocal(xp.clip(x, 0.5, 2.0))
    return squared(z) + xp.where((x > 0.5) & (x <= 2.0), squared(y), 0.0)


def test_plain_numbers_are_as_arrays():
    n = 0.6 + 5.6j
    whole = formula(REALS, n)
    one_by_one = [formula(float(x), n) for x in REALS]
    assert all(isinstance(value, float) for value in one_by_one)
    np.testing.assert_allclose(one_by_one, whole, rtol=1e-14)


def test_kernels_are_as_arrays(some_variant):
    import mitsuba as mi

    n = mi.Complex2f(0.6, 5.6)
    values = [np.ravel(formula(mi.Float(x), n))[0] for x in REALS.tolist()]
    np.testing.assert_allclose(values, formula(REALS, 0.6 + 5.6j), rtol=2e-6)  # single precision


def test_numbers_of_a_kernel_know_whether_they_are_complex(some_variant):
    import mitsuba as mi

    assert is_complex(mi.Complex2f(1.0, 2.0))
    assert not is_complex(mi.Float(1.0))


def test_an_unknown_kind_is_refused():
    with pytest.raises(TypeError, match="no arithmetic of str"):
        of("1.0")
