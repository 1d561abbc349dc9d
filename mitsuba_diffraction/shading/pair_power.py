"""Power N' of a boundary model for a pair of directions, bare or under a coat, for shaders.

Programs write it for a model, as the functions that a shader calls.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from ..optics.arithmetic import Number
from ..optics.boundary import Direction, Geometry, Heights, Jones, geometry, power
from ..optics.coat import coated_power, crossing
from ..optics.fresnel import Index


class Coat(NamedTuple):
    """Coat over a structure, for a pair of directions.

    Attributes
    ----------
    n : relative index.
    cos_i, cos_o : cosines of ωi and ωo outside of the coat.
    """

    n: Number
    cos_i: Number
    cos_o: Number


def pair_power(
    jones: Callable[[Geometry, Index, Heights], Jones] | None,
    wi: Direction,
    wo: Direction,
    index: Index,
    kappa: Number,
    variance: Number,
    coat: Coat | None = None,
) -> Number:
    """Return N' of a boundary model for a pair of directions, eq. 5 and 6.

    Parameters
    ----------
    jones : of a `boundary.Model`; None of a perfect reflector.
    wi, wo, index : of the structure, in the coat if it has one.
    kappa, variance : see `boundary.Heights`.
    coat : None without a coat.
    """
    pair = geometry(wi, wo)
    if jones is None:
        return pair.one_plus_dot * pair.one_plus_dot
    matrix = jones(pair, index, Heights(kappa, variance))
    if coat is not None:
        came, left = crossing(coat.cos_i, coat.n), crossing(coat.cos_o, coat.n)
        return coated_power(matrix, pair, index, came, left)
    return power(matrix)
