"""Formulas of `optics` that a shader calls, as functions in GLSL."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

from ...optics.colour import encoded_colour
from ...optics.dialects import GLSL
from ...optics.display import shown_colour
from ...optics.orders import (
    cell_wavelengths,
    lobe_falloff,
    lobe_peak,
    order_cell,
    order_lobe,
    smooth_coordinate,
    wavelength_coordinate,
    wavenumber_step,
)
from ...optics.programs import Program

_NUMBER = "float"
_ORDERS: dict[Callable[..., Any], int] = {
    order_cell: 5, smooth_coordinate: 1, cell_wavelengths: 5, wavelength_coordinate: 4,
    order_lobe: 3, lobe_peak: 2, wavenumber_step: 3, lobe_falloff: 4,
}  # fmt: skip
#: Definitions that the formulas of a shader depend on.
_DECISIVE = ("DISPLAYED", "NATURAL", "ORDERS")


def formulas(definitions: Mapping[str, str]) -> str:
    """Return the functions that a shader with these definitions calls, after `library.glsl`."""
    return _formulas(frozenset(name for name in _DECISIVE if name in definitions))


@functools.cache
def _formulas(definitions: frozenset[str]) -> str:
    program = Program(GLSL)
    program.add(encoded_colour, "vector")
    if "DISPLAYED" in definitions:
        shown = shown_colour if "NATURAL" in definitions else encoded_colour
        program.add(shown, "vector", name="displayed")
    if "ORDERS" in definitions:
        for formula, count in _ORDERS.items():
            program.add(formula, *[_NUMBER] * count)
    return f"{program.text}\n"
