"""What becomes of one order's light between the sides of a dielectric, or of a sheet (NumPy only).

Side 0 is above the structure, 1 below: within the dielectric, or outside of the flat other side of
a sheet. With m the index of the medium that a side's directions are measured in, n that at the
structure and q = n cosθ there, an order takes light from mi sinθi to mo sinθo with the share

    η = G |a_j|²,   G = 4 qi qo N / w²,   w = qi + qo, or |qi − qo| where it goes through,

at κ = k w: N, mean power of Jones matrices, as in `optics.boundary` and `optics.through`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics import blend, boundary, coat, fresnel, through
from ..table import DiffractionTable
from .gain import LEAST_COSINE

Real = NDArray[np.float64]
#: Of `Link.tables`, at rows of the last axis but one and at azimuths (rad).
Read = Callable[[Real, Real], Real]

#: Of `Medium.angle`, and of cosines of azimuths.
POLAR, AZIMUTHS = 91, 33
#: The plugin looks up tangential parts up to this, in units of k.
FARTHEST = 2.0
_DOWN = np.array([1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Medium:
    """The dielectric.

    Attributes
    ----------
    index : over that of the medium above.
    model : "kirchhoff" or "small_slope".
    thin : whether below is beyond the flat side of a sheet.
    """

    index: float
    model: str
    thin: bool

    def measured(self, side: int) -> float:
        """m of a side."""
        return 1.0 if self.thin or side == 0 else self.index

    def normal(self, side: int, cosine: Real) -> Real:
        """q of directions, by their cosines where they are measured."""
        if side == 0:
            return cosine
        if self.thin:
            return np.sqrt(self.index**2 - 1.0 + cosine**2)
        return self.index * cosine

    def links(self) -> list[Link]:
        """All ways from a side to a side."""
        found = [Link(self, came, left) for came in (0, 1) for left in (0, 1)]
        return [*found, Face(self, 1, 1), Returned(self, 0, 0)] if self.thin else found

    def angle(self, side: int, cosine: Real) -> Real:
        """0 to π/2, by which tables and grids are even: dense where Fresnel's have a root.

        Polar angles; of directions within the dielectric half the angle outside, and beyond the
        critical one π/2 less half the angle whose cosine is that within over its largest.
        """
        if side == 0 or self.thin:
            return np.asarray(np.arccos(np.minimum(cosine, 1.0)))
        n = self.index
        sine = n * np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        beyond = np.arccos(np.minimum(n * cosine / np.sqrt(n * n - 1.0), 1.0))
        outside = np.arcsin(np.minimum(sine, 1.0))
        return 0.5 * np.where(sine < 1.0, outside, 0.5 * np.pi + beyond)

    def cosine(self, side: int, angle: Real) -> Real:
        """The inverse."""
        if side == 0 or self.thin:
            return np.cos(angle)
        n, twice = self.index, 2.0 * angle
        within = np.sqrt(1.0 - (np.sin(twice) / n) ** 2)
        beyond = np.sqrt(n * n - 1.0) / n * np.cos(twice - 0.5 * np.pi)
        return np.where(twice < 0.5 * np.pi, within, beyond)


@dataclass(frozen=True)
class Link:
    """From one side to the same or the other."""

    medium: Medium
    came: int
    left: int

    #: Whether the orders are those of a flat surface.
    flat = False

    @property
    def sign(self) -> int:
        """Of the orders' frequencies: seen from within, heights are turned over; through, κ is."""
        return 1 if self.came == self.left == 0 else -1

    def width(self, cos_i: Real | float, cos_o: Real) -> Real:
        """w."""
        q_i, q_o = self._normals(cos_i, cos_o)
        return np.asarray(q_i + q_o if self.came == self.left else np.abs(q_i - q_o))

    def gain(self, read: Read, w: Real, cos_i: Real | float, cos_o: Real, turn: Real) -> Real:
        """G, from θi's `tables`."""
        q_i, q_o = self._normals(cos_i, cos_o)
        row = self.medium.angle(self.left, cos_o) * ((POLAR - 1) / (0.5 * np.pi))
        return read(row, turn) / (q_i * q_o * w**2) * self._reached(cos_i, cos_o, turn)

    def tables(
        self, parts: Real, theta: Real, k: float, table: DiffractionTable, scale: float
    ) -> Real:
        """4 qi² qo² N at angles θi (rad), `Medium.angle` and azimuths, of `parts`; at k."""
        if self.medium.model == "kirchhoff":
            return parts[1]
        cos_i, cos_o, cos_turn = self._at(theta)
        tangential = k * np.sqrt(self._squared(cos_i, cos_o, cos_turn))
        kappa = k * scale * self.width(cos_i, cos_o)
        s = blend.weight(kappa, table.roughness.at(tangential), self.medium.index)
        return s * s * parts[0] + (1.0 - s) ** 2 * parts[1] + 2.0 * s * (1.0 - s) * parts[2]

    def parts(self, theta: Real) -> Real:
        """4 qi² qo² times the powers of both models' matrices and of their product, (3, …)."""
        cos_i, cos_o, cos_turn = self._at(theta)
        sin_i, sin_o = np.sqrt(1.0 - cos_i**2), np.sqrt(1.0 - cos_o**2)
        across = np.sqrt(1.0 - cos_turn**2)
        first = [sin_i, 0.0, cos_i], [sin_o * cos_turn, sin_o * across, cos_o]
        wi, wo = (np.stack(np.broadcast_arrays(*one), axis=-1) for one in first)
        gentle, tangent = self._matrices(wi, wo)
        q_i, q_o = self._normals(cos_i, cos_o)
        mixed = 0.5 * np.sum((gentle * tangent.conj()).real, axis=(-2, -1))
        powers = [boundary.unpolarised(gentle), boundary.unpolarised(tangent), mixed]
        return np.asarray(4.0 * (q_i * q_o) ** 2 * np.stack(powers))

    def _matrices(self, wi: Real, wo: Real) -> list[boundary.Complex]:
        """B and K of directions that are both as if above."""
        n, thin = self.medium.index, self.medium.thin
        if self.came != self.left:
            above, below = (wi, wo * _DOWN) if self.came == 0 else (wo, wi * _DOWN)
            inside = coat.refracted(below * _DOWN, n) * _DOWN if thin else below
            pair = [f(above, inside, n) for f in (through.small_slope, through.kirchhoff)]
            return [through.out_of_sheet(one, above, below, n) for one in pair] if thin else pair
        reflect = boundary.small_slope, boundary.kirchhoff
        if self.came == 0:
            return [f(wi, wo, n) for f in reflect]
        if not thin:
            return [f(wi, wo, 1.0 / n) for f in reflect]
        inside, left = coat.refracted(wi, n), coat.refracted(wo, n)
        pair = [f(inside, left, 1.0 / n) for f in reflect]
        return [coat.transmitted(one, wi, wo, n, 1.0 / n) for one in pair]

    def _normals(self, cos_i: Real | float, cos_o: Real) -> tuple[Real, Real]:
        medium = self.medium
        return medium.normal(self.came, np.asarray(cos_i)), medium.normal(self.left, cos_o)

    def _squared(self, cos_i: Real | float, cos_o: Real, cos_turn: Real) -> Real:
        """Squared tangential part of the sum of directions, in units of k."""
        m_i, m_o = (self.medium.measured(side) for side in (self.came, self.left))
        one, other = m_i**2 * (1.0 - cos_i**2), m_o**2 * (1.0 - cos_o**2)
        total = one + other + 2.0 * np.sqrt(one * other) * cos_turn
        return np.maximum(total, 0.0)

    def _reached(self, cos_i: Real | float, cos_o: Real, turn: Real) -> NDArray[np.bool_]:
        return np.asarray(self._squared(cos_i, cos_o, np.cos(turn)) < FARTHEST**2)

    def _at(self, theta: Real) -> tuple[Real, Real, Real]:
        cos_i = np.maximum(np.cos(theta), LEAST_COSINE)
        cos_o = self.medium.cosine(self.left, np.linspace(0.0, 0.5 * np.pi, POLAR))
        cos_turn = np.linspace(-1.0, 1.0, AZIMUTHS)
        return cos_i[:, None, None], np.maximum(cos_o, LEAST_COSINE)[:, None], cos_turn


class Face(Link):
    """The flat side of a sheet, from outside."""

    flat = True

    def _matrices(self, wi: Real, wo: Real) -> list[boundary.Complex]:
        return [boundary.kirchhoff(wi, wo, self.medium.index)] * 2

    def _normals(self, cos_i: Real | float, cos_o: Real) -> tuple[Real, Real]:
        return np.asarray(cos_i), cos_o


class Returned(Link):
    """What the flat side of a sheet sends back through the structure (`plugin.transmission`)."""

    def width(self, cos_i: Real | float, cos_o: Real) -> Real:
        n = self.medium.index
        deeper = [np.sqrt(n * n - 1.0 + cosine**2) - cosine for cosine in (cos_i, cos_o)]
        return np.hypot(*deeper)

    def gain(self, read: Read, w: Real, cos_i: Real | float, cos_o: Real, turn: Real) -> Real:
        one, other = self._kept(np.asarray(cos_i)), self._kept(cos_o)
        return np.sqrt(one * other) * self._reached(cos_i, cos_o, turn)

    def tables(
        self, parts: Real, theta: Real, k: float, table: DiffractionTable, scale: float
    ) -> Real:
        return parts

    def parts(self, theta: Real) -> Real:
        return theta  # it needs none

    def _kept(self, cosine: Real) -> Real:
        """T² R / (1 − R²), the mean of both polarisations."""
        back = np.abs(np.stack(fresnel.amplitudes(cosine, self.medium.index))) ** 2
        return np.asarray(np.mean((1.0 - back) * back / (1.0 + back), axis=0))
