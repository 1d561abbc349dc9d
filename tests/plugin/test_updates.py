"""Updates of parameters: refused ones leave the BSDF as it was, and all others leave it finite."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import Array
from tests.support.kinds import KINDS, MIX, THROUGH, made
from tests.support.lanes import evaluated
from tests.support.layered import pairs

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("mono")]

HOSTILE = [float("nan"), float("inf"), -1.0, 0.0, 0.5, 3.0, 1e30]


def values(bsdf: Any) -> Array:
    """f·cosθo between directions above and, every other one, below."""
    wi, wo, lam = pairs(24)
    wo = wo * np.where(np.arange(len(wo)) % 2, 1, -1)[:, None]
    return evaluated(bsdf, wi, wo, lam)


def state(parameters: Any) -> dict[str, Array]:
    return {
        name: numbers if dr.is_tensor_v(value) else numbers.ravel()
        for name, value in parameters
        if dr.is_array_v(value)
        for numbers in [np.array(dr.detach(value), float)]
    }


@pytest.mark.parametrize("kind", [*KINDS, *THROUGH, MIX])
def test_a_refused_update_leaves_everything_as_it_was(kind):
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
