"""Parameters that change: listed, without another table or kernel, all together or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.parameter_changes import Bounded, ObjectValues, take_changes
from tests.support import layered
from tests.support.directions import Array
from tests.support.gentle import load, pairs
from tests.support.kinds import KINDS, MIX, THROUGH, made
from tests.support.lanes import brdf_values, evaluated, interaction, vectors


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


@pytest.mark.parametrize(
    ("given", "name", "value", "said"),
    [
        ({}, "height_scale", 1.51, RANGE),
        (COATED, "height_scale", 1.6, RANGE),
        (COATED, "coat_eta", 0.9, "coat_eta=0.9"),
        (COATED, "coat_eta", 2.9, "beyond the table's 2.37"),
    ],
)
def test_a_change_beyond_the_table_is_a_named_error(some_variant, given, name, value, said):
    parameters = mi.traverse(load(**given))
    parameters[name] = value
    with pytest.raises((md.DiffractionError, RuntimeError)) as caught:
        parameters.update()
    *_, line = str(caught.value).splitlines()
    assert said in line


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


class Surface:
    """Two parameters whose sum must be below 3, and a derived quantity that may fail."""

    def __init__(self) -> None:
        self.number = Bounded("number", 1.0, 0.0, 2.0, lambda value: f"number={value:g}")
        self.spectrum = mi.load_dict({"type": "uniform", "value": 1.0})
        self.parameters = [self.number, ObjectValues("spectrum", self.spectrum, (0.5, 5.0))]
        self.error: BaseException | None = None
        self.derived = 0.0
        self.derive()

    def values(self) -> tuple[float, float]:
        return float(self.number.value[0]), float(mi.traverse(self.spectrum)["value"][0])

    def refusals(self) -> Iterator[str | None]:
        yield "the sum is too large" if sum(self.values()) >= 3.0 else None

    def derive(self) -> None:
        error, self.error = self.error, None
        if error is not None:
            raise error
        self.derived = sum(self.values())

    changed = derive

    def assign(self, number: float, value: float) -> None:
        mi.set_property(self.number.value, mi.Float(number))
        mi.traverse(self.spectrum).update({"value": value})


@pytest.mark.parametrize(
    ("values", "error", "named"),
    [
        ((3.0, 1.5), None, "number=3"),
        ((1.5, 0.1), None, "spectrum.value=0.1|spectrum=0.1"),
        ((float("nan"), float("inf")), None, "number=nan; spectrum"),
        ((1.6, 1.6), None, "the sum is too large"),
        ((1.2, 1.2), AssertionError("derived"), "derived"),
        ((1.2, 1.2), KeyboardInterrupt("interrupted"), "interrupted"),
    ],
)
def test_whatever_fails_the_last_values_and_what_follows_from_them_are_restored(
    mono: None, values: tuple[float, float], error: BaseException | None, named: str
) -> None:
    surface, bystander = Surface(), Surface()
    together: list[Any] = [surface, bystander]
    surface.assign(1.25, 1.5)
    take_changes(surface, together)
    assert (surface.values(), surface.derived) == ((1.25, 1.5), 2.75)
    surface.assign(*values)
    bystander.assign(0.5, 0.75)
    surface.error = error
    with pytest.raises(type(error) if error else md.DiffractionError, match=named):
        take_changes(surface, together)
    assert (surface.values(), surface.derived) == ((1.25, 1.5), 2.75)
    assert (bystander.values(), bystander.derived) == ((1.0, 1.0), 2.0)


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
