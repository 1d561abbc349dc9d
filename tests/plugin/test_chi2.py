"""`pdf` is the density of `sample`'s directions, for every kind of table; weights stay small."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support import gentle
from tests.support.chi_square import DISPERSED, ROUGH, SMALL, Case, chi_square
from tests.support.directions import polar, rough_patch
from tests.support.furnace import sent_on
from tests.support.layered import INDICES, SIDES
from tests.support.patches import SMALL_SCAN
from tests.support.variants import use

DEFAULT = {"int_ior": 1.5, "energy_conserving": True}
DEEP = rough_patch((64, 60), (0.085, 0.085), 0.8)
BLAZED = {"coherence_width": 6.0, "height_scale": 1.2, "orientation": 25.0}
PIGMENT = {
    "int_ior": 1.5,
    "pigment": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}},
}
PRINCIPLED = {"int_ior": 1.5, "pigment": {"type": "principled", "roughness": 0.3}}
GLOSSY_BELOW = {"int_ior": 1.5, "pigment": {"type": "roughplastic", "alpha": 0.2}}
TAYLOR, PATCH = {"basis": "taylor"}, {"coherence": "patch"}
PERIOD = 2.0 * math.pi / 2.0  # of the gratings' orders, rad/µm
THROUGH = INDICES | {"plugin": "diffraction_dielectric"}
SIDES_LIT = ("dielectric", 40.0), ("dielectric", 150.0), ("sheet", 60.0), ("sheet", 130.0)
#: Of `make test` as well.
CASES = {
    "one wavelength, 45°": Case(ROUGH, 45.0, (400.0,), SMALL),
    "lobes far apart, order 1": Case(
        rough_patch((60, 60), (0.13, 0.13), 0.12),
        20.0,
        (550.0,),
        {"coherence_width": 60.0},
        (2.0 * math.pi / 7.8, 0.0),
    ),
    "dielectric, dispersed, 60°": Case(ROUGH, 60.0, DISPERSED, SMALL | DEFAULT),
    "through a sheet, 20°": Case(
        ROUGH, 20.0, (550.0,), SMALL | THROUGH | SIDES["sheet"], side=-1.0
    ),
}
MORE = {
    "ensemble, 0°": Case(ROUGH, 0.0, (550.0,), SMALL),
    "ensemble, 80°": Case(ROUGH, 80.0, (700.0,), SMALL),
    "patch, 30°": Case(ROUGH, 30.0, (550.0,), SMALL | PATCH),
    "taylor, ensemble, 70°": Case(ROUGH, 70.0, (400.0,), SMALL | TAYLOR),
    "deep, 35°": Case(DEEP, 35.0, (400.0,), SMALL),
    "deep, dispersed, 60°": Case(DEEP, 60.0, DISPERSED, SMALL),
    "blazed, turned, dispersed, 75°": Case(
        lambda: md.gratings.blazed(2.0, 0.15, periods=3, pixels_per_period=24),
        75.0,
        DISPERSED,
        BLAZED,
    ),
    "over pigment, turned, dispersed, 70°": Case(
        ROUGH, 70.0, DISPERSED, SMALL | PIGMENT | {"orientation": -50.0}
    ),
    "over gloss, 50°": Case(ROUGH, 50.0, (700.0,), SMALL | GLOSSY_BELOW),
    "over pigment, what lies beneath, 35°": Case(
        ROUGH, 35.0, (550.0,), SMALL | PIGMENT, component=1
    ),
    "over principled, what lies above, 35°": Case(
        ROUGH, 35.0, (550.0,), SMALL | PRINCIPLED, component=0
    ),
    "mirror, 65 µm, its lobe": Case(
        md.HeightField(np.zeros((60, 60)), 0.085), 30.0, (550.0,), {}, (0.0, 0.0)
    ),
    "small scan, the lobe of the light": Case(SMALL_SCAN, 30.0, (550.0,), {}, (0.0, 0.0)),
    # a histogram of the hemisphere resolves lobes of 12 µm
    "small scan, 12 µm, 30°": Case(SMALL_SCAN, 30.0, (550.0,), {"coherence_width": 12.0}),
    "sinusoid, 65 µm, dispersed": Case(
        lambda: md.gratings.sinusoidal(2.0, 0.15, periods=4, pixels_per_period=24),
        20.0,
        DISPERSED,
        {},
        (PERIOD, 0.0),
    ),
    "dispersed, 0°": Case(ROUGH, 0.0, DISPERSED, SMALL),
    "a made scale, 20 µm, 10°": Case(
        lambda: md.gratings.elaphe_like(20.0, 300), 10.0, (550.0,), {"coherence_width": 20.0}
    ),
    "measured scale, 16 µm, 80°": Case("elaphe", 80.0, (400.0,), {"coherence_width": 16.0}),
} | {
    f"{kind}, {theta:g}°, {'above' if side > 0.0 else 'below'}": Case(
        ROUGH, theta, DISPERSED, SMALL | THROUGH | SIDES[kind], side=side
    )
    for kind, theta in SIDES_LIT
    for side in (1.0, -1.0)
}


@pytest.mark.parametrize(
    "name", [*CASES, *(pytest.param(name, marks=pytest.mark.thorough) for name in MORE)]
)
def test_the_density_is_that_of_the_samples(variant, request, name):
    case = (CASES | MORE)[name]
    shared = request.getfixturevalue("shared_afm") if case.heights == "elaphe" else None
    assert_density_of_samples(case, shared)


def test_the_density_in_rgb_is_that_of_the_samples():
    use("llvm_ad_rgb")
    assert_density_of_samples(Case(ROUGH, 50.0, (550.0,), SMALL))


def assert_density_of_samples(case, shared=None):
    test = chi_square(case.load(shared), case)
    # 1 % for all cases together; the numbers drawn are always the same
    assert test.run(0.01, len(CASES | MORE), quiet=True), test.messages
    # enough of the samples fall where the histogram looks to say something
    assert test.histogram_sum[0] > 0.01, test.messages


def test_a_wrong_density_is_rejected(some_variant):
    case = CASES["one wavelength, 45°"]
    test = chi_square(case.load(), case, pdf_at=(404.0,))  # 1 % beside the samples' wavelength
    assert not test.run(0.01, len(CASES | MORE), quiet=True)


@pytest.mark.thorough
@pytest.mark.parametrize("theta", [0.0, 50.0])
def test_weights_stay_small_where_lobes_are_far_narrower_than_their_distance(some_variant, theta):
    bsdf = gentle.load(rough_patch((60, 60), (0.13, 0.13), 0.1), coherence_width=400.0)
    lam = (450.0, 500.0, 550.0, 650.0)
    weights = sent_on(bsdf, polar(theta)[None], 4, lam, samples=1 << 15)
    error = weights.std() / np.sqrt(weights.shape[2])
    assert weights.mean() == pytest.approx(1.0, abs=5 * error + 0.01)  # a gentle mirror
    assert weights.std() < 1.0
    assert weights.max() < 60.0  # with cells as wide as eleven lobes 400
