"""Factor of |a_j|² in the albedo: what a boundary makes of one order's light (NumPy, float64).

An order of a surface sends the share η = G |a_j|² of the light along −ωi to ωo, with

    G = 4 qi qo N / w²,   q = n cosθ,   w = qi + qo,

at κ = k w: N, mean power of the boundary's Jones matrix (`optics.boundary`), n the index of the
medium. For Kirchhoff's and R = 1 that is (1 + ωi·ωo)²/(w² cosθi cosθo). G is symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import map_coordinates

from ...optics import blend, boundary, fresnel
from ...optics.blend import RoughnessTable
from ...optics.boundary import Complex
from ...optics.mean_second_order import mean_gain
from .grid import Real

#: Polar angles of both directions, and azimuths between them, of tables of G.
POLAR, AZIMUTHS = 37, 25
#: Least cosine: the horizon itself would divide by zero in the facets' frame.
LEAST_COSINE = 1e-3
#: The plugin looks up tangential parts of ωi + ωo up to this, in units of k.
FARTHEST = 2.0


@dataclass(frozen=True)
class Boundary:
    """Reflection of light from above.

    Attributes
    ----------
    index : n + ik over that of the medium of the light, or that under a film; None for R = 1.
    model : one of `optics.boundary.MODELS`.
    came, left : indices of the media of incident and outgoing light over that of the medium above.
    sign : of the orders' frequencies: from within, heights are turned over.
    least : of w; powers of orders over w² have a limit for w → 0.
    """

    index: complex | fresnel.Filmed | None
    model: str
    came: float = 1.0
    left: float = 1.0
    sign: int = 1
    least: float = 0.0

    #: Whether heights do not matter.
    flat = False

    def normals(self, cos_i: Real, cos_o: Real) -> tuple[Real, Real]:
        """qi and qo."""
        return self.came * cos_i, self.left * cos_o

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        """w."""
        return np.asarray(sum(self.normals(cos_i, cos_o)))

    def tangential(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Tangential part of ωi + ωo, in units of k."""
        incident, outgoing = self.came**2 * (1.0 - cos_i**2), self.left**2 * (1.0 - cos_o**2)
        cross = 2.0 * np.sqrt(np.maximum(incident * outgoing, 0.0)) * cos_turn
        return np.sqrt(np.maximum(incident + outgoing + cross, 0.0))

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """G without the material: what varies steeply towards the horizon."""
        sines = np.sqrt(np.maximum((1.0 - cos_i**2) * (1.0 - cos_o**2), 0.0))
        one_plus_dot = 1.0 + cos_i * cos_o + sines * cos_turn
        return np.asarray((one_plus_dot / (cos_i + cos_o)) ** 2 / (cos_i * cos_o))

    def matrices(self, wi: Real, wo: Real) -> tuple[Complex, Complex]:
        """K and B of directions that are both as if above; twice J of a model without heights."""
        assert self.index is not None
        if self.model == "small_slope":
            return boundary.kirchhoff(wi, wo, self.index), boundary.small_slope(wi, wo, self.index)
        jones = boundary.matrices_of(self.model)(wi, wo, self.index)
        return jones, jones

    def order_0(self, gain: Gain, cos_i: Real, cos_o: Real) -> Real:
        """G of order 0 across its lobe."""
        return self.common(cos_i, cos_o, -1.0) * gain.ratio(cos_i, cos_o, -1.0)

    @cached_property
    def nodes(self) -> tuple[Real, Real, Real]:
        """Cosines of θi, θo and the azimuth between at which tables are made."""
        angle = 0.5 * np.pi * (1.0 - np.linspace(1.0, 0.0, POLAR) ** 2)  # denser towards grazing
        cosine = np.maximum(np.cos(angle), LEAST_COSINE)
        azimuth = np.linspace(0.0, np.pi, AZIMUTHS)
        return cosine[:, None, None], cosine[:, None], np.cos(azimuth)

    @cached_property
    def at_nodes(self) -> tuple[Complex, Complex]:
        """K and B at the nodes: the same at all wavelengths, if the index is."""
        return self.at(*self.nodes)

    def at(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> tuple[Complex, Complex]:
        """K and B at cosines that broadcast."""
        cos_i, cos_o, cos_turn = np.broadcast_arrays(cos_i, cos_o, cos_turn)
        sin_i, sin_o = (np.sqrt(np.maximum(1.0 - c**2, 0.0)) for c in (cos_i, cos_o))
        sin_turn = np.sqrt(1.0 - cos_turn**2)
        wi = np.stack([sin_i, np.zeros_like(sin_i), cos_i], axis=-1)
        return self.matrices(wi, np.stack([sin_o * cos_turn, sin_o * sin_turn, cos_o], axis=-1))


@dataclass(frozen=True)
class Gain:
    """G of a boundary at one wavelength.

    Attributes
    ----------
    roughness : of the table; the small-slope model follows it.
    wavenumber : 2π/λ in the medium above, rad/µm.
    height_scale : factor on the table's heights.
    """

    boundary: Boundary
    roughness: RoughnessTable
    wavenumber: float
    height_scale: float

    def ratio(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """G over what all materials have in common: smooth up to the horizon; all broadcast."""
        if self.boundary.index is None:
            return np.ones(np.broadcast_shapes(*map(np.shape, (cos_i, cos_o, cos_turn))))
        incident, outgoing = (np.clip(c, LEAST_COSINE, 1.0) for c in (cos_i, cos_o))
        ends = incident, outgoing, np.asarray(cos_turn)
        return self._ratio(self.boundary.at(*ends), *ends)

    def __call__(self, cos_i: float, cos_o: Real, turn: Real) -> Real:
        """G at cosθi, cosθo and φo − φi, linear between a table's nodes."""
        cos_turn, cosine = np.cos(turn), np.asarray(cos_i)
        common = self.boundary.common(cosine, cos_o, cos_turn)
        if self.boundary.index is None:
            return common
        rows = (
            (1.0 - np.sqrt(1.0 - np.arccos(np.minimum(c, 1.0)) * (2.0 / np.pi))) * (POLAR - 1)
            for c in (cosine, cos_o)
        )
        at = np.broadcast_arrays(*rows, np.arccos(cos_turn) * ((AZIMUTHS - 1) / np.pi))
        common *= self.boundary.tangential(cosine, cos_o, cos_turn) < FARTHEST
        return common * map_coordinates(self._table, np.stack(at), order=1, mode="nearest")

    @cached_property
    def _table(self) -> Real:
        """`ratio` at the nodes, (POLAR, POLAR, AZIMUTHS)."""
        return self._ratio(self.boundary.at_nodes, *self.boundary.nodes)

    def _ratio(
        self, both: tuple[Complex, Complex], cos_i: Real, cos_o: Real, cos_turn: Real
    ) -> Real:
        """`ratio` from K and B at cosines."""
        surface, k = self.boundary, self.wavenumber
        assert surface.index is not None
        jones, gentle = both
        w = np.maximum(surface.width(cos_i, cos_o), surface.least)
        if surface.model == "small_slope":
            variance = self.roughness.at(k * surface.tangential(cos_i, cos_o, cos_turn))
            s = blend.weight(k * w * self.height_scale, variance, surface.index)[..., None, None]
            jones = (1.0 - s) * jones + s * gentle
        q_i, q_o = surface.normals(cos_i, cos_o)
        common = surface.common(cos_i, cos_o, cos_turn)
        ratio = 4.0 * q_i * q_o / (w**2 * common) * boundary.unpolarised(jones)
        if isinstance(surface.index, fresnel.Filmed) and surface.model == "small_slope":
            film = surface.index, self.roughness, k, self.height_scale
            ratio = ratio * mean_gain(cos_i, *film) * mean_gain(cos_o, *film)
        return np.asarray(ratio)
