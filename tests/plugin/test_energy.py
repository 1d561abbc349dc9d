"""Conservation of energy: white furnaces of the default; test_energy_thorough.py has others."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar
from tests.support.furnace import (
    COMBINATIONS,
    DIELECTRIC,
    assert_at_most_white,
    bsdf,
    check_combination,
    furnace_in,
    steep_sinusoid,
    white_pair,
)
from tests.support.lanes import evaluated

# the surfaces are steep on purpose
pytestmark = [
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("fine"),
]


@pytest.mark.parametrize("base", [False, True])
def test_white_furnace_of_a_dielectric(some_variant, base):
    assert_at_most_white(white_pair("rough") if base else bsdf("rough", **DIELECTRIC))


def test_a_dielectric_is_as_it_is(some_variant, coarsely):
    conserving, raw = (bsdf("sawtooth", **DIELECTRIC, energy_conserving=e) for e in (True, False))
    assert conserving.energy_conserving
    si = dr.zeros(mi.SurfaceInteraction3f, 1000)
    si.wi = mi.Vector3f(polar(70.0, 10.0))
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    rng = mi.PCG32(1000)
    wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    one, other = (np.array(b.eval(mi.BSDFContext(), si, wo)) for b in (conserving, raw))
    assert np.array_equal(one, other)


@pytest.mark.parametrize("material", ["Al", "none"])
def test_scales_that_come_and_go_with_the_heights_load_and_update(some_variant, coarsely, material):
    given = {"material": material, "model": "kirchhoff", "coherence_width": 18.5}
    bsdf = mi.load_dict(md.bsdf_dict(steep_sinusoid(), height_scale=0.02, **given))
    parameters = mi.traverse(bsdf)
    for height_scale in (0.002, 0.01, 0.05, 0.2, 1.0):
        parameters["height_scale"] = height_scale
        parameters.update()
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi, si.wavelengths = (
            mi.Vector3f(polar(70.0, 10.0)),
            mi.Spectrum(400.0, 500.0, 600.0, 700.0),
        )
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(polar(70.0, 190.0))))
        assert np.all(np.isfinite(value))
        assert value.min() > 0.0


@pytest.mark.parametrize(("field", "parameters"), COMBINATIONS[::4])
def test_combinations_send_on_no_more_than_they_get(mono, field, parameters):
    check_combination(field, parameters)


def test_a_film_over_next_to_no_contrast_is_finite(mono, coarsely):
    film = {"int_ior": 1.01, "ext_ior": 1.0, "film_ior": 1.05, "film_thickness": 50.0}
    mean, _ = furnace_in(bsdf("rough", material=None, **film), np.array([polar(30.0, 0.0)]), 1)
    assert 0.0 < mean.item() < 0.1


def test_nested_light_below_0_counts_as_0(mono, coarsely):
    nested = {"type": "diffuse", "reflectance": {"type": "uniform", "value": -1.0}}
    beneath, alone = (bsdf("rough", **DIELECTRIC, **n) for n in ({"beneath": nested}, {}))
    wo = polar(20.0, 90.0)
    values = [evaluated(b, polar(30.0, 0.0), wo, 550.0) for b in (beneath, alone)]
    assert np.array_equal(*values)
