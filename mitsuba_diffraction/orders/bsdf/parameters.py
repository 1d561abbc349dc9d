"""Parameters of the plugin `diffraction_orders`, read from Mitsuba's Properties and checked."""

from __future__ import annotations

import weakref

from ...errors import DiffractionError
from ...heights.lengths import is_auto
from ...plugin.dictionary import ORDERS, Data
from ...plugin.parameters import resolved_path
from ...plugin.properties import class_of
from ...plugin.types import BSDF, Properties
from ...settings import USUAL_WIDTH, checked
from ...tables.store import loaded_once
from ..file import load_orders
from ..table import OrderTable

#: Periods that the coherence window spans at least: in a narrower one orders are no lobes.
LEAST_PERIODS = 2.0

_tables: weakref.WeakValueDictionary[str, OrderTable] = weakref.WeakValueDictionary()


def table_of(props: Properties, nested: BSDF | None) -> OrderTable:
    """Load the table.

    Raises a DiffractionError with the parameter and the choices, or if the table has two sides,
    beneath which no BSDF lies.
    """
    table = _loaded(props)
    if table.sides == 2 and nested is not None:
        kind = "thin sheet" if table.thin else "block"
        raise DiffractionError(
            f"the table is that of a {kind}, beneath which no BSDF ({class_of(nested)}) lies; "
            f"put a surface behind the {kind} instead"
        )
    return table


def _loaded(props: Properties) -> OrderTable:
    if ("filename" in props) == ("data" in props):
        raise DiffractionError(
            f"{ORDERS} takes one of filename, a file of orders, and data, an "
            "OrderTable of md.bsdf_dict"
        )
    if "data" in props:
        data = props.get("data")
        if not isinstance(data, Data) or not isinstance(data.value, OrderTable):
            raise DiffractionError("data must be an OrderTable; pass it to md.bsdf_dict")
        return data.value
    name = props.get("filename")
    if not isinstance(name, str):
        raise DiffractionError(f"filename={name!r} must be the name of a file")
    return loaded_once(resolved_path(name, "filename"), load_orders, _tables)


def coherence_width_of(props: Properties, table: OrderTable) -> float:
    """Return the coherence width, µm.

    Raises a DiffractionError with the value and the least one.
    """
    value = props.get("coherence_width", "auto")
    width = USUAL_WIDTH if is_auto(value) else checked("coherence_width", value)
    if width < LEAST_PERIODS * table.period:
        raise DiffractionError(
            f"coherence_width={width:g} µm must be at least {LEAST_PERIODS:g} periods of the "
            f"grating, {LEAST_PERIODS * table.period:g} µm: narrower windows have no orders"
        )
    return float(width)
