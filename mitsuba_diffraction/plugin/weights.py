"""Weights of a mix: given by the scene, or by the depth of solved gratings (Dr.Jit)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from .arithmetic import clip
from .description import SolvedOrders, Surface, describe
from .properties import number
from .textures import is_attribute, uv_square
from .types import BSDF, Float, Interaction, Mask, Properties, Texture
from .varying import Varying

#: Parameter of `diffraction_mix`, and header of a table.
DEPTH = "depth"
_PREFIX = "weight_"
#: A sum of such weights is far from the largest number there is.
_MOST_WEIGHT = 1e6


class Weights:
    """Weights of surfaces, in their order.

    varied : the numbers that a scene gives.
    """

    varied: list[Varying]

    def at(self, si: Interaction, active: Mask) -> list[Float]:
        """Return the weights at points, of sum 1; 0 where inactive or where all are 0."""
        raise NotImplementedError

    def refusal(self) -> str | None:
        """Reason why numbers that are allowed each by itself are refused together, or None."""

    @property
    def textures(self) -> list[Texture]:
        """Textures and mesh attributes among the numbers."""
        return [number.texture for number in self.varied if number.texture is not None]

    @property
    def shown(self) -> dict[str, Any]:
        """Return the numbers by their parameters, for people."""
        return {number.name: number for number in self.varied}


def weights_of(props: Properties, bsdfs: Mapping[str, BSDF]) -> Weights:
    """Read the weights of a scene's surfaces.

    Raises a DiffractionError with the parameter that is missing, unknown or out of bounds.
    """
    by_depth = DEPTH in props and DEPTH not in bsdfs
    return (DepthWeights if by_depth else GivenWeights)(props, bsdfs)


class GivenWeights(Weights):
    """A number for each surface; one may have none, and gets the rest."""

    def __init__(self, props: Properties, bsdfs: Mapping[str, BSDF]) -> None:
        names = list(bsdfs)
        if len(names) < 2:
            raise DiffractionError(
                f"diffraction_mix takes two nested BSDFs or more, got {len(names)}"
            )
        known = [_PREFIX + name for name in names]
        for name in props.keys():  # noqa: SIM118 - Properties is no mapping
            if name not in (*known, *names, "id"):
                raise DiffractionError(
                    f"unknown parameter '{name}' of diffraction_mix; its surfaces are "
                    f"{', '.join(names)}, and their weights {', '.join(known)}, or {DEPTH}"
                )
        missing = [name for name in known if name not in props]
        if len(missing) > 1:
            raise DiffractionError(
                f"give weights for all surfaces but one; there is no {', '.join(missing)}"
            )
        objects = dict(props.objects())
        given = [name for name in known if name in props]
        self.varied = [
            Varying(name, objects.get(name) or number(props, name, 0.0), 0.0, _MOST_WEIGHT)
            for name in given
        ]
        self._known, self._rest = known, known.index(missing[0]) if missing else None

    def at(self, si: Interaction, active: Mask) -> list[Float]:
        """See `Weights.at`."""
        weights = [weight.at(si, active) for weight in self.varied]
        if self._rest is not None:
            rest = dr.maximum(1.0 - sum(weights, mi.Float(0.0)), 0.0)
            weights.insert(self._rest, rest)
        total: Float = sum(weights, mi.Float(0.0))
        some = mi.Mask(active) & (total > 0.0)
        scale = dr.select(some, dr.rcp(dr.select(some, total, 1.0)), 0.0)
        return [weight * scale for weight in weights]

    def refusal(self) -> str | None:
        """Reason to refuse weights whose sum is 0 in places of the UV square, or None."""
        if self._rest is not None or any(map(is_attribute, self.textures)):
            return None
        totals = [sum(self.at(si, True), mi.Float(0.0)) for si in uv_square()]
        if min(dr.slice(dr.min(total)) for total in totals) > 0.0:
            return None
        names = ", ".join(self._known)
        return f"{names} are all 0 somewhere; leave out that of a surface, which gets the rest"

    @property
    def shown(self) -> dict[str, Any]:
        """See `Weights.shown`."""
        return {**dict.fromkeys(self._known, "the rest"), **super().shown}


class DepthWeights(Weights):
    """Weights that interpolate linearly over depth between surfaces of solved orders.

    Raises a DiffractionError if a surface has no solved orders, its table does not say its depth,
    two are as deep, their periods differ, or the depth lies outside of theirs.
    """

    def __init__(self, props: Properties, bsdfs: Mapping[str, BSDF]) -> None:
        for name in props.keys():  # noqa: SIM118 - Properties is no mapping
            if name not in (*bsdfs, DEPTH, "id"):
                raise DiffractionError(
                    f"{name}: diffraction_mix takes no weights beside {DEPTH}; leave one out"
                )
        tables = {name: _table_of(name, bsdf) for name, bsdf in bsdfs.items()}
        self._depths = {name: _depth_of(name, table) for name, table in tables.items()}
        first = next(iter(tables))
        for name, table in tables.items():
            if table.periods != tables[first].periods:
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
        # bounds are of single precision, and so are values but in scalar variants
        ends = (float(np.float32(end)) for end in self.ends)
        value = dict(props.objects()).get(DEPTH) or number(props, DEPTH, 0.0)
        advice = ", the depths of the surfaces"
        self.varied = [Varying(DEPTH, value, *ends, unit=" µm", advice=advice)]

    def at(self, si: Interaction, active: Mask) -> list[Float]:
        """See `Weights.at`."""
        depth = clip(self.varied[0].at(si, active), *self.ends)
        steps = [
            clip((depth - self._depths[a]) * (1.0 / (self._depths[b] - self._depths[a])), 0.0, 1.0)
            for a, b in itertools.pairwise(self._ordered)
        ]
        # each step hands on from one surface to the next
        shares = [mi.Float(1.0), *steps, mi.Float(0.0)]
        weights = dict(
            zip(self._ordered, (a - b for a, b in itertools.pairwise(shares)), strict=True)
        )
        return [dr.select(active, weights[name], 0.0) for name in self._depths]


def _table_of(name: str, bsdf: BSDF) -> SolvedOrders:
    """Return the solved orders of a surface."""
    described = describe(bsdf)
    if not isinstance(described, Surface) or not described.solved:
        raise DiffractionError(
            f"{DEPTH}: {name} has no solved orders; a depth blends surfaces of type "
            "'diffraction_orders', and weights blend any others"
        )
    orders: SolvedOrders = described.orders
    return orders


def _depth_of(name: str, table: SolvedOrders) -> float:
    """Return the depth of a surface's profile, µm."""
    depth = table.header.get(DEPTH)
    if not isinstance(depth, int | float):
        raise DiffractionError(
            f"{DEPTH}: the table of {name} does not say how deep its profile is; solve it again, "
            f"or set {DEPTH!r} in its header, µm"
        )
    return float(depth)
