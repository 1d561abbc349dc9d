"""What lies beneath: it gets what is not reflected, and the flags say that it is there."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.reference import fresnel
from mitsuba_diffraction.tables.directional import DirectionalTable
from mitsuba_diffraction.tables.energy.conservation import Energy
from mitsuba_diffraction.tables.energy.conserved import Reflector
from mitsuba_diffraction.tables.energy.settings import EnergySettings
from tests.support.coarse import energy_as
from tests.support.furnace import furnace
from tests.support.gentle import load, pairs
from tests.support.lanes import bitmap, evaluated, interaction, spectra, vectors, with_bitmaps


def test_what_is_not_reflected_reaches_the_nested_bsdf(variant):
    pigment = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
    bare, coated = load(int_ior=1.5), load(int_ior=1.5, pigment=pigment)
    wi, wo, lam = pairs()
    context, si = mi.BSDFContext(), interaction(wi, lam[:, None])
    eta = 1.5 / 1.000277
    table = bare.table
    glass = Reflector("small_slope", lambda w: np.full(len(w), 1.5 + 0j))
    albedo = Energy(table, glass, table.wavelength_range).at(1.0).albedo
    flat = fresnel.reflectance(np.cos(albedo.grid.theta), 1.5)[:, None]
    excess = DirectionalTable(albedo.wavelengths, (albedo.values - flat).astype(np.float32))

    def transmittance(directions):
        theta, phi = np.arccos(directions[:, 2]), np.arctan2(directions[:, 1], directions[:, 0])
        more = [excess.at(*one) for one in zip(theta, phi, lam, strict=True)]
        return 1 - np.array(more) - fresnel.reflectance(directions[:, 2], eta)

    t = transmittance(wi) * transmittance(wo)
    beneath = spectra(mi.load_dict(pigment).eval(context, si, vectors(wo)))
    expected = evaluated(bare, wi, wo, lam[:, None]) + t[:, None] * beneath
    # an angle in single precision, on a grid of directions
    assert evaluated(coated, wi, wo, lam[:, None]) == pytest.approx(expected, rel=1e-4)
    # and it is not the flat interface's
    assert np.abs(excess.values / flat).max() > 0.02


def test_flags_say_what_there_is(some_variant):
    bare = load(int_ior=1.5)
    assert bare.component_count() == 1
    assert mi.has_flag(bare.flags(), mi.BSDFFlags.GlossyReflection)
    assert mi.has_flag(bare.flags(), mi.BSDFFlags.Anisotropic)
    assert mi.has_flag(bare.flags(), mi.BSDFFlags.FrontSide)
    assert not mi.has_flag(bare.flags(), mi.BSDFFlags.BackSide)
    coated = load(int_ior=1.5, pigment={"type": "diffuse"})
    assert coated.component_count() == 2
    assert mi.has_flag(coated.flags(), mi.BSDFFlags.DiffuseReflection)
    assert mi.has_flag(coated.flags(1), mi.BSDFFlags.DiffuseReflection)


FLAT = md.HeightField(np.zeros((8, 8)), 0.05, periodic=True)
WHITE = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}


#: Rows of texels, of which the first is at (0, 0).
FRINGES = {
    "one thickness": {"film_thickness": 1738.0},
    "texture": {
        "film_thickness": np.array([[0.7, 0.0, 1.0]]), "film_thickness_min": 600.0,
        "film_thickness_max": 700.0,
    },
    "stretched": {"film_thickness": 1738.0, "lateral_scale": np.array([[0.95, 0.6, 1.0]])},
}  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("name", FRINGES)
def test_a_film_of_many_fringes_over_white_sends_on_no_more_than_it_gets(some_variant, name):
    # its fringes come and go within 25 nm; a window of a wavelength smears them
    film = with_bitmaps(FRINGES[name]) | {"film_ior": 1.32, "int_ior": 1.1, "ext_ior": 1.0}
    with energy_as(EnergySettings(polar=24, azimuthal=12)):
        bsdf = load(FLAT, **film, coherence_width=0.5, beneath=WHITE)
    # four times, at other wavelengths
    mean, error = furnace(bsdf, angles=4 * (70.0, 80.0, 84.0, 87.0), azimuths=(0.0,))
    assert np.all(mean <= 1.003 + 4.0 * error)


@pytest.mark.parametrize("width", [1.5, 6.0, 65.0])
def test_white_beneath_a_less_dense_medium_sends_on_no_more_than_it_gets(mono, width):
    """Light is totally reflected from 72.25° on, where the albedo rises to 1 within a lobe."""
    bsdf = load(FLAT, int_ior=1.0, ext_ior=1.05, coherence_width=width, beneath=WHITE)
    mean, error = furnace(bsdf, angles=(60.0, 70.0, 71.7, 72.1, 72.2, 73.0, 84.0), azimuths=(20.0,))
    assert np.all(mean <= 1.003 + 4.0 * error), mean


@pytest.mark.thorough
@pytest.mark.parametrize("metal", ["gold", "filmed aluminium"])
def test_a_metal_of_varying_stretch_sends_on_no_more_than_it_gets(variant, metal):
    """Of a stretch that differs from the mean one, whose light has other indices."""
    field = md.HeightField(0.09 * np.tile(np.arange(24) % 8 < 4, (8, 1)), 0.07)
    material = {"material": "Au"}
    if metal != "gold":
        material = {"material": "Al", "film_ior": 1.5, "film_thickness": 300.0}
    given = {"lateral_scale": bitmap([[0.95, 0.6, 1.0]]), "energy_conserving": True}
    bsdf = load(field, coherence_width=0.9, **material, **given)
    for seed in range(4):
        mean, error = furnace(bsdf, angles=(60.0, 80.0, 85.0), azimuths=(0.0, 45.0), seed=seed)
        # orders of steps come and go between height scales; with the mean stretch's indices 1.27,
        # and 1.45 under the film
        assert np.all(mean <= 1.04 + 4.0 * error), mean.max()
