"""The models `small_slope` and `kirchhoff`: values, reciprocity, derivatives, refusals."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from tests.support.layered import PATCH, WIDTH, pairs
from tests.support.variants import SOME, evaluate, runs

pytestmark = pytest.mark.thorough


def load(**parameters: Any) -> Any:
    raw = {"energy_conserving": False, "coherence_width": WIDTH, "tolerance": 1e-4}
    return mi.load_dict(md.bsdf_dict(PATCH, **(raw | parameters)))


@pytest.mark.parametrize("name", SOME)
def test_variants_agree(name):
    if not runs(name):
        pytest.skip(f"{name}: Dr.Jit finds no device for it")
    mi.set_variant(name)
    wi, wo, _ = pairs(24)
    count = len(wi)
    lam = np.tile([600.0] if not mi.is_spectral else [480.0, 540.0, 600.0, 660.0], (count, 1))
    samples = np.full((count, 3), 0.5)
    small, mirror = (
        evaluate(load(wavelength=600.0, **p), wi, wo, samples, lam)[0]
        for p in ({}, {"material": "none"})
    )
    colours = RGB_WAVELENGTHS if mi.is_rgb else lam[0]
    for n, one in enumerate(colours):
        exact, perfect = (
            reference.brdf(PATCH, wi, wo, one, coherence_width=WIDTH, **p)
            for p in ({"model": "small_slope", "eta": 1.5 / 1.000277}, {})
        )
        lit = (perfect > 1e-4 * perfect.max()) & (np.abs(mirror[:, n]) > 1e-4 * mirror.max())
        assert lit.sum() > count // 4
        found = small[lit, n] / mirror[lit, n]
        assert found == pytest.approx((exact / perfect)[lit], rel=1e-3)


@pytest.mark.parametrize(
    ("parameters", "model"),
    [
        ({}, "small_slope"),
        ({"material": "Al"}, "small_slope"),
        ({"material": "none"}, "kirchhoff"),
        ({"nested": {"type": "diffuse"}}, "small_slope"),
        ({"model": "kirchhoff"}, "kirchhoff"),
    ],
)
def test_the_default_model_is_that_of_the_material(some_variant, parameters, model):
    assert f"model = {model}" in str(load(**parameters))


def test_the_wavelengths_of_rgb_are_the_means_of_its_channels():
    lam = np.arange(360.0, 831.0)
    weights = linear_srgb(response(lam))
    means = (weights * lam[:, None]).sum(axis=0) / weights.sum(axis=0)
    assert RGB_WAVELENGTHS == pytest.approx(means, abs=0.1)
