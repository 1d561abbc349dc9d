"""Paths of light by a boundary: reflected or let through, from above or below (NumPy, float64).

A path has a side that light comes from and one that it goes to. On each side q is the normal part
of the wave vector at the structure, over 2π/λ above the surface:

    q = √(m² − n² sin²θ),   w = qi + qo where light is reflected, |qi − qo| where it is let through,

with n the index of the medium in which θ is measured and m that of the medium at the structure.
They differ below a thin sheet, whose directions are those beyond its flat other side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...optics import boundary, coat, fresnel, through
from ...optics.boundary import Complex
from ..directional import Real

#: Polar angles of both directions, and azimuths between them, of tables of G (`gain`).
POLAR, AZIMUTHS = 37, 25
#: Least cosine: the horizon itself would divide by zero in the facets' frame.
LEAST_COSINE = 1e-3
_DOWN = np.array([1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Side:
    """Side of the surface that light comes from or goes to.

    Attributes
    ----------
    index : n, of the medium in which directions are measured, over that above the surface.
    at_structure : m, of the medium at the structure, over that above the surface.
    """

    index: float = 1.0
    at_structure: float = 1.0

    @property
    def number(self) -> int:
        """0 above the surface, 1 below."""
        return 0 if self.at_structure == 1.0 else 1

    @property
    def beyond_sheet(self) -> bool:
        """Whether directions are those beyond the flat side of a sheet."""
        return self.at_structure != self.index

    def normal(self, cosine: Real) -> Real:
        """Return q of directions by their cosine to the normal."""
        difference = self.at_structure**2 - self.index**2
        return np.asarray(np.sqrt(difference + (self.index * cosine) ** 2))

    def at(self, direction: Real) -> Real:
        """Return directions (..., 3) as they are in the medium at the structure."""
        return coat.refracted(direction, self.at_structure / self.index)


ABOVE = Side()


@dataclass(frozen=True)
class Path:
    """Light that a boundary sends from one side to another.

    Attributes
    ----------
    index : n + ik, or a film. Of reflected light: of the medium beyond the structure over that
        before it. Of light that is let through: of the medium below over that above. None where G
        equals `common`.
    model : one of `optics.boundary.MODELS`; of `optics.through.MODELS` for light let through.
    came, left : sides of the incident and of the outgoing light.
    least : of w; powers of orders over w² have a limit for w → 0.
    """

    index: complex | fresnel.Filmed | None
    model: str
    came: Side = ABOVE
    left: Side = ABOVE
    least: float = 0.0

    @property
    def let_through(self) -> bool:
        """Whether light crosses the structure."""
        return self.came.number != self.left.number

    @property
    def sign(self) -> int:
        """Sign of the orders' frequencies: seen from below, heights are turned over."""
        return -1 if self.came.number or self.left.number else 1

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        """Return w."""
        q_i, q_o = self.came.normal(cos_i), self.left.normal(cos_o)
        return np.abs(q_i - q_o) if self.let_through else q_i + q_o

    def tangential(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return the tangential part of both wave vectors' sum, over 2π/λ above the surface.

        cos_turn : cosine of the azimuth between both directions.
        """
        incident = self.came.index**2 * (1.0 - cos_i**2)
        outgoing = self.left.index**2 * (1.0 - cos_o**2)
        cross = 2.0 * np.sqrt(np.maximum(incident * outgoing, 0.0)) * cos_turn
        return np.sqrt(np.maximum(incident + outgoing + cross, 0.0))

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return G of a perfect conductor, or 1/(qi qo w²) of light let through.

        G of any material varies as steeply towards the horizon; the ratio of both is smooth.
        """
        w = np.maximum(self.width(cos_i, cos_o), self.least)
        common = 1.0 / (self.came.normal(cos_i) * self.left.normal(cos_o) * w**2)
        if self.let_through:
            return np.asarray(common)
        # ½ m² |ωi + ωo|², which is m² (1 + ωi·ωo)
        return np.asarray(
            common * (0.5 * (self.tangential(cos_i, cos_o, cos_turn) ** 2 + w**2)) ** 2
        )

    def matrices(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> list[Complex]:
        """Return K and B of small slope, which it blends, or the matrix of another model alone.

        All cosines broadcast; matrices are (..., 2, 2).
        """
        cos_i, cos_o, cos_turn = np.broadcast_arrays(cos_i, cos_o, cos_turn)
        sin_i, sin_o = (np.sqrt(np.maximum(1.0 - c**2, 0.0)) for c in (cos_i, cos_o))
        sin_turn = np.sqrt(1.0 - cos_turn**2)
        wi = np.stack([sin_i, np.zeros_like(sin_i), cos_i], axis=-1)
        wo = np.stack([sin_o * cos_turn, sin_o * sin_turn, cos_o], axis=-1)
        assert self.index is not None
        names = ("kirchhoff", "small_slope") if self.model == "small_slope" else (self.model,)
        jones = self._let_through if self.let_through else self._reflected
        return [jones(name, wi, wo) for name in names]

    def _reflected(self, model: str, wi: Real, wo: Real) -> Complex:
        ends = self.came.at(wi), self.left.at(wo)
        assert self.index is not None
        jones = boundary.matrices_of(model)(*ends, self.index)
        if not self.came.beyond_sheet:
            return jones
        # the flat side lies over the structure as a coat's face does
        return coat.transmitted(jones, wi, wo, self.came.at_structure, self._real)

    def _let_through(self, model: str, wi: Real, wo: Real) -> Complex:
        ends = (self.came.at(wi), wi), (self.left.at(wo), wo)
        above, below = ends[::-1] if self.came.number else ends
        jones = through.MODELS[model](above[0], below[0] * _DOWN, self._real)
        if not (self.came.beyond_sheet or self.left.beyond_sheet):
            return jones
        return through.out_of_sheet(jones, above[1], below[1], self._real)

    @property
    def _real(self) -> float:
        assert isinstance(self.index, (int, float))  # light is let through dielectrics alone
        return float(self.index)

    @cached_property
    def nodes(self) -> tuple[Real, Real, Real]:
        """Cosines of θi, θo and the azimuth between, at which G is tabulated."""
        angle = 0.5 * np.pi * (1.0 - np.linspace(1.0, 0.0, POLAR) ** 2)  # denser towards grazing
        cosine = np.maximum(np.cos(angle), LEAST_COSINE)
        azimuth = np.linspace(0.0, np.pi, AZIMUTHS)
        return cosine[:, None, None], cosine[:, None], np.cos(azimuth)

    @cached_property
    def matrices_at_nodes(self) -> list[Complex]:
        """`matrices` at `nodes`: the same at all wavelengths if the index is."""
        return self.matrices(*self.nodes)

    def transmittance(self, cos_i: Real, cos_o: Real) -> Real:
        """Return G of order 0 that is let through: the flat surface's at both directions."""
        thin = self.came.beyond_sheet or self.left.beyond_sheet
        came, left = (
            through.flat_transmittances(cosine, self._real, thin, side.number)
            for cosine, side in ((cos_i, self.came), (cos_o, self.left))
        )
        return np.asarray(np.mean(np.sqrt(came * left), axis=0))

    def face(self, cos_i: Real, cos_o: Real) -> Real | float:
        """Return G of light that the flat side of a sheet reflects before it is at the structure.

        Fresnel's reflectance at the half vector; 0 of other paths.
        """
        if self.let_through or not self.came.beyond_sheet:
            return 0.0
        half = Path(None, "kirchhoff")
        tangential, w = half.tangential(cos_i, cos_o, -1.0), half.width(cos_i, cos_o)
        reflectance = fresnel.reflectance(0.5 * np.hypot(tangential, w), self.came.at_structure)
        return np.asarray(half.common(cos_i, cos_o, -1.0) * reflectance)


@dataclass(frozen=True)
class Returned(Path):
    """Light from above that the flat side of a sheet sends back through the structure.

    It passes the structure twice, which to first order in κ² is one passage of κ = √(κi² + κo²).

    Attributes
    ----------
    sheet : index of the sheet.
    """

    sheet: float = 1.0

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        inside = Side(1.0, self.sheet)
        return np.hypot(*(inside.normal(cosine) - cosine for cosine in (cos_i, cos_o)))

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return G: T² R/(1 − R²) of either direction, the mean of both polarisations."""
        shares = []
        for cosine in (cos_i, cos_o):
            back = np.abs(np.stack(fresnel.amplitudes(cosine, self.sheet))) ** 2
            shares.append(np.mean((1.0 - back) * back / (1.0 + back), axis=0))
        return np.sqrt(shares[0] * shares[1]) + 0.0 * np.asarray(cos_turn)
