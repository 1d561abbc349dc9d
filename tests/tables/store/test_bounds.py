"""Bounds at any height scale: continuous, between few nodes, each computed once."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.energy.bound import AZIMUTHAL, POLAR, AlbedoBound, albedo_bound
from mitsuba_diffraction.tables.store import bounds as bound_cache
from mitsuba_diffraction.tables.store.bounds import bounds_around, cached_bound
from mitsuba_diffraction.tables.store.store import VARIABLE


@pytest.fixture
def computed(monkeypatch, tmp_path):
    """Height scales of the bounds computed; instead of one, what a linear one would be."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    scales: list[float] = []

    def instead(table: md.DiffractionTable, height_scale: float) -> AlbedoBound:
        scales.append(height_scale)
        return AlbedoBound(np.full((POLAR + 1, AZIMUTHAL + 1), 1 + height_scale, np.float32))

    monkeypatch.setattr(bound_cache, "albedo_bound", instead)
    return scales


def table(depth: float = 0.1, scale: float = 1.5) -> md.DiffractionTable:
    field = md.gratings.sinusoidal(2.0, depth, periods=2, pixels_per_period=24)
    return md.DiffractionTable.build(field, coherence_width=4.0, height_scale_max=scale)


@pytest.mark.parametrize("most", [1.5, 1.43, 0.1])
def test_in_between_it_is_interpolated(computed, most):
    surface = table(scale=most)
    for height_scale in most * np.linspace(0.01, 1.0, 23):
        around = bounds_around(surface, height_scale)
        assert around.scales[0] <= max(height_scale * (1 + 1e-5), 1e-3)
        assert height_scale <= around.scales[1] * (1 + 1e-4)  # nodes catch what is that near
        value = cached_bound(surface, height_scale).values
        assert value == pytest.approx(1 + max(height_scale, 1e-3), rel=1e-4)
    assert max(computed) <= most


def test_each_node_is_computed_once_and_kept_on_disk(computed):
    surface = table()
    for height_scale in np.linspace(0.6, 1.0, 50):
        cached_bound(surface, height_scale)
    assert len(computed) == len(set(computed)) < 10
    again = table()  # another table of the same content: from the disk
    cached_bound(again, 0.7)
    assert len(computed) == len(set(computed))


def test_one_bound_does_at_the_scale_of_most_scenes(computed):
    surface = table()
    assert bounds_around(surface, 1.0).scales == (1.0, 1.0)
    assert bounds_around(surface, float(np.float32(1.0 + 1e-6))).scales == (1.0, 1.0)
    assert computed == [1.0]


@pytest.mark.parametrize("height_scale", [1.0, 1.5])
def test_for_derivatives_there_are_always_two(computed, height_scale):
    low, high = bounds_around(table(), height_scale, interval=True).scales
    assert low < high
    assert low <= height_scale <= high


@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
def test_between_nodes_the_bound_is_what_it_would_be_there(monkeypatch, tmp_path):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    surface = table(0.3)
    around = bounds_around(surface, 0.97)
    middle = 0.5 * sum(around.scales)
    between = np.maximum(cached_bound(surface, middle).values, 1.0)
    there = np.maximum(albedo_bound(surface, middle).values, 1.0)
    # below by less than the margin of 1 % that every bound has; above by what two nodes see
    assert np.all(between > 0.99 * there)
    assert np.all(between < 1.06 * there)
