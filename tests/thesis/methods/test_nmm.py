"""The n_min–n_max method: all of the spectrum with lobes of their width, too blue without."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import OrdersOnly
from tests.directions import polar


@pytest.fixture(scope="module")
def pairs_of_a_sweep():
    """Light from 40°, views along x, away from the mirror direction."""
    theta = np.concatenate([np.linspace(-33.0, 25.0, 30), np.linspace(-70.0, -50.0, 10)])
    return polar(40.0), np.array([polar(t) for t in theta])


def test_nmm_with_the_width_of_lobes_is_the_whole_spectrum(grating, pairs_of_a_sweep):
    wi, wo = pairs_of_a_sweep
    settings = {"coherence_width": 240.0, "step": 0.5}
    full = methods.make("flss", grating, **settings)
    few = OrdersOnly(full, (2.0, None), weights="lobe")
    away = ~few.special(np.broadcast_to(wi, wo.shape), wo)[0]
    assert away.sum() > 30
    exact, found = full.xyz(wi, wo[away]), few.xyz(wi, wo[away])
    # lobes are about 1 % of a wavelength wide; the observer's curves bend within them
    assert np.abs(found - exact).sum() < 0.01 * exact.sum()


def test_nmm_of_the_thesis_is_too_blue(grating, pairs_of_a_sweep):
    wi, wo = pairs_of_a_sweep
    of = methods.make_all(("flss", "nmm"), grating, coherence_width=60.0)
    away = ~of["nmm"].special(np.broadcast_to(wi, wo.shape), wo)[0]
    shares = [m.xyz(wi, wo[away]).sum(axis=0) for m in of.values()]
    blue = [xyz[2] / xyz[0] for xyz in shares]
    assert blue[1] > 1.2 * blue[0]


def test_nmm_is_white_around_the_mirror_direction(grating):
    method = methods.make("nmm", grating, coherence_width=60.0)
    xyz = method.xyz(polar(30.0), [polar(-30.0), polar(-30.2)])
    white = xyz / xyz[:, 1:2]
    # x, y = 0.3127, 0.3290: D65
    chromaticity = white[:, :2] / white.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(chromaticity, [[0.3127, 0.3290]] * 2, atol=2e-4)
    assert xyz[0, 1] == pytest.approx(method.brdf(polar(30.0), polar(-30.0), 555.0)[0], rel=1e-3)


def test_nmm_takes_every_wavelength_of_an_order_once(grating):
    method = methods.make("nmm", grating, coherence_width=60.0)
    wi, wo = polar(0.0)[None], polar(50.0)[None]
    path = 2000.0 * np.sin(np.radians(50.0))
    taken = [float(w[0]) for w, weight in method.samples(wi, wo) if weight[0] > 0]
    expected = [path / n for n in range(1, 20) if 380.0 <= path / n <= 780.0]
    np.testing.assert_allclose(taken, expected, rtol=1e-3)  # the period is an estimate
