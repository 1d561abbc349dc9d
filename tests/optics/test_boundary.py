"""Jones matrices of pairs of directions: limits, symmetries, Mitsuba's conventions, the blend."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.blend import NODES_PER_OCTAVE, ScaleRoughness
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from mitsuba_diffraction.reference import boundary, fresnel, model
from tests.support.directions import polar, rough_patch
from tests.support.matrices import MATRICES, REVERSED, pairs

BARE = (1.5, 0.8, 0.65 + 5.6j)
DEPTHS = np.random.default_rng(4).uniform(0.1, 6.0, 300)
FILMED = [Filmed(index, film, DEPTHS) for index in BARE for film in (1.45, 0.7, 2.4 + 0.1j)]


@pytest.mark.parametrize("index", [*BARE, *FILMED])
@pytest.mark.parametrize("matrix", MATRICES)
def test_in_the_mirror_direction_it_is_fresnel_s(matrix, index):
    wi, _ = pairs()
    r_s, r_p = fresnel.amplitudes(wi[:, 2], index)
    found = matrix(wi, wi * [-1, -1, 1], index)
    expected = np.stack([r_s, 0 * r_s, 0 * r_s, r_p], -1).reshape(-1, 2, 2)
    assert found == pytest.approx(expected, abs=1e-13 if index in BARE else 1e-12)  # rounding


@pytest.mark.parametrize("index", [*BARE, *FILMED])
@pytest.mark.parametrize("matrix", MATRICES)
def test_reciprocity(matrix, index):
    wi, wo = pairs()
    there, back = matrix(wi, wo, index), matrix(wo, wi, index)
    scale = np.abs(there).max()
    assert back == pytest.approx(REVERSED * np.swapaxes(there, -1, -2), abs=1e-13 * scale)


@pytest.mark.parametrize("index", BARE)
def test_kirchhoff_s_power_is_the_scalar_form_with_fresnel_at_the_half_vector(index):
    wi, wo = pairs()
    power = boundary.unpolarised(model.kirchhoff(wi, wo, index))
    w = wi[:, 2] + wo[:, 2]
    cos_half = np.sqrt(0.5 * (1 + np.sum(wi * wo, axis=1)))
    sigma, wavelength = 1.0, 1000.0  # λ²A is then π
    scalar = kirchhoff_factor(wi, wo, wavelength, sigma) * np.pi
    expected = fresnel.reflectance(cos_half, index) * scalar
    assert 4 * wi[:, 2] * wo[:, 2] * power / w**2 == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("index", [1.5, 0.65 + 5.6j])
def test_near_the_mirror_both_agree_to_first_order_cross_terms_included(index):
    # Kirchhoff's cross terms are rotations of axes: their signs are those of geometry
    wi, _ = pairs()
    wi = wi[wi[:, 2] > 0.3]
    aside = np.random.default_rng(5).normal(size=wi.shape)
    differences = []
    for step in (1e-3, 1e-4):
        wo = wi * [-1, -1, 1] + step * aside
        wo /= np.linalg.norm(wo, axis=1, keepdims=True)
        both = [matrix(wi, wo, index) for matrix in MATRICES]
        differences.append(np.abs(both[0] - both[1]).max())
        assert np.abs(both[0][:, 0, 1]).max() > 0.01 * step  # there is something to compare
    assert differences[1] < 0.015 * differences[0]  # quadratic: 0.01, and a little of the cubic


def test_a_mueller_matrix_does_to_stokes_vectors_what_the_jones_matrix_does_to_fields():
    rng = np.random.default_rng(1)
    jones = rng.normal(size=(20, 2, 2)) + 1j * rng.normal(size=(20, 2, 2))
    field = rng.normal(size=(20, 2)) + 1j * rng.normal(size=(20, 2))
    after = np.einsum("nij,nj->ni", jones, field)
    found = np.einsum("nij,nj->ni", boundary.mueller(jones), stokes(field))
    assert found == pytest.approx(stokes(after), rel=1e-12)
    assert boundary.mueller(jones)[:, 0, 0] == pytest.approx(boundary.unpolarised(jones))


def stokes(field: np.ndarray) -> np.ndarray:
    """Stokes vectors (n, 4) of fields (n, 2) as `boundary.mueller` has them."""
    s, p = field[:, 0], field[:, 1]
    cross = s * p.conj()
    plus, minus = abs(s) ** 2 + abs(p) ** 2, abs(s) ** 2 - abs(p) ** 2
    return np.stack([plus, minus, 2 * cross.real, 2 * cross.imag], -1)


@pytest.mark.parametrize("matrix", MATRICES)
def test_axes_of_stokes_vectors_turn_as_mitsuba_s_do(matrix):
    # a facet's own matrix, turned by Mitsuba's functions as roughconductor does it
    import mitsuba as mi

    mi.set_variant("scalar_spectral_polarized")
    wi, wo = polar(40, 10), polar(38, 195)
    half = (wi + wo) / np.linalg.norm(wi + wo)
    cosine = float(wi @ half)
    facet = mi.mueller.specular_reflection(cosine, mi.Complex2f(0.65, 5.6))
    s_in, s_out = boundary.polarisation_axes(wi, wo)
    theirs = np.array(mi.mueller.rotate_mueller_basis(
        facet,
        mi.Vector3f(-wi), mi.Vector3f(unit(np.cross(half, -wi))), mi.Vector3f(s_in),
        mi.Vector3f(wo), mi.Vector3f(unit(np.cross(half, wo))), mi.Vector3f(s_out),
    ))  # fmt: skip
    mine = boundary.mueller(matrix(wi, wo, 0.65 + 5.6j))
    assert abs(theirs[0, 2]) > 1e-3  # there is something to turn
    # near the mirror both matrices are alike to second order (4e-3); Kirchhoff's exactly
    tolerance = 5e-6 if matrix is model.kirchhoff else 2e-2
    assert mine / mine[0, 0] == pytest.approx(theirs / theirs[0, 0], abs=tolerance)


def unit(vector: np.ndarray) -> np.ndarray:
    """The vector at length 1."""
    return vector / np.linalg.norm(vector)


#: M/M₀₀ of orders 1 and −1 of a sinusoid of 2.5/0.025 µm, index 1.56, 550 nm, light at 50° and −35°
#: from x, from coupled waves: pySCATMECH 0.1.10, RCW_Model (Sinusoidal_Relief_Grating, order 12, 40
#: levels, rotation 35), whose circular polarisation has the other sign (here 0.006 at most).
CONICAL = {
    1: [
        [1.0, 0.7111, 0.2041, -0.0010],
        [0.7075, 0.8650, 0.4529, -0.0032],
        [0.2162, 0.4584, -0.5378, 0.0023],
        [-0.0011, -0.0015, -0.0037, -0.6728],
    ],
    -1: [
        [1.0, 0.9625, -0.2554, -0.0017],
        [0.9604, 0.9383, -0.2241, -0.0001],
        [-0.2632, -0.2329, 0.1529, 0.0057],
        [-0.0016, -0.0027, -0.0049, 0.0913],
    ],
}


#: The same of 40 nm, index 1.56 under 100 nm of 2.4, light at 50° and −30° from x, by grcwa 0.1.2
#: (31 orders, 24 layers, both faces).
CONICAL_FILM = {
    1: [
        [1.0, 0.474, 0.1406, 0.0133],
        [0.4822, 0.8796, 0.4575, 0.07],
        [0.1102, 0.4527, -0.7246, -0.1937],
        [-0.0011, -0.0384, 0.2019, -0.8445],
    ],
    -1: [
        [1.0, 0.799, -0.143, 0.0247],
        [0.7757, 0.9197, -0.2999, -0.0807],
        [-0.2369, -0.3381, -0.3076, -0.4332],
        [0.04, 0.137, 0.42, -0.3833],
    ],
}


@pytest.mark.parametrize(
    ("index", "azimuth", "expected", "tolerance"),
    # the gratings have a depth, and circular terms of their staircases
    [
        (1.56, -35, CONICAL, 7e-3),
        (Filmed(1.56, 2.4, 2 * np.pi * 100 / 550), -30, CONICAL_FILM, 0.012),
    ],
    ids=["bare", "film"],
)
def test_between_the_planes_of_incidence_it_has_the_signs_of_coupled_waves(
    index, azimuth, expected, tolerance
):
    wi = polar(50, azimuth)
    for order, matrix in expected.items():
        x, y = order * 0.55 / 2.5 - wi[0], -wi[1]
        wo = np.array([x, y, np.sqrt(1 - x * x - y * y)])
        found = boundary.mueller(model.small_slope(wi, wo, index))
        assert found / found[0, 0] == pytest.approx(np.array(matrix), abs=tolerance)


PATCH = rough_patch((40, 56), (0.11, 0.09), 0.3)


def roughness() -> ScaleRoughness:
    return ScaleRoughness.from_heights(PATCH.heights, PATCH.pixel_size)


def test_it_is_the_sum_over_all_components():
    power = np.abs(np.fft.fft2(PATCH.heights) / PATCH.heights.size) ** 2
    ny, nx = PATCH.shape
    qx = 2 * np.pi * np.fft.fftfreq(nx, PATCH.pixel_size[0])
    qy = 2 * np.pi * np.fft.fftfreq(ny, PATCH.pixel_size[1])[:, None]
    power[0, 0] = 0
    for q in (0.3, 2.0, 7.0, 30.0):
        ratio = np.hypot(qx, qy) / q
        share = (1 - np.exp(-((4 * ratio) ** 4))) * np.exp(-((ratio / 2) ** 4))
        # components are told apart to 1/256 of an octave
        assert roughness().at(q) == pytest.approx((power * share).sum(), rel=1e-5)
    assert roughness().at(0.0) == 0.0


def test_several_patches_have_the_mean_of_their_roughness():
    other = ScaleRoughness.from_heights(2 * PATCH.heights[:, ::-1], PATCH.pixel_size)
    q = np.geomspace(0.1, 35, 20)
    both = ScaleRoughness.mean([roughness(), other])
    assert both.at(q) == pytest.approx(2.5 * roughness().at(q), rel=1e-9)
    assert np.all(np.diff(both.frequency) >= 0)


@pytest.mark.parametrize("index", [1.56, 0.65 + 5.6j])
def test_smooth_surfaces_follow_small_slope_and_rough_ones_kirchhoff(index):
    wi, wo = polar(60, 0), polar(20, 100)
    gentle, tangent = model.small_slope(wi, wo, index), model.kirchhoff(wi, wo, index)
    smooth = (model.small_slope_weight(20.0, rms**2, index) for rms in (0.0, 0.001))
    assert np.array_equal(model.blended(wi, wo, index, next(smooth)), gentle)
    assert model.blended(wi, wo, index, next(smooth)) == pytest.approx(gentle, abs=1e-3)
    rough = model.blended(wi, wo, index, model.small_slope_weight(20.0, 1.0, index))
    assert np.array_equal(rough, tangent)


def test_a_table_of_nodes_interpolates_to_it():
    exact = roughness()
    table = exact.table(35.0)
    q = np.geomspace(0.01, 35.0, 2000)
    assert table.first + (len(table.nodes) - 1) / NODES_PER_OCTAVE >= np.log2(35.0)
    assert table.at(q) == pytest.approx(exact.at(q), abs=5e-4 * table.nodes.max())
    assert table.at(0.0) < 1e-30
