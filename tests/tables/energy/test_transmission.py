"""R + T of dielectrics and sheets: sums over the orders, and the scale that makes it 1."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField, gratings
from mitsuba_diffraction.tables.energy.conservation import Conservation, SurfaceEnergy
from mitsuba_diffraction.tables.energy.conserved import Transmitter
from mitsuba_diffraction.tables.energy.settings import EnergySettings
from tests.support.coarse import energy_as
from tests.support.directions import rough_patch

#: Between nodes of angles and azimuths; at the critical angle from within lobes are half reflected.
THETA, PHI = np.radians([1.0, 31.0, 59.0, 74.0]), np.radians([11.0, 184.0])
#: Angle from the critical one, rad, within which s has a kink: light beside it is lowered.
KINK = np.radians(3.0)
KINDS = {"interface": False, "sheet": True}


@pytest.fixture(autouse=True)
def few_wavelengths():
    """One pair of wavelengths, at which the sums are taken: nothing lies between."""
    with energy_as(EnergySettings(side_wavelengths=2, azimuthal=16)):
        yield


def flat() -> HeightField:
    return HeightField(np.zeros((8, 8)), 8.0)


def shallow() -> HeightField:
    """5 nm of noise."""
    return rough_patch((200, 200), (0.1, 0.1), 0.005, 1.0)


def sums(field, index, width, thin, model="small_slope"):
    """R + T raw and conserved, (2 wavelengths, 2 sides, angles, azimuths)."""
    table = DiffractionTable.build(field, coherence_width=width, height_scale_max=index)
    surface = SurfaceEnergy(table, Transmitter(index, model, thin))
    scales = surface.conservation((450.0, 650.0))
    pairs = [surface.albedos(scales, THETA, PHI, wavelength) for wavelength in (450.0, 650.0)]
    return (np.stack(part) for part in zip(*pairs, strict=True))


def beside_kinks(conserved, index, thin):
    """R + T, (…, angles, azimuths), without directions near the critical angle from within."""
    critical = np.inf if thin else np.arcsin(1.0 / index)
    below = np.abs(THETA - critical) > KINK
    return np.concatenate([conserved[:, 0], conserved[:, 1, below]], axis=1)


@pytest.mark.parametrize("thin", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("index", [1.01, 1.2, 2.4])
def test_a_flat_surface_sends_on_all_light_whatever_its_index(index, thin):
    raw, kept = sums(flat(), index, 65.0, thin)
    assert np.abs(raw - 1.0).max() < 5e-3  # a lobe of half a degree is spread at 74°
    assert np.abs(beside_kinks(kept, index, thin) - 1.0).max() < 1e-3
    assert np.abs(kept - 1.0).max() < 5e-3


@pytest.mark.parametrize("thin", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("index", [1.01, 1.5])
def test_a_narrow_window_makes_no_light(index, thin):
    """Order 0 has what the flat surface transmits: 1/w², as large as one likes, is not in it."""
    raw, kept = sums(flat(), index, 4.0, thin)
    # lobes are 6° wide: from 59° on part of them is below the horizon, or beyond the critical
    # angle, and C is that of a straight edge
    assert np.abs(raw - 1.0).max() < 1.2e-2
    assert np.abs(kept - 1.0).max() < 4e-3


@pytest.mark.parametrize("thin", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
def test_a_shallow_surface_sends_on_all_light(model, thin):
    _, kept = sums(shallow(), 1.2, 20.0, thin, model)
    assert np.abs(beside_kinks(kept, 1.2, thin) - 1.0).max() < 1e-2  # lobes of 6° at 74°
    assert np.abs(kept[:, :, :2] - 1.0).max() < 1e-3
    assert 0.98 < kept.min() <= kept.max() < 1.002


#: Surfaces under windows of one or two wavelengths, whose light jumps at the critical angle from
#: within: heights, pixels, index, window, and least R + T from 3° within to 3° beyond. Rows of s
#: about the angle have the value of the brighter side, and the darker side loses light.
JUMPS = {
    # all is reflected beyond, and too much: 1.08 by a scale of light within
    "brighter beyond": (0.015 * (np.arange(32) % 8 < 4), (0.0722, 0.1175), 2.36, 0.5, 0.7),
    # half of the lobe is lost beyond: 1.11 within by a scale of light beyond
    "brighter within": (np.zeros(32), (0.14, 0.11), 1.048, 1.33, 0.6),
}


@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
@pytest.mark.parametrize("name", JUMPS)
def test_light_about_the_critical_angle_is_no_more_than_comes_in(name, model):
    heights, pixels, index, width, least = JUMPS[name]
    table = DiffractionTable.build(
        HeightField(heights * np.ones((32, 1)), pixels), coherence_width=width,
        height_scale_max=index,
    )  # fmt: skip
    surface = SurfaceEnergy(table, Transmitter(index, model, False))
    scales = surface.conservation((466.0, 466.0))
    angles = np.arcsin(1.0 / index) + np.radians(np.linspace(-3.0, 3.0, 24))
    _, kept = surface.albedos(scales, angles, np.radians([30.0, 100.0]), 466.0)
    assert kept[1].max() < 1.005  # as the fuzz asks of all surfaces
    assert kept[1].min() > least


def test_heights_that_are_scaled_are_as_others():
    glass = Transmitter(1.5, "small_slope", True)
    totals = []
    for depth, scale in ((0.03, 1.4), (0.042, 1.0)):
        field = gratings.sinusoidal(2.5, depth, periods=4, pixels_per_period=28)
        table = DiffractionTable.build(field, coherence_width=20.0, height_scale_max=2.2)
        surface = SurfaceEnergy(table, glass, scale)
        totals.append(surface.albedos(Conservation(), THETA, PHI, 550.0)[0])
    assert totals[0] == pytest.approx(totals[1], abs=1e-4)
