"""Factor of |a_j|² in the albedo: what a boundary makes of one order's light (NumPy, float64).

An order of a surface sends the share η = G |a_j|² of the light along −ωi to ωo, with

    G = 4 qi qo N / w²

at κ = k w: N, mean power of the boundary's Jones matrix (`optics.boundary`), q and w as in `paths`.
For Kirchhoff's and R = 1 that is (1 + ωi·ωo)²/(w² cosθi cosθo). G is symmetric.
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
from ..directional import Real
from .paths import AZIMUTHS, LEAST_COSINE, POLAR, Path

#: The plugin looks up tangential parts of ωi + ωo up to this, in units of k.
FARTHEST = 2.0


@dataclass(frozen=True)
class Gain:
    """G of a path at one wavelength.

    Attributes
    ----------
    path : of the light.
    roughness : of the table; the small-slope model follows it.
    wavenumber : 2π/λ in the medium above, rad/µm.
    height_scale : factor on the table's heights.
    """

    path: Path
    roughness: RoughnessTable
    wavenumber: float
    height_scale: float

    def __call__(self, cos_i: Real, cos_o: Real, turn: Real) -> Real:
        """Return G at cosθi, cosθo and φo − φi, which broadcast, linear between a table's nodes."""
        cos_turn = np.cos(turn)
        common = self.path.common(cos_i, cos_o, cos_turn)
        if self.path.index is None:
            return common
        rows = (
            (1.0 - np.sqrt(1.0 - np.arccos(np.minimum(c, 1.0)) * (2.0 / np.pi))) * (POLAR - 1)
            for c in (cos_i, cos_o)
        )
        at = np.broadcast_arrays(*rows, np.arccos(cos_turn) * ((AZIMUTHS - 1) / np.pi))
        ratio = map_coordinates(self._table, np.stack(at), order=1, mode="nearest")
        reached = self.path.tangential(cos_i, cos_o, cos_turn) < FARTHEST
        return np.asarray(common * ratio * reached)

    def exact(self, cos_i: Real, cos_o: Real, cos_turn: float) -> Real:
        """Return G at cosines that broadcast, without a table."""
        common = self.path.common(cos_i, cos_o, cos_turn)
        if self.path.index is None:
            return common
        ends = (
            *(np.maximum(cosine, LEAST_COSINE) for cosine in (cos_i, cos_o)),
            np.asarray(cos_turn),
        )
        return common * self._ratio(self.path.matrices(*ends), *ends)

    @cached_property
    def _table(self) -> Real:
        """G over `Path.common` at `Path.nodes`, (POLAR, POLAR, AZIMUTHS)."""
        return self._ratio(self.path.matrices_at_nodes, *self.path.nodes)

    def _ratio(self, matrices: list[Complex], cos_i: Real, cos_o: Real, cos_turn: Real) -> Real:
        """G over `Path.common`, from the path's matrices at these cosines."""
        path, k = self.path, self.wavenumber
        assert path.index is not None
        w = np.maximum(path.width(cos_i, cos_o), path.least)
        jones = matrices[0]
        if path.model == "small_slope":
            variance = self.roughness.at(k * path.tangential(cos_i, cos_o, cos_turn))
            s = blend.weight(k * w * self.height_scale, variance, path.index)[..., None, None]
            jones = (1.0 - s) * jones + s * matrices[1]
        q_i, q_o = path.came.normal(cos_i), path.left.normal(cos_o)
        common = path.common(cos_i, cos_o, cos_turn)
        ratio = 4.0 * q_i * q_o / (w**2 * common) * boundary.unpolarised(jones)
        if isinstance(path.index, fresnel.Filmed) and path.model == "small_slope":
            film = path.index, self.roughness, k, self.height_scale
            ratio = ratio * mean_gain(cos_i, *film) * mean_gain(cos_o, *film)
        return np.asarray(ratio)
