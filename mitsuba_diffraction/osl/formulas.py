"""Formulas of `optics` that the shaders call, as functions in OSL."""

from __future__ import annotations

import functools
from collections.abc import Callable
from importlib import resources
from typing import Any

from ..optics.boundary import Model
from ..optics.coat import (
    coated_reflectance,
    cosine_within,
    face_transmittance,
    passage,
    refracted,
)
from ..optics.fresnel import reflectance
from ..optics.geometry import horizon_attenuation
from ..optics.orders import order_direction
from ..shading.dialects import OSL
from ..shading.orders import FORMULAS
from ..shading.pair_power import Coat, pair_power
from ..shading.programs import Program

#: Complex number of OSL, an index n + ik.
_COMPLEX = """struct md_number { float re; float im; };
md_number md_of(float re, float im) { md_number n; n.re = re; n.im = im; return n; }

"""


@functools.cache
def shader_file(name: str) -> str:
    """Read a file of the folder shaders."""
    return resources.files(__package__).joinpath("shaders", name).read_text(encoding="utf-8")


def order_formulas() -> str:
    """Return the formulas that `shaders/orders.osl` calls."""
    program = Program(OSL)
    functions: dict[Callable[..., Any], int] = {
        **FORMULAS, face_transmittance: 2, passage: 2, order_direction: 4,
    }  # fmt: skip
    for formula, count in functions.items():
        program.add(formula, *["float"] * count)
    return program.text


def patch_formulas(model: Model | None, coated: bool = False) -> str:
    """Return the functions of `optics` that `shaders/patch.osl` calls.

    model : of the boundary; None of a perfect reflector.
    coated : whether the structure lies under a coat.

    Raises a DiffractionError if the model's formula cannot be written in OSL.
    """
    program = Program(OSL)
    jones = None if model is None else model.jones
    program.add(
        pair_power, jones, "vector", "vector", "complex", "float", "float",
        Coat("float", "float", "float") if coated else None,
    )  # fmt: skip
    if coated:
        program.add(refracted, "vector", "float")
        for formula in (face_transmittance, coated_reflectance, cosine_within):
            program.add(formula, "float", "float")
    program.add(horizon_attenuation, "float")
    flat = reflectance if model is not None else _everything
    program.add(flat, "float", "complex", name="flat_reflectance")
    return _COMPLEX + program.text


def _everything(cosine: Any, index: Any) -> float:
    """Return the reflectance of a perfect reflector."""
    return 1.0
