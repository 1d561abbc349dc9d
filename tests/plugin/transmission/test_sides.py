"""Light that goes through: values, both sides, samples, sums, derivatives, and what is refused."""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.energy.settings import EnergySettings, use_energy_settings
from tests.support.chi_square import DISPERSED, ROUGH, SMALL, Case, chi_square
from tests.support.lanes import evaluated, interaction, spectra, vectors
from tests.support.layered import PATCH, load, pairs
from tests.support.transmitting import BELOW, INDICES, SIDES, OneSide, both, sampled

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("fine")]


@pytest.mark.parametrize("kind", SIDES)
def test_above_it_reflects_what_it_does_alone_and_below_as_from_within(some_variant, kind):
    wi, wo, lam = pairs(60)
    found = evaluated(both(**SIDES[kind]), wi, wo, lam)
    alone = evaluated(load(**INDICES), wi, wo, lam)
    if kind == "dielectric":
        assert found == pytest.approx(alone, rel=1e-4, abs=1e-6 * alone.max())
    else:  # and what the flat side sends back
        assert np.all(found >= alone * (1 - 1e-4) - 1e-6 * alone.max())
    from_below = evaluated(both(**SIDES[kind]), wi * BELOW, wo * BELOW, lam)
    # seen from below, the heights are turned over
    turned = md.HeightField(-PATCH.heights, PATCH.pixel_size)
    if kind == "sheet":
        # as a structure of air under a coat of the sheet's index
        coated = {"eta": 1.0, "k": 0.0, "coat_ior": 1.5}
        expected = evaluated(load(turned, **coated), wi, wo, lam)
        assert from_below == pytest.approx(expected, rel=2e-3, abs=1e-4 * expected.max())


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("kind", "theta"),
    [("dielectric", 40.0), ("dielectric", 150.0), ("sheet", 60.0), ("sheet", 130.0)],
)
def test_the_density_is_that_of_the_samples_on_both_sides(some_variant, kind, theta, side):
    case = Case(
        ROUGH,
        theta,
        DISPERSED,
        SMALL | INDICES | {"plugin": "diffraction_dielectric"} | SIDES[kind],
    )
    test = chi_square(OneSide(case.load(), side), case, samples=1 << 19)
    assert test.run(0.01, 8, quiet=True), test.messages
    assert test.histogram_sum[0] > 0.01, test.messages


@pytest.mark.parametrize(
    ("kind", "theta", "lengths", "width"),
    [
        ("dielectric", 60.0, (2.5, 0.08), 20.0),
        ("sheet", 75.0, (1.1, 0.06), 40.0),
    ],
)
def test_conserved_both_sides_add_up_to_all_light(some_variant, kind, theta, lengths, width):
    period, depth = lengths
    size = {"periods": math.ceil(width / period), "pixels_per_period": math.ceil(period / 0.0895)}
    grating = md.gratings.sinusoidal(period, depth, **size)
    common = {"field": grating, "coherence_width": width, **SIDES[kind]}
    before = use_energy_settings(EnergySettings(side_wavelengths=3, azimuthal=36))  # one at 550
    raw, conserved = (sampled(both(energy_conserving=e, **common), theta)[0] for e in (False, True))
    use_energy_settings(before)
    error = 3 * raw.std() / np.sqrt(len(raw))
    # first order gains light, and a sheet loses what is beyond its critical angle
    assert raw.mean() > 1.0 + error if kind == "dielectric" else raw.mean() < 0.99 - error
    assert 0.98 - error < conserved.mean() < 1.001 + error


@pytest.mark.parametrize("kind", SIDES)
def test_of_a_component_alone_there_is_that_share_of_the_whole(some_variant, kind):
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
