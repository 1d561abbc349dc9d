"""Phases of orders: of fields at the origin of the profile, with time exp(−iωt)."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.orders.listing import JONES, WITH_PHASE, list_orders
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import Profile, polygon, sinusoidal
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.reference.fresnel import amplitudes as fresnel

WAVELENGTH = 550.0
#: 2π/λ, 1/µm.
WAVENUMBER = 2e3 * np.pi / WAVELENGTH
SETTINGS = Settings((WAVELENGTH, WAVELENGTH), polarised=True, resolution=12)


def nearly_flat(walls, height=0.0):
    """A profile 10⁻⁴ nm deep, of steps or smooth, at a height."""
    steps = [(0.0, height), (0.3, height), (0.3, height - 1e-7), (0.6, height - 1e-7)]
    u = np.arange(64) / 64
    smooth = Profile(0.6 * u, height + 1e-7 * np.cos(2 * np.pi * u), 0.6)
    return polygon(steps, 0.6) if walls else smooth


def solved(profile, material, theta, phi, resolution=12, method="auto", **more):
    """Jones matrices by order of one light."""
    settings = Settings(
        (WAVELENGTH, WAVELENGTH), method=method, polarised=True, resolution=resolution
    )
    table = solve_orders(profile, material, theta=theta, phi=phi, settings=settings, **more)
    return listed(table, WAVELENGTH, theta, phi)


def listed(table, *light):
    """Jones matrices by order of one light; all of them have their phase."""
    listing = list_orders(table, *light, jones=True)
    first = listing.columns.index(JONES[0])
    parts = listing.rows[:, first : first + 8]
    assert listing.rows[:, listing.columns.index(WITH_PHASE)].all()
    matrices = (parts[:, 0::2] + 1j * parts[:, 1::2]).reshape(-1, 2, 2)
    orders = listing.rows[:, 3:first].astype(int).tolist()
    return {tuple(order): matrix for order, matrix in zip(orders, matrices, strict=True)}


@pytest.mark.parametrize("light", [(40.0, 60.0), (-40.0, 60.0), (40.0, 200.0), (0.0, 0.0)])
@pytest.mark.parametrize("walls", [False, True])
def test_a_raised_mirror_has_fresnel_s_amplitudes_and_the_phase_of_its_way(walls, light):
    """exp(−2ikh cosθ); r_s and r_p of a metal (Born and Wolf, section 1.5.2). Two solvers."""
    height, cosine = 0.137, np.cos(np.radians(light[0]))
    coefficients = fresnel(cosine, material_of("Al", SETTINGS.wavelengths).index(WAVELENGTH))
    expected = np.diag(coefficients) * np.exp(-2j * WAVENUMBER * height * cosine)
    found = solved(nearly_flat(walls, height), "Al", *light)
    # the depth; the light 10⁻⁴° from the normal that stands for it
    np.testing.assert_allclose(found[0,], expected, atol=5e-6)


@pytest.mark.parametrize("method", ["chandezon", "coupled"])
def test_a_film_has_airy_s_amplitudes_at_the_level_of_the_metal(method):
    """(r₁ + r₂E)/(1 + r₁r₂E), E = exp(2ik n t cosθ'); its upper face is t nearer to the light."""
    thickness, film = 0.083, 1.46
    cosine = np.cos(np.radians(40.0))
    within = np.sqrt(1.0 - (1.0 - cosine**2) / film**2)
    metal = material_of("Al", SETTINGS.wavelengths).index(WAVELENGTH)
    faces = zip(fresnel(cosine, film), fresnel(within, metal / film), strict=True)
    through = np.exp(2j * WAVENUMBER * film * thickness * within)
    airy = [(first + last * through) / (1.0 + first * last * through) for first, last in faces]
    profile = nearly_flat(method == "coupled")
    found = solved(profile, "Al", 40.0, 60.0, method=method, layers=[(str(film), thickness)])
    expected = np.diag(airy) * np.exp(-2j * WAVENUMBER * thickness * cosine)
    # the depth
    np.testing.assert_allclose(found[0,], expected, atol=5e-6)


@pytest.mark.parametrize("light", [(20.0, 0.0), (20.0, -130.0)])
def test_orders_of_shifted_grooves_turn_by_their_number(light):
    """The field of order m has exp(2πimx/d) of the incident one at a point of the grooves."""
    u, shift = np.arange(128) / 128, 0.2
    there, here = (
        solved(Profile(0.9 * u, 0.05 * np.cos(a) + 0.02 * np.cos(2 * a + 0.3), 0.9), "Al", *light)
        for a in (2 * np.pi * u, 2 * np.pi * (u - shift))
    )
    assert len(there) > 2
    for order, matrix in there.items():
        turned = matrix * np.exp(-2j * np.pi * order[0] * shift)
        np.testing.assert_allclose(here[order], turned, atol=1e-5)  # harmonics


HILL = np.zeros((8, 8))
HILL[1:4, 2:5] = 0.1


@pytest.mark.thorough
@pytest.mark.parametrize("phi", [20.0, 150.0, 200.0, 340.0])
def test_orders_of_shifted_heights_turn_too_whichever_mirror_image_is_solved(phi):
    """A square hill is its own mirror image about planes beside the origin; a notch ends that."""
    notched = HILL.copy()
    notched[7, 6] = 1e-7
    fields = {
        name: md.HeightField(heights, 0.6 / 8, periodic=True)
        for name, heights in (
            ("hill", HILL), ("notched", notched), ("shifted", np.roll(HILL, (1, 3), (0, 1))),
        )
    }  # fmt: skip
    found = {name: solved(field, "1.5", 30.0, phi, resolution=3) for name, field in fields.items()}
    assert len(found["hill"]) > 3
    for order, matrix in found["hill"].items():
        turn = np.exp(-2j * np.pi * (3 * order[0] + order[1]) / 8)
        np.testing.assert_allclose(found["shifted"][order], matrix * turn, atol=1e-6)
        np.testing.assert_allclose(found["notched"][order], matrix, atol=1e-6)


def test_saved_light_keeps_its_phases_and_other_light_says_that_it_has_none(tmp_path):
    settings = Settings((540.0, 560.0), polarised=True, resolution=12)
    profile = sinusoidal(0.9, 0.1)
    table = solve_orders(profile, "Al", theta=[-20.0, 30.0], phi=0.0, step=10.0, settings=settings)
    table.save(tmp_path / "table.nc")
    loaded = md.OrderTable.load(tmp_path / "table.nc")
    for wavelength, theta in itertools.product((540.0, 550.0, 560.0), (-20.0, 30.0)):
        before, after = (listed(each, wavelength, theta, 0.0) for each in (table, loaded))
        assert before.keys() == after.keys()
        for order, matrix in before.items():
            np.testing.assert_array_equal(after[order], matrix)
            share = loaded.polarised_efficiency(
                -np.sin(np.radians(theta)), 0.0, wavelength, order[0]
            )
            # single precision of the table's elements
            np.testing.assert_allclose((np.abs(matrix) ** 2).sum(axis=0), share, atol=1e-6)
    for light in ((545.0, 30.0, 0.0), (550.0, 20.0, 0.0), (550.0, 30.0, 10.0)):
        listing = list_orders(loaded, *light, jones=True)
        assert not listing.rows[:, listing.columns.index(WITH_PHASE)].any()
        assert np.abs(listing.rows[:, listing.columns.index("J_ss_im")]).max() < 1e-12
