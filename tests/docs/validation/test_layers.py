"""Gratings under a coat and a film, and orders that go through: solvers, and the model."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import coated, filmed, rayleigh, transmitted
from docs.make.validation.cases import Case, Light, Media, Sampled
from docs.make.validation.compare import table_of
from docs.make.validation.model import modelled
from docs.make.validation.models import ANGLES, by_model, of_colours
from docs.make.validation.solutions import stored
from mitsuba_diffraction import HeightField


@pytest.mark.parametrize("grating", coated.GRATINGS[:4], ids=str)
def test_gentle_gratings_under_a_coat(grating):
    compared = coated.compared([grating])
    for theta in ANGLES:
        once, bounced = (part.where(theta=theta) for part in compared)
        # refraction and transmission; half a per cent is the structure's own deviation
        assert of_colours(once) < 0.005
        # the model's bounces leave less than no bounces would
        assert of_colours(bounced) < min(0.1, 0.85 * coated.returned(once, bounced))


def test_a_film_of_air_is_the_bare_grating_of_rayleigh_s_expansion():
    grating, light = filmed.GRATINGS[2], Light(610.0, 30.0)
    under = filmed.solve(Case(grating, light, Media("aluminium", (1.0, 200.0))), 12)
    bare = rayleigh.solve(Case(grating, light, Media("aluminium")), 31)
    place = np.searchsorted(under.order[:, 0], bare.order[:, 0])
    # the secants of the sinusoid
    assert under.powers[place] == pytest.approx(bare.powers, abs=1e-7)


@pytest.mark.parametrize("film", filmed.FILMS)
def test_gratings_of_slope_up_to_a_tenth_under_a_film(film):
    solved = stored(filmed.file_of(film), filmed.FILMS[film])
    assert solved.column("change").max() < 1e-6
    kirchhoff, default = (
        table_of(part, filmed.GRATINGS, ANGLES, of_colours) for part in by_model(solved).values()
    )
    # thick lacquer lacks light that the rough faces diffract twice, which grows as heights squared
    worst, gentle = (0.2, 0.02) if film.startswith("lacquer") else (0.1, 0.007)
    assert default.max() < worst
    assert default[0].max() < gentle  # of slope 0.03: first order is exact as heights go to 0
    assert np.median(default / kirchhoff) < 0.3


@pytest.mark.thorough
@pytest.mark.parametrize("grating", transmitted.GRATINGS[:4], ids=str)
def test_colours_through_gratings_of_slope_up_to_a_tenth(grating):
    default = transmitted.compared([grating])["small_slope"]
    for phi in transmitted.AZIMUTHS:
        part = default.where(phi=phi)
        normal, *oblique = table_of(part, [grating], transmitted.ANGLES, of_colours)[0]
        assert normal < 0.002
        assert max(oblique) < 0.03


@pytest.mark.thorough
def test_on_a_surface_without_symmetry_orders_are_on_their_own_side():
    x = np.arange(64) / 64 * 2 * np.pi
    heights = 0.03 * np.cos(x) + 0.012 * np.sin(2 * x)
    surface = Sampled(HeightField(np.tile(heights, (2, 1)), 2.5 / 64))
    case = Case(surface, Light(550.0, 0.0), Media("keratin", through=True))
    solution = rayleigh.solve(case, 31)
    exact = solution.powers.mean(axis=1)
    model = modelled(case, solution.order, "small_slope").mean(axis=1)
    first = {int(m): n for n, m in enumerate(solution.order[:, 0])}
    assert exact[first[1]] > 1.1 * exact[first[-1]]  # the sides differ
    for order in (-1, 1):
        assert model[first[order]] == pytest.approx(exact[first[order]], rel=2e-3)
