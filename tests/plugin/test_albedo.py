"""What denoisers ask for: a colour that does not depend on where it is seen from."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import polar
from tests.support.gentle import load
from tests.support.lanes import interaction, spectra
from tests.support.variants import obstacle

pytestmark = pytest.mark.thorough

PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}
COLOURED = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5, 0.1, 0.05]}}


def camera(theta):
    """One pixel, a small part of the plate z = 0, seen under an angle in degrees."""
    origin = [float(10.0 * x) for x in np.ravel(polar(theta))]
    look = mi.ScalarTransform4f().look_at(origin, [0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    film = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}}
    return mi.load_dict({"type": "perspective", "fov": 1.0, "to_world": look, "film": film})


def albedo(bsdf, theta):
    return spectra(bsdf.eval_diffuse_reflectance(interaction(polar(theta), 550.0)))[0]


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
def test_it_is_the_same_from_all_sides_and_at_most_1(variant, surface, expected):
    bsdf = load(**surface)
    found = np.array([albedo(bsdf, theta) for theta in (0.0, 30.0, 60.0)])
    assert np.all((found >= 0.0) & (found <= 1.0))
    assert found == pytest.approx(expected, abs=0.01)
    assert np.ptp(found, axis=0) == pytest.approx(0.0, abs=1e-6)


def aov(bsdf):
    """Mitsuba's AOV of a denoiser, (3, 3): RGB from three angles."""
    scene = mi.load_dict({"type": "scene", "plate": {"type": "rectangle", "bsdf": bsdf}})
    integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo"})
    pictures = [
        mi.render(scene, sensor=camera(theta), integrator=integrator, spp=64)
        for theta in (0.0, 30.0, 60.0)
    ]
    return np.array(pictures)[:, 0, 0]


@pytest.mark.parametrize(
    "surface",
    [{"material": "none"}, {"material": "Al"}, {"int_ior": 1.5, "beneath": COLOURED}],
    ids=["none", "Al", "pigment"],
)
@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"])
def test_the_aov_is_the_same_from_all_sides_and_at_most_white(variant, surface):
    if reason := obstacle(variant):
        pytest.skip(reason)
    mi.set_variant(variant)
    found = aov(load(**surface))
    # (1, 1, 1) in RGB; Mitsuba's spectral variants give white as equal energy, 1.2 in red
    white = aov(mi.load_dict({"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}))
    if variant == "llvm_ad_rgb":
        assert white == pytest.approx(1.0)
    assert np.all((found > 0.0) & (found <= white * (1.0 + 1e-6)))  # rounding
    assert np.all(np.ptp(found, axis=0) <= 0.1 * found.min(axis=0))
