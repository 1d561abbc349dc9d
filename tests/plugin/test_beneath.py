"""What lies beneath: it gets what is not reflected, and the flags say that it is there."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.directions import polar
from tests.lanes import evaluated, interaction, spectra, vectors
from tests.plugin.gentle import load, pairs


def test_what_is_not_reflected_reaches_the_nested_bsdf(variant):
    pigment = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
    bare, coated = load(int_ior=1.5), load(int_ior=1.5, pigment=pigment)
    wi, wo, lam = pairs()
    context, si = mi.BSDFContext(), interaction(wi, lam[:, None])
    eta = 1.5 / 1.000277

    def transmittance(cos_theta):
        return 1 - np.array(mi.fresnel(mi.Float(cos_theta.astype(np.float32)), eta)[0])

    t = transmittance(wi[:, 2]) * transmittance(wo[:, 2])
    beneath = spectra(mi.load_dict(pigment).eval(context, si, vectors(wo)))
    expected = evaluated(bare, wi, wo, lam[:, None]) + t[:, None] * beneath
    # three sums and products in single precision
    assert evaluated(coated, wi, wo, lam[:, None]) == pytest.approx(expected, rel=1e-5)


def test_over_a_white_base_no_light_is_gained_where_a_mirror_would_gain_none(variant):
    white = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}
    flat = md.HeightField(np.zeros((60, 60)), 0.08)
    bsdf = load(flat, int_ior=1.5, white=white)
    n = 1 << 14
    rng = np.random.default_rng(4)
    s1, s2 = mi.Float(rng.random(n).astype("f4")), mi.Point2f(*rng.random((2, n)).astype("f4"))
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
