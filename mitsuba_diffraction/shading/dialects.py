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
    functions : names of functions that differ from `symbols`.
    reserved : names that no variable may have.
    """

    types: Mapping[str, str]
    result: str
    components: Mapping[str, str]
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
    functions={"asin": "arcsine"},
    reserved=frozenset(
        (
            f"{_FUNCTIONS} in out inout uniform varying attribute layout flat smooth "
            "centroid precision highp mediump lowp half fixed input output sample active "
            "filter common partition noise texture entry discard switch case default sizeof "
            "cast namespace using this union enum typedef template packed goto inline "
            "volatile public static extern external interface long short double unsigned "
            "superp arcsine"
        ).split()
    ),
)  # fmt: skip

OSL = Dialect(
    types={"float": "float", "complex": "md_number", "bool": "int", "vector": "vector"},
    result="output",
    components={"x": "[0]", "y": "[1]", "z": "[2]", "real": ".re", "imag": ".im"},
    functions={},
    reserved=frozenset(
        (
            # the grammar's words, in use and kept for later (language specification, section 2)
            f"{_FUNCTIONS} and or not case catch char class color closure default delete double "
            "emit enum extern friend goto illuminance illuminate inline light long matrix new "
            "normal operator output point private protected public shader short signed sizeof "
            "static string super surface displacement switch template this throw try typedef "
            "uniform union unsigned varying vector virtual volatile volume "
            "P N I Ng dPdu dPdv u v time dtime noise cellnoise hashnoise snoise texture "
            "environment trace hypot print printf format area degrees radians transform "
            "rotate luminance blackbody wavelength_color raytype backfacing emission "
            "diffuse reflection transparent background"
        ).split()
    ),
)  # fmt: skip
