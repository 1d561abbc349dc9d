"""Formulas as functions of a shader, and the texture of solved orders as shaders read it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.arithmetic import of
from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.shading.dialects import GLSL
from mitsuba_diffraction.shading.orders import (
    order_row,
    order_texel,
    pack_orders,
    texture_constants,
)
from mitsuba_diffraction.shading.programs import Program
from tests.support.orders import thin_grating


def test_texture_has_the_efficiencies_of_the_table() -> None:
    table: OrderTable = thin_grating(period=1.2)
    packed = pack_orders(table, 4 << 20)
    constants = texture_constants(table, packed)
    cells = [constants.pop(f"{name}_cells") for name in ("tau", "rho", "w")]
    across, _ = constants.pop("tiles_across"), constants.pop("kept")
    x, y = 0.6 * np.random.default_rng(3).uniform(-1.0, 1.0, (2, 200))
    wavelength = np.linspace(0.41, 0.69, 200)
    row = order_row(x, y, wavelength, **constants)
    channels = packed.pixels.astype(float).transpose(2, 0, 1)
    for order in range(-2, 3):
        q = row.channel - order
        leaves = (q >= 0) & (q < row.channels)
        column, line, along = order_texel(
            row.tile + np.where(leaves, q, 0), *row.place, *cells, across
        )
        four = [map_coordinates(channel, [line - 0.5, column - 0.5], order=1, mode="nearest")
                for channel in channels]  # fmt: skip
        read = sum(n * np.maximum(1.0 - abs(along - at), 0.0) for at, n in enumerate(four))
        exact = table.efficiency(-x, -y, 1e3 * wavelength, order)
        # half floats and linear cells: 0.1 % of the light
        assert np.abs(np.where(leaves, row.lit * read, 0.0) - exact).max() < 2e-3


def halved(z: Any) -> Any:
    """Return z/2, eq. 3."""
    return 0.5 * z


def printed(function: Any, *kinds: Any, dialect: Any = GLSL) -> str:
    program = Program(dialect)
    program.add(function, *kinds)
    return program.text


def test_an_expression_is_computed_once() -> None:
    def twice(x: Any, y: Any) -> Any:
        return (x * y + 1.0) * (x * y + 2.0)

    assert printed(twice, "float", "float").count("x * y") == 1


def branches(x: Any) -> Any:
    return x if x > 0.0 else -x


def of_numpy(x: Any) -> Any:
    return np.tanh(x)


def without_home(x: Any) -> Any:
    return of(x).gamma(x)


def of_method(x: Any) -> Any:
    return x.conj()


def of_math(x: Any) -> Any:
    return math.sqrt(x)


@pytest.mark.parametrize(
    ("function", "reason", "line"),
    [
        (branches, "branches on a value", "return x if x > 0.0 else -x"),
        (of_numpy, "numpy.tanh", "return np.tanh(x)"),
        (without_home, "gamma", "return of(x).gamma(x)"),
        (of_method, "no .conj", "return x.conj()"),
        (of_math, "needs a value", "return math.sqrt(x)"),
    ],
)
def test_formulas_that_no_shader_can_express_are_refused(
    function: Any, reason: str, line: str
) -> None:
    with pytest.raises(DiffractionError) as refused:
        printed(function, "float")
    message = str(refused.value)
    number = function.__code__.co_firstlineno + 1
    assert f"test_orders.py, line {number}" in message
    assert reason in message
    assert line in message
    assert "\n" not in message


def test_infinity_is_refused() -> None:
    with pytest.raises(DiffractionError, match="inf"):
        printed(lambda x: x * math.inf, "float")


def test_numpy_numbers_are_constants() -> None:
    def scaled(x: Any) -> Any:
        return np.float64(0.25) * x + np.float32(0.5)

    assert "return 0.25 * x + 0.5;" in printed(scaled, "float")


def test_macros_are_no_variables() -> None:
    def of_gain(GAIN: Any) -> Any:
        return halved(GAIN)

    text = printed(of_gain, "float")
    assert "float of_gain(float GAIN_)" in text
    assert "return 0.5 * GAIN_;" in text
