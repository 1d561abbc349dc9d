"""Dictionaries for `mi.load_dict` from arrays in memory."""

from __future__ import annotations

import os
from typing import Any

import mitsuba as mi

from ..errors import DiffractionError, check_choice, quoted
from ..files import FileKind, kind_of
from ..heights import HeightField
from ..tables import DiffractionTable
from .description import SolvedOrders

#: BSDFs of a single height field.
PLUGINS = ("diffraction", "diffraction_dielectric")
#: BSDF of a table of orders.
ORDERS = "diffraction_orders"


class Data(mi.Object):
    """Height field or table in an object that a dictionary of Mitsuba's can hold."""

    def __init__(self, value: HeightField | DiffractionTable | SolvedOrders) -> None:
        super().__init__()
        self.value = value

    def __deepcopy__(self, memo: dict[int, Any]) -> Data:
        """Return another object of the same value, which never changes."""
        return Data(self.value)


def bsdf_dict(
    field: HeightField | DiffractionTable | SolvedOrders | str | os.PathLike[str],
    plugin: str = "diffraction",
    **parameters: Any,
) -> dict[str, Any]:
    """Return the dictionary of a BSDF for a height field, a table, or a file.

    Raises a DiffractionError if `field` is none of these, or the plugin is unknown.

    Parameters
    ----------
    field : heights in µm, or their table; or the path of a file, as for the parameter `filename`.
        Or a table of orders, whose plugin is `diffraction_orders`.
    plugin : `diffraction`, which reflects light, or `diffraction_dielectric`, which lets it through
        as well.
    parameters : any other parameter of the plugin, e.g. material="Al", tolerance=1e-4; None is
        the same as leaving it out.

    Returns
    -------
    dict for `mi.load_dict`, alone or inside a shape.
    """
    check_choice("bsdf_dict: plugin", plugin, PLUGINS)
    arguments = {name: value for name, value in parameters.items() if value is not None}
    if isinstance(field, str | os.PathLike):
        solved = kind_of(field) is FileKind.ORDERS
        return {"type": ORDERS if solved else plugin, "filename": os.fspath(field), **arguments}
    if isinstance(field, HeightField | DiffractionTable):
        return {"type": plugin, "data": Data(field), **arguments}
    if isinstance(field, SolvedOrders):
        return {"type": ORDERS, "data": Data(field), **arguments}
    raise DiffractionError(
        f"bsdf_dict: expected a HeightField, a table or the path of a file, got {quoted(field)}; "
        "make a field of an array with HeightField(heights, pixel_size)"
    )
