"""Tables of a restricted domain in the plugin: the NumPy look-up's values, and a count."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.restricted import device_table
from tests.support.directions import polar, rough_patch, uniform_directions
from tests.support.lanes import evaluated, interaction, lanes, refusal, vectors

#: Of coarse pixels: small tables. The plugin warns of that, and this is not about that.
PATCH = rough_patch((64, 64), (0.3, 0.3), 0.2)

pytestmark = [
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning"),
    pytest.mark.usefixtures("coarse"),
]


def build(coherence):
    return md.DiffractionTable.build(
        PATCH, coherence_width=18.0, coherence=coherence, q_max=(6.0, 5.0), kappa_max=20.0
    )


@pytest.fixture(scope="module", params=["ensemble", "patch"])
def table(request):
    return build(request.param)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A file with one of them: all else is the same for both."""
    file = tmp_path_factory.mktemp("restricted") / "table.exr"
    build("ensemble").save(file)
    return str(file)


def lookups(n):
    """(qx, qy, κ), all over what light can probe."""
    rng = np.random.default_rng(2)
    angle, radius = rng.uniform(0, 2 * np.pi, n), 34.0 * np.sqrt(rng.uniform(0, 1, n))
    values = radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0.5, 50.0, n)
    return [v.astype(np.float32).astype(float) for v in values]


def test_the_plugin_reads_what_numpy_reads_and_counts(variant, table):
    x, y, kappa = lookups(2000)
    device = device_table(table)
    device.take()
    found = np.array(device.window_sum(*map(lanes, (x, y, kappa))))
    expected = table.window_sum(x, y, kappa)
    # sums of float32 products: 1e-5 of the largest
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected.max())
    outside = ~table.covers(x, y, kappa)
    seen = device.take()
    assert seen.count == outside.sum()
    assert seen.frequency == pytest.approx(np.hypot(x, y)[outside].max(), rel=1e-6)
    assert seen.kappa == pytest.approx(kappa[outside].max(), rel=1e-6)
    assert device.take().count == 0


def test_scalar_variants_do_the_same(table):
    mi.set_variant("scalar_spectral")
    x, y, kappa = lookups(60)
    device = device_table(table)
    device.take()
    found = [device.window_sum(*map(float, q)) for q in zip(x, y, kappa, strict=True)]
    expected = table.window_sum(x, y, kappa)
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected.max())
    assert device.take().count == (~table.covers(x, y, kappa)).sum()


def test_a_scene_counts_what_it_looks_up_outside(variant, saved):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "orthographic",
                "film": {"type": "hdrfilm", "width": 4, "height": 4},
            },
            "light": {"type": "directional", "direction": [0.9, 0.0, 1.0]},
            "plate": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().translate([0, 0, 4]).rotate([0, 1, 0], 180),
                "bsdf": {"type": "diffraction", "table": saved, "material": "none"},
            },
        }
    )
    (bsdf,) = {shape.bsdf() for shape in scene.shapes()}
    device = device_table(bsdf.table)
    device.take()
    picture = np.array(mi.render(scene, spp=8))
    seen = device.take()
    assert np.isfinite(picture).all()
    assert picture.mean() > 0.0  # dark nowhere: the cells have light there
    assert seen.count > 0
    # sin 42° towards the light, and all that is sampled from there, at 360 nm
    assert 6.0 < seen.frequency < 1.669 * 17.46


def test_values_are_finite_and_symmetric(variant, saved):
    bsdf = mi.load_dict({"type": "diffraction", "table": saved, "material": "none"})
    directions = uniform_directions(200, np.random.default_rng(4))
    there = evaluated(bsdf, polar(50.0, 20.0), directions, 450.0)
    back = np.concatenate([evaluated(bsdf, d, [polar(50.0, 20.0)], 450.0) for d in directions[:8]])
    assert (there >= 0.0).all()
    assert np.isfinite(there).all()
    first = there[:8] / directions[:8, 2:]
    assert first == pytest.approx(back / np.cos(np.radians(50.0)), rel=1e-4)


def test_rgb_variants_refuse_it(saved):
    mi.set_variant("llvm_ad_rgb")
    line = refusal(lambda: mi.load_dict({"type": "diffraction", "table": saved}))
    assert "RGB variants" in line


def test_derivatives_flow_inside_and_outside(variant, saved):
    bsdf = mi.load_dict(
        {"type": "diffraction", "table": saved, "material": "none", "energy_conserving": False}
    )
    rng = np.random.default_rng(5)
    wi, wo = uniform_directions(400, rng), uniform_directions(400, rng)
    si, out = interaction(wi, 500.0), vectors(wo)
    parameters = mi.traverse(bsdf)

    def value(height_scale):
        parameters["height_scale"] = height_scale
        parameters.update()
        return bsdf.eval(mi.BSDFContext(), si, out)[0]

    step = 2e-3
    above, below = (np.array(value(mi.Float(1.0 + s)), float) for s in (step, -step))
    scale = mi.Float(1.0)
    dr.enable_grad(scale)
    found = value(scale)
    dr.set_grad(scale, 1.0)
    dr.enqueue(dr.ADMode.Forward, scale)
    dr.traverse(dr.ADMode.Forward)
    derivative = np.array(dr.grad(found), float)
    u, v, w = (wi + wo).T
    k = 2 * np.pi / 0.5
    # κ of the others crosses the table's end between the two heights: the value jumps there
    clear = np.abs(k * w - 20.0) > 1.0
    outside = (np.hypot(k * u / 6.0, k * v / 5.0) > 1.0) | (k * w > 20.0)
    for mine in (clear & outside, clear & ~outside):
        expected = (above - below)[mine] / (2 * step)
        # float32 differences: 1e-7 of values about as large as the derivative, over the step
        assert np.abs(derivative[mine] - expected).sum() <= 1e-3 * np.abs(expected).sum()


def test_frozen_functions_read_both_parts(variant, saved):
    bsdf = mi.load_dict({"type": "diffraction", "table": saved, "material": "none"})
    frozen = dr.freeze(lambda bsdf, si, wo: bsdf.eval(mi.BSDFContext(), si, wo))
    rng = np.random.default_rng(6)
    for _ in range(3):
        si = interaction(uniform_directions(200, rng), 450.0)
        wo = vectors(uniform_directions(200, rng))
        assert np.array_equal(
            np.array(frozen(bsdf, si, wo)), np.array(bsdf.eval(mi.BSDFContext(), si, wo))
        )
