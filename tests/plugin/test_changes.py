"""Parameters that change: listed, without another table or kernel, all together or not at all."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.parameter_changes import take_changes
from tests.support import layered
from tests.support.directions import Array
from tests.support.gentle import load, pairs
from tests.support.kinds import KINDS, MIX, THROUGH, made
from tests.support.lanes import brdf_values, evaluated, interaction, vectors, with_bitmaps


def test_a_changed_height_scale_is_a_factor_on_the_table_s_heights(variant):
    bsdf = load()
    parameters = mi.traverse(bsdf)
    parameters["height_scale"] = 1.4
    parameters.update()
    wi, wo, lam = pairs()
    changed = brdf_values(bsdf, wi, wo, lam[:, None])
    expected = bsdf.table.brdf(wi, wo, lam, height_scale=1.4)
    assert np.sum(np.abs(changed - expected)) < 1e-5 * np.sum(expected)  # single precision


RANGE = "must be above 0 and at most 1.5, the table's range; load the plugin anew"
COATED = {"eta": 0.9, "k": 6.0, "coat_ior": 1.58}
FILMED = {
    "eta": 0.9, "k": 6.0, "film_ior": 1.4, "film_thickness": np.full((2, 2), 0.5),
    "film_thickness_max": 300.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("given", "name", "value", "said"),
    [
        ({}, "height_scale", 1.51, RANGE),
        (COATED, "height_scale", 1.6, RANGE),
        (FILMED, "film_thickness.data", 1.5, "film_thickness: the texture's numbers"),
        (COATED, "coat_eta", 0.9, "coat_eta=0.9"),
        (COATED, "coat_eta", 2.9, "beyond the table's 2.37"),
    ],
)
def test_a_change_beyond_the_table_is_a_named_error(some_variant, given, name, value, said):
    parameters = mi.traverse(load(**with_bitmaps(given)))
    texels = name.endswith("data")
    parameters[name] = dr.full(mi.TensorXf, value, (2, 2, 1)) if texels else value
    with pytest.raises((md.DiffractionError, RuntimeError)) as caught:
        parameters.update()
    *_, line = str(caught.value).splitlines()
    assert said in line


def test_a_new_value_needs_no_new_kernel(variant):
    bsdf = load(int_ior=1.5, lateral_scale=1.0)
    parameters = mi.traverse(bsdf)
    wi, wo, lam = pairs(20)
    si, outgoing, context = interaction(wi, lam[:, None]), vectors(wo), mi.BSDFContext()
    changed = {"height_scale": 1.0, "lateral_scale": 1.0, "orientation": 10.0, "eta": 2.0}
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for scale in (0.7, 0.8, 0.9):
            for name, factor in changed.items():
                parameters[name] = factor * scale
            parameters.update()
            dr.eval(bsdf.eval(context, si, outgoing))
            history = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
            if scale > 0.7:
                assert all(kernel["cache_hit"] for kernel in history)


#: An index near 0 was rounded to 0 for the ratio of albedos.
HOSTILE = [float("nan"), float("inf"), -1.0, 0.0, 1e-30, 0.02, 0.5, 3.0, 1e30]
QUICK = "pigment"
OTHERS = [kind for kind in (*KINDS, *THROUGH, MIX) if kind != QUICK]


def values(bsdf: Any) -> Array:
    """f·cosθo between directions above and, every other one, below."""
    wi, wo, lam = layered.pairs(24)
    wo = wo * np.where(np.arange(len(wo)) % 2, 1, -1)[:, None]
    return evaluated(bsdf, wi, wo, lam)


def state(parameters: Any) -> dict[str, Array]:
    return {
        name: numbers if dr.is_tensor_v(value) else numbers.ravel()
        for name, value in parameters
        if dr.is_array_v(value)
        for numbers in [np.array(dr.detach(value), float)]
    }


@pytest.mark.parametrize(
    ("changes", "error", "named"),
    [
        ({"height_scale": np.nan, "eta": np.inf}, None, "height_scale=nan.*; eta=inf"),
        ({"height_scale": 0.8}, AssertionError, "derived"),
        ({"height_scale": 0.8}, KeyboardInterrupt, "interrupted"),
    ],
)
def test_whatever_fails_all_surfaces_and_what_follows_from_them_are_restored(
    mono, monkeypatch, changes, error, named
):
    surface, bystander = together = [made(QUICK), made(QUICK)]
    before = [state(mi.traverse(each)) for each in together], values(surface)

    def fail() -> None:
        monkeypatch.undo()
        surface.changed()
        raise error(named)  # a new one, whose traceback is let go with the surface

    if error is not None:
        monkeypatch.setattr(surface, "changed", fail)
    for changed, numbers in ((surface, changes), (bystander, {"height_scale": 0.7})):
        parameters = mi.traverse(changed)
        for name, number in numbers.items():
            parameters[name] = number
    with pytest.raises(error or md.DiffractionError, match=named):
        take_changes(surface, together)
    np.testing.assert_equal(
        ([state(mi.traverse(each)) for each in together], values(surface)), before
    )


@pytest.mark.parametrize(
    "kind", [QUICK, *(pytest.param(kind, marks=pytest.mark.thorough) for kind in OTHERS)]
)
def test_a_refused_update_leaves_everything_as_it_was(mono, kind):
    bsdf = made(kind)
    names = [name for name, value in mi.traverse(bsdf) if dr.is_array_v(value)]
    before, state_before = values(bsdf), state(mi.traverse(bsdf))
    assert np.all(np.isfinite(before))
    for name in names:
        refused = 0
        for hostile in HOSTILE:
            parameters = mi.traverse(bsdf)
            others = {n: state_before[n] * 0.99 for n in names if n != name and "data" not in n}
            texels = name.endswith("_scale.data")
            value = dr.full(mi.TensorXf, hostile, parameters[name].shape) if texels else hostile
            try:
                parameters.update({name: value} | others)
            except (md.DiffractionError, RuntimeError) as error:
                refused += 1
                *_, line = str(error).splitlines()
                assert name.split(".")[-1 if kind == MIX else 0] in line, line
                assert not line.startswith("AssertionError")
            else:
                assert np.all(np.isfinite(values(bsdf))), (name, hostile)
                mi.traverse(bsdf).update(state_before)
            after = state(mi.traverse(bsdf))
            assert all(np.array_equal(after[n], state_before[n]) for n in names), (name, hostile)
        assert np.array_equal(values(bsdf), before), name
        assert refused >= 2, name  # NaN and infinity at least
