"""Components and types that a context asks for, in `eval`, `pdf` and `sample` alike.

For every BSDF of Mitsuba's that reflects, as what lies beneath: samples' mean weight is the
integral of `eval`, and what a lobe of one direction adds is what it returns times T(ωi) T(ωo).
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import polar
from tests.support.gentle import load
from tests.support.lanes import lanes, vectors

# the light beneath depends on the albedo: within 3 %
pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("fine")]

THETA = 35.0
FLAGS = mi.BSDFFlags
GREY = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.7}}
REFLECTING: dict[str, dict[str, Any]] = {
    "diffuse": GREY,
    "conductor": {"type": "conductor", "material": "none"},
    "roughconductor": {"type": "roughconductor", "alpha": 0.3},
    "plastic": {"type": "plastic"},
    "roughplastic": {"type": "roughplastic", "alpha": 0.2},
    "pplastic": {"type": "pplastic", "alpha": 0.2},
    "principled": {"type": "principled", "roughness": 0.3, "clearcoat": 0.5},
    "blend": {"type": "blendbsdf", "weight": 0.3, "a": GREY, "b": {"type": "conductor"}},
    "two-sided": {"type": "twosided", "b": GREY},
}


@pytest.fixture(autouse=True)
def mono() -> None:
    """One wavelength: the kernels are small."""
    mi.set_variant("llvm_ad_mono")


def surface(**parameters: Any) -> Any:
    return load(tolerance=0.05, int_ior=1.5, **parameters)


def lit(n: int) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = vectors(np.tile(polar(THETA), (n, 1)))
    return si


def sampled(bsdf, context, n=1 << 15) -> tuple[float, float, float, float]:
    """Mean weight in the first wavelength of samples in spread lobes, its error, the share of
    samples that found one, and the mean weight of those in lobes of one direction."""
    rng = np.random.default_rng(4)
    s1, s2 = lanes(rng.random(n)), mi.Point2f(*map(lanes, rng.random((2, n))))
    drawn, weight = bsdf.sample(context, lit(n), s1, s2)
    dr.eval(drawn, weight)  # one kernel instead of three
    weights = np.array(weight[0], float)
    delta = np.array(mi.has_flag(drawn.sampled_type, FLAGS.Delta))
    spread, share = np.where(delta, 0.0, weights), (np.array(drawn.pdf) > 0.0) & ~delta
    return spread.mean(), spread.std() / np.sqrt(n), share.mean(), (weights - spread).mean()


def integrals(bsdf, context, n=240) -> tuple[float, float]:
    """Of eval in the first wavelength and of pdf, over Lambert's equal-area disc."""
    x, y = (np.stack(np.meshgrid(*[np.arange(n) + 0.5] * 2)).reshape(2, -1) / n - 0.5) * 2.0
    x, y = x[x**2 + y**2 < 1.0], y[x**2 + y**2 < 1.0]
    r2 = x**2 + y**2
    scale = np.sqrt(2.0 - r2)
    wo = np.stack([x * scale, y * scale, 1.0 - r2], axis=1)
    si = lit(len(wo))
    value, density = bsdf.eval_pdf(context, si, vectors(wo))
    dr.eval(value, density)
    cell = 8.0 / n**2  # 2π over π of the disc
    return cell * np.array(value[0], float).sum(), cell * np.array(density, float).sum()


def asked(component: int | None, types: int = FLAGS.All) -> Any:
    return mi.BSDFContext(mi.TransportMode.Radiance, int(types), component)


def agree(bsdf, context) -> None:
    spread, error, share, _ = sampled(bsdf, context)
    value, density = integrals(bsdf, context)
    # five standard errors, and half a per cent for the sum over a grid
    assert spread == pytest.approx(value, abs=5 * error + 0.005 * value + 1e-6)
    assert share == pytest.approx(density, abs=0.01)


@pytest.mark.parametrize("name", REFLECTING)
def test_what_is_sampled_is_what_is_evaluated(name):
    nested = mi.load_dict(REFLECTING[name])
    bsdf = surface(beneath=REFLECTING[name])
    agree(bsdf, asked(None))
    cos = mi.Float(np.cos(np.deg2rad(THETA)))
    through = (1.0 - float(mi.fresnel(cos, 1.5 / 1.000277)[0][0])) ** 2
    alone = sampled(nested, asked(None), 1 << 18)[-1]
    # three standard errors: one sample in twenty is such a direction
    found = sampled(bsdf, asked(None), 1 << 18)[-1]
    assert found == pytest.approx(through * alone, rel=0.03, abs=1e-9)


@pytest.mark.parametrize("name", ["diffuse", "principled", "plastic"])
def test_components_are_sampled_as_they_are_evaluated_and_add_up(name):
    bsdf = surface(beneath=REFLECTING[name])
    whole, _ = integrals(bsdf, asked(None))
    parts = []
    for component in range(bsdf.component_count()):
        agree(bsdf, asked(component))
        parts.append(integrals(bsdf, asked(component))[0])
    if name != "principled":  # which returns all of its lobes, whichever is asked for
        assert sum(parts) == pytest.approx(whole, rel=1e-3)
    assert parts[0] == pytest.approx(integrals(surface(), asked(None))[0], rel=1e-3)


def test_types_are_sampled_as_they_are_evaluated_and_add_up():
    bsdf = surface(beneath=REFLECTING["plastic"])
    glossy, diffuse = (
        asked(None, kind) for kind in (FLAGS.GlossyReflection, FLAGS.DiffuseReflection)
    )
    whole, parts = integrals(bsdf, asked(None))[0], []
    for context in (glossy, diffuse):
        agree(bsdf, context)
        parts.append(integrals(bsdf, context)[0])
    assert sum(parts) == pytest.approx(whole, rel=1e-3)
    delta = asked(None, FLAGS.DeltaReflection)
    assert integrals(bsdf, delta) == (0.0, 0.0)
    spread, *_, light = sampled(bsdf, delta)
    assert spread == 0.0
    assert light > 0.01
