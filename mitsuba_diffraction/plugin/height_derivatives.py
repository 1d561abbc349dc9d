"""Derivatives of renderings by the heights of a patch: a table's coefficients follow them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..tables import DiffractionTable
from ..tables.build.derivatives import HeightDerivatives
from ..tables.layout import BinRecord
from .memory import tensor, upload
from .types import Buffer

#: Taps of a look-up at most: kernels of more take minutes to compile.
MOST_DIFFERENTIABLE = 64


class DifferentiableHeights(NamedTuple):
    """Heights that derivatives are wanted by.

    Attributes
    ----------
    values : `mi.TensorXf`, µm, shape (ny, nx), with derivatives.
    treated : the same numbers, up to a constant, that the table is made of.
    """

    values: Any
    treated: Real

    def coefficients(self, table: DiffractionTable, record: BinRecord) -> tuple[Buffer, Buffer]:
        """Return the records of bins and of order 0, which change with the heights.

        table : without `tables.build.derivatives.missing`.
        record : of its bins.
        """
        linear = HeightDerivatives(table, self.treated)
        bins, order_0 = dr.custom(_Coefficients, self.values, linear, table, record)
        return bins, order_0


class _Coefficients(dr.CustomOp):
    """A table's records, not scaled, as functions of heights."""

    def eval(
        self, heights: Any, linear: HeightDerivatives, table: DiffractionTable, record: BinRecord
    ) -> tuple[Buffer, Buffer]:
        self._linear = linear
        self._parts = table.coefficients / np.float32(table.scale), table.order_0
        self._records = record, BinRecord.aligned(*table.order_0.shape[1:])
        return self._packed(self._parts)

    def _packed(self, parts: tuple[NDArray[Any], NDArray[Any]]) -> tuple[Buffer, Buffer]:
        bins, order_0 = (
            upload(mi.Float, record.pack(part.astype(np.float32)))
            for record, part in zip(self._records, parts, strict=True)
        )
        return bins, order_0

    def forward(self) -> None:
        change = np.array(self.grad_in("heights"), np.float64)
        self.set_grad_out(self._packed(self._linear.forward(change)))

    def backward(self) -> None:
        parts = []
        for record, part, given in zip(self._records, self._parts, self.grad_out(), strict=True):
            shape = *part.shape[:-1], record.stored
            numbers = np.broadcast_to(np.array(given), math.prod(shape))  # a literal is one number
            parts.append(numbers.reshape(shape)[..., : record.terms])
        self.set_grad_in("heights", tensor(self._linear.backward(*parts)))

    def name(self) -> str:
        return "coefficients by heights"
