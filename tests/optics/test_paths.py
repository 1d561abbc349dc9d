"""Paths of light by a boundary: closed forms of q and G, and both orders of directions."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.boundary import Heights
from mitsuba_diffraction.optics.mirror import horizon_correction
from mitsuba_diffraction.optics.paths import ABOVE, Path, Returned, Side
from mitsuba_diffraction.reference import coat, fresnel

RNG = np.random.default_rng(1)
COS_I, COS_O = RNG.uniform(0.1, 1.0, (2, 50))
TURN = RNG.uniform(-np.pi, np.pi, 50)
INSIDE, BEYOND_SHEET = Side(1.5, 1.5, below=True), Side(1.0, 1.5, below=True)


@pytest.mark.parametrize("side", [ABOVE, INSIDE, BEYOND_SHEET])
def test_q_is_that_of_the_refracted_direction(side):
    sine = np.sqrt(1.0 - COS_I**2)
    direction = np.stack([sine, 0.0 * sine, COS_I], axis=-1)
    inside = coat.refracted(direction, side.at_structure / side.index)
    assert side.normal(COS_I) == pytest.approx(side.at_structure * inside[:, 2])


@pytest.mark.parametrize("side", [ABOVE, INSIDE])
def test_a_perfect_conductor_has_stam_s_factor(side):
    path = Path(None, "kirchhoff", side, side)
    sines = np.sqrt((1.0 - COS_I**2) * (1.0 - COS_O**2))
    one_plus_dot = 1.0 + COS_I * COS_O + sines * np.cos(TURN)
    expected = (one_plus_dot / (COS_I + COS_O)) ** 2 / (COS_I * COS_O)
    assert path.common(COS_I, COS_O, np.cos(TURN)) == pytest.approx(expected)


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


def test_the_flat_side_of_a_sheet_reflects_what_fresnel_says():
    face = Path(1.0 / 1.5, "small_slope", BEYOND_SHEET, BEYOND_SHEET)
    # a lobe so narrow that none of it lies beyond the horizon
    _, reflected = face.mirrored(COS_I, COS_I, -1.0, k=10.0, sigma_0=1e3)
    assert reflected == pytest.approx(fresnel.reflectance(COS_I, 1.5))
