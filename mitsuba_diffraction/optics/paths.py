"""Paths of light by a boundary: reflected or let through, from above or below (NumPy, float64).

On a path an order of a surface sends the share η = G |a_j|² of the light along ωi to ωo, with

    G = 4 qi qo N / w²,   w = qi + qo where light is reflected, |qi − qo| where it is let through,

at κ = k w: N, mean power of the boundary's Jones matrix (`boundary`, `through`, `coat`), and
q = √(m² − n² sin²θ), with n the index of the medium in which θ is measured and m the index of the
medium at the structure. For Kirchhoff's model and R = 1, G is (1 + ωi·ωo)²/(w² cosθi cosθo). G is
symmetric.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays import Real
from . import boundary, through
from .boundary import Direction, Heights, Jones
from .coat import beneath_reflectance, crossing, refracted, transmitted
from .fresnel import Filmed, reflectance
from .mirror import correction_within, horizon_correction, mirror_cosine, outside_square
from .stack import Stacked


@dataclass(frozen=True)
class Side:
    """Side of the surface that light comes from or goes to.

    Attributes
    ----------
    index : n, of the medium in which directions are measured, over that above the surface.
    at_structure : m, of the medium at the structure. It is another one under a coat and below a
        thin sheet: directions there are those beyond the flat face.
    below : whether the side is below the surface.
    """

    index: float = 1.0
    at_structure: float = 1.0
    below: bool = False

    @property
    def number(self) -> int:
        """0 above the surface, 1 below."""
        return int(self.below)

    @property
    def beyond_face(self) -> bool:
        """Whether directions lie beyond the flat face of a sheet or a coat."""
        return self.index != self.at_structure

    @property
    def critical_sine(self) -> float:
        """Sine of the critical angle, beyond which light stays on its side; 1 without one."""
        return 1.0 / self.index

    def outside(self, cosine: Real) -> Real:
        """Return the squared cosine above the surface, below 0 beyond the critical angle."""
        return np.asarray(outside_square(cosine, self.index))

    def normal(self, cosine: Real) -> Real:
        """Return q of directions by their cosine to the normal."""
        square = self.at_structure**2 - self.index**2 + (self.index * cosine) ** 2
        return np.asarray(np.sqrt(square))


ABOVE = Side()


@dataclass(frozen=True)
class Path:
    """Light that a boundary sends from one side to another.

    Attributes
    ----------
    index : n + ik, or a film. Of reflected light: of the medium beyond the structure over that
        before it. Of light that is let through: of the medium below over that above. None where G
        equals `common`.
    model : one of `boundary.MODELS`; of `through.MODELS` for light let through.
    came, left : sides of the incident and of the outgoing light.
    least : of w; powers of orders over w² have a limit for w → 0.
    """

    index: complex | Filmed | Stacked | None
    model: str
    came: Side = ABOVE
    left: Side = ABOVE
    least: float = 0.0

    @property
    def let_through(self) -> bool:
        """Whether light crosses the structure."""
        return self.came.number != self.left.number

    @property
    def thin(self) -> bool:
        """Whether light passes the flat face of a sheet or a coat."""
        return self.came.beyond_face or self.left.beyond_face

    @property
    def critical_sine(self) -> float:
        """Sine of incidence beyond which light is totally reflected; 1 where none is."""
        if self.let_through or self.index is None or isinstance(self.index, Filmed | Stacked):
            return self.came.critical_sine
        if abs(np.imag(self.index)) > 0.0:
            return 1.0
        sine = float(np.real(self.index)) * self.came.at_structure / self.came.index
        return min(sine, 1.0)

    @property
    def signs(self) -> tuple[int, ...]:
        """Signs of the orders' frequencies over q: −1 where the heights seem turned over.

        Light that is reflected below sees the heights from behind. Light that is let through has
        the sign of q above less q below, and either sign where the index is below √2.
        """
        if not self.let_through:
            return (-1,) if self.came.number else (1,)
        return (-1, 1) if self._real < math.sqrt(2.0) else (-1,)

    def sign(self, cos_i: Real, cos_o: Real) -> Real:
        """Return which of `signs` the light has, in float32."""
        if len(self.signs) == 1:
            return np.full(np.broadcast(cos_i, cos_o).shape, self.signs[0], np.float32)
        q_i, q_o = self.came.normal(cos_i), self.left.normal(cos_o)
        above, below = (q_o, q_i) if self.came.number else (q_i, q_o)
        return np.where(below > above, np.float32(-1.0), np.float32(1.0))

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        """Return w."""
        q_i, q_o = self.came.normal(cos_i), self.left.normal(cos_o)
        return np.abs(q_i - q_o) if self.let_through else q_i + q_o

    def tangential(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return the tangential part of n_i ωi + n_o ωo; cos_turn : of the azimuth between."""
        incident = self.came.index**2 * (1.0 - cos_i**2)
        outgoing = self.left.index**2 * (1.0 - cos_o**2)
        return np.sqrt(_square_of_sum(incident, outgoing, cos_turn))

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return G of a perfect conductor, or 1/(qi qo w²) of light that is let through.

        G of any material varies as steeply towards the horizon; the ratio of both is smooth.
        """
        w = np.maximum(self.width(cos_i, cos_o), self.least)
        common = 1.0 / (self.came.normal(cos_i) * self.left.normal(cos_o) * w**2)
        if self.let_through:
            return np.asarray(common)
        one_plus_dot = 0.5 * (self.tangential(cos_i, cos_o, cos_turn) ** 2 + w**2)  # times m²
        return np.asarray(common * one_plus_dot**2)

    def power(
        self, cos_i: Real, cos_o: Real, cos_turn: Real | float, heights: Heights | None
    ) -> Real:
        """Return N, the mean power of the Jones matrix.

        All cosines broadcast; heights : of the model's, None if it does not depend on them.
        """
        cos_i, cos_o, cos_turn = np.broadcast_arrays(cos_i, cos_o, cos_turn)
        pair, jones = self._jones(*directions(cos_i, cos_o, cos_turn), heights)
        return np.asarray(boundary.power(jones) / (2.0 * pair.cos_i * pair.cos_o) ** 2)

    def _jones(
        self, wi: Direction, wo: Direction, heights: Heights | None
    ) -> tuple[boundary.Geometry, Jones]:
        """Return the geometry at the structure, and 2 cosθi cosθo J as seen from outside."""
        if self.let_through:
            n = self._real
            above, below = (wo, wi) if self.came.number else (wi, wo)
            x, y, z = refracted(below, n) if self.thin else below
            inside = x, y, -z
            pair = boundary.geometry(above, inside)
            jones = through.MODELS[self.model](
                pair, above, inside, n, through.outside_square(pair, n), heights
            )
            return pair, through.out_of_sheet(jones, n, above[2], below[2]) if self.thin else jones
        model = boundary.model_of(self.model)
        if self.thin:  # the flat side lies over the structure as the face of a coat does
            n = self.came.at_structure
            assert self.index is not None
            assert not isinstance(self.index, Filmed | Stacked)  # no coat lies on it
            pair = boundary.geometry(refracted(wi, n), refracted(wo, n))
            jones = model.jones(pair, self.index, heights)
            faces = (crossing(direction[2], n) for direction in (wi, wo))
            return pair, transmitted(jones, pair, self.index, *faces)
        pair = boundary.geometry(wi, wo)
        return pair, model.jones(pair, self.index, heights)

    def mirrored(
        self, cos_i: Real, cos_o: Real, cos_turn: Real | float, k: float, sigma_0: float
    ) -> tuple[Real, Real]:
        """Return G of order 0, and of the flat face of a sheet or a coat.

        k : 2π/λ in the medium above, rad/µm.
        sigma_0 : of the lobe's window, µm.
        """
        cos_i, cos_o, cos_turn = np.broadcast_arrays(cos_i, cos_o, cos_turn)
        into, out = self.came.outside(cos_i), self.left.outside(cos_o)
        leaves = (into > 0.0) & (out > 0.0)
        above_i, above_o = np.sqrt(np.maximum(into, 0.0)), np.sqrt(np.maximum(out, 0.0))
        if self.let_through:
            visible = leaves * horizon_correction(sigma_0 * above_i**2, sigma_0 * above_o**2, k)
        else:
            visible = correction_within(cos_i, cos_o, self.left.index, sigma_0, k)
        none = np.zeros_like(visible)
        half = half_cosine(above_i, above_o, cos_turn)
        cosine = mirror_cosine(half, above_i, above_o, np.asarray(k * sigma_0))
        if self.let_through:
            return visible * self._passed(cosine), none
        if not self.thin:
            return visible * np.where(leaves, self._flat(cosine), 1.0), none
        n = np.asarray(self.came.at_structure)
        face = visible * reflectance(cosine, n)
        assert self.index is not None
        share = visible * beneath_reflectance(cosine, n, self.index)
        return share, face

    def _flat(self, cosine: Real) -> Real | float:
        """Return the flat surface's reflectance by the cosine above it, the same from below."""
        if self.index is None:
            return 1.0
        return reflectance(cosine, self.left.index if self.left.below else self.index)

    def _passed(self, cosine: Real) -> Real:
        """Return the flat surface's transmittance by the cosine above it."""
        passed = through.flat_transmittances(cosine, self._real, self.thin)
        return np.asarray(0.5 * sum(passed))

    @property
    def _real(self) -> float:
        assert isinstance(self.index, (int, float))  # light is let through dielectrics alone
        return float(self.index)


def directions(cos_i: Real, cos_o: Real, cos_turn: Real) -> tuple[Direction, Direction]:
    """Return unit vectors of these cosines, of one shape, and of the azimuth between them."""
    sin_i, sin_o = (np.sqrt(np.maximum(1.0 - c**2, 0.0)) for c in (cos_i, cos_o))
    across = np.sqrt(np.maximum(1.0 - cos_turn**2, 0.0))
    return (sin_i, np.zeros_like(sin_i), cos_i), (sin_o * cos_turn, sin_o * across, cos_o)


def half_cosine(cos_i: Real, cos_o: Real, cos_turn: Real) -> Real:
    """Return the cosine between either of two unit vectors and their half vector, |ωi + ωo|/2."""
    across = _square_of_sum(1.0 - cos_i**2, 1.0 - cos_o**2, cos_turn)
    return np.asarray(0.5 * np.sqrt(across + (cos_i + cos_o) ** 2))


def _square_of_sum(incident: Real, outgoing: Real, cos_turn: Real | float) -> Real:
    """Return the squared length of the sum of two vectors by their own, and their angle."""
    cross = 2.0 * np.sqrt(np.maximum(incident * outgoing, 0.0)) * cos_turn
    return np.asarray(np.maximum(incident + outgoing + cross, 0.0))


@dataclass(frozen=True)
class Returned(Path):
    """Light from above that the flat side of a sheet sends back through the structure.

    It passes the structure twice, which to first order in κ² is one passage of κ = √(κi² + κo²).

    sheet : index of the sheet.
    """

    sheet: float = 1.0

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        inside = Side(1.0, self.sheet)
        return np.hypot(*(inside.normal(cosine) - cosine for cosine in (cos_i, cos_o)))

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return G, the geometric mean of both directions' `through.returned`."""
        came, left = (through.returned(np.asarray(cosine), self.sheet) for cosine in (cos_i, cos_o))
        return np.sqrt(came * left) + 0.0 * np.asarray(cos_turn)

    def _flat(self, cosine: Real) -> Real:
        return self.common(cosine, cosine, 0.0)
