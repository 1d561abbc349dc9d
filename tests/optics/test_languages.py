"""Formulas of `optics` in NumPy and Dr.Jit against the float64 judges of `reference`."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics import boundary, coat, through
from mitsuba_diffraction.optics.arithmetic import of, squared
from mitsuba_diffraction.optics.blend import kirchhoff_weight
from mitsuba_diffraction.optics.boundary import Heights, geometry
from mitsuba_diffraction.optics.fresnel import Filmed, amplitudes, normal_reflectance
from mitsuba_diffraction.reference import boundary as judge
from mitsuba_diffraction.reference import coat as coat_judge
from mitsuba_diffraction.reference import fresnel as fresnel_judge
from mitsuba_diffraction.reference import model as model_judge
from mitsuba_diffraction.reference import through as through_judge
from tests.support.matrices import pairs

WI, WO = pairs(2000)
KAPPA, VARIANCE = np.random.default_rng(4).uniform([[1.0], [1e-6]], [[20.0], [0.02]], (2, 2000))
INDICES = {
    "dielectric": 1.5 + 0j,
    "total reflection": 0.7 + 0j,
    "aluminium": 0.65 + 5.6j,
    "weak absorber": 1.2 + 0.3j,
    "film": Filmed(1.5 + 0j, 1.35 + 0j, 3.2),
    "film on a metal": Filmed(0.65 + 5.6j, 2.1 + 0.05j, 1.1),
}
ENTRIES = (0, 0), (0, 1), (1, 0), (1, 1)
SCALE = 2.0 * WI[:, 2] * WO[:, 2]


def numpy_numbers(index):
    return tuple(WI.T), tuple(WO.T), index, Heights(KAPPA, VARIANCE)


def kernel_numbers(index):
    import mitsuba as mi

    def number(n):
        return mi.Complex2f(n.real, n.imag)

    def column(values):
        return mi.Float(np.ascontiguousarray(values, np.float32))

    if isinstance(index, Filmed):
        index = Filmed(number(index.index), number(index.film), mi.Float(index.depth))
    else:  # real where no light is reflected totally, as the plugin has it
        index = mi.Float(index.real) if index == 1.5 else number(index)
    ends = (tuple(map(column, w.T)) for w in (WI, WO))
    return *ends, index, Heights(column(KAPPA), column(VARIANCE))


def agree(jones, expected, kernel):
    """Compare 2 cosθi cosθo J of either kind of numbers with matrices (n, 2, 2)."""
    expected = expected * SCALE[:, None, None]
    largest = np.abs(expected).max()
    powers = boundary.power(jones)
    if kernel:
        import drjit as dr

        dr.eval(jones, powers)  # one kernel for all
    for entry, place in zip(jones, ENTRIES, strict=True):
        array = np.asarray(entry)
        if kernel and array.ndim == 2:
            array = array[0] + 1j * array[1]
        error = np.abs(array - expected[:, place[0], place[1]]).max() / largest
        # double precision's sums; or those of single precision, of numbers up to `largest`
        assert error < (1e-5 if kernel else 1e-12), (place, error)
    powers = np.asarray(powers, np.float64)
    want = judge.unpolarised(expected)
    # of the largest, and of each that is not lost in the largest's rounding
    assert np.abs(powers - want).max() < (1e-5 if kernel else 1e-12) * want.max()
    seen = want > 1e-6 * want.max()
    assert np.abs(powers[seen] / want[seen] - 1.0).max() < (1e-3 if kernel else 1e-12)


@pytest.fixture(params=["numpy", "kernel"])
def numbers(request):
    if request.param == "numpy":
        return numpy_numbers, False
    request.getfixturevalue("some_variant")
    return kernel_numbers, True


@pytest.mark.parametrize("name", INDICES)
@pytest.mark.parametrize("matrix", ["kirchhoff", "small_slope"])
def test_matrices_are_those_of_the_reference(matrix, name, numbers):
    of, kernel = numbers
    wi, wo, index, _ = of(INDICES[name])
    expected = getattr(model_judge, matrix)(WI, WO, INDICES[name])
    agree(getattr(boundary, matrix)(geometry(wi, wo), index), expected, kernel)


@pytest.mark.parametrize("name", INDICES)
def test_the_default_model_is_the_blend_of_the_reference(name, numbers):
    of, kernel = numbers
    wi, wo, index, heights = of(INDICES[name])
    s = model_judge.small_slope_weight(KAPPA, VARIANCE, INDICES[name])
    jones = boundary.MODELS["small_slope"].jones(geometry(wi, wo), index, heights)
    weight = kirchhoff_weight(*heights, normal_reflectance(index))
    agree(jones, model_judge.blended(WI, WO, INDICES[name], s), kernel)
    # 1 − s is exact where it is small: its own relative error counts
    x = -np.expm1(np.log(np.maximum(s, 1e-300)))
    large = x > 1e-4
    assert np.abs(np.asarray(weight)[large] / x[large] - 1.0).max() < (1e-4 if kernel else 1e-10)


@pytest.mark.parametrize("name", ["dielectric", "aluminium", "weak absorber"])
def test_a_coat_s_face_is_that_of_the_reference(name, numbers):
    of, kernel = numbers
    wi, wo, index, _ = of(INDICES[name])
    n = 1.3
    inside = [coat.refracted(w, n) for w in (wi, wo)]
    pair, faces = geometry(*inside), [coat.crossing(w[2], n) for w in (wi, wo)]
    jones = coat.transmitted(boundary.kirchhoff(pair, index), pair, index, *faces)
    below = [coat_judge.refracted(w, n) for w in (WI, WO)]
    expected = coat_judge.transmitted(
        model_judge.kirchhoff(*below, INDICES[name]), WI, WO, n, INDICES[name]
    )
    expected = expected * (below[0][:, 2] * below[1][:, 2] / (WI[:, 2] * WO[:, 2]))[:, None, None]
    agree(jones, expected, kernel)


@pytest.mark.parametrize("part", ["kirchhoff", "small_slope", "order_0", "sheet"])
def test_light_that_goes_through_is_that_of_the_reference(part, numbers):
    of, kernel = numbers
    n = 1.5
    wi, wo, _, _ = of(n + 0j)
    wo = wo[0], wo[1], -wo[2]
    down = WO * [1, 1, -1]
    pair = geometry(wi, wo)
    if part == "kirchhoff":
        jones, expected = through.kirchhoff(pair, wi, wo, n), through_judge.kirchhoff(WI, down, n)
    elif part == "small_slope":
        outside = through.outside_square(pair, n)
        if kernel:
            import mitsuba as mi

            outside = mi.Complex2f(outside, 0.0)
        jones = through.small_slope(pair, n, outside)
        expected = through_judge.small_slope(WI, down, n)
    else:
        cosines = wi[2], -wo[2]
        jones = through.order_0(pair, through.flat_transmittances(wi[2], n, True))
        passed = through_judge.flat_transmittances(WI[:, 2], n, thin=True)
        expected = through_judge.order_0(WI, down, passed)
        if part == "sheet":
            jones = through.out_of_sheet(jones, n, *cosines)
            expected = through_judge.out_of_sheet(expected, WI, down, n)
        expected = expected / SCALE[:, None, None]
    agree(jones, expected, kernel)


@pytest.mark.parametrize("name", INDICES)
def test_fresnel_s_coefficients_are_those_of_the_reference(name, numbers):
    of, kernel = numbers
    wi, _, index, _ = of(INDICES[name])
    expected = fresnel_judge.amplitudes(WI[:, 2], INDICES[name])
    for got, want in zip(amplitudes(wi[2], 1.0 - wi[2] * wi[2], index), expected, strict=True):
        array = np.asarray(got)
        array = array[0] + 1j * array[1] if kernel and array.ndim == 2 else array
        assert np.abs(array - want).max() < (1e-5 if kernel else 1e-12)


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


def test_an_unknown_kind_is_refused():
    with pytest.raises(TypeError, match="no arithmetic of str"):
        of("1.0")
