"""A mirror's lobe as Fresnel says, paths of light, and factors outside the integral."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.optics.boundary import Heights
from mitsuba_diffraction.optics.fresnel import reflectance
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from mitsuba_diffraction.optics.mirror import horizon_correction, mirror_cosine
from mitsuba_diffraction.optics.paths import ABOVE, Path, Returned, Side
from mitsuba_diffraction.reference import coat, fresnel
from tests.support.directions import polar

#: 2π/λ of 550 nm, rad/µm.
WAVENUMBER = 2e3 * np.pi / 550.0
#: Widths of windows in µm at 550 nm, as kσ₀.
SHARPNESS = [2e3 * np.pi / 550.0 * width / 4.0 for width in (6.4, 12.0, 65.0)]
INDICES = {"perfect": None, "Al": 0.96 + 6.69j, "Au": 0.43 + 2.4j, "own": 2.2 + 1.5j}
INDICES |= {"glass": 1.5, "water": 1.33, "diamond": 2.42}


def albedo(sharp: float, degrees: float, index: complex | None) -> float:
    """∫ f₀ cosθo dωo of a flat mirror under a window of this kσ₀, by quadrature over the lobe."""
    theta, nodes, reach = np.radians(degrees), 200, 5.0 / sharp
    sine = np.sin(theta)
    first = np.sqrt(1.0 - min(sine + reach, 1.0) ** 2)
    last = np.sqrt(1.0 - max(sine - reach, 0.0) ** 2)
    places = (np.arange(nodes) + 0.5) / nodes
    half = min(np.pi, 1.2 * reach / max(sine, 1e-3))
    cos_o, turn = np.meshgrid(first + (last - first) * places, half * (2.0 * places - 1.0))
    sin_o = np.sqrt(1.0 - cos_o**2)
    apart = sin_o**2 + sine**2 - 2.0 * sin_o * sine * np.cos(turn)
    lobe = sharp**2 / np.pi * np.exp(-(sharp**2) * apart) * cos_o
    cos_i, sigma_0 = np.full_like(cos_o, np.cos(theta)), np.float64(sharp / WAVENUMBER)
    if index is not None:
        dot = cos_i * cos_o - sine * sin_o * np.cos(turn)
        cosine = mirror_cosine(np.sqrt(0.5 * (1.0 + dot)), cos_i, cos_o, np.float64(sharp))
        lobe *= reflectance(cosine, np.asarray(index))
    lobe *= horizon_correction(sigma_0 * cos_i**2, sigma_0 * cos_o**2, WAVENUMBER)
    return float(lobe.sum() * (last - first) * 2.0 * half / nodes**2)


@pytest.mark.parametrize("name", INDICES)
@pytest.mark.parametrize("sharp", SHARPNESS)
def test_a_flat_mirror_reflects_what_fresnel_says(name, sharp):
    index = INDICES[name]
    for degrees in (0.0, 30.0, 60.0, 70.0, 80.0, 85.0, 88.0):
        flat = 1.0 if index is None else float(reflectance(np.cos(np.radians(degrees)), index))
        ratio = albedo(sharp, degrees, index) / flat
        # the fit of h: no h is right for all shapes of R within a lobe
        assert 1.0 - (0.10 if degrees > 85.0 else 0.03) < ratio < 1.012
        assert ratio * flat < 1.004  # never more than is received, but for C of a straight horizon


@pytest.mark.parametrize(
    ("nm", "index", "most"), [(650.0, 1.47 + 7.79j, 1.022), (800.0, 2.8 + 8.45j, 1.056)]
)
def test_a_lobe_reflects_the_mean_about_aluminium_s_minimum(nm, index, most):
    # its least R is at 84 to 86°, where a lobe of 6.4 µm is several degrees wide (docs/theory.md)
    sharp = 2e3 * np.pi / nm * 6.4 / 4.0
    for degrees in (80.0, 84.0, 85.0, 88.0):
        flat = float(reflectance(np.cos(np.radians(degrees)), index))
        assert 0.98 < albedo(sharp, degrees, index) / flat < most


RNG = np.random.default_rng(1)
COS_I, COS_O = RNG.uniform(0.1, 1.0, (2, 50))
TURN = RNG.uniform(-np.pi, np.pi, 50)
INSIDE, BEYOND_SHEET = Side(1.5, 1.5, below=True), Side(1.0, 1.5, below=True)


@pytest.mark.parametrize("below", [INSIDE, BEYOND_SHEET])
def test_light_takes_a_path_in_either_direction(below):
    down, up = (Path(1.5, "small_slope", *ends) for ends in ((ABOVE, below), (below, ABOVE)))
    turn = np.cos(TURN)
    heights = Heights(3.0, 0.02)
    forth = down.power(COS_I, COS_O, turn, heights)
    assert forth == pytest.approx(up.power(COS_O, COS_I, turn, heights))
    assert down.common(COS_I, COS_O, turn) == pytest.approx(up.common(COS_O, COS_I, turn))


def test_light_of_a_flat_sheet_adds_up_to_1():
    """Order 0 in the refracted direction: structure and flat side reflect, and both transmit."""
    # a lobe so narrow that none of it lies beyond the horizon
    light = COS_I, COS_I, -1.0, 10.0, 1e3
    passed, _ = Path(1.5, "small_slope", ABOVE, BEYOND_SHEET).mirrored(*light)
    back, _ = Returned(None, "small_slope", sheet=1.5).mirrored(*light)
    assert passed + back + fresnel.reflectance(COS_I, 1.5) == pytest.approx(1.0)


@pytest.mark.parametrize("below", [INSIDE, BEYOND_SHEET])
def test_a_lobe_is_divided_between_both_sides(below):
    """What the flat surface reflects and transmits adds up pair by pair, from above and below."""
    k, sigma_0, turn = 10.0, 1.0, np.cos(TURN)
    within = [np.sqrt(1.0 - (1.0 - c**2) / below.index**2) for c in (COS_I, COS_O)]
    reflected, _ = Path(1.5, "small_slope").mirrored(COS_I, COS_O, turn, k, sigma_0)
    passed, _ = Path(1.5, "small_slope", ABOVE, below).mirrored(COS_I, within[1], turn, k, sigma_0)
    if below.beyond_face:
        back = Returned(None, "small_slope", sheet=1.5)
        passed = passed + back.mirrored(COS_I, COS_O, turn, k, sigma_0)[0]
    else:
        back = Path(1.0 / 1.5, "small_slope", below, below)
        assert back.mirrored(*within, turn, k, sigma_0)[0] == pytest.approx(reflected)
    whole = horizon_correction(sigma_0 * COS_I**2, sigma_0 * COS_O**2, k)
    assert reflected + passed == pytest.approx(whole)


angles = st.tuples(st.floats(0.0, 89.9), st.floats(-180.0, 180.0))


@given(angles, angles, st.floats(360.0, 830.0))
def test_the_factor_is_positive_symmetric_and_as_written(incident, outgoing, lam):
    wi, wo = polar(*incident), polar(*outgoing)
    factor = kirchhoff_factor(wi, wo, lam, 3.0)
    # the order of multiplication: a few units in the last place
    assert factor == pytest.approx(kirchhoff_factor(wo, wi, lam, 3.0), rel=1e-15)
    plain = (1 + wi @ wo) ** 2 / (
        (lam * 1e-3) ** 2 * np.pi * 9.0 * (wi[2] + wo[2]) ** 2 * wi[2] * wo[2]
    )
    assert factor > 0
    # the plain form itself loses digits as ωi·ωo → −1, at worst 2e-16/3e-6 at two times 89.9°
    assert factor == pytest.approx(plain, rel=4e-10)


def test_opposite_grazing_directions_keep_their_precision():
    # towards the mirror direction 1 + ωi·ωo is 2cos²θ
    theta = 89.999
    cos = np.cos(np.radians(theta))
    factor = kirchhoff_factor(polar(theta, 0), polar(theta, 180), 500.0, 1.0)
    exact = (2 * cos**2) ** 2 / (0.25 * np.pi * (2 * cos) ** 2 * cos**2)
    assert factor == pytest.approx(exact, rel=1e-10)  # cos itself is known to 1e-16/2e-5


@pytest.mark.parametrize("side", [ABOVE, INSIDE, BEYOND_SHEET])
def test_q_is_that_of_the_refracted_direction(side):
    sine = np.sqrt(1.0 - COS_I**2)
    direction = np.stack([sine, 0.0 * sine, COS_I], axis=-1)
    inside = coat.refracted(direction, side.at_structure / side.index)
    assert side.normal(COS_I) == pytest.approx(side.at_structure * inside[:, 2])
