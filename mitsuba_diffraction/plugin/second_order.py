"""The second order of small slope as a factor on the power of orders (Dr.Jit).

The formula is `optics.second_order.added_power`: c is looked up once for a pair of directions, r
for each channel at k (u, v) and κ. A factor on the heights multiplies κ by the factor and r by its
square; a factor on lengths in the plane divides r, a product of slopes, by its square.
"""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..optics.blend import small_slope_weight
from ..optics.fresnel import normal_reflectance
from ..optics.second_order import NODES, added_power, coefficient_table
from ..optics.second_order_change import applies
from ..optics.slope_ratios import SlopeRatios
from ..settings import checked
from ..tables.table import DiffractionTable
from .arithmetic import clip, index_of, maximum
from .boundary import Boundary
from .directions import Pair
from .fresnel import Dielectric
from .memory import index_between, read_record, upload
from .types import Float, Index, Kind, Properties

#: Step to which indices are rounded for c.
INDEX_STEP = 0.01
# Cosines are clipped to this: the derivative of an angle at 1 is infinite
_NORMAL = 1.0 - 1e-7


def ratios_of_second_order(props: Properties, table: DiffractionTable) -> SlopeRatios | None:
    """Return the table's slope ratios if the second order applies to it, or None.

    The scene's `second_order` wins over the table's; "auto" decides by the table's change of
    colours.

    Raises a DiffractionError if the scene says true and the table has no slope ratios.
    """
    ratios, asked = table.slope_ratios, table.settings.second_order
    if "second_order" in props:
        asked = checked("second_order", props.get("second_order"))
    if ratios is None or table.grid.coherent:
        if asked is True:
            raise DiffractionError(
                "second_order=true needs a table of coherence='ensemble' with slope ratios; build "
                "it with DiffractionTable.build(second_order=auto)"
            )
        return None
    return ratios if applies(asked, ratios) else None


class SecondOrder:
    """Factor of the second order for one BSDF, at its index.

    Parameters
    ----------
    material : the surface's dielectric.
    boundary : its model, which sees the heights.
    ratios : slope ratios of its heights.

    index : index of the coefficients c, rounded to `INDEX_STEP`.
    """

    def __init__(self, material: Dielectric, boundary: Boundary, ratios: SlopeRatios) -> None:
        self._material, self._boundary, self.index = material, boundary, math.nan
        self._cell, self._orders, self._middle = ratios.cell, ratios.orders, ratios.middle
        self._first = ratios.kappa[0]
        self._per_kappa = (len(ratios.values) - 1) / (ratios.kappa[1] - ratios.kappa[0])
        values = np.moveaxis(ratios.values, 1, -1)
        self._ratios = _Grid(values, mi.Float16)
        self.update()

    def update(self) -> None:
        """Take another index of the material, to `INDEX_STEP`."""
        index = float(dr.slice(dr.detach(self._material.eta)))
        index = round(max(1, round(index / INDEX_STEP)) * INDEX_STEP, 6)
        if index != self.index:
            self.index = index
            self._coefficients = _Grid(coefficient_table(index), mi.Float16)

    def added(self, pair: Pair, height_scale: Float, wavenumbers: list[Float]) -> list[Float]:
        """|1 + s (c_l r_l + c_t r_t)|² − 1 for each channel."""
        c = self._coefficients.at(self._angles(pair))
        reflected = normal_reflectance(self._material.eta)
        scale = dr.square(height_scale * dr.rcp(pair.frame.stretch))
        changes = []
        heights = self._boundary.heights(pair, height_scale, wavenumbers)
        for k, each in zip(wavenumbers, heights, strict=True):
            assert each is not None
            r = self._ratios.at(self._place(pair, height_scale, k))
            weight = scale * small_slope_weight(each.kappa, each.variance, reflected)
            changes.append(added_power(tuple(c), tuple(r), weight))
        return changes

    def _angles(self, pair: Pair) -> list[Float]:
        """θi, θo and the azimuth of ωo from that of −ωi, in nodes."""
        first, second = pair.wi, pair.wo
        dot = dr.fma(first.x, second.x, first.y * second.y)
        squares = dr.fma(first.x, first.x, dr.square(first.y)) * dr.fma(
            second.x, second.x, dr.square(second.y)
        )
        turn = -dot * dr.rsqrt(maximum(squares, 1e-20))
        cosines = (pair.cos_i, pair.cos_o, turn)
        angles = [dr.acos(clip(cosine, -_NORMAL, _NORMAL)) for cosine in cosines]
        per = (NODES - 1) / math.pi
        return [angles[0] * (2.0 * per), angles[1] * (2.0 * per), angles[2] * per]

    def _place(self, pair: Pair, height_scale: Float, k: Float) -> list[Float]:
        """κ, q_y and q_x, in nodes."""
        nodes = [(k * pair.w * height_scale - self._first) * self._per_kappa]
        for axis, q in ((1, pair.uv.y), (0, pair.uv.x)):
            cells = dr.fma(k * q, 1.0 / self._cell[axis], self._middle[axis])
            nodes.append(dr.round(cells) if self._orders[axis] else cells)
        return nodes


class _Grid:
    """Two complex numbers on a grid of three axes, linear in between."""

    def __init__(self, values: NDArray[np.complexfloating], kind: Kind) -> None:
        floats = np.stack([values.real, values.imag], axis=-1).astype(np.float32)
        floats = floats.reshape(*values.shape[:3], 4)
        self._shape = values.shape[:3]
        # A node and the three next to it side by side, so that one packet load fetches them
        rows = np.concatenate([floats[:, :, :-1], floats[:, :, 1:]], axis=-1)
        records = np.concatenate([rows[:, :-1], rows[:, 1:]], axis=-1)
        self._records = upload(kind, records.astype(np.float16) if kind is mi.Float16 else records)

    def at(self, places: list[Float]) -> list[Float]:
        """The four floats at places in units of nodes; beyond the grid, those at its edge."""
        lower, upper = [], []
        for place, count in zip(places, self._shape, strict=True):
            first = index_between(dr.floor(place), 0.0, count - 2.0)
            lower.append(index_of(first))
            upper.append(clip(place - first, 0.0, 1.0))
        _, rows, columns = self._shape
        start = (lower[0] * (rows - 1) + lower[1]) * (columns - 1) + lower[2]
        ends = [self._between(start + n * (rows - 1) * (columns - 1), upper) for n in (0, 1)]
        return _lerp(ends[0], ends[1], upper[0])

    def _between(self, index: Index, upper: list[Float]) -> list[Float]:
        four = read_record(self._records, index, 16)
        ends = [_lerp(four[n : n + 4], four[n + 4 : n + 8], upper[2]) for n in (0, 8)]
        return _lerp(ends[0], ends[1], upper[1])


def _lerp(low: list[Float], high: list[Float], upper: Float) -> list[Float]:
    return [dr.lerp(a, b, upper) for a, b in zip(low, high, strict=True)]
