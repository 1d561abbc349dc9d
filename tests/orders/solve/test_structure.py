"""Films on profiles and layers beneath: transfer matrices, other solvers, and themselves."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from docs.make.validation.light import light_on, powers_of
from docs.make.validation.stacks import BENEATH, MIRROR, RIDGES, by_ikarus
from mitsuba_diffraction.orders.solve.chandezon import Chandezon
from mitsuba_diffraction.orders.solve.coupled import CoupledWaves
from mitsuba_diffraction.orders.solve.films import read_layers, structure_of
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import AUTO, problem_of, solver_of
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import blazed, lamellar, sinusoidal
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating, reversed_light

PERIOD = 0.5
#: A slice of two materials and a gap, and a ridge across the period's end, as of a scale of Morpho.
SLICES = (
    (0.06, ("chitin", 0.05, 0.3), ("1.9+0.2i", 0.3, 0.35)),
    (0.09, ("chitin", 0.42, 0.58)),
)
#: Protected aluminium with a high and a low index; µm.
LAYERS = [("1.46", 0.08), ("2.3+0.01i", 0.06), ("1.38", 0.12)]
SUPERSTRATE = 1.2


def grating(profile, material="1.46", superstrate=1.0, **media):
    """A grating with films and layers; media are arguments of `structure_of`."""
    limits = (500.0, 600.0)
    substance = material_of(material, limits)
    structure = structure_of(profile, substance, limits, **media)
    return Grating(profile, substance, superstrate, limits, structure=structure)


def filmed(profile, layers=LAYERS, material="Al"):
    """A grating with films, under another medium than air."""
    return grating(profile, material, SUPERSTRATE, layers=layers)


def efficiencies(surface, harmonics, theta, wavelength):
    """Efficiencies (2,) of s and p light by order, of light across the grooves."""
    solver = solver_of(problem_of(surface, AUTO, harmonics))
    return powers_of(solver, light_on(surface, -np.sin(np.radians(theta)), 0.0, wavelength))


def solved(surface, harmonics, place=(1, 0, 0.35, 0.5), w=(0.5,)):
    return at_station(surface, surface.station(*place, w), harmonics)


def at_station(surface, station, harmonics):
    return CoupledWaves(surface.profile, harmonics, surface.structure).amplitudes(station)


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


@pytest.mark.parametrize(
    ("method", "surface", "size", "error"),
    [
        # harmonics are cut at other frequencies: 0.05 with 8 of them on slopes, 0.0035 with 30
        ("coupled", filmed(lamellar(PERIOD, 0.1)), 20, 0.02),
        ("coupled", filmed(blazed(PERIOD, 0.1)), 20, 0.02),
        # harmonics beside the vertical wall
        ("chandezon", filmed(blazed(PERIOD, 0.1)), 24, 5e-3),
        # 1e-2 with 8
        ("coupled", grating(lamellar(PERIOD, 0.0), "melanin", beneath=SLICES), 20, 3e-3),
        # the solver's own error with so many points or harmonics
        ("integral", grating(blazed(0.8, 0.1), "Al"), 110, 5e-3),
        ("chandezon", grating(blazed(0.8, 0.1), "Al"), 15, 5e-6),
    ],
    ids=["walls", "slope", "slope by Chandezon", "slices", "points", "bare slope"],
)
def test_light_is_reciprocal(method, surface, size, error):
    if method == "integral":
        pytest.importorskip("gratinglab")
    waves = solver_of(problem_of(surface, method, size))
    there, back = (waves.amplitudes(surface.station(1, 0, tau, 0.5, (0.5,))) for tau in (0.3, 0.7))
    assert np.abs(there - reversed_light(back)).max() < error
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


def stack_of(surface, lam):
    """Indices of flat layers from the medium above down, and thicknesses in nm."""
    structure = surface.structure
    layers = [(film.material, film.thickness) for film in reversed(structure.films)]
    layers += [(part.parts[0].material, part.thickness) for part in reversed(structure.slices)]
    materials = [*(material for material, _ in layers), structure.substrate or surface.material]
    indices = [surface.superstrate, *(material.index(lam)[()] for material in materials)]
    return indices, [np.inf, *(1e3 * thickness for _, thickness in layers), np.inf]


@pytest.mark.parametrize(
    ("solver", "surface"),
    [
        (CoupledWaves, filmed(lamellar(PERIOD, 0.0))),
        (Chandezon, filmed(sinusoidal(PERIOD, 1e-9))),
        (
            CoupledWaves,
            grating(lamellar(PERIOD, 0.0), layers=LAYERS, beneath=MIRROR, substrate="Al"),
        ),
    ],
    ids=["walls", "slopes", "beneath"],
)
def test_flat_stacks_reflect_as_transfer_matrices_say(solver, surface):
    tmm = pytest.importorskip("tmm")
    station = surface.station(1, 0, 0.35, 0.5, [0.2, 0.9])
    amplitudes = solver(surface.profile, 3, surface.structure).amplitudes(station)
    for n, lam in enumerate(station.wavelengths * surface.superstrate * 1e3):
        y, c = station.along[n], np.sqrt(1 - station.along[n] ** 2)
        for channel, sine in enumerate(station.sines):
            theta = np.arcsin(np.hypot(c * sine, y))
            powers = [tmm.coh_tmm(name, *stack_of(surface, lam), theta, lam)["R"] for name in "sp"]
            row = (np.abs(amplitudes[n, channel, :, channel]) ** 2).sum()
            # rounding; both polarisations together: along the grooves s and p mix
            assert row == pytest.approx(sum(powers), abs=1e-9)


def test_two_solvers_agree_on_films_on_a_slope():
    surface = filmed(sinusoidal(0.6, 0.1), [("2.0", 0.08), ("1.38", 0.1)], material="1.6")
    station = surface.station(1, 0, 0.45, 0.5, [0.2])
    coarse, fine = (at_station(surface, station, harmonics) for harmonics in (8, 16))
    chandezon = Chandezon(surface.profile, 8, surface.structure).amplitudes(station)
    # phases too: steps in place of the slope miss 0.014 and 0.007, as 1/steps
    assert np.abs(2 * fine - coarse - chandezon).max() < 2e-3


@pytest.mark.parametrize(
    ("layers", "step", "warned"),
    [
        ([("1.38", 100.0)], 5.0, True),  # 100 nm, given as µm
        ([("1.38", 0.1)], 5.0, False),
        ([("1.38", 100.0)], 1.0, False),  # one wavelength: nothing is interpolated
        ([("1.38", 100.0), ("Al", 1.0)], 5.0, False),  # behind a mirror
        ([("1.38", 4.0)], 5.0, False),  # fringes 22 nm apart
    ],
)
def test_fringes_that_the_wavelengths_do_not_resolve_are_warned_of(layers, step, warned):
    limits = (500.0, 500.0) if step == 1.0 else (500.0, 505.0)
    settings = Settings(limits, method="chandezon", resolution=5)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solve_orders(sinusoidal(0.4, 0.02), layers=layers, theta=0.0, step=step, settings=settings)
    lines = [str(each.message) for each in caught if "fringes" in str(each.message)]
    assert len(lines) == warned
    for line in lines:  # the step that it names resolves them
        named = float(line.partition("step=")[2].split()[0])
        assert named == pytest.approx(0.5 * 500.0**2 / (2e3 * 1.38 * 100.0), rel=0.02)
