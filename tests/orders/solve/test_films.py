"""Films on profiles, beside transfer matrices and themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.orders.solve.chandezon import Chandezon
from mitsuba_diffraction.orders.solve.coupled import CoupledWaves
from mitsuba_diffraction.orders.solve.films import structure_of
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import problem_of
from mitsuba_diffraction.orders.solve.profiles import blazed, lamellar, sinusoidal
from mitsuba_diffraction.orders.solve.stations import Grating, reversed_light

RANGE = (500.0, 600.0)
#: Protected aluminium with a high and a low index; µm.
LAYERS = [("1.46", 0.08), ("2.3+0.01i", 0.06), ("1.38", 0.12)]
SUPERSTRATE = 1.2


def grating(profile, layers=LAYERS, material="Al", **beneath):
    substance = material_of(material, RANGE)
    structure = structure_of(profile, substance, RANGE, layers=layers, **beneath)
    return Grating(profile, substance, SUPERSTRATE, RANGE, structure=structure)


def solved(surface, station, harmonics):
    return CoupledWaves(surface.profile, harmonics, surface.structure).amplitudes(station)


@pytest.mark.parametrize("solver", [CoupledWaves, Chandezon])
def test_flat_stacks_reflect_as_transfer_matrices_say(solver):
    tmm = pytest.importorskip("tmm")
    surface = grating(lamellar(0.5, 0.0) if solver is CoupledWaves else sinusoidal(0.5, 1e-9))
    station = surface.station(1, 0, 0.35, 0.5, [0.2, 0.9])
    amplitudes = solver(surface.profile, 3, surface.structure).amplitudes(station)
    for n, lam in enumerate(station.wavelengths * SUPERSTRATE * 1e3):
        y, c = station.along[n], np.sqrt(1 - station.along[n] ** 2)
        indices = [
            SUPERSTRATE, *(f.material.index(lam)[()] for f in reversed(surface.structure.films)),
            surface.material.index(lam)[()],
        ]  # fmt: skip
        depths = [np.inf, *(1e3 * f.thickness for f in reversed(surface.structure.films)), np.inf]
        for channel, sine in enumerate(station.sines):
            theta = np.arcsin(np.hypot(c * sine, y))
            powers = [tmm.coh_tmm(name, indices, depths, theta, lam)["R"] for name in "sp"]
            row = (np.abs(amplitudes[n, channel, :, channel]) ** 2).sum()
            # rounding; both polarisations together, since axes along the grooves are not s and p
            assert row == pytest.approx(sum(powers), abs=1e-9)


def test_a_film_of_the_material_is_a_higher_profile():
    """And one of the medium above is none."""
    profile = lamellar(0.5, 0.1)
    bare, same = grating(profile, []), grating(profile, [("Al", 0.07)])
    station = bare.station(1, 0, 0.35, 0.5, [0.2])
    coated = replace(station, media=same.station(1, 0, 0.35, 0.5, [0.2]).media)
    difference = np.abs(solved(bare, station, 12)) - np.abs(solved(same, coated, 12))
    assert np.abs(difference).max() < 1e-9
    air = grating(profile, [(str(SUPERSTRATE), 0.07)])
    aired = replace(station, media=air.station(1, 0, 0.35, 0.5, [0.2]).media)
    difference = solved(bare, station, 12) - solved(air, aired, 12)
    assert np.abs(difference).max() < 1e-9


@pytest.mark.parametrize("profile", [lamellar(0.5, 0.1), blazed(0.5, 0.1)], ids=("walls", "slope"))
def test_light_under_films_is_reciprocal(profile):
    surface = grating(profile)
    there, back = (surface.station(1, 0, tau, 0.5, [0.5]) for tau in (0.3, 0.7))
    amplitudes = solved(surface, there, 20)
    difference = amplitudes - reversed_light(solved(surface, back, 20))
    # harmonics are cut at other frequencies: 0.05 with 8 of them on slopes, 0.0035 with 30
    assert np.abs(difference).max() < 0.02
    assert (np.abs(amplitudes) ** 2).sum(axis=(3, 4)).max() < 1


def test_two_solvers_agree_on_films_on_a_slope():
    surface = grating(sinusoidal(0.6, 0.1), [("2.0", 0.08), ("1.38", 0.1)], material="1.6")
    station = surface.station(1, 0, 0.45, 0.5, [0.2])
    coarse, fine = (solved(surface, station, harmonics) for harmonics in (8, 16))
    chandezon = Chandezon(surface.profile, 8, surface.structure).amplitudes(station)
    # phases too: steps in place of the slope miss 0.014 and 0.007, as 1/steps
    assert np.abs(2 * fine - coarse - chandezon).max() < 2e-3


@pytest.mark.parametrize("profile", [sinusoidal(0.6, 0.1), blazed(0.6, 0.1)], ids=("sine", "blaze"))
def test_films_move_a_profile(profile):
    """Light sees only a film that it does not pass, and no film of the medium above."""
    bare, thick = grating(profile, []), grating(profile, [("Al", 0.3)], material="1.5")
    station = bare.station(1, 0, 0.35, 0.5, [0.5])
    same = thick.station(1, 0, 0.35, 0.5, [0.5])
    expected = Chandezon(profile, 12).amplitudes(station)
    got = Chandezon(profile, 12, thick.structure).amplitudes(same)
    # e⁻⁴⁵ of the light reaches the glass; phases are those of a moved profile
    assert np.abs(np.abs(got) - np.abs(expected)).max() < 1e-6
    air = grating(profile, [(str(SUPERSTRATE), 0.07)])
    aired = replace(station, media=air.station(1, 0, 0.35, 0.5, [0.5]).media)
    assert np.abs(Chandezon(profile, 12, air.structure).amplitudes(aired) - expected).max() < 1e-6


def test_light_under_films_on_slopes_is_reciprocal():
    profile = blazed(0.5, 0.1)
    surface = grating(profile)
    there, back = (
        Chandezon(profile, 24, surface.structure).amplitudes(surface.station(1, 0, tau, 0.5, [0.5]))
        for tau in (0.3, 0.7)
    )
    # harmonics beside the vertical wall
    assert np.abs(there - reversed_light(back)).max() < 5e-3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: grating(lamellar(0.5, 0.1), [("1.46", 0.0)]), "layer 1: thickness"),
        (lambda: grating(lamellar(0.5, 0.1), [("1.4", 0.1), ("Unobtainium", 1)]), "is unknown"),
        (lambda: grating(lamellar(0.5, 0.1), [("none", 0.1)]), "layer 1: .*perfect conductor"),
        (lambda: grating(lamellar(0.5, 0.1), LAYERS, "none"), "not thin sheets or perfect"),
        (lambda: problem_of(grating(blazed(0.5, 0.1)), "integral", 20), "method=coupled"),
    ],
)
def test_films_that_cannot_be_solved_are_refused(make, message):
    with pytest.raises(DiffractionError, match=message):
        make()
