"""A patch as a coat, a film or transmission is tried on, and the reference beside it."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.support.directions import Array, as_single, rough_patch, uniform_directions

PATCH = rough_patch((40, 44), (0.09, 0.09), 0.14, 0.8)
WIDTH = 3.0


def pairs(n: int = 200) -> tuple[Array, Array, Array]:
    """wi, wo (n, 3) and wavelengths (n, 4): at all angles, and where a plane is any plane."""
    rng = np.random.default_rng(8)
    wi, wo = uniform_directions(n, rng, 0.03), uniform_directions(n, rng, 0.03)
    near = slice(0, n // 2)
    wo[near] = wi[near] * [-1, -1, 1] + rng.normal(0.0, 0.03, (n // 2, 3))
    wi[0], wo[1], wi[2], wi[3], wi[4] = (0, 0, 1), (0, 0, 1), wo[2], wo[3] + (1e-5, 0, 0), (0, 0, 1)
    wo[4] = wi[4]
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    good = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    lam = as_single(rng.uniform(400.0, 700.0, (n, 4)))
    return as_single(wi[good]), as_single(wo[good]), lam[good]


FLAT = md.HeightField(np.zeros((40, 40)), 0.08)
#: Interfaces and sheets that let light through.
INDICES = {"int_ior": 1.5, "ext_ior": 1.0}
SIDES: dict[str, dict[str, Any]] = {"dielectric": {}, "sheet": {"thin": True}}
BELOW = np.array([1, 1, -1])


def load(field: md.HeightField = PATCH, **parameters: Any) -> Any:
    raw = {"energy_conserving": False, "coherence_width": WIDTH, "tolerance": 1e-4}
    return mi.load_dict(md.bsdf_dict(field, **(raw | parameters)))


def both(field: md.HeightField = PATCH, **parameters: Any) -> Any:
    return load(field, plugin="diffraction_dielectric", **INDICES, **parameters)
