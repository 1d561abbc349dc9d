"""`diffraction_mix`: surfaces by weights, each evaluated only where it has one."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import rough_patch
from tests.support.gentle import PATCH, UV, WIDTH, bitmap, hits, pairs
from tests.support.lanes import refusal, spectra, vectors

pytestmark = pytest.mark.thorough

OTHER = rough_patch((60, 60), (0.08, 0.08), 0.1, seed=3)
RAW = {"material": "none", "energy_conserving": False, "coherence_width": WIDTH}
PIGMENTED = {"int_ior": 1.5, "pigment": {"type": "conductor"}, "energy_conserving": False}
WEIGHTS = np.array([[1.0, 0.0], [0.25, 0.6]], np.float32)


def surfaces():
    """Two, with other orders, one over a mirror."""
    pigmented = PIGMENTED | {"coherence_width": WIDTH}
    return {"back": md.bsdf_dict(PATCH, **RAW), "belly": md.bsdf_dict(OTHER, **pigmented)}


def mix(**weights):
    return mi.load_dict({"type": "diffraction_mix", **surfaces(), **weights})


def test_it_is_the_mean_of_its_surfaces_by_weight(variant):
    wi, wo, lam = pairs(100)
    alone = [mi.load_dict(one) for one in surfaces().values()]
    both = mix(weight_back=bitmap(WEIGHTS))
    context, uv = mi.BSDFContext(), np.resize(UV, (100, 2))
    si, out, w = hits(wi, uv, lam[:, None]), vectors(wo), np.resize(WEIGHTS.ravel(), 100)
    values, densities = zip(*(one.eval_pdf(context, si, out) for one in alone), strict=True)
    found = (
        *both.eval_pdf(context, si, out),
        both.eval(context, si, out),
        both.pdf(context, si, out),
    )
    dr.eval(values, densities, found)  # one kernel instead of eight
    value = w[:, None] * spectra(values[0]) + (1 - w[:, None]) * spectra(values[1])
    density = w * np.array(densities[0]) + (1 - w) * np.array(densities[1])
    for one, expected in (
        (spectra(found[0]), value), (spectra(found[2]), value),
        (np.array(found[1]), density), (np.array(found[3]), density),
    ):  # fmt: skip
        assert one == pytest.approx(expected, rel=1e-5, abs=1e-6 * float(expected.max()))


@pytest.mark.parametrize("component", [0xFFFFFFFF, 0, 1, 2])
def test_samples_add_up_to_the_value(variant, component):
    """∫ f cosθ dω by samples, mirrors included, against that of each surface by weight."""
    wi, _, lam = pairs(1)
    n = 40_000
    rng = np.random.default_rng(1)
    si = hits(np.repeat(wi, n, axis=0), UV[2], np.repeat(lam, n)[:, None])
    numbers = mi.Float(rng.random(n)), mi.Point2f(*rng.random((2, n)).astype(np.float32))

    def albedo(bsdf, component=component):
        context = mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, component)
        drawn, weight = bsdf.sample(context, si, *numbers)
        if component < bsdf.component_count():
            assert (np.array(drawn.sampled_component) == component).all()
        return spectra(weight)[:, 0]

    both, (back, belly) = mix(weight_back=bitmap(WEIGHTS)), map(mi.load_dict, surfaces().values())
    found = albedo(both)
    parts = {0: [(0.25, back, 0)], 1: [(0.75, belly, 0)], 2: [(0.75, belly, 1)]}
    whole = [(0.25, back, 0xFFFFFFFF), (0.75, belly, 0xFFFFFFFF)]
    expected = sum(w * albedo(one, c).mean() for w, one, c in parts.get(component, whole))
    # standard errors of both; a surface that is drawn without noise has rounding alone
    noise = max(5.0 * found.std() / np.sqrt(n), 4e-7)
    assert found.mean() == pytest.approx(expected, abs=noise)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({}, "there is no weight_back, weight_belly"),
        ({"weight_back": -0.5}, "weight_back=-0.5 must be at least 0"),
        ({"weight_back": "much"}, "weight_back='much' must be"),
        ({"weight_back": lambda: bitmap(-WEIGHTS)}, "numbers go from -1"),
        ({"weight_back": lambda: bitmap(WEIGHTS * np.nan)}, "numbers go from nan"),
        ({"weight_back": lambda: bitmap(WEIGHTS, raw=False)}, "takes numbers for colours"),
        (
            {"weight_back": 0.0, "weight_belly": 0.0},
            "weight_back, weight_belly are all 0 somewhere",
        ),
        ({"weight_back": lambda: bitmap(WEIGHTS), "weight_belly": 0.0}, "are all 0 somewhere"),
        ({"weight_side": 1.0, "weight_back": 1.0}, "unknown parameter 'weight_side'"),
        ({"weight_back": 1.0, "height_scale": 1.0}, "its surfaces are back, belly"),
        ({"belly": None, "weight_back": 1.0}, "takes two nested BSDFs or more, got 1"),
    ],
)
def test_weights_that_mean_nothing_are_refused(some_variant, parameters, said):
    made = {k: v() if callable(v) else v for k, v in (surfaces() | parameters).items()}
    given = {k: v for k, v in made.items() if v is not None}
    assert said in refusal(lambda: mi.load_dict({"type": "diffraction_mix", **given}))
