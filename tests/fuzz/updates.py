"""Random updates of parameters: refused ones change nothing, others leave the BSDF finite."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.fuzz.surfaces import log_uniform
from tests.support.gentle import PATCH, WIDTH, pairs
from tests.support.lanes import interaction, spectra, vectors

_UPDATES = 12
_HOSTILE = (
    float("nan"), float("inf"), -float("inf"), -1.0, -1e-9, 0.0, 1e-30, 1e-3, 0.5, 1.0, 1.01, 2.1,
    3.0, 1e6, 1e30,
)  # fmt: skip
_KINDS: tuple[dict[str, Any], ...] = (
    {"material": "none"},
    {"int_ior": 1.5},
    {"int_ior": 1.5, "pigment": {"type": "diffuse", "reflectance": 0.5}},
    {"eta": 0.9, "k": 6.0},
    {"int_ior": 1.5, "coat_ior": 1.3},
    {"eta": 0.9, "k": 6.0, "film_ior": 1.8, "film_thickness": 200.0, "model": "kirchhoff"},
    {"int_ior": 1.5, "plugin": "diffraction_dielectric"},
    {"int_ior": 1.5, "plugin": "diffraction_dielectric", "thin": True},
)


def check(rng: np.random.Generator) -> None:
    """Update some parameters of a surface at once, several times."""
    mi.set_variant("llvm_ad_mono")
    kind = _KINDS[rng.integers(len(_KINDS))]
    raw = {"coherence_width": WIDTH, "energy_conserving": False, "ext_ior": 1.0}
    if "int_ior" not in kind:
        del raw["ext_ior"]
    bsdf = mi.load_dict(md.bsdf_dict(PATCH, **raw, **kind))
    values, state = _values(bsdf), _state(bsdf)
    names = list(state)
    for _ in range(_UPDATES):
        chosen = rng.choice(names, int(rng.integers(1, len(names) + 1)), replace=False)
        update = {str(name): _number(rng, state[str(name)]) for name in chosen}
        try:
            mi.traverse(bsdf).update(update)
        except (md.DiffractionError, RuntimeError) as error:
            *_, line = str(error).splitlines()
            assert any(name.split(".")[0] in line for name in update), line
        else:
            assert np.all(np.isfinite(_values(bsdf))), f"{kind}: {update}"
            mi.traverse(bsdf).update(state)
        for name, value in _state(bsdf).items():
            assert np.array_equal(value, state[name]), f"{kind}: {update} leaves {name}={value}"
        assert np.array_equal(_values(bsdf), values), f"{kind}: {update}"


def _number(rng: np.random.Generator, now: Any) -> Any:
    """A hostile number, any number, or one close to the present value."""
    kind = rng.integers(3)
    if kind == 0:
        return float(rng.choice(_HOSTILE))
    if kind == 1:
        return float(rng.choice([-1.0, 1.0])) * log_uniform(rng, 1e-6, 1e6)
    return float(now[0]) * float(rng.uniform(0.9, 1.1))


def _state(bsdf: Any) -> dict[str, Any]:
    """All numbers; heights are arrays, which test_data.py changes."""
    return {
        name: np.array(dr.detach(value), float).ravel()
        for name, value in mi.traverse(bsdf)
        if dr.is_array_v(value) and name != "data"
    }


def _values(bsdf: Any) -> Any:
    """f·cosθo of directions above and, every other one, below."""
    wi, wo, lam = pairs(24)
    wo = wo * np.where(np.arange(len(wo)) % 2, 1, -1)[:, None]
    return spectra(bsdf.eval(mi.BSDFContext(), interaction(wi, lam[:, None]), vectors(wo)))
