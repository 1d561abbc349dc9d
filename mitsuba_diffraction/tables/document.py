"""A table as plain data, without its coefficients, for files and the cache; checked when read.

Whatever `parse_document` accepts can be looked up anywhere without reading outside the table: each
field has its type, size and range, and agrees with the others.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import quoted
from ..optics.blend import RoughnessTable
from ..settings import BASES, MAX_TAPS, MAX_TERMS, TableSettings
from .expansion import KINDS, Expansion, series_sum
from .fields import check_names, list_of, mapping, number, numbers, pair, require, whole
from .layout import Grid
from .store import Record
from .table import DiffractionTable

#: Largest table, bytes: a larger one fits no renderer's memory.
MAX_BYTES = 4 << 30

_REQUIRED = ("coherence_width", "coherence", "tolerance", "wavelength_range", "height_scale_max")
_SETTINGS = tuple(field.name for field in dataclasses.fields(TableSettings))
_TABLE_FIELDS = ("scale", "spacing", "error", "roughness", "source", "expansion", "grid", "order_0")
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


def to_record(table: DiffractionTable) -> Record:
    """Return the record of a table for the cache, without the names of its patches."""
    document = json.loads(json.dumps(document_of(table), default=plain))
    for patch in _patches(document["source"]):
        patch["name"] = ""
    return Record(document, [table.coefficients])


def named(table: DiffractionTable, names: Sequence[str]) -> DiffractionTable:
    """Give the patches of a table from the cache their names, unless they have some."""
    if table.source.get("name") == "":
        for patch, name in zip(_patches(table.source), (names[0], *names), strict=False):
            patch["name"] = name
    return table


def _patches(source: Any) -> list[dict[str, Any]]:
    """Return the descriptions of the first patch, and of all if there are several."""
    return [source, *source.get("patches", [])]


def from_record(record: Record) -> DiffractionTable:
    """Return the table of such a record; raises a ValueError for what does not fit."""
    (coefficients,) = record.arrays
    return with_coefficients(parse_document(record.document), coefficients)


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
    return expansion.intervals, *table.grid.shape, expansion.components, expansion.terms


def with_coefficients(table: DiffractionTable, coefficients: NDArray[Any]) -> DiffractionTable:
    """Return a table read by `parse_document` with its coefficients.

    Raises a ValueError if they have another shape, are not finite, or larger than any surface has.
    """
    shape = shape_of(table)
    require(coefficients.shape == shape, f"coefficients of shape {coefficients.shape} for {shape}")
    _check_sizes(coefficients, table.expansion, table.scale)
    return dataclasses.replace(table, coefficients=coefficients)


def parse_document(document: Any) -> DiffractionTable:
    """Read the result of `document_of`, checked field by field and against each other.

    The table has no coefficients: `with_coefficients` adds them.

    Raises a ValueError with the field that does not fit.
    """
    fields = mapping(document, "the description")
    settings = _settings(fields)
    check_names(fields, (*_TABLE_FIELDS, *_SETTINGS), _TABLE_FIELDS)
    expansion = _expansion(mapping(fields["expansion"], "expansion"))
    order_0 = expansion.intervals, expansion.components, expansion.series_terms
    table = DiffractionTable(
        coefficients=np.zeros((0, 0, 0, 0, 0), np.float32),
        order_0=numbers(fields["order_0"], "order_0", order_0),
        scale=number(fields["scale"], "scale", 1e-30, 1e30),
        expansion=expansion,
        grid=_grid(mapping(fields["grid"], "grid")),
        spacing=pair(fields["spacing"], "spacing", 1e-9, 1e9),
        settings=settings,
        error=_error(fields["error"]),
        roughness=_roughness(mapping(fields["roughness"], "roughness")),
        source=_source(fields["source"]),
    )
    _check_agreement(table)
    shares = np.linspace(0.0, 1.0, 33)
    kappa = expansion.length * (np.arange(expansion.intervals)[:, None] + shares).ravel()
    with np.errstate(over="ignore"):
        largest = np.abs(table.order_0_at(kappa)).max()
    require(largest <= _LARGEST_POWER, f"order_0 of a size of {largest:.3g}")
    size = 4 * math.prod(shape_of(table))
    require(size <= MAX_BYTES, f"{size:.3g} bytes of coefficients")
    return table


def _check_agreement(table: DiffractionTable) -> None:
    """Refuse fields that contradict others from which they follow."""
    grid, expansion, settings = table.grid, table.expansion, table.settings
    require(grid.coherent == settings.coherent, "coherent beside coherence")
    require(expansion.kind == "amplitude" or not grid.coherent, "coherence of powers")
    single = not grid.coherent or settings.window_width is None
    require(single and table.order_0_ratio <= _LARGEST_RATIO_0, "window_width beside coherence")
    steps = [table.sigma * spacing for spacing in table.spacing]
    require(np.allclose(grid.steps, steps, rtol=_ROUNDED, atol=0.0), "steps beside spacing")
    radius = [q / spacing for q, spacing in zip(table.frequency_limit, table.spacing, strict=True)]
    require(np.allclose(grid.radius, radius, rtol=1e-3, atol=0.0), "radius beside frequency_limit")
    limit = table.q_limit * table.height_scale_max
    require(
        limit * (1 - _ROUNDED) <= expansion.kappa_max <= limit * (1 + _ROUNDED),
        f"kappa_max={expansion.kappa_max:g} beside wavelength_range and height_scale_max",
    )


def _settings(fields: Mapping[str, Any]) -> TableSettings:
    check_names(fields, fields, _REQUIRED)
    settings = {name: fields[name] for name in _SETTINGS if name in fields}
    checked = TableSettings(**settings)
    require(checked.coherence_width != "auto", "coherence_width")
    return checked


def _expansion(fields: Mapping[str, Any]) -> Expansion:
    required = ("basis", "kind", "terms", "intervals", "kappa_max", "half_range")
    check_names(fields, (*required, "functions"), required)
    require(fields["basis"] in BASES, f"basis={quoted(fields['basis'])}")
    require(fields["kind"] in KINDS, f"kind={quoted(fields['kind'])}")
    expansion = Expansion(
        fields["basis"],
        fields["kind"],
        whole(fields["terms"], "terms", 1, MAX_TERMS),
        whole(fields["intervals"], "intervals", 1, _MOST_INTERVALS),
        number(fields["kappa_max"], "kappa_max", 1e-9, 1e9),
        number(fields["half_range"], "half_range", 0.0, 1e9),
    )
    if expansion.basis == "taylor":
        require(expansion.kind == "amplitude" and expansion.intervals == 1, "basis='taylor'")
    require((expansion.basis == "svd") == ("functions" in fields), "functions beside basis")
    if "functions" in fields:
        shape = (expansion.intervals, None, expansion.terms)
        functions = numbers(fields["functions"], "functions", shape)
        require(1 <= functions.shape[1] <= _LONGEST_SERIES, f"{functions.shape[1]} series terms")
        expansion = dataclasses.replace(expansion, functions=functions)
    terms = expansion.series_terms
    require(expansion.intervals * terms <= _MOST_SERIES, f"{expansion.intervals}×{terms} terms")
    # it has to follow the phases of its heights; few terms are a radian each
    phase = expansion.half_range * expansion.length
    require(phase <= 4.0 * terms + 8.0, f"half_range={expansion.half_range:g} beside terms")
    return expansion


def _grid(fields: Mapping[str, Any]) -> Grid:
    required = ("last", "steps", "radius", "taps", "coherent", "trims")
    check_names(fields, required, required)
    require(isinstance(fields["coherent"], bool), "coherent")
    grid = Grid(
        last=pair(fields["last"], "last", 1, 1 << 20, whole),
        steps=pair(fields["steps"], "steps", 1e-9, 1e9),
        radius=pair(fields["radius"], "radius", 1e-9, 1e9),
        taps=pair(fields["taps"], "taps", 1, MAX_TAPS, whole),
        coherent=fields["coherent"],
        trims=tuple(whole(n, "trims", 0, MAX_TAPS) for n in list_of(fields["trims"], "trims")),
    )
    for taps, bins in zip(grid.taps, grid.shape[::-1], strict=True):
        require(taps <= bins, f"{taps} taps of {bins} orders")
    rows = grid.taps[1]
    require(len(grid.trims) in (0, rows), f"{len(grid.trims)} trims of {rows} rows")
    require(all(2 * n < grid.taps[0] for n in grid.trims), "trims beyond the taps")
    return grid


def _error(value: Any) -> dict[str, float]:
    names = ("near", "far", "kappa_near", "kappa_far")
    fields = mapping(value, "error")
    check_names(fields, names, ())
    return {name: number(value, name, 0.0, 1e9) for name, value in fields.items()}


def _roughness(fields: Mapping[str, Any]) -> RoughnessTable:
    check_names(fields, ("first", "nodes"), ("first", "nodes"))
    nodes = numbers(fields["nodes"], "nodes", (None,))
    require(2 <= len(nodes) <= _MOST_NODES and bool(np.all(nodes >= 0.0)), "nodes of roughness")
    return RoughnessTable(number(fields["first"], "first", -64.0, 64.0), nodes)


def _source(value: Any) -> dict[str, Any]:
    source = dict(mapping(value, "source"))
    require(all(isinstance(source.get(name, ""), str) for name in ("name", "digest")), "source")
    source.pop("warnings", None)  # of the heights, not of the table
    return source


def _check_sizes(coefficients: NDArray[Any], expansion: Expansion, scale: float) -> None:
    """Refuse coefficients that are not finite, or make an order brighter than all the light."""
    shares = np.linspace(0.02, 1.0 - 1e-9, 5)  # at 1 the next interval begins
    _, ny, nx, components, terms = coefficients.shape
    rows = max(1, _BLOCK // (nx * components * terms))
    for interval, start in itertools.product(range(len(coefficients)), range(0, ny, rows)):
        weights = expansion.weights(expansion.length * (interval + shares)) / scale
        part = coefficients[interval, start : start + rows].astype(np.float32)
        with np.errstate(all="ignore"):
            values = series_sum(part, weights.astype(np.float32))
            largest = float(np.abs(expansion.power_of(values)).max())
        require(largest <= _LARGEST_POWER, f"an order with {largest:.3g} of the light")
