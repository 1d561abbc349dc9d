"""Options of the command line from the parameters of `Anatomy` and `Scales`."""

from __future__ import annotations

import argparse
import inspect
import re
from dataclasses import fields
from typing import TypeVar

from . import anatomy, scales
from .anatomy import Anatomy
from .scales import Scales

Part = TypeVar("Part", Anatomy, Scales)
_LIMITS = {**anatomy.LIMITS, **scales.LIMITS}


def add_options_of(part: Anatomy | Scales, group: argparse._ArgumentGroup) -> None:
    """Declare an option for each parameter; `part` has the defaults, its docstring the help."""
    described = dict(re.findall(r"^(\w+) : (.+)$", inspect.getdoc(type(part)) or "", re.MULTILINE))
    for field in fields(part):
        if not field.init:
            continue
        if field.name == "length":
            low, high = anatomy.LENGTH_LIMITS
            allowed = f"{low:g} to {high:g} girth radii"
        else:
            low, high = _LIMITS[field.name]
            allowed = f"{low:.10g} to {high:.10g}"
        group.add_argument(
            "--" + field.name.replace("_", "-"),
            type=int if field.type == "int" else float,
            default=getattr(part, field.name),
            help=f"{described[field.name].rstrip('.').replace('%', '%%')}; {allowed}",
        )


def chosen(part: type[Part], args: argparse.Namespace) -> Part:
    """`part` with the values that the command line gave.

    Raises
    ------
    DiffractionError
        If one is outside its limits.
    """
    return part(**{field.name: getattr(args, field.name) for field in fields(part) if field.init})
