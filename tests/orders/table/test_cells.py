"""Coordinates of orders: leaving directions, reversed light, and nodes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.orders import cells

PERIOD = 1.6
# polar coordinates: grazing and normal light alike
radii, turns = st.floats(0.0, 0.9999), st.floats(0.0, 6.3)
wavelengths = st.floats(300.0, 4000.0)


def at(radius, turn):
    return radius * np.cos(turn), radius * np.sin(turn)


@given(radii, turns, wavelengths)
def test_orders_leave_through_their_channels(radius, turn, wavelength):
    x, y = at(radius, turn)
    cell = cells.to_cell(x, y, wavelength, PERIOD)
    steps = np.arange(-40, 41)
    outgoing = x + steps * wavelength / (1e3 * PERIOD)
    squared = outgoing**2 + y**2
    q = cell.channel - steps
    propagates = (q >= 0) & (q < cell.channels)
    # at the horizon itself rounding decides
    clear = np.abs(squared - 1.0) > 1e-9
    assert np.array_equal(propagates[clear], (squared <= 1.0)[clear])
    for m in steps[propagates & clear]:
        leaving = cells.to_cell(x + m * wavelength / (1e3 * PERIOD), y, wavelength, PERIOD)
        if 1e-6 < cell.tau < 1.0 - 1e-6 and 1e-6 < cell.rho < 1.0 - 1e-6:
            assert (leaving.band, leaving.kind) == (cell.band, cell.kind)
            assert leaving.channel == cell.channel - m
            assert leaving.tau == pytest.approx(cell.tau, abs=1e-4)


@given(radii, turns, wavelengths)
def test_reversed_light_swaps_channels(radius, turn, wavelength):
    x, y = at(radius, turn)
    cell = cells.to_cell(x, y, wavelength, PERIOD)
    back = cells.to_cell(-x, y, wavelength, PERIOD)
    if 1e-6 < cell.tau < 1.0 - 1e-6 and 1e-6 < cell.rho < 1.0 - 1e-6:
        assert (back.band, back.kind) == (cell.band, cell.kind)
        assert back.channel == cell.channels - 1 - cell.channel
        assert back.tau == pytest.approx(1.0 - cell.tau, abs=1e-4)


@given(radii, turns, wavelengths)
def test_conditions_are_those_of_the_cell(radius, turn, wavelength):
    x, y = at(radius, turn)
    cell = cells.to_cell(x, y, wavelength, PERIOD)
    light = cells.from_cell(
        cell.band, cell.kind, cell.channel, cell.tau, cell.rho, wavelength, PERIOD
    )
    # arcsin of a root loses half of the digits near the ends
    assert light.x == pytest.approx(x, abs=1e-6)
    assert light.y == pytest.approx(abs(y), abs=1e-6)


@given(st.floats(0.1, 9.0), st.floats(0.0, 1.0))
def test_w_is_the_wavelength_at_the_same_k(big_k, w):
    ends = (380.0, 780.0)
    wavelength = cells.wavelength_of(big_k, w, ends, PERIOD)
    assert wavelength <= 2e3 * PERIOD / big_k * (1.0 + 1e-12)
    if 2e3 * PERIOD / big_k > ends[0] + 1e-6:
        assert cells.w_of(big_k, wavelength, ends, PERIOD) == pytest.approx(w, abs=1e-6)


@pytest.mark.parametrize("count", [1, 2, 7])
def test_nodes_reproduce_polynomials(count):
    polynomial = np.polynomial.Polynomial(np.arange(1.0, count + 1.0))
    places = np.append(np.linspace(0.0, 1.0, 11), cells.nodes(count))
    matrix = cells.interpolation(count, places)
    assert matrix @ polynomial(cells.nodes(count)) == pytest.approx(polynomial(places), rel=1e-12)
