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
from tests.support.directions import polar
from tests.support.gentle import load, pairs
from tests.support.lanes import evaluated, interaction, lanes, spectra, vectors


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
    ratio = DirectionalTable(albedo.wavelengths, (albedo.values / flat).astype(np.float32))

    def transmittance(directions):
        theta, phi = np.arccos(directions[:, 2]), np.arctan2(directions[:, 1], directions[:, 0])
        relative = [ratio.at(*one) for one in zip(theta, phi, lam, strict=True)]
        return 1 - np.array(relative) * fresnel.reflectance(directions[:, 2], eta)

    t = transmittance(wi) * transmittance(wo)
    beneath = spectra(mi.load_dict(pigment).eval(context, si, vectors(wo)))
    expected = evaluated(bare, wi, wo, lam[:, None]) + t[:, None] * beneath
    # an angle in single precision, on a grid of directions
    assert evaluated(coated, wi, wo, lam[:, None]) == pytest.approx(expected, rel=1e-4)
    # and it is not the flat interface's
    assert np.abs(ratio.values - 1.0).max() > 0.02


def test_over_a_white_base_no_light_is_gained_where_a_mirror_would_gain_none(variant):
    white = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}
    flat = md.HeightField(np.zeros((60, 60)), 0.08)
    bsdf = load(flat, int_ior=1.5, white=white)
    n = 1 << 14
    rng = np.random.default_rng(4)
    s1, s2 = lanes(rng.random(n)), mi.Point2f(*map(lanes, rng.random((2, n))))
    for theta in (0.0, 50.0):
        si = interaction(np.tile(polar(theta), (n, 1)), 550.0)
        _, weight = bsdf.sample(mi.BSDFContext(), si, s1, s2)
        weights = spectra(weight)[:, 0]
        # three standard errors, and 2 % for the lobe of so small a window (kσ = 13)
        assert weights.mean() < 1.0 + 3 * weights.std() / np.sqrt(n) + 0.02


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
