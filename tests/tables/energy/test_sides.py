"""R + T of dielectrics and sheets: of what keeps it, and the scale that makes it 1."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField, gratings
from mitsuba_diffraction.tables.energy import sides as made
from mitsuba_diffraction.tables.energy.chains import put, taken
from mitsuba_diffraction.tables.energy.gain import bilinear
from mitsuba_diffraction.tables.energy.grating import Grating, fractions, position_of
from mitsuba_diffraction.tables.energy.links import Link, Medium
from mitsuba_diffraction.tables.energy.sides import Sides

pytestmark = pytest.mark.thorough

#: Between nodes of angles, azimuths and wavelengths.
THETA, PHI = np.radians([1.0, 31.0, 46.0, 59.0, 74.0]), np.radians([11.0, 63.0, 184.0])


def table(depth: float, width: float = 20.0, period: float = 2.5) -> DiffractionTable:
    field = gratings.sinusoidal(period, depth, periods=4, pixels_per_period=28)
    return DiffractionTable.build(field, coherence_width=width, height_scale_max=1.6)


def sides(depth: float, *, scale: float = 1.0, thin: bool = False) -> Sides:
    return Sides(table(depth), scale, Medium(1.5, "small_slope", thin))


@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
@pytest.mark.parametrize("thin", [False, True])
def test_a_flat_surface_keeps_all_light(model, thin):
    flat = DiffractionTable.build(
        HeightField(np.zeros((100, 100)), 0.09), coherence_width=200.0, height_scale_max=1.6
    )
    sums, _ = Sides(flat, 1.0, Medium(1.5, model, thin)).sums(None, THETA, PHI[:1], 550.0)
    # lobes of half a degree, and G linear between nodes
    assert sums == pytest.approx(np.ones_like(sums), abs=2e-3)


def test_the_gain_grows_with_the_square_of_the_heights():
    along = np.radians([40.0]), np.array([0.0])
    flat, *gains = (sides(d).sums(None, *along, 550.0)[0][0, 0, 0] for d in (1e-3, 0.02, 0.04))
    assert gains[0] - flat > 1e-4
    assert gains[1] - flat == pytest.approx(4 * (gains[0] - flat), rel=0.1)


def test_heights_that_are_scaled_are_as_others():
    scaled, others = (
        one.sums(None, THETA, PHI, 550.0)[0] for one in (sides(0.03, scale=1.4), sides(0.042))
    )
    assert scaled == pytest.approx(others, abs=1e-4)


@pytest.mark.parametrize("thin", [False, True])
def test_what_goes_through_is_the_same_both_ways(thin):
    medium, found = Medium(1.5, "small_slope", thin), []
    ends = np.radians([[20.0, 35.0], [50.0, 25.0]])
    surface = table(0.05)
    for came, angles in ((0, ends), (1, ends[:, ::-1])):
        link = Link(medium, came, 1 - came)
        for one, other in angles:
            theta = np.array([one])
            values = link.tables(link.parts(theta), theta, 11.0, surface, 1.0)[0]
            cos_i, cos_o = float(np.cos(one)), np.array([np.cos(other)])
            w, turn = link.width(cos_i, cos_o), np.array([2.0])
            found.append(float(link.gain(partial(bilinear, values), w, cos_i, cos_o, turn)[0]))
    assert found[:2] == pytest.approx(found[2:], rel=5e-3)  # linear between nodes


def test_angles_of_directions_within_are_even_and_invertible():
    for side in (0, 1):
        medium = Medium(1.5, "small_slope", False)
        angle = np.linspace(0.0, 0.5 * np.pi, 50)
        cosine = medium.cosine(side, angle)
        assert np.all(np.diff(cosine) < 0.0)
        assert medium.angle(side, cosine) == pytest.approx(angle, abs=1e-6)
    critical = np.sqrt(1.0 - 1.0 / 1.5**2)
    assert medium.angle(1, np.array([critical])) == pytest.approx([0.25 * np.pi], abs=1e-6)


@pytest.mark.parametrize(
    ("thin", "width"),
    # chains of directions are solved of the last, whose lobes are narrow
    [(False, 20.0), (True, 20.0), (True, 65.0)],
)
def test_scaled_both_sides_add_up_to_all_light(thin, width, monkeypatch):
    monkeypatch.setattr(made, "WAVELENGTHS", (2, 2))
    surface = Sides(table(0.08, width), 1.0, Medium(1.5, "small_slope", thin))
    scale = surface.scale((500.0, 560.0))
    assert scale is not None
    assert (scale[0].grating is not None) == (width > 60.0)
    raw, kept = surface.sums(scale, THETA, PHI, 530.0)
    assert np.abs(raw - 1.0).max() > 0.02
    # it is lowered where it is above 1 in the middle between nodes, at the middle wavelength
    assert kept.max() < 1.001
    # From within, close beyond the critical angle, R + T of a grating falls by 0.12 within two
    # nodes of azimuth (at 46°)
    assert (kept if thin else kept[0]).min() > 0.98
    assert kept.min() > 0.97


def test_what_scales_leave_out_is_spread():
    field = gratings.blazed(2.5, 0.25, periods=26, pixels_per_period=28)
    steep = DiffractionTable.build(field, height_scale_max=1.6)
    surface = Sides(steep, 1.0, Medium(1.5, "small_slope", True))
    scale = surface.scale((550.0, 550.0))
    assert scale is not None
    assert len(scale) == 6
    _, scaled = surface.sums(scale[:4], THETA, PHI, 550.0)
    _, kept = surface.sums(scale, THETA, PHI, 550.0)
    assert scaled.min() < 0.96
    # bilinear between nodes, beside which an order comes up
    assert kept.min() > 0.98
    assert kept.max() < 1.002


def test_nodes_of_both_sides_are_found_again():
    places = np.arange(0.0, made.PLACES[0], 0.25)
    xi = 2.0 + fractions(places, *made.PLACES)
    assert position_of(xi, *made.PLACES) == pytest.approx(2 * made.PLACES[0] + places)
    assert np.all(np.diff(xi) > 0.0)


def test_cells_are_looked_at_above_the_horizon():
    grating = Grating((1.0, 0.0), 2 * np.pi / 2.5, *made.PLACES)
    widest = 2.0 * 2.5 / 0.55  # ξ₁ + ξ₂ in light across the grooves
    for last in (3, int(widest) - 1, int(widest)):
        share = made._amid(grating, 550.0, last)
        inside = last + sum(made._places(grating, 0.125)) <= widest
        assert np.all(last + sum(made._places(grating, share))[inside] <= widest)
        assert np.any(share < 0.5) == (last + 2 > widest)


def test_chains_are_taken_as_they_are_put():
    values, rng = np.zeros((20, 20), np.float32), np.random.default_rng(0)
    chains = [rng.random((5, 5, last + 1), np.float32) for last in range(4)]
    for last, one in enumerate(chains):
        put(values, one, last)
    for last, one in enumerate(chains):
        assert np.array_equal(taken(values, last, 5), one)


def test_what_is_near_1_stays_as_it_is():
    flat = table(1e-3, width=65.0)
    assert Sides(flat, 1.0, Medium(1.5, "small_slope", True)).scale((550.0, 550.0)) is None
