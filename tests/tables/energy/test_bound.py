"""The albedo's bound: above the true albedo everywhere, and not far above it."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md  # before Mitsuba: it chooses Dr.Jit's LLVM
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.tables.energy.albedo import AlbedoModel
from mitsuba_diffraction.tables.energy.bound import (
    LAST_ANGLE,
    POLAR,
    albedo_bound,
    polar_angle,
    position_of,
)
from tests.directions import polar

import mitsuba as mi  # isort: skip
import drjit as dr  # isort: skip

pytestmark = [
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("variant"),
]


def quadrature(table, theta: float, phi: float, wavelength: float) -> float:
    """∫f cosθo dωo of the raw table with R = 1, on a grid of directions finer than a lobe."""
    from mitsuba_diffraction.plugin.restricted import device_table

    k, wi = float(wavenumber(wavelength)), polar(theta, phi)
    step = 0.45 / (table.sigma * k)
    rings, spokes = int(0.5 * np.pi / step), int(2.0 * np.pi / step)
    n = dr.arange(mi.UInt32, rings * spokes)
    angle = (mi.Float(n // spokes) + 0.5) * (0.5 * np.pi / rings)
    sin, cos = dr.sincos(angle)
    azimuth = (mi.Float(n % spokes) + 0.5) * (2.0 * np.pi / spokes)
    wo = mi.Vector3f(sin * dr.cos(azimuth), sin * dr.sin(azimuth), cos)
    wavenumbers, incident = mi.Float(k), mi.Vector3f(wi)
    dr.make_opaque(wavenumbers, incident)  # one kernel for all directions and wavelengths
    total = incident + wo
    power = device_table(table).window_sum(
        wavenumbers * total.x, wavenumbers * total.y, wavenumbers * total.z
    )
    values = np.array(power * dr.square(0.5 * dr.squared_norm(total) / total.z) * sin, float)
    area = (0.5 * np.pi / rings) * (2.0 * np.pi / spokes)
    return float(values.sum() * area * k**2 * table.sigma**2 / np.pi / wi[2])


def grazing_wavelength(table, order: float, theta: float, phi: float) -> float | None:
    """Wavelength (nm) at which the order at (order, 0) rad/µm spikes: just above the horizon."""
    k = np.linspace(*wavenumber(np.array(table.wavelength_range[::-1])) * (1.0001, 0.9999), 5000)
    wi = polar(theta, phi)
    above = np.hypot(order / k - wi[0], wi[1]) - (1.0 - 0.8 / (table.sigma * k))
    crossings = np.flatnonzero(np.diff(np.sign(above)))
    return float(2e3 * np.pi / k[crossings[0]]) if len(crossings) else None


def grating(depth: float = 0.3) -> md.HeightField:
    x = np.arange(64) * (1.6 / 64)
    heights = 0.5 * depth * np.cos(2 * np.pi * x / 1.6)
    return md.HeightField(np.tile(heights, (8, 1)), (0.025, 0.05))


def test_the_grid_of_polar_angles_can_be_inverted():
    positions = np.linspace(0.0, POLAR, 50)
    angles = polar_angle(positions)
    assert angles[0] == 0.0
    assert angles[-1] == pytest.approx(LAST_ANGLE)
    assert position_of(angles) == pytest.approx(positions, abs=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_gratings_albedo_is_below_the_bound_also_where_orders_graze(seed):
    table = md.DiffractionTable.build(grating())
    bound = albedo_bound(table)
    rng = np.random.default_rng(seed)
    spikes = 0
    for _ in range(16):
        theta, phi = rng.uniform(0.0, 88.0), rng.uniform(0.0, 360.0)
        order = rng.choice([-3, -2, -1, 1, 2, 3]) * 2.0 * np.pi / 1.6
        wavelength = grazing_wavelength(table, order, theta, phi)
        spikes += wavelength is not None
        true = quadrature(table, theta, phi, wavelength or rng.uniform(361.0, 829.0))
        assert true <= bound(polar(theta, phi)), (theta, phi, wavelength)
    assert spikes >= 4  # or the test would say little


def test_a_mirror_is_hardly_dimmed():
    bound = albedo_bound(md.DiffractionTable.build(md.HeightField(np.zeros((8, 8)), 8.0)))
    directions = [polar(theta, phi) for theta in (0, 30, 60, 75) for phi in (0, 50)]
    # the true albedo is within 3e-3 of 1 up to 75°; the margin adds 1 %
    assert np.all(bound(directions) < 1.02)


def test_the_bound_is_tight_on_a_measured_patch(shared_afm):
    patch = md.HeightField.load(
        shared_afm / "elaphe-65um.png", pixel_size=65 / 1332, max_height=0.375
    )
    table = md.DiffractionTable.build(patch)
    bound = albedo_bound(table)
    for theta in (0.0, 30.0, 60.0, 75.0, 80.0):
        for phi in (0.0, 90.0):
            true = max(quadrature(table, theta, phi, w) for w in (361.0, 500.0, 650.0, 829.0))
            # up to 10 %: neighbouring cells, 1 % of margin, and wavelengths between these four
            assert true <= bound(polar(theta, phi)) <= 1.10 * true


def test_the_model_is_the_integral():
    table = md.DiffractionTable.build(grating(0.2))
    model = AlbedoModel(table)
    for theta, phi, wavelength in ((0, 0, 500), (40, 20, 430), (70, 60, 650), (80, 0, 800)):
        true = quadrature(table, theta, phi, wavelength)
        # lobes averaged along the radius only, and 64 steps of κ: within 2 %
        assert model.albedo(np.radians(theta), np.radians(phi), wavelength)[0] == pytest.approx(
            true, rel=0.02
        )
