"""What the BSDF returns: its table, reciprocal, nothing below, the lobes where they belong."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import wavenumber
from tests.support.directions import polar
from tests.support.gentle import load, pairs
from tests.support.lanes import brdf_values, evaluated, interaction, spectra, vectors


@pytest.mark.parametrize("basis", ["svd", "chebyshev", "taylor"])
@pytest.mark.parametrize("coherence", md.reference.COHERENCES)
def test_the_plugin_is_its_table(variant, coherence, basis):
    bsdf = load(coherence=coherence, basis=basis, tolerance=1e-4)
    wi, wo, lam = pairs()
    expected = bsdf.table.brdf(wi, wo, lam)
    value = brdf_values(bsdf, wi, wo, lam[:, None])
    # single precision in phases: positions of up to 50 bins to 1e-5 of one, under Gaussians whose
    # exponents are at most 10 times that far from the centre
    assert np.sum(np.abs(value - expected)) < 3e-6 * np.sum(expected)
    assert value == pytest.approx(expected, rel=1e-3, abs=1e-5 * expected.max())


def test_nothing_is_reflected_from_or_to_below(variant):
    bsdf = load()
    wi, wo, lam = pairs()
    down = [1, 1, -1]
    for incident, outgoing in ((wi, wo * down), (wi * down, wo), (wi * down, wo * down)):
        assert np.array_equal(evaluated(bsdf, incident, outgoing, lam[:, None]), np.zeros((200, 4)))
        si = interaction(incident, lam[:, None])
        pdf = np.array(bsdf.pdf(mi.BSDFContext(), si, vectors(outgoing)))
        assert np.array_equal(pdf, np.zeros(200))


def test_masked_lanes_are_zero(variant):
    bsdf = load()
    wi, wo, lam = pairs()
    active = mi.Mask(np.arange(200) % 2 == 0)
    si, context = interaction(wi, lam[:, None]), mi.BSDFContext()
    value = bsdf.eval(context, si, vectors(wo), active)
    density = bsdf.pdf(context, si, vectors(wo), active)
    sample, weight = bsdf.sample(context, si, 0.3, mi.Point2f(0.2, 0.4), active)
    dr.eval(value, density, sample, weight)  # one kernel instead of four
    value = spectra(value)
    assert np.all(value[1::2] == 0)
    # a cut series may dip below zero where it is dark, and is 0 there
    assert np.mean(value[::2].sum(axis=1) > 0) > 0.95
    assert np.all(np.array(density)[1::2] == 0)
    assert np.all(spectra(weight)[1::2] == 0)
    assert np.all(np.array(sample.pdf)[1::2] == 0)


def test_a_flat_mirror_s_albedo_is_one(variant):
    flat = md.HeightField(np.zeros((800, 800)), 0.0815)  # 65.2 µm
    bsdf = mi.load_dict(md.bsdf_dict(flat, material="none", energy_conserving=False))
    wavelengths = [400.0, 480.0, 560.0, 700.0]
    for theta, allowed in [(0, 1e-3), (30, 1e-3), (45, 1e-3), (60, 1e-3), (75, 3e-3)]:
        wi = polar(theta, 20.0)
        for n, lam in enumerate(wavelengths):
            # ∫ f cosθo dωo = ∫ f du dv over the lobe, in steps of 1/4 of its width 1/(kσ)
            step = 0.25 / (float(wavenumber(lam)) * 16.25)
            u, v = (g.ravel() * step for g in np.meshgrid(*2 * [np.arange(-24, 25)]))
            tangential = np.stack([u, v], axis=1) - wi[:2]
            z2 = 1 - np.sum(tangential**2, axis=1)
            wo = np.concatenate([tangential, np.sqrt(np.maximum(z2, 0))[:, None]], axis=1)
            wo = wo[z2 > 1e-6]
            f = evaluated(bsdf, wi, wo, [wavelengths])[:, n] / wo[:, 2]
            # what the window's own width breaks, design section 7
            assert np.sum(f) * step**2 == pytest.approx(1.0, abs=allowed), (theta, lam)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_facet_that_descends_towards_a_tangent_reflects_towards_it(variant, axis):
    lam, period = 500.0, 2.0
    angle = np.degrees(np.arcsin(lam * 1e-3 / period))
    depth = lam * 1e-3 / (1 + np.cos(np.radians(angle)))  # one wavelength of path
    field = md.gratings.blazed(period, depth, axis="xy"[axis], periods=5, pixels_per_period=64)
    bsdf = mi.load_dict(
        md.bsdf_dict(field, material="none", coherence_width=10.0, energy_conserving=False)
    )
    towards, away = polar(angle, 90.0 * axis), polar(angle, 90.0 * axis + 180.0)
    lit, dark = evaluated(bsdf, polar(0), [towards, away], lam)[:, 0]
    assert lit > 1e3 * dark  # sinc² of 0 against sinc² of 2, and the tolerance


def test_the_ends_of_the_range_are_served(variant):
    # the shortest wavelength, straight up and down, at the largest scale: κ_max itself, rounded
    bsdf = load(height_scale=1.0)
    parameters = mi.traverse(bsdf)
    parameters["height_scale"] = bsdf.table.height_scale_max
    parameters.update()
    assert np.all(np.isfinite(evaluated(bsdf, polar(0), [polar(0)], 360.0)))
    # and |(u, v)| = 2, all but
    grazing = polar(89.99)
    assert np.all(np.isfinite(evaluated(bsdf, grazing, [grazing], 360.0)))
