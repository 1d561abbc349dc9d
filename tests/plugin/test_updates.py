"""Updates of parameters: refused ones leave the BSDF as it was, and all others leave it finite."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import Array
from tests.support.gentle import PATCH, WIDTH, pairs
from tests.support.lanes import interaction, spectra, vectors

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("mono")]

HOSTILE = [float("nan"), float("inf"), -1.0, 0.0, 0.5, 3.0, 1e30]
WHITE = {"type": "diffuse", "reflectance": 0.5}
TEXTURE = {"type": "checkerboard", "color0": 0.5, "color1": 0.9}


def surface(**parameters: Any) -> dict[str, Any]:
    raw = {"coherence_width": WIDTH, "energy_conserving": False, "int_ior": 1.5}
    if {"material", "eta"} & set(parameters):
        del raw["int_ior"]
    return md.bsdf_dict(PATCH, **(raw | parameters))


def mixed() -> dict[str, Any]:
    return {
        "type": "diffraction_mix",
        "back": surface(material="none"),
        "belly": surface(material="none", orientation=30.0),
        "weight_back": 0.3,
        "weight_belly": 0.2,
    }


KINDS = {
    "mirror": surface(material="none"),
    "varying": surface(material="none", height_scale=TEXTURE, height_scale_max=1.0),
    "dielectric": surface(pigment=WHITE),
    "conductor": surface(eta=0.9, k=6.0),
    "coat": surface(coat_ior=1.3),
    "film": surface(film_ior=1.3, film_thickness=120.0, pigment=WHITE, model="kirchhoff"),
    "filmed metal": surface(
        eta=0.9, k=6.0, film_ior=1.8, film_thickness=200.0, film_k=0.01, model="kirchhoff"
    ),
    "transmission": surface(plugin="diffraction_dielectric"),
    "thin": surface(plugin="diffraction_dielectric", thin=True),
    "mix": mixed(),
}


def values(bsdf: Any) -> Array:
    """f·cosθo between directions above and, every other one, below."""
    wi, wo, lam = pairs(24)
    wo = wo * np.where(np.arange(len(wo)) % 2, 1, -1)[:, None]
    return spectra(bsdf.eval(mi.BSDFContext(), interaction(wi, lam[:, None]), vectors(wo)))


def state(parameters: Any) -> dict[str, Array]:
    return {
        name: numbers if dr.is_tensor_v(value) else numbers.ravel()
        for name, value in parameters
        if dr.is_array_v(value)
        for numbers in [np.array(dr.detach(value), float)]
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_refused_update_leaves_everything_as_it_was(kind):
    bsdf = mi.load_dict(KINDS[kind])
    names = [name for name, value in mi.traverse(bsdf) if dr.is_array_v(value)]
    before, state_before = values(bsdf), state(mi.traverse(bsdf))
    assert np.all(np.isfinite(before))
    for name in names:
        refused = 0
        for hostile in HOSTILE:
            parameters = mi.traverse(bsdf)
            others = {n: state_before[n] * 0.99 for n in names if n != name and "data" not in n}
            try:
                parameters.update({name: hostile} | others)
            except (md.DiffractionError, RuntimeError) as error:
                refused += 1
                *_, line = str(error).splitlines()
                assert name.split(".")[-1 if kind == "mix" else 0] in line, line
                assert not line.startswith("AssertionError")
            else:
                assert np.all(np.isfinite(values(bsdf))), (name, hostile)
                mi.traverse(bsdf).update(state_before)
            after = state(mi.traverse(bsdf))
            assert all(np.array_equal(after[n], state_before[n]) for n in names), (name, hostile)
        assert np.array_equal(values(bsdf), before), name
        assert refused >= 2, name  # NaN and infinity at least
