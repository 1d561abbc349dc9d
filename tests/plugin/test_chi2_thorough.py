"""`pdf` is the density of `sample`'s directions, for every kind of table; weights stay small."""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support import gentle
from tests.support.chi_square import DISPERSED, ROUGH, SMALL, Case, chi_square
from tests.support.directions import polar, rough_patch
from tests.support.lanes import interaction, lanes, spectra
from tests.support.patches import SMALL_SCAN

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]

DEEP = rough_patch((64, 60), (0.085, 0.085), 0.8)
BLAZED = {"coherence_width": 6.0, "height_scale": 1.2, "orientation": 25.0}
PIGMENT = {
    "int_ior": 1.5,
    "pigment": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}},
}
PRINCIPLED = {"int_ior": 1.5, "pigment": {"type": "principled", "roughness": 0.3}}
GLOSSY_BELOW = {"int_ior": 1.5, "pigment": {"type": "roughplastic", "alpha": 0.2}}


def blazed() -> md.HeightField:
    return md.gratings.blazed(2.0, 0.15, periods=3, pixels_per_period=24)


def sinusoid() -> md.HeightField:
    return md.gratings.sinusoidal(2.0, 0.15, periods=4, pixels_per_period=24)


def like_elaphe() -> md.HeightField:
    """20 µm of a made scale, for windows of 20 µm."""
    return md.gratings.elaphe_like(20.0, 300)


TAYLOR, PATCH = {"basis": "taylor"}, {"coherence": "patch"}
PERIOD = 2.0 * math.pi / 2.0  # of the gratings' orders, rad/µm
CASES = {
    "ensemble, 0°": Case(ROUGH, 0.0, (550.0,), SMALL),
    "ensemble, 80°": Case(ROUGH, 80.0, (700.0,), SMALL),
    "patch, 30°": Case(ROUGH, 30.0, (550.0,), SMALL | PATCH),
    "taylor, ensemble, 70°": Case(ROUGH, 70.0, (400.0,), SMALL | TAYLOR),
    "deep, 35°": Case(DEEP, 35.0, (400.0,), SMALL),
    "deep, dispersed, 60°": Case(DEEP, 60.0, DISPERSED, SMALL),
    "blazed, turned, dispersed, 75°": Case(blazed, 75.0, DISPERSED, BLAZED),
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
    "sinusoid, 65 µm, dispersed": Case(sinusoid, 20.0, DISPERSED, {}, (PERIOD, 0.0)),
    "dispersed, 0°": Case(ROUGH, 0.0, DISPERSED, SMALL),
    "a made scale, 20 µm, 10°": Case(like_elaphe, 10.0, (550.0,), {"coherence_width": 20.0}),
    "measured scale, 16 µm, 80°": Case("elaphe", 80.0, (400.0,), {"coherence_width": 16.0}),
}


@pytest.mark.parametrize("name", CASES)
def test_the_density_is_that_of_the_samples(variant, request, name):
    case = CASES[name]
    shared = request.getfixturevalue("shared_afm") if case.heights == "elaphe" else None
    test = chi_square(case.load(shared), case)
    # 1 % for all cases together; the numbers drawn are always the same
    assert test.run(0.01, len(CASES), quiet=True), test.messages
    # enough of the samples fall where the histogram looks to say something
    assert test.histogram_sum[0] > 0.01, test.messages


@pytest.mark.parametrize("theta", [0.0, 50.0])
def test_weights_stay_small_where_lobes_are_far_narrower_than_their_distance(some_variant, theta):
    bsdf = gentle.load(rough_patch((60, 60), (0.13, 0.13), 0.1), coherence_width=400.0)
    n = 1 << 15
    rng = np.random.default_rng(4)
    si = interaction(np.tile(polar(theta), (n, 1)), [(450.0, 500.0, 550.0, 650.0)])
    s1, s2 = lanes(rng.random(n)), mi.Point2f(*map(lanes, rng.random((2, n))))
    weights = spectra(bsdf.sample(mi.BSDFContext(), si, s1, s2)[1])
    error = weights.std() / np.sqrt(n)
    assert weights.mean() == pytest.approx(1.0, abs=5 * error + 0.01)  # a gentle mirror
    assert weights.std() < 1.0
    assert weights.max() < 60.0  # with cells as wide as eleven lobes 400
