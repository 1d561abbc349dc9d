"""What conserves energy at any height scale: between few nodes, each computed once."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.directional import DirectionalTable
from mitsuba_diffraction.tables.energy.conservation import Conservation, Energy, SurfaceEnergy
from mitsuba_diffraction.tables.energy.conserved import Reflector
from mitsuba_diffraction.tables.energy.settings import EnergySettings
from mitsuba_diffraction.tables.store import VARIABLE
from tests.support.coarse import COARSE, energy_as


@pytest.fixture
def computed(monkeypatch, tmp_path):
    """(height scale, index) of what was computed; instead of it, a constant."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    made: list[tuple[float, complex]] = []

    def instead(
        surface: SurfaceEnergy, wavelength_range: tuple[float, float], beneath: bool
    ) -> Conservation:
        height_scale = surface.orders.height_scale
        assert isinstance(surface.material, Reflector)
        made.append((height_scale, complex(surface.material.index(np.array([500.0]))[0])))
        values = np.full((2, 3, 4), 1.0 + height_scale, np.float32)
        found = DirectionalTable(np.array([400.0, 700.0]), values)
        return Conservation(found, found if height_scale > 0.5 else None)

    monkeypatch.setattr(SurfaceEnergy, "conservation", instead)
    return made


@functools.cache
def table(scale: float) -> md.DiffractionTable:
    field = md.gratings.sinusoidal(2.0, 0.1, periods=2, pixels_per_period=24)
    return md.DiffractionTable.build(field, coherence_width=4.0, height_scale_max=scale)


def energy(index: complex = 1.5, scale: float = 1.5) -> Energy:
    """Of a table without what others keep for the next material."""
    material = Reflector("small_slope", lambda w: np.full(len(w), index))
    return Energy(replace(table(scale)), material, (400.0, 700.0))


@pytest.mark.parametrize("height_scale", [0.25, 1.0])
def test_each_is_computed_once_and_kept_on_disk(computed, height_scale):
    first = energy().at(height_scale)
    again = energy().at(height_scale)  # of another table of the same content: from the disk
    assert len(computed) == 1
    assert np.array_equal(first.albedo.values, again.albedo.values)
    assert (first.scale is None) == (again.scale is None) == (height_scale < 0.5)


def test_another_material_is_computed_anew(computed):
    for index in (1.5, 1.5000001, 1.6, 1.5 + 0.1j):  # the second is the first to rounding
        energy(index).at(1.0)
    assert [index for _, index in computed] == [1.5, 1.6, 1.5 + 0.1j]


def test_another_coat_light_use_beneath_or_setting_is_another_record(computed):
    first = energy()
    coated = replace(first.material, coat=1.3)
    others = {"material": coated}, {"beneath": True}, {"wavelength_range": (450.0, 700.0)}
    for surface in (first, *(replace(first, **other) for other in others)):
        surface.at(1.0)
    with energy_as(EnergySettings(target=0.9)):
        energy().at(1.0)
    energy().at(1.0)
    assert len(computed) == 5


def test_what_a_table_keeps_for_the_next_material_changes_no_values() -> None:
    table, light = energy().table, (400.0, 700.0)

    def albedo(of: md.DiffractionTable, index: complex, coat: float, scale: float) -> np.ndarray:
        material = Reflector("small_slope", lambda w: np.full(len(w), index), coat)
        found = SurfaceEnergy(of, material, scale, light).conservation(light)
        assert found.albedo is not None
        return found.albedo.values

    seen = []
    with energy_as(COARSE):
        for asked in ((1.5, 1.0, 1.0), (0.5 + 5.0j, 1.0, 1.0), (1.5, 1.3, 1.0), (1.5, 1.0, 0.5)):
            seen.append(albedo(table, *asked))
            assert np.array_equal(seen[-1], albedo(energy().table, *asked))
    assert not any(np.array_equal(seen[0], other) for other in seen[1:])


@pytest.mark.parametrize("most", [1.5, 1.43, 0.1])
def test_two_nodes_are_around_each_height_scale(most):
    surface = energy(scale=most)
    for height_scale in most * np.linspace(0.01, 1.0, 23):
        low, high = surface.nodes(height_scale, height_scale)
        assert low <= max(height_scale * (1 + 1e-5), 1e-3)
        assert height_scale <= high * (1 + 1e-4)  # nodes catch what is that near
        assert high <= most
