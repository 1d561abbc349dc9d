"""The model in one file, materials in all models, and what surrounds it: transmission, coats."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import reference
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.optics.mirror import horizon_correction
from mitsuba_diffraction.reference import boundary, fresnel, model, through
from mitsuba_diffraction.reference.coat import refracted, transmitted
from mitsuba_diffraction.reference.fresnel import amplitudes
from tests.support.directions import polar, rough_patch
from tests.support.matrices import pairs

FIELD = rough_patch((12, 15), (0.13, 0.15), 0.3)
WI, WO = (directions[::6] for directions in pairs())
LIGHT = model.Light(WI, WO, np.linspace(400.0, 700.0, len(WI)))
INDICES = [np.full(len(WI), n, complex) for n in (1.5, 0.8, 0.65 + 5.6j)]
KERATIN, ALUMINIUM = {"eta": 1.56}, {"eta": 0.65, "k": 5.6}


@pytest.mark.parametrize("index", INDICES)
def test_fields_at_a_bare_interface_make_the_matrix_of_equation_8(index):
    """In the form in which first-order small slope is published; a film has more fields."""
    (x0, y0, _), (x, y, _) = (axis.T for axis in boundary.polarisation_axes(WI, WO))
    dot, cross = x0 * x + y0 * y, x0 * y - y0 * x
    (t0, q0), (t, q) = ((np.hypot(w[:, 0], w[:, 1]), w[:, 2]) for w in (WI, WO))
    epsilon = index * index
    inside0, inside = (np.sqrt(epsilon - sine**2) for sine in (t0, t))
    s0, s, p0, p = q0 + inside0, q + inside, epsilon * q0 + inside0, epsilon * q + inside
    pp = (inside * inside0 * dot - epsilon * t * t0) / (p * p0)
    expected = [[-dot / (s * s0), inside0 * cross / (s * p0)], [inside * cross / (p * s0), pp]]
    found = np.moveaxis(model.small_slope(WI, WO, index), 0, -1)
    assert found == pytest.approx((epsilon - 1.0) * np.array(expected))


def test_the_reference_s_default_is_the_model():
    light = {"eta": 1.5, "coherence_width": 2.0}
    found = reference.brdf(FIELD, WI, WO, LIGHT.wavelength, **light)
    expected = model.default_brdf(
        FIELD, LIGHT, INDICES[0], reference.Sigmas(sigma_of(2.0), sigma_of(2.0))
    )
    assert np.array_equal(found, expected)
    matrices = reference.mueller(FIELD, WI, WO, LIGHT.wavelength, **light)
    assert matrices[:, 0, 0] == pytest.approx(found)


def test_small_slope_is_the_default_where_there_is_an_index():
    light = {"coherence_width": 2.0}
    pair = WI[:4], WO[:4], 550.0
    for material, name in (({"eta": 0.7, "k": 5.0}, "small_slope"), ({}, "kirchhoff")):
        default, told = (
            reference.brdf(FIELD, *pair, **light, **material, **model)
            for model in ({}, {"model": name})
        )
        assert np.array_equal(default, told)
    through = WI[:4], -WO[:4], 550.0
    assert np.array_equal(
        reference.btdf(FIELD, *through, eta=1.5),
        reference.btdf(FIELD, *through, eta=1.5, model="small_slope"),
    )


@pytest.mark.parametrize("coat", [None, 1.58])
@pytest.mark.parametrize("model", reference.MODELS)
def test_the_first_entry_of_the_mueller_matrix_is_the_brdf(model, coat):
    wi, wo = polar(50, 30), polar(35, 100)
    matrix = reference.mueller(FIELD, wi, wo, 520.0, model=model, coat=coat, **ALUMINIUM)
    found = reference.brdf(FIELD, wi, wo, 520.0, model=model, coat=coat, **ALUMINIUM)
    assert matrix.shape == (1, 4, 4)
    assert matrix[:, 0, 0] == pytest.approx(found, rel=1e-12)


def test_below_the_surface_there_is_no_light_in_any_model():
    below = np.array([0.6, 0.0, -0.8])
    for coherence in reference.COHERENCES:
        for pair in ((polar(30), below), (below, polar(30)), (below, below)):
            assert reference.brdf(FIELD, *pair, 520.0, coherence=coherence) == 0.0
    for name in reference.MODELS:
        assert reference.brdf(FIELD, polar(30), below, 520.0, model=name, **KERATIN) == 0.0
        assert np.all(reference.mueller(FIELD, below, polar(3), 520.0, model=name, **KERATIN) == 0)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"model": "small_slope"}, "eta"),
        ({"eta": 0.0}, "eta"),
        ({"eta": np.nan}, "eta"),
        ({"eta": 1.5, "k": -1.0}, "k="),
        ({"eta": [1.5, 1.6]}, "eta"),
    ],
)
def test_a_model_or_index_that_is_none_is_refused(arguments, word):
    with pytest.raises(DiffractionError, match=word):
        reference.brdf(FIELD, polar(30), polar(10), 520.0, **arguments)


THROUGH = (through.small_slope, through.kirchhoff)
N = 1.5


def passed(wi: np.ndarray) -> np.ndarray:
    """Where the flat interface sends light along −ωi."""
    tangential = -wi[:, :2] / N
    return np.column_stack([tangential, -np.sqrt(1 - np.sum(tangential**2, axis=1))])


@pytest.mark.parametrize("matrix", THROUGH)
def test_in_the_refracted_direction_it_is_fresnel_s(matrix):
    wi, _ = pairs()
    wo = passed(wi)
    cos_i, cos_t = wi[:, 2], -wo[:, 2]
    t_s, t_p = 2 * cos_i / (cos_i + N * cos_t), 2 * cos_i / (N * cos_i + cos_t)
    scale = (N * cos_t - cos_i) / (2 * cos_i)
    expected = np.stack([t_s, 0 * t_s, 0 * t_s, t_p], -1).reshape(-1, 2, 2)
    assert matrix(wi, wo, N) == pytest.approx(scale[:, None, None] * expected, abs=1e-13)


def test_near_the_refracted_direction_both_agree_cross_terms_included():
    wi, _ = pairs()
    wi = wi[wi[:, 2] > 0.3]
    aside = np.random.default_rng(5).normal(size=wi.shape)
    differences = []
    for step in (1e-3, 1e-4):
        wo = passed(wi) + step * aside
        wo /= np.linalg.norm(wo, axis=1, keepdims=True)
        both = [matrix(wi, wo, N) for matrix in THROUGH]
        differences.append(np.abs(both[0] - both[1]).max())
        assert np.abs(both[0][:, 0, 1]).max() > 0.01 * step  # there is something to compare
    assert differences[1] < 0.015 * differences[0]  # quadratic: 0.01, and a little of the cubic


@pytest.mark.parametrize("theta", [0.0, 50.0, 80.0])
def test_a_flat_sheet_lets_through_what_two_mirrors_do(theta):
    wi = polar(theta, 30.0)
    cos_t = np.sqrt(1 - (1 - wi[2] ** 2) / N**2)
    t_s, t_p = 2 * wi[2] / (wi[2] + N * cos_t), 2 * wi[2] / (N * wi[2] + cos_t)
    found = through.out_of_sheet(np.diag([t_s, t_p]), wi, -wi, N)
    powers = np.abs(np.diag(found)) ** 2 * N * cos_t / wi[2]
    single = np.abs(np.stack(fresnel.amplitudes(wi[2], N))) ** 2
    assert powers == pytest.approx((1 - single) / (1 + single), rel=1e-12)


@pytest.mark.parametrize("index", [0.6 + 4j, 1.3, 2.0])
@pytest.mark.parametrize("theta", [0.0, 40.0, 80.0])
def test_a_coat_and_a_mirror_reflect_what_their_bounces_add_up_to(theta, index):
    wi = polar(theta)
    inside = refracted(wi, 1.58)[2]
    found = transmitted(np.diag(amplitudes(inside, index)), wi, wi * [-1, -1, 1], 1.58, index)
    for n in range(2):
        face = np.abs(amplitudes(wi[2], 1.58)[n]) ** 2
        structure = np.abs(amplitudes(inside, index)[n]) ** 2
        series = sum((1 - face) ** 2 * structure * (face * structure) ** m for m in range(200))
        assert np.abs(found[n, n]) ** 2 == pytest.approx(series, rel=1e-9)


@pytest.mark.parametrize("index", [0.05 + 4j, 0.6 + 4j])
def test_under_a_coat_no_light_is_gained_whatever_the_structure_does_with_it(index):
    angles = np.linspace(0.0, 89.9, 60)
    wi, wo = np.meshgrid(angles, angles)
    wi, wo = polar(wi.ravel()).T, polar(wo.ravel()).T
    # all that a mirror would reflect of either polarisation goes to ωo
    mirror = np.abs(np.stack(amplitudes(refracted(wi, 1.58)[:, 2], index))) ** 2
    most = np.abs(transmitted(np.ones((len(wi), 2, 2)), wi, wo, 1.58, index)) ** 2
    face = np.abs(np.stack(amplitudes(wi[:, 2], 1.58))) ** 2
    for out in range(2):
        for into in range(2):
            assert np.all(face[into] + most[:, out, into] * mirror[into] < 1.0 + 1e-9)


def test_the_fit_at_the_horizon_satisfies_its_equation():
    """C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) C(Y) = 1."""
    nodes, reach = 1600, 9.0
    x = (np.arange(nodes) + 0.5) * reach / nodes
    kernel = np.exp(-((x[:, None] ** 2 - x**2) ** 2) / 4) / np.sqrt(np.pi) * x * reach / nodes
    c = horizon_correction(x**2, np.full_like(x, 99.0), np.float64(1.0))  # C = 1 at the other end
    inside = x < reach - 2.0  # the sum misses what lies beyond
    # the fit is to 0.06 %; a C that is 0.1 % off, with any course, misses 1 by 0.0016 or more
    np.testing.assert_allclose((c * (kernel @ c))[inside], 1.0, atol=0.001)
