"""Languages that symbols are printed in: GLSL (3.30 and ES 3.00) and OSL."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Dialect:
    """Words of a C-like language.

    Attributes
    ----------
    types : by the kinds of symbols.
    result : word before a parameter that is a result.
    components : of a vector and of a complex number, by "xyz", "real" and "imag".
    complex : by operation, with places for the operands: see `printer`.
    prelude : functions of complex numbers that `complex` calls.
    functions : names of functions that differ from `symbols`.
    reserved : names that no variable may have.
    """

    types: Mapping[str, str]
    result: str
    components: Mapping[str, str]
    complex: Mapping[str, str]
    prelude: str
    functions: Mapping[str, str]
    reserved: frozenset[str]


_FUNCTIONS = (
    "sqrt exp exp2 log log2 sin cos tan asin acos atan abs min max floor ceil clamp pow mix mod "
    "fract round sign step length dot cross normalize distance reflect refract any all if else for "
    "while do break continue return const int float bool void struct true false"
)

GLSL = Dialect(
    types={"float": "float", "complex": "vec2", "bool": "bool", "vector": "vec3"},
    result="out",
    components={"x": ".x", "y": ".y", "z": ".z", "real": ".x", "imag": ".y"},
    complex={
        "of": "vec2({}, {})", "sum": "{} + {}", "difference": "{} - {}", "plus": "plus({}, {})",
        "scaled": "{} * {}", "times": "times({}, {})", "inverse": "inverse_of({})",
        "negative": "-{}",
    },
    prelude="""// Complex numbers: sum with a real number, product, and 1/a.
vec2 plus(vec2 a, float b) { return vec2(a.x + b, a.y); }
vec2 times(vec2 a, vec2 b) { return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x); }
vec2 inverse_of(vec2 a) { return vec2(a.x, -a.y) / dot(a, a); }
""",
    functions={"asin": "arcsine"},
    reserved=frozenset(
        (
            f"{_FUNCTIONS} in out inout uniform varying attribute layout flat smooth "
            "centroid precision highp mediump lowp half fixed input output sample active "
            "filter common partition noise texture entry discard switch case default sizeof "
            "cast namespace using this union enum typedef template packed goto inline "
            "volatile public static extern external interface long short double unsigned "
            "superp plus times inverse_of"
        ).split()
    ),
)  # fmt: skip

OSL = Dialect(
    types={"float": "float", "complex": "md_number", "bool": "int", "vector": "vector"},
    result="output",
    components={"x": "[0]", "y": "[1]", "z": "[2]", "real": ".re", "imag": ".im"},
    complex={
        "of": "md_of({}, {})", "sum": "md_sum({}, {})", "difference": "md_difference({}, {})",
        "plus": "md_plus({}, {})", "scaled": "md_scaled({}, {})", "times": "md_times({}, {})",
        "inverse": "md_inverse({})", "negative": "md_scaled({}, -1.0)",
    },
    prelude="""// Complex numbers: sums, products, and 1/a.
struct md_number { float re; float im; };
md_number md_of(float re, float im) { md_number n; n.re = re; n.im = im; return n; }
md_number md_sum(md_number a, md_number b) { return md_of(a.re + b.re, a.im + b.im); }
md_number md_difference(md_number a, md_number b) { return md_of(a.re - b.re, a.im - b.im); }
md_number md_plus(md_number a, float b) { return md_of(a.re + b, a.im); }
md_number md_scaled(md_number a, float b) { return md_of(a.re * b, a.im * b); }
md_number md_times(md_number a, md_number b)
{
    return md_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}
md_number md_inverse(md_number a)
{
    float squared = a.re * a.re + a.im * a.im;
    return md_of(a.re / squared, -a.im / squared);
}
""",
    functions={},
    reserved=frozenset(
        (
            f"{_FUNCTIONS} P N I Ng dPdu dPdv u v time dtime color point vector normal "
            "matrix string closure output public shader surface displacement volume emit "
            "illuminance illuminate private inline noise cellnoise hashnoise snoise texture "
            "environment trace hypot print printf format area degrees radians transform "
            "rotate luminance blackbody wavelength_color raytype backfacing emission "
            "diffuse reflection transparent background"
        ).split()
    ),
)  # fmt: skip
