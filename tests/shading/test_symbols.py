"""Formulas as functions of a shader: names, structure, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.arithmetic import of
from mitsuba_diffraction.shading.dialects import GLSL
from mitsuba_diffraction.shading.programs import Program


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
    assert f"test_symbols.py, line {number}" in message
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
    program = Program(GLSL, frozenset({"GAIN"}))

    def of_gain(GAIN: Any) -> Any:
        return halved(GAIN)

    program.add(of_gain, "float")
    assert "float of_gain(float GAIN_)" in program.text
    assert "return 0.5 * GAIN_;" in program.text
