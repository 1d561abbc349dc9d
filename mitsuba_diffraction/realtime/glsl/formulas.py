"""Formulas of `optics` that a shader calls, as functions in GLSL."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

from ...optics.boundary import MODELS, Model
from ...optics.coat import (
    beneath_reflectance,
    coated_reflectance,
    cosine_within,
    face_transmittance,
    passage,
    refracted,
)
from ...optics.colour import encoded_colour
from ...optics.display import shown_colour
from ...optics.fresnel import reflectance
from ...optics.geometry import horizon_attenuation, vcavity
from ...optics.mirror import horizon_correction, mirror_cosine
from ...optics.orders import (
    lobe_falloff,
    lobe_peak,
    order_direction,
    order_lobe,
    wavenumber_step,
)
from ...shading.dialects import GLSL
from ...shading.orders import FORMULAS
from ...shading.pair_power import Coat, pair_power
from ...shading.programs import Program

#: Formulas of real numbers by the definition that needs them, with the numbers of parameters.
_REAL: dict[str, dict[Callable[..., Any], int]] = {
    "ORDERS": {
        **FORMULAS, order_lobe: 3, lobe_peak: 2, wavenumber_step: 3, lobe_falloff: 4,
        horizon_correction: 3,
    },
    "FACE": {face_transmittance: 2, passage: 2, order_direction: 4},
    "ORDER_0": {horizon_correction: 3, mirror_cosine: 4},
    "COATED": {face_transmittance: 2, cosine_within: 2, coated_reflectance: 2},
    "VCAVITY": {vcavity: 3},
    "ENERGY_CONSERVING": {horizon_attenuation: 1},
}  # fmt: skip
_KINDS = {"1": "float", "2": "complex"}


def formulas(definitions: Mapping[str, str]) -> str:
    """Return the functions that a shader with these definitions calls, after `library.glsl`.

    Raises a DiffractionError if the formula of a boundary model cannot be written in GLSL.
    """
    names = {*_REAL, "DISPLAYED", "NATURAL"} & set(definitions)
    model = MODELS[definitions["BOUNDARY"]] if "BOUNDARY" in definitions else None
    return _formulas(frozenset(names), _KINDS.get(definitions.get("SURFACE_KIND", "0")), model)


@functools.lru_cache(maxsize=64)
def _formulas(names: frozenset[str], index: str | None, model: Model | None) -> str:
    program = Program(GLSL)
    program.add(encoded_colour, "vector")
    if "DISPLAYED" in names:
        shown = shown_colour if "NATURAL" in names else encoded_colour
        program.add(shown, "vector", name="displayed")
    for name in sorted(names & _REAL.keys()):
        for formula, count in _REAL[name].items():
            program.add(formula, *["float"] * count)
    if "COATED" in names:
        program.add(refracted, "vector", "float")
    if index is not None:
        program.add(reflectance, "float", index, name="interface_reflectance")
    if {"ORDER_0", "COATED"} <= names and index is not None:
        program.add(beneath_reflectance, "float", "float", index)
    if index is not None and model is not None:
        coat = Coat("float", "float", "float") if "COATED" in names else None
        program.add(
            pair_power, model.jones, "vector", "vector", index, "float", "float", coat,
        )  # fmt: skip
    return f"{program.text}\n"
