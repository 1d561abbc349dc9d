"""A parameter that changes between renderings, and keeps its value when another is refused."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np

from .roles import Callback, Float


class Bounded:
    """A differentiable number between bounds.

    Parameters
    ----------
    name : for `mi.traverse`.
    value : the first.
    low, high : the least and the largest that are taken.
    refusal : what to say of another one.

    Attributes
    ----------
    high : as given.
    value : mi.Float, the same object ever after: Mitsuba assigns to it.
    """

    def __init__(
        self, name: str, value: float, low: float, high: float, refusal: Callable[[float], str]
    ) -> None:
        self.value: Float = mi.Float(value)
        self.high = high
        self._name, self._low, self._refusal = name, low, refusal
        self._last: Float = mi.Float(value)

    def settle(self) -> str | None:
        """Take the value given, as a variable, so that kernels stay; or say why it is refused."""
        given = np.array(dr.detach(self.value), float).ravel()
        wrong = given[~((given >= self._low) & (given <= self.high))]
        if len(wrong):
            if dr.is_jit_v(self.value):
                mi.set_property(self.value, self._last)
            return self._refusal(float(wrong[0]))
        dr.make_opaque(self.value)
        self._last = mi.Float(dr.detach(self.value))
        return None

    def traverse(self, callback: Callback) -> None:
        """Expose it."""
        callback.put(self._name, self.value, mi.ParamFlags.Differentiable)
