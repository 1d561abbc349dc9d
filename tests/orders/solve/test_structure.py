"""Layers and slices beneath profiles, beside transfer matrices, another solver and themselves."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation.light import light_on, powers_of
from docs.make.validation.stacks import (
    BENEATH,
    MIRROR,
    RIDGES,
    by_ikarus,
    quarter_wave_reflectance,
)
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.orders.solve.coupled import CoupledWaves
from mitsuba_diffraction.orders.solve.films import read_layers, structure_of
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import AUTO, Jobs, problem_of, solver_of
from mitsuba_diffraction.orders.solve.profiles import lamellar, sinusoidal
from mitsuba_diffraction.orders.solve.resolution import places_to_test, resolved
from mitsuba_diffraction.orders.solve.stations import Grating, reversed_light

PERIOD = 0.5
#: A slice of two materials and a gap, and a ridge across the period's end, as of a scale of Morpho.
SLICES = (
    (0.06, ("chitin", 0.05, 0.3), ("1.9+0.2i", 0.3, 0.35)),
    (0.09, ("chitin", 0.42, 0.58)),
)


def grating(profile, material="1.46", superstrate=1.0, **media):
    """A grating with films and layers; media are arguments of `structure_of`."""
    limits = (500.0, 600.0)
    substance = material_of(material, limits)
    structure = structure_of(profile, substance, limits, **media)
    return Grating(profile, substance, superstrate, limits, structure=structure)


def efficiencies(surface, harmonics, theta, wavelength):
    """Efficiencies (2,) of s and p light by order, of light across the grooves."""
    solver = solver_of(problem_of(surface, AUTO, harmonics))
    return powers_of(solver, light_on(surface, -np.sin(np.radians(theta)), 0.0, wavelength))


def solved(surface, harmonics, place=(1, 0, 0.35, 0.5), w=(0.5,)):
    solver = CoupledWaves(surface.profile, harmonics, surface.structure)
    return solver.amplitudes(surface.station(*place, w))


def test_layers_over_and_beneath_a_flat_surface_reflect_as_transfer_matrices_say():
    tmm = pytest.importorskip("tmm")
    media = {"layers": [("1.38", 0.12)], "beneath": MIRROR, "substrate": "Al"}
    surface = grating(lamellar(PERIOD, 0.0), **media)
    lam = 540.0
    aluminium = surface.structure.substrate.index(lam)[()]
    indices = [1.0, 1.38, *(1.95, 1.46) * 3, aluminium]
    depths = [np.inf, 120.0, *(75.0, 100.0) * 3, np.inf]
    for theta in (10.0, 50.0):
        got = efficiencies(surface, 3, theta, lam)[0]
        expected = [
            tmm.coh_tmm(name, indices, depths, np.radians(theta), lam)["R"] for name in "sp"
        ]
        assert np.allclose(got, expected, atol=1e-9)  # rounding


def test_a_quarter_wave_stack_reflects_as_its_closed_form_says():
    """Born and Wolf, Principles of Optics, section 1.6.5, for N double layers on an index."""
    low, high, pairs, lam = 1.46, 2.35, 5, 550.0
    beneath = [(high, 1e-3 * lam / 4 / high), *[
        (low, 1e-3 * lam / 4 / low), (high, 1e-3 * lam / 4 / high)
    ] * pairs]  # fmt: skip
    surface = grating(lamellar(PERIOD, 0.0), "1.52", beneath=beneath)
    got = efficiencies(surface, 2, 1e-3, lam)[0]
    assert np.allclose(got, quarter_wave_reflectance(low, high, 1.52, pairs), atol=1e-8)


def test_a_grating_on_a_mirror_has_the_efficiencies_of_ikarus():
    """Silica ridges on a dielectric mirror, which send light of 532 nm at 45° back to its source.

    Hehl et al. 1999 (Applied Optics 38, 6257) computed 100 % of s light for such gratings, and
    measured 97 %.
    """
    pytest.importorskip("ikarus")
    surface = grating(lamellar(*RIDGES), beneath=BENEATH)
    ours, theirs = efficiencies(surface, 6, 45.0, 532.0), by_ikarus(45.0, 532.0)
    assert ours[1][0] > 0.99
    for order, values in theirs.items():
        # the Fourier series of 40 pixels: 2e-4; n_orders beyond 6 changes 1e-4
        assert ours[order] == pytest.approx(values, abs=1e-3)


def test_a_slice_is_a_rectangular_profile():
    ridge = solved(grating(lamellar(PERIOD, 0.1, 0.4), "Al"), 12)
    surface = grating(lamellar(PERIOD, 0.0), "Al", beneath=[(0.1, ("Al", 0.3, 0.3 + 0.4 * PERIOD))])
    # moved along x, and in z: phases alone differ
    assert np.allclose(np.abs(ridge), np.abs(solved(surface, 12)), atol=1e-9)


def test_a_substrate_of_the_material_and_a_layer_of_it_change_nothing():
    profile = sinusoidal(PERIOD, 0.1)
    bare, same = grating(profile), grating(profile, beneath=[("1.46", 0.2)], substrate="1.46")
    assert np.allclose(solved(bare, 8), solved(same, 8), atol=1e-9)


def test_light_on_slices_is_reciprocal():
    surface = grating(lamellar(PERIOD, 0.0), "melanin", beneath=SLICES)
    there, back = (solved(surface, 20, (1, 0, tau, 0.5)) for tau in (0.3, 0.7))
    # harmonics are cut at other frequencies: 1e-2 with 8
    assert np.abs(there - reversed_light(back)).max() < 3e-3
    assert (np.abs(there) ** 2).sum(axis=(3, 4)).max() < 1


def test_layers_are_read_from_a_file(tmp_path):
    file = tmp_path / "stack.toml"
    file.write_text(
        'layers = [["1.46", 0.1], [0.06, ["chitin", 0.05, 0.3], ["melanin", 0.3, 0.4]]]\nrepeat = 2'
    )
    layers = read_layers(file)
    assert len(layers) == 4
    surface = grating(lamellar(PERIOD, 0.05), beneath=layers)
    assert len(surface.structure.slices) == 4
    assert "chitin and melanin 0.06 µm" in surface.material_text


def test_the_structure_identifies_a_problem():
    """Stored stations of another structure are not used."""
    first = [(0.1, ("2", 0.1, 0.2))], [(0.1, ("2", 0.1, 0.3))], [("2", 0.1)], [("2.1", 0.1)]
    problems = [
        problem_of(grating(lamellar(PERIOD, 0.1), beneath=beneath), "auto", 8) for beneath in first
    ]
    assert len({problem.digest for problem in problems}) == len(problems)
    assert {problem.method for problem in problems} == {"coupled"}


@pytest.mark.parametrize(
    ("media", "message"),
    [
        ({"beneath": [("1.46", 0.0)]}, "beneath 1: thickness"),
        ({"beneath": [(0.1, ("1.5", 0.3, 0.2))]}, "must end after its beginning"),
        ({"beneath": [(0.1, ("1.5", 0.0, 0.3), ("2", 0.2, 0.4))]}, "before the next part begins"),
        ({"beneath": [(0.1, ("1.5", 0.3, 0.7), ("2", 0.1, 0.2))]}, "before the next part begins"),
        ({"beneath": [(0.1, "SiO2", 0.2)]}, "parts are a material"),
        ({"beneath": [("Alu", 0.2)]}, "did you mean Al"),
        ({"layers": [(0.1, ("1.5", 0.3, 0.7))]}, "slices lie beneath a profile"),
        ({"substrate": "none"}, "substrate: .*perfect conductor"),
    ],
)
def test_impossible_structures_are_refused(media, message):
    with pytest.raises(DiffractionError, match=message):
        grating(lamellar(PERIOD, 0.1), **media)


def test_a_grating_of_the_medium_above_is_refused():
    """It reflects nothing, so that no error is a share of its light."""
    for beneath in ((), [("1.2", 0.1)]):
        surface = grating(lamellar(PERIOD, 0.1), "1.2", 1.2, beneath=beneath)
        problem = problem_of(surface, "coupled", 8)
        with pytest.raises(DiffractionError, match="reflects no light"):
            resolved(problem, Jobs(), places_to_test(range(2)), 0.01)
