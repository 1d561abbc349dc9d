"""What the BSDF returns: its table, nothing below, the lobes where they belong, an albedo."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar
from tests.support.gentle import load, pairs
from tests.support.lanes import brdf_values, evaluated, interaction, spectra, vectors
from tests.support.variants import use


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


PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}


@pytest.mark.thorough
@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        ({"material": "none"}, 1.0),
        ({"int_ior": 1.5}, 0.04),
        ({"material": "Al"}, 0.92),
        ({"int_ior": 1.5, "beneath": PIGMENT}, 0.04 + 0.5 * 0.96**2),
        ({"int_ior": 1.5, "beneath": {"type": "roughconductor", "alpha": 0.01}}, 1.0),
    ],
)
def test_the_albedo_is_the_same_from_all_sides_and_at_most_1(variant, surface, expected):
    use(variant)
    bsdf = load(**surface)
    found = np.array(
        [
            spectra(bsdf.eval_diffuse_reflectance(interaction(polar(theta), 550.0)))[0]
            for theta in (0.0, 30.0, 60.0)
        ]
    )
    assert np.all((found >= 0.0) & (found <= 1.0))
    assert found == pytest.approx(expected, abs=0.01)
    assert np.ptp(found, axis=0) == pytest.approx(0.0, abs=1e-6)
