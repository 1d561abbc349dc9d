"""Dictionaries for `mi.load_dict` from arrays in memory."""

from __future__ import annotations

import os
from typing import Any, Protocol, runtime_checkable

import mitsuba as mi

from ..errors import DiffractionError, check_choice, quoted
from ..files import FileKind, kind_of
from ..heights.field import HeightField
from ..tables.table import DiffractionTable

#: BSDFs of a single height field.
PLUGINS = ("diffraction", "diffraction_dielectric")
#: BSDF of a table of orders.
ORDERS = "diffraction_orders"


class HeightData(mi.Object):
    """Height field in an object that a dictionary of Mitsuba's can hold."""

    def __init__(self, field: HeightField) -> None:
        super().__init__()
        self.field = field


class TableData(mi.Object):
    """Table in an object that a dictionary of Mitsuba's can hold."""

    def __init__(self, table: DiffractionTable | SolvedTable) -> None:
        super().__init__()
        self.table = table


@runtime_checkable
class SolvedTable(Protocol):
    """Table with a BSDF of its own, an `OrderTable`.

    Attributes
    ----------
    plugin : name of the BSDF.
    """

    plugin: str


def bsdf_dict(
    field: HeightField | DiffractionTable | SolvedTable | str | os.PathLike[str],
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
    if isinstance(field, SolvedTable):
        return {"type": field.plugin, "data": TableData(field), **arguments}
    if isinstance(field, DiffractionTable):
        return {"type": plugin, "data": TableData(field), **arguments}
    if isinstance(field, str | os.PathLike) and kind_of(field) is FileKind.ORDERS:
        return {"type": ORDERS, "filename": os.fspath(field), **arguments}
    if isinstance(field, str | os.PathLike):
        return {"type": plugin, "filename": os.fspath(field), **arguments}
    if not isinstance(field, HeightField):
        raise DiffractionError(
            f"bsdf_dict: expected a HeightField or the path of a file, got {quoted(field)}; make "
            "one of an array with HeightField(heights, pixel_size)"
        )
    return {"type": plugin, "data": HeightData(field), **arguments}
