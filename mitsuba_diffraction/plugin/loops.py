"""Loops and branches inside a Dr.Jit kernel, which derivatives pass in both directions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from .types import Index, Mask


def sum_of(
    count: Index | int, add: Callable[[Index, Any, Any], Any], inputs: Any, total: Any
) -> Any:
    """Return a total of `count` terms.

    add : function of the number of a term, the inputs and the total, which returns the total with
        that term added. All that derivatives are wanted for must come by `inputs`: Dr.Jit drops
        derivatives of captured variables in a loop's body, without a warning.
    """
    state = mi.UInt32(0), inputs, total
    # -1: Dr.Jit's reverse mode of sums, which stores nothing
    return dr.while_loop(
        state,
        lambda n, *_: n < count,
        lambda n, inputs, total: (n + 1, inputs, add(n, inputs, total)),
        max_iterations=-1,
    )[2]


def only_in(lanes: Mask, value: Callable[[], Any]) -> Any:
    """Return a value in some lanes, and zero in all others.

    Vectors without such a lane skip its operations, but for values that have derivatives: Dr.Jit
    fails at derivatives of loops in a branch.

    value : called once or twice.
    """
    plain = value()
    nothing = dr.zeros(type(plain))
    if not dr.is_jit_v(lanes) or dr.grad_enabled(plain):
        return dr.select(lanes, plain, nothing)
    return dr.if_stmt((), lanes, value, lambda: nothing)
