"""Parameters that change: listed, checked, differentiable, without another table or kernel."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.gentle import load, pairs
from tests.support.lanes import brdf_values, interaction, vectors


def test_what_may_change_is_listed(some_variant):
    names = {
        "perfect": set(mi.traverse(load()).keys()),
        "dielectric": set(mi.traverse(load(int_ior=1.5)).keys()),
        "conductor": set(mi.traverse(load(material="Al")).keys()),
        "coated": set(mi.traverse(load(int_ior=1.5, pigment={"type": "diffuse"})).keys()),
    }
    always = {"data", "height_scale", "orientation"}
    assert names["perfect"] == always
    assert names["dielectric"] == always | {"eta"}
    assert always < names["conductor"]
    assert {n.split(".")[0] for n in names["conductor"]} == always | {"eta", "k"}
    assert always | {"eta"} < names["coated"]
    assert any(n.startswith("nested.") for n in names["coated"])


def test_a_changed_height_scale_is_that_of_a_new_plugin(variant):
    bsdf = load()
    parameters = mi.traverse(bsdf)
    parameters["height_scale"] = 1.4
    parameters.update()
    wi, wo, lam = pairs()
    changed = brdf_values(bsdf, wi, wo, lam[:, None])
    assert changed == pytest.approx(
        brdf_values(load(height_scale=1.4), wi, wo, lam[:, None]),
        rel=1e-2,  # another table, since this one must serve 1.5 · 1.4; to 1e-3 of all
        abs=1e-3 * changed.max(),
    )
    expected = bsdf.table.brdf(wi, wo, lam, height_scale=1.4)
    assert np.sum(np.abs(changed - expected)) < 1e-5 * np.sum(expected)  # single precision


@pytest.mark.parametrize("scale", [1.51, 0.0, -1.0, float("nan")])
def test_a_height_scale_beyond_the_table_is_a_named_error(some_variant, scale):
    parameters = mi.traverse(load())
    parameters["height_scale"] = scale
    with pytest.raises((md.DiffractionError, RuntimeError)) as caught:
        parameters.update()
    *_, line = str(caught.value).splitlines()
    assert "must be above 0 and at most 1.5, the table's range; load the plugin anew" in line


def test_a_new_value_needs_no_new_kernel(variant):
    bsdf = load()
    parameters = mi.traverse(bsdf)
    wi, wo, lam = pairs(20)
    si, outgoing, context = interaction(wi, lam[:, None]), vectors(wo), mi.BSDFContext()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for scale in (0.7, 0.8, 0.9):
            parameters["height_scale"] = scale
            parameters["orientation"] = 10 * scale
            parameters.update()
            dr.eval(bsdf.eval(context, si, outgoing))
            history = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
            if scale > 0.7:
                assert all(kernel["cache_hit"] for kernel in history)


def test_it_says_what_it_is(some_variant):
    text = str(load(int_ior=1.5, orientation=30.0, height_scale=1.2))
    assert text.startswith("Diffraction[\n")
    for part in (
        "svd power, ensemble",
        "coherence_width = 4.5 µm",
        "tolerance = 0.001",
        "dielectric[eta = 1.4996]",
        "height_scale = 1.2",
        "orientation = 30°",
    ):
        assert part in text
    assert "SmoothDiffuse" in str(load(int_ior=1.5, pigment={"type": "diffuse"}))
    assert "conductor[Al]" in str(load(material="Al"))
