"""Factors of the orders' powers between directions, orders that are summed, boundary models."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from mitsuba_diffraction.optics import boundary, through
from mitsuba_diffraction.optics.blend import RoughnessTable, ScaleRoughness
from mitsuba_diffraction.optics.paths import Path
from mitsuba_diffraction.tables.directional import LAST_ANGLE, DirectionGrid
from mitsuba_diffraction.tables.energy.conservation import Conservation, SurfaceEnergy
from mitsuba_diffraction.tables.energy.conserved import Reflector, Transmitter
from mitsuba_diffraction.tables.energy.gain import PathGain
from mitsuba_diffraction.tables.order_mixture import order_mixture
from mitsuba_diffraction.tables.powers import powers_at
from tests.support.directions import polar, rough_patch

PATCH = rough_patch((40, 44), (0.09, 0.09), 0.1)


def gain_of(path):
    roughness = ScaleRoughness.from_heights(PATCH.heights, PATCH.pixel_size)
    return PathGain(path, roughness.table(50.0), 11.0, 1.0)


def test_heights_scaled_alike_have_the_same_gain():
    light = np.array(0.7), np.array(0.5), 0.3
    gains = [
        PathGain(Path(0.9 + 6.0j, "small_slope"), roughness.table(50.0), 11.0, scale).exact(*light)
        for heights, scale in ((PATCH.heights, 1.5), (1.5 * PATCH.heights, 1.0))
        for roughness in [ScaleRoughness.from_heights(heights, PATCH.pixel_size)]
    ]
    assert gains[0] == pytest.approx(gains[1])


PATHS = [
    pytest.param(path, id=f"{name} {path.came.number}-{path.left.number}")
    for name, thin in (("surface", False), ("sheet", True))
    for path in Transmitter(1.5, "small_slope", thin).paths(np.ones(1), 1e-3)[0]
    if path.index is not None  # the flat side of a sheet has no table
] + [pytest.param(Path(0.9 + 6.0j, "small_slope"), id="metal")]


@pytest.mark.parametrize("path", PATHS)
def test_tables_hold_the_boundary_s_gain_in_either_order_of_directions(path):
    gain = gain_of(path)
    rng = np.random.default_rng(4)
    cos_i, cos_o = rng.uniform(0.4, 0.98, (2, 400))
    turn = rng.uniform(-np.pi, np.pi, 400)
    expected, tabulated = (
        gain.exact(cos_i, cos_o, np.cos(turn)),
        gain(cos_i, np.arange(400), cos_o, turn),
    )
    near = path.tangential(cos_i, cos_o, np.cos(turn)) < 1.9
    # linear between 37 × 37 × 25 nodes, within 73 × 73 × 25; where w is small, 1/w² is not linear
    away = near & (path.width(cos_i, cos_o) > 0.2)
    assert np.count_nonzero(away) > 150
    error = np.abs(tabulated - expected)[away].sum() / expected[away].sum()
    # 1.2 % where total reflection begins at a kink, 1.6 % within with 37 × 37 × 25 nodes
    assert error < 0.014


@pytest.mark.parametrize("index", [1.5, 2.46])
def test_tables_hold_the_root_at_a_critical_angle(index):
    """Light is let through towards directions within 3° of the critical angle."""
    gain = gain_of(Transmitter(index, "small_slope", False).paths(np.array([550.0]), 0.05)[0][1])
    critical = np.arcsin(1.0 / index)
    cos_o = np.cos(np.linspace(critical - 0.05, critical + 0.05, 41))
    cos_i, row = np.array([np.cos(1.1)]), np.zeros(41, int)
    expected = gain.exact(cos_i, cos_o, np.full(41, -0.95))
    tabulated = gain(cos_i, row, cos_o, np.full(41, np.arccos(-0.95)))
    # up to 0.11 where nodes were the same for all sides
    np.testing.assert_allclose(tabulated, expected, rtol=0.02)


def test_the_grid_interpolates_what_is_linear_and_goes_round():
    grid = DirectionGrid(10, 12)
    assert grid.theta[0] == 0.0
    assert grid.theta[-1] == pytest.approx(LAST_ANGLE)
    rows = np.arange(11.0, dtype=np.float32)[:, None] + np.zeros((1, 12), np.float32)
    theta = np.radians([0.0, 10.0, 47.0, 89.9])
    found = grid.interpolation(theta, np.radians([-30.0, 0.0, 359.0, 725.0]))(rows)
    assert found == pytest.approx(grid.row(theta), abs=1e-5)
    round_ = np.cos(grid.phi).astype(np.float32) + np.zeros((11, 1), np.float32)
    middle = grid.interpolation(0.5, np.radians([345.0, -15.0]))(round_)
    assert middle == pytest.approx(0.5 * (1.0 + np.cos(np.radians(30.0))), abs=1e-6)


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


FLAT = md.HeightField(np.zeros((4, 4)), 0.2)
UP, DOWN = polar(20), polar(30) * [1, 1, -1]
CALLS = {
    "brdf": lambda name: reference.brdf(FLAT, UP, UP, 520.0, eta=1.5, model=name),
    "film": lambda name: reference.brdf(
        FLAT, UP, UP, 520.0, eta=1.5, film=(1.3, 200.0), model=name
    ),
    "btdf": lambda name: reference.btdf(FLAT, UP, DOWN, 520.0, eta=1.5, model=name),
    "model": lambda name: boundary.model_of(name),
    "gain": lambda name: PathGain(
        Path(1.5, name), RoughnessTable(0.0, np.zeros(2)), 12.0, 1.0
    ).exact(np.array(0.5), np.array(0.5), 0.0),
    "dielectric": lambda name: Transmitter(1.5, name, thin=False).paths(np.ones(1), 0.1),
}


def test_models_of_light_that_goes_through_are_models_of_reflected_light():
    assert set(through.MODELS) <= set(boundary.MODELS)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_an_unknown_model_is_refused_with_the_choices(call):
    with pytest.raises(md.DiffractionError, match=r"model='rice'.*small_slope, kirchhoff"):
        call("rice")
    call("kirchhoff")
