"""Weights of gratings of one profile at several depths, by a depth that varies (Dr.Jit)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from ..tables.orders import CrossedTable, OrderTable
from ..tables.table import DiffractionTable
from .arithmetic import clip
from .description import Surface, describe
from .properties import number
from .types import BSDF, Float, Interaction, Mask, Properties
from .varying import Varying

#: Parameter of `diffraction_mix`, and header of a table.
DEPTH = "depth"


class DepthWeights:
    """Weights that interpolate linearly over depth between surfaces of solved orders.

    Raises a DiffractionError if a surface has no solved orders, its table does not say its depth,
    two are as deep, their periods differ, or the depth lies outside of theirs.

    Attributes
    ----------
    depth : µm, a number or a texture.
    """

    def __init__(self, props: Properties, bsdfs: Mapping[str, BSDF]) -> None:
        tables = {name: _table_of(name, bsdf) for name, bsdf in bsdfs.items()}
        self._depths = {name: _depth_of(name, table) for name, table in tables.items()}
        first = next(iter(tables))
        for name, table in tables.items():
            if _periods(table) != _periods(tables[first]):
                raise DiffractionError(
                    f"{DEPTH}: the periods of {first} and {name} differ, so their orders leave in "
                    "other directions; give one profile at several depths"
                )
        ordered = sorted(self._depths, key=lambda name: self._depths[name])
        for one, other in itertools.pairwise(ordered):
            if self._depths[one] == self._depths[other]:
                raise DiffractionError(
                    f"{DEPTH}: {one} and {other} are both {self._depths[one]:g} µm deep; leave one "
                    "out"
                )
        self._ordered = ordered
        self.ends = self._depths[ordered[0]], self._depths[ordered[-1]]
        value: Any = dict(props.objects()).get(DEPTH)
        value = number(props, DEPTH, 0.0) if value is None else value
        # bounds are of single precision, and so are values but in scalar variants
        ends = (float(np.float32(end)) for end in self.ends)
        self.depth = Varying(DEPTH, value, *ends, unit=" µm", advice=", the depths of the surfaces")

    def at(self, si: Interaction, active: Mask) -> list[Float]:
        """Return the weights, in the order of the surfaces."""
        depth = clip(self.depth.at(si, active), *self.ends)
        steps = [
            clip((depth - self._depths[a]) * (1.0 / (self._depths[b] - self._depths[a])), 0.0, 1.0)
            for a, b in itertools.pairwise(self._ordered)
        ]
        # each step hands on from one surface to the next
        shares = [mi.Float(1.0), *steps, mi.Float(0.0)]
        weights = dict(
            zip(self._ordered, (a - b for a, b in itertools.pairwise(shares)), strict=True)
        )
        return [weights[name] for name in self._depths]


def _table_of(name: str, bsdf: BSDF) -> OrderTable | CrossedTable:
    """Return the solved orders of a surface."""
    described = describe(bsdf)
    table = described.table if isinstance(described, Surface) else None
    if table is None or isinstance(table, DiffractionTable):
        raise DiffractionError(
            f"{DEPTH}: {name} has no solved orders; a depth blends surfaces of type "
            "'diffraction_orders', and weights blend any others"
        )
    return table


def _periods(table: OrderTable | CrossedTable) -> tuple[float, ...]:
    return table.periods if isinstance(table, CrossedTable) else (table.period,)


def _depth_of(name: str, table: OrderTable | CrossedTable) -> float:
    """Return the depth of a surface's profile, µm."""
    depth = table.header.get(DEPTH)
    if not isinstance(depth, int | float):
        raise DiffractionError(
            f"{DEPTH}: the table of {name} does not say how deep its profile is; solve it again, "
            f"or set {DEPTH!r} in its header, µm"
        )
    return float(depth)
