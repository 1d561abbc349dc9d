"""A table as plain data, without its coefficients, for files and the cache; checked when read.

Whatever `parse_document` accepts can be looked up anywhere without reading outside the table: each
field has its type, size and range, and agrees with the others.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import quoted
from ..optics.blend import RoughnessTable
from ..settings import BASES, MAX_TAPS, MAX_TERMS, TableSettings
from .expansion import KINDS, Expansion
from .layout import Grid
from .table import DiffractionTable

#: Largest table, bytes: a larger one fits no renderer's memory.
MAX_BYTES = 4 << 30

_REQUIRED = ("coherence_width", "coherence", "tolerance", "wavelength_range", "height_scale_max")
_SETTINGS = tuple(field.name for field in dataclasses.fields(TableSettings))
_TABLE_FIELDS = ("scale", "spacing", "error", "roughness", "source", "expansion", "grid", "order_0")
_COMPONENTS = {"power": 1, "amplitude": 2}
_MOST_INTERVALS, _LONGEST_SERIES = 4096, 2048
_MOST_SERIES = 1 << 16  # terms over all intervals
_MOST_NODES = 1 << 12
_ROUNDED = 1e-6  # relative tolerance of fields that follow from others
#: Largest share of the light in an order: 1 and the error of a table of a large tolerance.
_LARGEST_POWER = 2.0
_LARGEST_RATIO_0 = 1e8  # windows of 500 and of 0.05 µm
_BLOCK = 1 << 22  # coefficients at a time


def document_of(table: DiffractionTable) -> dict[str, Any]:
    """Return all fields of a table but the coefficients; absent ones are left out."""
    return {
        **table.settings.as_json(),
        "scale": table.scale,
        "spacing": table.spacing,
        "error": dict(table.error),
        "roughness": {"first": table.roughness.first, "nodes": table.roughness.nodes.tolist()},
        "source": dict(table.source),
        "expansion": _present(table.expansion),
        "grid": _present(table.grid),
        "order_0": table.order_0.tolist(),
    }


def plain(value: Any) -> Any:
    """Convert NumPy's numbers and read-only mappings for JSON."""
    return dict(value) if isinstance(value, Mapping) else value.tolist()


def _present(record: Expansion | Grid) -> dict[str, Any]:
    """Return the fields of a record that are not None."""
    fields = dataclasses.asdict(record)
    return {name: value for name, value in fields.items() if value is not None}


def shape_of(table: DiffractionTable) -> tuple[int, ...]:
    """Return the shape of a table's coefficients, which it may lack."""
    expansion = table.expansion
    return expansion.intervals, *table.grid.shape, _COMPONENTS[expansion.kind], expansion.terms


def with_coefficients(table: DiffractionTable, coefficients: NDArray[Any]) -> DiffractionTable:
    """Return a table read by `parse_document` with its coefficients.

    Raises a ValueError if numbers are not finite, or larger than any surface has.
    """
    _check_sizes(coefficients, table.expansion, table.scale)
    return dataclasses.replace(table, coefficients=coefficients)


def parse_document(document: Any) -> DiffractionTable:
    """Read the result of `document_of`, checked field by field and against each other.

    The table has no coefficients: `with_coefficients` adds them.

    Raises a ValueError with the field that does not fit.
    """
    fields = _mapping(document, "the description")
    settings = _settings(fields)
    _names(fields, (*_TABLE_FIELDS, *_SETTINGS), _TABLE_FIELDS)
    expansion = _expansion(_mapping(fields["expansion"], "expansion"))
    components = _COMPONENTS[expansion.kind], expansion.series_terms
    table = DiffractionTable(
        coefficients=np.zeros((0, 0, 0, 0, 0), np.float32),
        order_0=_numbers(fields["order_0"], "order_0", (expansion.intervals, *components)),
        scale=_number(fields["scale"], "scale", 1e-30, 1e30),
        expansion=expansion,
        grid=_grid(_mapping(fields["grid"], "grid")),
        spacing=_pair(fields["spacing"], "spacing", 1e-9, 1e9),
        settings=settings,
        error=_error(fields["error"]),
        roughness=_roughness(_mapping(fields["roughness"], "roughness")),
        source=_source(fields["source"]),
    )
    _check_agreement(table)
    shares = np.linspace(0.0, 1.0, 33)
    kappa = expansion.length * (np.arange(expansion.intervals)[:, None] + shares).ravel()
    with np.errstate(over="ignore"):
        largest = np.abs(table.order_0_at(kappa)).max()
    _require(largest <= _LARGEST_POWER, f"order_0 of a size of {largest:.3g}")
    size = 4 * math.prod(shape_of(table))
    _require(size <= MAX_BYTES, f"{size:.3g} bytes of coefficients")
    return table


def _check_agreement(table: DiffractionTable) -> None:
    """Refuse fields that contradict others from which they follow."""
    grid, expansion, settings = table.grid, table.expansion, table.settings
    _require(grid.coherent == settings.coherent, "coherent beside coherence")
    _require(expansion.kind == "amplitude" or not grid.coherent, "coherence of powers")
    single = not grid.coherent or settings.window_width is None
    _require(single and table.order_0_ratio <= _LARGEST_RATIO_0, "window_width beside coherence")
    steps = [table.sigma * spacing for spacing in table.spacing]
    _require(np.allclose(grid.steps, steps, rtol=_ROUNDED, atol=0.0), "steps beside spacing")
    radius = [q / spacing for q, spacing in zip(table.frequency_limit, table.spacing, strict=True)]
    _require(np.allclose(grid.radius, radius, rtol=1e-3, atol=0.0), "radius beside frequency_limit")
    limit = table.q_limit * table.height_scale_max
    _require(
        limit * (1 - _ROUNDED) <= expansion.kappa_max <= limit * (1 + _ROUNDED),
        f"kappa_max={expansion.kappa_max:g} beside wavelength_range and height_scale_max",
    )


def _settings(fields: Mapping[str, Any]) -> TableSettings:
    _names(fields, fields, _REQUIRED)
    settings = {name: fields[name] for name in _SETTINGS if name in fields}
    checked = TableSettings(**settings)
    _require(checked.coherence_width != "auto", "coherence_width")
    return checked


def _expansion(fields: Mapping[str, Any]) -> Expansion:
    required = ("basis", "kind", "terms", "intervals", "kappa_max", "half_range")
    _names(fields, (*required, "functions"), required)
    _require(fields["basis"] in BASES, f"basis={quoted(fields['basis'])}")
    _require(fields["kind"] in KINDS, f"kind={quoted(fields['kind'])}")
    expansion = Expansion(
        fields["basis"],
        fields["kind"],
        _whole(fields["terms"], "terms", 1, MAX_TERMS),
        _whole(fields["intervals"], "intervals", 1, _MOST_INTERVALS),
        _number(fields["kappa_max"], "kappa_max", 1e-9, 1e9),
        _number(fields["half_range"], "half_range", 0.0, 1e9),
    )
    if expansion.basis == "taylor":
        _require(expansion.kind == "amplitude" and expansion.intervals == 1, "basis='taylor'")
    _require((expansion.basis == "svd") == ("functions" in fields), "functions beside basis")
    if "functions" in fields:
        shape = (expansion.intervals, None, expansion.terms)
        functions = _numbers(fields["functions"], "functions", shape)
        _require(1 <= functions.shape[1] <= _LONGEST_SERIES, f"{functions.shape[1]} series terms")
        expansion = dataclasses.replace(expansion, functions=functions)
    terms = expansion.series_terms
    _require(expansion.intervals * terms <= _MOST_SERIES, f"{expansion.intervals}×{terms} terms")
    # it has to follow the phases of its heights; few terms are a radian each
    phase = expansion.half_range * expansion.length
    _require(phase <= 4.0 * terms + 8.0, f"half_range={expansion.half_range:g} beside terms")
    return expansion


def _grid(fields: Mapping[str, Any]) -> Grid:
    required = ("last", "steps", "radius", "taps", "coherent", "trims")
    _names(fields, required, required)
    _require(isinstance(fields["coherent"], bool), "coherent")
    grid = Grid(
        last=_pair(fields["last"], "last", 1, 1 << 20, _whole),
        steps=_pair(fields["steps"], "steps", 1e-9, 1e9),
        radius=_pair(fields["radius"], "radius", 1e-9, 1e9),
        taps=_pair(fields["taps"], "taps", 1, MAX_TAPS, _whole),
        coherent=fields["coherent"],
        trims=tuple(_whole(n, "trims", 0, MAX_TAPS) for n in _list(fields["trims"], "trims")),
    )
    for taps, bins in zip(grid.taps, grid.shape[::-1], strict=True):
        _require(taps <= bins, f"{taps} taps of {bins} orders")
    rows = grid.taps[1]
    _require(len(grid.trims) in (0, rows), f"{len(grid.trims)} trims of {rows} rows")
    _require(all(2 * n < grid.taps[0] for n in grid.trims), "trims beyond the taps")
    return grid


def _error(value: Any) -> dict[str, float]:
    names = ("near", "far", "kappa_near", "kappa_far")
    fields = _mapping(value, "error")
    _names(fields, names, ())
    return {name: _number(number, name, 0.0, 1e9) for name, number in fields.items()}


def _roughness(fields: Mapping[str, Any]) -> RoughnessTable:
    _names(fields, ("first", "nodes"), ("first", "nodes"))
    nodes = _numbers(fields["nodes"], "nodes", (None,))
    _require(2 <= len(nodes) <= _MOST_NODES and bool(np.all(nodes >= 0.0)), "nodes of roughness")
    return RoughnessTable(_number(fields["first"], "first", -64.0, 64.0), nodes)


def _source(value: Any) -> dict[str, Any]:
    source = dict(_mapping(value, "source"))
    _require(all(isinstance(source.get(name, ""), str) for name in ("name", "digest")), "source")
    source.pop("warnings", None)  # of the heights, not of the table
    return source


def _check_sizes(coefficients: NDArray[Any], expansion: Expansion, scale: float) -> None:
    """Refuse coefficients that are not finite, or make an order brighter than all the light."""
    shares = np.linspace(0.02, 1.0 - 1e-9, 5)  # at 1 the next interval begins
    _, ny, nx, components, terms = coefficients.shape
    rows = max(1, _BLOCK // (nx * components * terms))
    for interval, start in itertools.product(range(len(coefficients)), range(0, ny, rows)):
        weights = expansion.weights(expansion.length * (interval + shares)).T / scale
        part = coefficients[interval, start : start + rows].astype(np.float32)
        with np.errstate(all="ignore"):
            values = part @ weights.astype(np.float32)
            powers = values[..., 0, :] if expansion.kind == "power" else (values**2).sum(axis=2)
        largest = float(np.abs(powers).max())
        _require(largest <= _LARGEST_POWER, f"an order with {largest:.3g} of the light")


# ------------------------------------------------------------------------ one value


def _require(fits: bool | np.bool_, what: str) -> None:
    if not fits:
        raise ValueError(f"{what} does not fit")


def _mapping(value: Any, name: str) -> Mapping[str, Any]:
    _require(isinstance(value, dict), name)
    return value


def _list(value: Any, name: str) -> list[Any]:
    _require(isinstance(value, list | tuple), name)
    return list(value)


def _names(fields: Iterable[str], allowed: Iterable[str], required: Iterable[str]) -> None:
    missing, unknown = set(required) - set(fields), set(fields) - set(allowed)
    if missing:
        raise ValueError(f"missing entries: {', '.join(sorted(missing))}")
    if unknown:
        raise ValueError(f"unknown entry {quoted(min(unknown))}")


def _number(value: Any, name: str, low: float, high: float) -> float:
    real = isinstance(value, int | float) and not isinstance(value, bool)
    _require(real and low <= value <= high, f"{name}={quoted(value)}")
    return float(value)


def _whole(value: Any, name: str, low: int, high: int) -> int:
    _require(type(value) is int and low <= value <= high, f"{name}={quoted(value)}")
    return int(value)


def _two(value: Any, name: str) -> list[Any]:
    pair = _list(value, name)
    _require(len(pair) == 2, f"{name}={quoted(value)}")
    return pair


def _pair(
    value: Any, name: str, low: float, high: float, number: Callable[..., Any] = _number
) -> tuple[Any, Any]:
    x, y = (number(part, name, low, high) for part in _two(value, name))
    return x, y


def _numbers(value: Any, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    array = np.array(value)
    right = len(shape) == array.ndim and all(
        n in (None, m) for n, m in zip(shape, array.shape, strict=True)
    )
    _require(right and array.dtype.kind in "if", f"{name} of shape {array.shape}")
    _require(np.isfinite(array).all() and np.abs(array).max(initial=0.0) < 1e12, name)
    return array.astype(float)
