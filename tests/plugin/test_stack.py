"""Stacks of layers on a structure: light, energy, and what is refused."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.mirror import mirror_cosine
from mitsuba_diffraction.optics.stack import mean_powers
from mitsuba_diffraction.plugin.description import Feature, describe
from mitsuba_diffraction.plugin.stack import read_layers
from tests.support.directions import polar
from tests.support.furnace import furnace
from tests.support.lanes import evaluated
from tests.support.stokes import matrices
from tests.support.variants import use

pytestmark = pytest.mark.thorough

FLAT = md.HeightField(np.zeros((8, 8)), 0.05, periodic=True)


def stack(folder, text):
    (folder / "stack.toml").write_text(text)
    return str(folder / "stack.toml")


CHITIN = 'layers = [["chitin", 0.09], ["1.33", 0.08]]\nrepeat = 6\n'


@pytest.mark.parametrize("spread", [0.0, 0.05])
def test_a_surface_reflects_what_the_stack_does_at_the_mirrors_angle(tmp_path, spectral, spread):
    file = stack(tmp_path, f"{CHITIN}spread = {spread}")
    shared = {"coherence_width": 2.0, "energy_conserving": False}
    bsdf = mi.load_dict(md.bsdf_dict(FLAT, material="1.56+0.3i", layers=file, **shared))
    perfect = mi.load_dict(md.bsdf_dict(FLAT, material="none", **shared))
    angles, lam = np.array([10.0, 30, 50]), np.array([420.0, 500, 580, 660])
    wo = [polar(angle) for angle in angles]
    ratio = np.divide(*(evaluated(b, polar(30.0, 180.0), wo, lam[None]) for b in (bsdf, perfect)))
    layers = read_layers(tmp_path / "stack.toml")
    half, towards = np.cos(np.radians(0.5 * (angles + 30))), np.cos(np.radians(angles))
    substrate = np.full((1, 4), 1.56 + 0.3j)
    indices = np.concatenate([substrate, layers.indices(lam)])
    powers = []
    for i, wavelength in enumerate(lam):
        sharpness = 2000 * np.pi / wavelength * bsdf.table.sigma_0
        cosines = mirror_cosine(half, np.cos(np.radians(30)), towards, sharpness)
        means = mean_powers(cosines, lam, indices, layers.thicknesses, spread)
        powers.append(means[i, :, :2].real.mean(axis=-1))
    # linear interpolation between 24 nodes of a fringe; single precision
    np.testing.assert_allclose(ratio, np.transpose(powers), atol=0.008)
    assert Feature.STACK in describe(bsdf).features()


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_mono_polarized"])
def test_no_direction_reflects_more_than_it_receives(tmp_path, variant):
    use(variant)
    # 20 quarter waves of 550 nm: a stop band of 0.999
    file = stack(tmp_path, 'layers = [["2.3", 0.0598], ["1.38", 0.0996]]\nrepeat = 10')
    rough = md.gratings.sinusoidal(period=1.5, depth=0.1, periods=2)
    bsdf = mi.load_dict(md.bsdf_dict(rough, coherence_width=3.0, layers=file))
    mean, error = furnace(bsdf, angles=(0.0, 60.0, 85.0), azimuths=(0.0,))
    assert np.all(mean < 1.01 + 4.0 * error)
    assert mean[:, 0].max() > 0.8


def test_a_gap_over_a_white_base_sends_on_no_more_than_it_gets(tmp_path, some_variant):
    # flat, it reflects 3e-5; a window of 1.4 wavelengths reflects 0.01 of light from 65°
    white = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}
    gap = {"int_ior": 1.01, "ext_ior": 1.0, "layers": stack(tmp_path, 'layers = [["1.0", 0.1]]')}
    bsdf = mi.load_dict(md.bsdf_dict(FLAT, coherence_width=0.8, beneath=white, **gap))
    mean, error = furnace(bsdf, angles=(0.0, 65.0, 80.0), azimuths=(0.0,))
    assert np.all(mean <= 1.003 + 4.0 * error)


def test_polarised_light_has_the_phases_of_a_film(tmp_path):
    use("llvm_ad_mono_polarized")
    shared = {"coherence_width": 8.0, "material": "Al", "energy_conserving": False}
    film = {"film_ior": 1.77, "film_thickness": 250.0, "model": "kirchhoff"}
    both = []
    for more in (film, {"layers": stack(tmp_path, 'layers = [["1.77", 0.25]]')}):
        bsdf = mi.load_dict(md.bsdf_dict(FLAT, **shared, **more))
        both.append(matrices(bsdf, polar(50.0, 180.0)[None], polar(50.0)[None], 550.0))
    # nodes over the angle
    np.testing.assert_allclose(both[1], both[0], atol=5e-3 * both[0][0, 0, 0, 0])


def test_iridophores_lie_beneath_a_scale(tmp_path, spectral):
    below = md.bsdf_dict(FLAT, coherence_width=2.0, material="melanin",
                         layers=stack(tmp_path, CHITIN))  # fmt: skip
    scale = md.bsdf_dict(FLAT, coherence_width=2.0, material="keratin", pigment=below)
    alone, with_stack = (
        evaluated(mi.load_dict(each), polar(30.0, 180.0), polar(30.0), 500.0)[0, 0]
        for each in (md.bsdf_dict(FLAT, coherence_width=2.0, material="keratin"), scale)
    )
    assert with_stack > 1.5 * alone


@pytest.mark.parametrize(
    ("text", "more", "message"),
    [
        ("spread = 0.1", {}, "layers: expected pairs"),
        ('layers = [["chitin", 0]]', {}, "layer 1: thickness"),
        ('layers = [["chitim", 0.1]]', {}, "did you mean chitin"),
        ('layers = [["none", 0.1]]', {}, "perfect conductor is no layer"),
        ('layers = [["1.5", 0.1]]\nrepeet = 2', {}, "unknown key 'repeet'"),
        ('layers = [["1.5", 0.1]]\nrepeat = 100', {}, "interfere"),
        (CHITIN, {"coat_ior": 1.5}, "cannot be combined"),
        (CHITIN, {"film_ior": 1.5, "film_thickness": 100.0}, "cannot be combined"),
        (CHITIN, {"material": "none"}, "cannot be combined"),
        (CHITIN, {"model": "small_slope"}, "cannot be combined"),
        ('layers = [["melanin", 0.1]]', {"pigment": 0.5}, "absorb the light"),
    ],
)
def test_wrong_stacks_are_one_line(tmp_path, spectral, text, more, message):
    surface = md.bsdf_dict(FLAT, coherence_width=2.0, layers=stack(tmp_path, text), **more)
    with pytest.raises((DiffractionError, RuntimeError), match=message):
        mi.load_dict(surface)
