"""Orders that are summed together keep the places where the light goes."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.energy.conservation import Conservation, SurfaceEnergy
from mitsuba_diffraction.tables.energy.conserved import Reflector
from mitsuba_diffraction.tables.order_mixture import order_mixture
from mitsuba_diffraction.tables.powers import powers_at


@pytest.mark.parametrize("width", [0.4, 1.0, 2.0, 4.0])
def test_joined_orders_keep_their_places(width: float) -> None:
    """Of a blazed grating of 2.5 µm, whose orders lie on one side, under a narrow window."""
    field = md.HeightField(np.tile(0.1 * np.arange(50) / 50, (8, 1)), 0.05, periodic=True)
    table = md.DiffractionTable.build(field, coherence_width=width, coherence="ensemble")
    lobe = 1.0 / (np.sqrt(2.0) * table.sigma)
    mixture = order_mixture(table, 1.0, table.q_limit, lobe)
    middle = len(mixture.density) // 2
    kappa = middle * mixture.kappa_step
    density = mixture.density[middle].astype(np.float64) * kappa**2
    places = mixture.pitch * (np.arange(density.shape[1]) - 0.5 * (density.shape[1] - 1))
    power = powers_at(table, kappa).sum(axis=0)
    orders = table.spacing[0] * (np.arange(len(power)) - len(power) // 2)
    lobes = np.exp(-0.5 * ((places[:, None] - orders) / lobe) ** 2)
    exact = lobes @ power / (lobe * np.sqrt(2.0 * np.pi))
    found = density.sum(axis=0) * mixture.pitch
    # a bin is moved by 1/(3σ) at most, which puts 0.37 of its lobe elsewhere; a third stay in place
    assert np.abs(found - exact).sum() < 0.1 * exact.sum()


@pytest.mark.parametrize("share", [1.0, 2.0])
@pytest.mark.parametrize("width", [1.0, 7.0])
def test_the_density_of_a_window_has_all_light_in_few_samples(width: float, share: float) -> None:
    """However wide the smoothing is beside the lobes, by its share."""
    field = md.HeightField(np.tile(0.1 * np.arange(50) / 50, (50, 1)), 0.05, periodic=True)
    table = md.DiffractionTable.build(field, coherence_width=width, coherence="patch")
    lobe = 1.0 / (np.sqrt(2.0) * table.sigma)
    mixture = order_mixture(table, 1.0, table.q_limit, share * lobe)
    assert mixture.beats is not None
    others, beats = (
        part.astype(np.float64).sum(axis=(1, 2)) for part in (mixture.density, mixture.beats)
    )
    light = others * (mixture.kappa_step * np.arange(len(others))) ** 2 + beats
    # mirrors reflect all light; what the saw's edges send beyond the table's frequencies is missing
    np.testing.assert_allclose(light * mixture.pitch**2 + mixture.central, 1.0, atol=0.02)
    # powers are sampled at distances of 0.15/σ, or half of them
    assert mixture.pitch >= 0.05 * lobe


def test_orders_that_do_not_overlap_send_on_the_light_of_an_ensemble() -> None:
    """Under a window of many periods: a few lobes of a degree, which a smooth density misses."""
    heights = 0.3 * np.random.default_rng(4).random((8, 6))
    field, mirror = (
        md.HeightField(heights, (0.25, 0.17), periodic=True),
        Reflector("kirchhoff", lambda lam: None),
    )
    theta, phi = np.radians([40.0, 70.0]), np.radians([-53.0, 10.0, 14.0])
    albedos = []
    for coherence in ("ensemble", "patch"):
        table = md.DiffractionTable.build(field, coherence_width=25.0, coherence=coherence)
        surface = SurfaceEnergy(table, mirror)
        albedos.append(surface.albedos(Conservation(), theta, phi, 600.0)[0])
    # both tables' tolerance; a density had up to 13 % more light
    np.testing.assert_allclose(albedos[1], albedos[0], rtol=0.02)
