"""Formulas as functions of a shader: names, structure, refusals."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.arithmetic import is_complex, of, squared
from mitsuba_diffraction.shading.dialects import GLSL, OSL
from mitsuba_diffraction.shading.programs import Program


class Ends(NamedTuple):
    """Two numbers."""

    low: Any
    high: Any


def halved(z: Any) -> Any:
    """Return z/2, eq. 3."""
    return 0.5 * z


def both(wi: tuple[Any, Any, Any], ends: Ends, index: Any) -> tuple[Any, Any]:
    """Return two numbers, eq. 1.

    More words.
    """
    x, _, z = wi
    xp = of(x)
    length = xp.sqrt(xp.maximum(x * x + z * z, 1e-20))
    steep = (length > ends.low) & (z < ends.high)
    chosen = xp.where(steep, length, 2.0)
    return halved(chosen), squared((index - 1.0) / (index + 1.0) * halved(index))


def printed(function: Any, *kinds: Any, dialect: Any = GLSL) -> str:
    program = Program(dialect)
    program.add(function, *kinds)
    return program.text


def test_variables_keep_their_names() -> None:
    text = printed(both, "vector", Ends("float", "float"), "float")
    assert "// Return two numbers, eq. 1.\n" in text
    assert "More words" not in text
    assert "void both(vec3 wi, float low, float high, float index," in text
    assert "float length_ = sqrt(max(wi.x * wi.x + wi.z * wi.z, 1e-20));" in text
    assert "bool steep = length_ > low && wi.z < high;" in text


def test_complex_numbers_are_pairs() -> None:
    text = printed(both, "vector", Ends("float", "float"), "complex")
    assert "vec2 index" in text
    assert "index.x - 1.0" in text
    osl = printed(both, "vector", Ends("float", "float"), "complex", dialect=OSL)
    assert "md_number index" in osl
    assert "int steep = length_ > low && wi[2] < high;" in osl


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


def unbounded(x: Any) -> Any:
    return x * math.inf


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
        printed(unbounded, "float")


def test_the_program_works_after_a_refusal() -> None:
    with pytest.raises(DiffractionError):
        printed(branches, "float")
    assert halved(3.0) == 1.5
    assert "return 0.5 * z;" in printed(halved, "float")


def test_numpy_numbers_are_constants() -> None:
    def scaled(x: Any) -> Any:
        return np.float64(0.25) * x + np.float32(0.5)

    assert "return 0.25 * x + 0.5;" in printed(scaled, "float")


def test_squares_and_kinds() -> None:
    def of_kind(z: Any) -> Any:
        return squared(z) if is_complex(z) else z

    assert "return z.x * z.x + z.y * z.y;" in printed(of_kind, "complex")
    assert "return z;" in printed(of_kind, "float")


def test_macros_are_no_variables() -> None:
    def of_gain(GAIN: Any) -> Any:
        return halved(GAIN)

    text = printed(of_gain, "float")
    assert "float of_gain(float GAIN_)" in text
    assert "return 0.5 * GAIN_;" in text
