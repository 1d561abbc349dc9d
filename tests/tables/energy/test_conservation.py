"""Albedos of model and material, and the scale by which no more is reflected than comes in."""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.blend import ScaleRoughness
from mitsuba_diffraction.optics.paths import Path
from mitsuba_diffraction.tables.directional import LAST_ANGLE, DirectionGrid
from mitsuba_diffraction.tables.energy.conservation import Conservation, SurfaceEnergy
from mitsuba_diffraction.tables.energy.conserved import Reflector, Transmitter
from mitsuba_diffraction.tables.energy.gain import PathGain
from mitsuba_diffraction.tables.energy.scaling import parallel, scaled
from tests.support.directions import polar, rough_patch
from tests.support.furnace import isotropic

ALUMINIUM = 0.96 + 6.69j  # at 550 nm (Rakić 1995)
MATERIALS = {
    "dielectric": ("small_slope", 1.5 + 0j),
    "aluminium": ("small_slope", ALUMINIUM),
    "perfect": ("kirchhoff", None),
}


GRATING = md.gratings.sinusoidal(1.6, 0.2, periods=1, pixels_per_period=32, rows=8)
ROUGH = md.HeightField(0.08 * isotropic(96, 0.125, 0.9), 0.125)


@pytest.fixture(scope="module")
def tables():
    return {
        "grating": md.DiffractionTable.build(GRATING),
        "rough": md.DiffractionTable.build(ROUGH, coherence_width=12.0),
    }


def raw_albedo(table, theta, phi, wavelength, material):
    directions = np.radians([theta]), np.radians([phi])
    surface = SurfaceEnergy(table, reflector(*MATERIALS[material]))
    return float(surface.albedos(Conservation(), *directions, wavelength)[0][0, 0, 0])


def reflector(model, index):
    return Reflector(model, lambda lam: None if index is None else np.full(len(lam), index))


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize(
    ("theta", "phi", "wavelength"), [(0, 0, 500), (40, 20, 430), (65, 60, 650)]
)
def test_a_gratings_albedo_is_the_sum_of_its_efficiencies(tables, material, theta, phi, wavelength):
    """Order by order, from the reference's peaks."""
    _, index = MATERIALS[material]
    wi, sigma = polar(theta, phi), 65.0 / 4.0
    parameters = {} if index is None else {"eta": index.real, "k": index.imag}
    total, lam = 0.0, wavelength * 1e-3
    for m in range(-8, 9):
        x, y = m * lam / 1.6 - wi[0], -wi[1]
        if x * x + y * y < 0.995:
            wo = np.array([x, y, np.sqrt(1.0 - x * x - y * y)])
            peak = reference.brdf(
                GRATING, wi, wo, wavelength, model=MATERIALS[material][0], **parameters
            )[0]
            # the lobe is exp(−σ²k²|Δ|²) in direction cosines, and cosθ dω is their area
            total += peak * np.pi * (lam / (2 * np.pi * sigma)) ** 2
    # lobes have a width, over which G changes
    assert raw_albedo(tables["grating"], theta, phi, wavelength, material) == pytest.approx(
        total, rel=0.01
    )


def integral(table, theta, phi, wavelength):
    """Albedo of a perfect mirror by midpoints, close together where light grazes the surface."""
    count = 96
    cosine = ((np.arange(count) + 0.5) / count) ** 2
    cosine, turn = np.meshgrid(cosine, (np.arange(2 * count) + 0.5) * (np.pi / count))
    sine = np.sqrt(1.0 - cosine**2)
    wo = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)
    weights = cosine**1.5 * (2 * np.pi / count**2)  # dωo cosθo
    return (table.brdf(polar(theta, phi), wo.reshape(-1, 3), wavelength) * weights.ravel()).sum()


_BUMPS = rough_patch((40, 40), (0.2, 0.2), 0.12, 1.2)
_COLUMNS = 0.08 * np.kron(np.random.default_rng(3).random((10, 7)), np.ones((3, 2)))
_STEPS = 0.18 * (np.arange(31) % 8 < 4) + np.zeros((45, 1))
#: Mirrors under narrow windows: field, settings of its table, angles, azimuths and wavelength of
#: light, and how far sums may be from the integral: samples of the density, a quarter or half of a
#: lobe's deviation apart, are read at the nearest. Few orders take seconds less.
NARROW = {
    # lobes of some degrees: neither single directions nor a smooth density; rings are 2.5° apart
    **{f"few orders, {coherence}": (
        _BUMPS, {"coherence_width": 8.0, "coherence": coherence,
                  "wavelength_range": (540.0, 560.0)},
        [45.0, 75.0], [20.0], 550.0, {"atol": 0.02},
    ) for coherence in ("ensemble", "patch")},
    # dozens of bins lie within a lobe: both sides of the mirror differ by 1.3
    "a blaze under a window of a wavelength": (
        md.HeightField(0.2 * np.tile(np.arange(41) / 41.0, (8, 1)), 0.073),
        {"coherence_width": 0.5, "wavelength_range": (600.0, 650.0)},
        [40.0, 80.0], [0.0, 60.0, 180.0], 636.0, {"rtol": 0.01},
    ),
    # between angles of incidence light grows as 1/cosθ: 0.06 too much at 88.5°
    "noise under a window of a wavelength": (
        md.HeightField(0.16 * np.random.default_rng(4).random((47, 38)), (0.0778, 0.0981)),
        {"coherence_width": 0.66, "wavelength_range": (440.0, 450.0)},
        [60.0, 80.0, 86.0, 88.5], [20.0, 200.0], 444.0, {"rtol": 0.01},
    ),
    # orders 30° apart with lobes of 3°: each azimuth of incidence sees others. Between angles
    # light grows as 1/cosθ; beyond them, where it decides on a scale, it is summed by itself
    "few wide orders": (
        md.HeightField(_COLUMNS, (0.055, 0.077), periodic=True),
        {"coherence_width": 3.3, "wavelength_range": (430.0, 440.0)},
        [70.0, 80.0, 86.0, 88.5, 89.8, 89.9], [16.0, 45.0, 80.0], 435.0,
        {"rtol": np.array([[0.01], [0.01], [0.01], [0.01], [0.02], [0.02]])},
    ),
    # an infrared blaze: the light of an order between rows of the grid was up to 0.15 off; lobes of
    # 2.6° between rows half as far apart
    "orders that appear over the width of a lobe": (
        md.HeightField(0.36 * np.tile(np.arange(40) / 40.0, (8, 1)), 0.0326, periodic=True),
        {"coherence_width": 9.6, "wavelength_range": (970.0, 990.0)},
        [10.0, 20.0, 47.0], [0.0, 90.0, 198.0], 976.0, {"atol": 0.05},
    ),
    # orders 1.8/σ apart: sums of their lobes ripple by a tenth, and albedos were 0.21 off
    "a window wider than its patch": (
        md.HeightField(_STEPS, (0.0854, 0.168), periodic=True),
        {"coherence_width": 3.1, "wavelength_range": (650.0, 660.0)},
        [30.0, 50.0], [37.0, 90.0, 200.0, 301.0], 656.0, {"rtol": 0.01},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", NARROW)
def test_an_albedo_under_a_narrow_window_is_the_integral_of_the_model(name):
    field, settings, angles, azimuths, wavelength, within = NARROW[name]
    table = md.DiffractionTable.build(field, **settings)
    mirror = SurfaceEnergy(table, reflector("kirchhoff", None))
    light = np.radians(angles), np.radians(azimuths), wavelength
    found = mirror.albedos(Conservation(), *light)[0][0]
    exact = [[integral(table, theta, phi, wavelength) for phi in azimuths] for theta in angles]
    close = np.isclose(found, exact, **({"rtol": 0.0, "atol": 0.0} | within))
    assert np.all(close), found - exact


@pytest.mark.parametrize("surface", ["grating", "rough"])
def test_a_dielectric_gains_nothing_and_nothing_is_taken(tables, surface):
    glass = SurfaceEnergy(tables[surface], reflector("small_slope", 1.5))
    found = glass.conservation((400.0, 500.0))
    # the grating sends on 1.06 times the light at 89.9°, beyond the grid: its scale attenuates that
    assert (found.scale is None) is (surface == "rough")
    assert found.scale is None or np.all(found.scale.values == 1.0)
    assert found.albedo.values.max() < 1.0


@pytest.mark.parametrize("rms", [0.0, 0.001])
def test_a_mirror_loses_less_than_its_roughness_scatters(rms):
    heights = rms * np.random.default_rng(0).normal(size=(64, 64))
    table = md.DiffractionTable.build(md.HeightField(heights, 0.1, periodic=True))
    surface = SurfaceEnergy(table, reflector("kirchhoff", None))
    theta, phi = np.radians([0.0, 30.0, 60.0, 80.0]), np.radians([0.0, 50.0])
    _, found = surface.albedos(surface.conservation((500.0, 520.0)), theta, phi, 510.0)
    # (4πσ/λ)² of the light is scattered at the table's shortest wavelength; single precision
    np.testing.assert_allclose(found, 1.0, atol=5e-4 + (4.0 * np.pi * rms / 0.36) ** 2)


def conserved(surface, wavelengths, theta, phi):
    """Albedos raw and conserved, (wavelengths, directions)."""
    scales = surface.conservation((min(wavelengths), max(wavelengths)))
    assert scales.scale is not None
    pairs = [surface.albedos(scales, theta, phi, wavelength) for wavelength in wavelengths]
    return (np.stack(part)[:, 0] for part in zip(*pairs, strict=True))


@pytest.mark.parametrize("material", ["aluminium", "perfect"])
def test_a_grating_gains_nothing_between_nodes_either(tables, material):
    """Where orders become propagating the albedo has kinks, and without a material spikes."""
    surface = SurfaceEnergy(tables["grating"], reflector(*MATERIALS[material]))
    rng = np.random.default_rng(0)
    theta, phi = np.radians(rng.uniform(0, 80, 30)), np.radians(rng.uniform(0, 360, 20))
    raw, kept = conserved(surface, [520.0, 547.0, 560.0], theta, phi)
    assert raw.max() > 1.02
    # spikes are as narrow as a lobe, half a degree, and looked at in the middle wavelength alone
    assert kept.max() <= (1.005 if material == "aluminium" else 1.02)
    assert np.mean(kept / np.minimum(raw, 1.0)) > 0.95


def test_sums_below_zero_leave_the_scale_a_number():
    # series of few terms, where next to nothing is reflected
    kernel = np.array([[-0.4, 0.1], [0.1, 1.2]], np.float32)
    aim = np.minimum(kernel.sum(axis=1), 1.0)
    scale = scaled(lambda s: kernel @ s, aim, 2.0, 8)
    assert np.all(np.isfinite(scale))
    assert scale[1] * (kernel @ scale)[1] == pytest.approx(1.0, rel=0.05)


def test_threads_start_no_threads_of_their_own():
    def most(_: int = 0) -> int:
        return max(library["num_threads"] for library in threadpool_info())

    with threadpool_limits(2, "blas"):
        assert parallel(most, range(3)) == [1, 1, 1]
        assert most() == 2


PATCH = rough_patch((40, 44), (0.09, 0.09), 0.1)


def gain_of(path):
    roughness = ScaleRoughness.from_heights(PATCH.heights, PATCH.pixel_size)
    return PathGain(path, roughness.table(50.0), 11.0, 1.0)


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
