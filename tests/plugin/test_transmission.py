"""Surfaces that let light through send on all light, none comes from nothing, and components.

test_kinds.py has values and samples, test_chi2.py the density on each side.
"""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.energy.settings import EnergySettings
from tests.support.coarse import energy_as
from tests.support.directions import polar, rough_patch
from tests.support.furnace import furnace_in, sent_on
from tests.support.lanes import interaction, spectra, vectors
from tests.support.layered import BELOW, PATCH, SIDES, both, pairs

pytestmark = pytest.mark.usefixtures("some_variant")

FIELDS = {
    "flat": md.HeightField(np.zeros((8, 8)), 8.0),
    "50 nm": rough_patch((48, 48), (0.1, 0.1), 0.05, 1.0),
    "5 nm": rough_patch((200, 200), (0.1, 0.1), 0.005, 1.0),
}
STEEP = md.HeightField(0.1 * np.random.default_rng(3).random((40, 40)), 0.1, periodic=True)
#: From above and from below.
DIRECTIONS = np.array([polar(theta, 20.0) * [1, 1, side] for theta in (0, 45) for side in (1, -1)])


def passed(field, kind, index, width, **more):
    """Mean weight of samples (4 wavelengths, directions), its error, and the largest weight."""
    parameters = {"int_ior": index, "ext_ior": 1.0, "coherence_width": width, **SIDES[kind], **more}
    bsdf = mi.load_dict(md.bsdf_dict(FIELDS[field], plugin="diffraction_dielectric", **parameters))
    lam = [410.0, 500.0, 590.0, 690.0]
    weights = sent_on(bsdf, DIRECTIONS, 0, lam, "Importance", samples=1 << 12)
    return weights.mean(axis=2), weights.std(axis=2) / 2.0**6, weights.max()


@pytest.mark.parametrize("kind", SIDES)
@pytest.mark.parametrize(
    ("field", "index", "width"),
    [("5 nm", 1.2, 65.0), ("flat", 1.06, 10.0)],
)
def test_no_light_comes_from_nothing(field, kind, index, width):
    mean, error, most = passed(field, kind, index, width)
    # the table's tolerance, and what 4 standard errors of 64 trials leave
    assert np.all(np.abs(mean - 1.0) < 4.0 * error + 5e-3)
    assert most < 20.0  # one of ten samples or more is drawn from each side


def test_a_narrow_window_at_a_critical_angle_gains_nothing():
    """An index of 1.0145, from inside beyond 80.3°: its rounding moves the critical angle."""
    mi.set_variant("llvm_ad_mono")
    given = {"int_ior": 1.0145, "ext_ior": 1.0, "coherence_width": 2.0}
    flat = md.HeightField(np.zeros((8, 8)), 0.5)
    bsdf = mi.load_dict(md.bsdf_dict(flat, plugin="diffraction_dielectric", **given))
    angles = np.array([60.0, 82.0, 84.0, 87.0, 88.3, 89.5])
    directions = np.array([polar(theta, 20.0) * [1, 1, -1] for theta in angles])
    mean, error = furnace_in(bsdf, directions, 1)
    assert np.all(mean <= 1.005 + 4.0 * error), mean


@pytest.mark.parametrize("kind", SIDES)
def test_colours_of_what_goes_through_gain_nothing(kind):
    """A channel's scale is that of its light as it is weighted: red has negative weights."""
    mi.set_variant("llvm_ad_rgb")
    given = {"int_ior": 2.4, "ext_ior": 1.0, "coherence_width": 12.0, **SIDES[kind]}
    bsdf = mi.load_dict(md.bsdf_dict(STEEP, plugin="diffraction_dielectric", **given))
    directions = np.array([polar(theta, 20.0) for theta in (0.0, 20.0, 40.0, 60.0, 70.0)])
    mean, _ = furnace_in(bsdf, directions, 1)
    # of five means, each of an error of 0.004, in colours whose luminance is at most 1
    assert (np.array([0.2126, 0.7152, 0.0722]) @ mean).mean() < 1.004


@pytest.mark.parametrize("kind", SIDES)
def test_one_window_of_a_rough_surface_sends_on_all_light(kind):
    """Orders interfere with one another, and in reflected light with order 0."""
    mean, error, _ = passed("50 nm", kind, 1.3, 3.0, coherence="patch")
    # the density of speckle is linear between samples of κ and of directions
    assert np.all(np.abs(mean - 1.0) < 4.0 * error + 2e-2)


@pytest.mark.thorough
@pytest.mark.usefixtures("fine")
@pytest.mark.parametrize(
    ("kind", "theta", "lengths", "width"),
    [
        ("dielectric", 60.0, (2.5, 0.08), 20.0),
        ("sheet", 75.0, (1.1, 0.06), 40.0),
    ],
)
def test_conserved_both_sides_add_up_to_all_light(kind, theta, lengths, width):
    period, depth = lengths
    size = {"periods": math.ceil(width / period), "pixels_per_period": math.ceil(period / 0.0895)}
    grating = md.gratings.sinusoidal(period, depth, **size)
    common = {"field": grating, "coherence_width": width, **SIDES[kind]}
    light = {"wavelength": 550.0, "mode": "Importance", "samples": 1 << 15}
    with energy_as(EnergySettings(side_wavelengths=3, azimuthal=36)):  # one at 550
        (raw, error), (conserved, _) = (
            furnace_in(both(energy_conserving=e, **common), polar(theta, 20.0)[None], 0, **light)
            for e in (False, True)
        )
    # first order gains light, and a sheet loses the light beyond its critical angle
    assert np.all(raw > 1.0 + 3 * error if kind == "dielectric" else raw < 0.99 - 3 * error)
    assert np.all((0.98 - 3 * error < conserved) & (conserved < 1.001 + 3 * error))


@pytest.mark.thorough
@pytest.mark.parametrize("kind", SIDES)
def test_of_a_component_alone_there_is_that_share_of_the_whole(kind):
    wi, wo, lam = (a[:40] for a in pairs())
    bsdf = both(**SIDES[kind])
    si = interaction(wi, lam)
    for outgoing, component in ((wo, 0), (wo * BELOW, 1)):
        alone, other = (
            mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), n)
            for n in (component, 1 - component)
        )
        whole = spectra(bsdf.eval(mi.BSDFContext(), si, vectors(outgoing)))
        assert spectra(bsdf.eval(alone, si, vectors(outgoing))) == pytest.approx(whole)
        assert np.all(spectra(bsdf.eval(other, si, vectors(outgoing))) == 0.0)


def test_a_dictionary_names_an_unknown_plugin():
    with pytest.raises(md.DiffractionError, match="plugin='glass' is unknown"):
        md.bsdf_dict(PATCH, plugin="glass")
