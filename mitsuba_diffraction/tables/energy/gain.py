"""Factor of |a_j|² in the power of an order: G of `optics.paths`, tabulated (NumPy, float64).

The roughness of the heights decides the share of small slope's matrix in N (`optics.blend`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from ...arrays import Real
from ...optics.blend import RoughnessTable
from ...optics.boundary import Heights, model_of
from ...optics.fresnel import Filmed
from ...optics.paths import Path

#: Polar angles of both directions, and azimuths between them, of tables of G.
POLAR, AZIMUTHS = 37, 25
#: A film's fringe that advances by more, rad, from the normal to the horizon takes finer tables.
THICK = 6.0
#: Least cosine: the horizon itself would divide by zero in the facets' frame.
LEAST_COSINE = 1e-3
#: The plugin looks up tangential parts of ωi + ωo up to this, in units of k.
FARTHEST = 2.0


@dataclass(frozen=True)
class PathGain:
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
        last = len(self._table)
        rows = (
            (1.0 - np.sqrt(1.0 - np.arccos(np.minimum(c, 1.0)) * (2.0 / np.pi))) * (last - 1)
            for c in (cos_i, cos_o)
        )
        at = np.broadcast_arrays(*rows, np.arccos(cos_turn) * ((AZIMUTHS - 1) / np.pi))
        ratio = scipy.ndimage.map_coordinates(self._table, np.stack(at), order=1, mode="nearest")
        reached = self.path.tangential(cos_i, cos_o, cos_turn) < FARTHEST
        return np.asarray(common * ratio * reached)

    def exact(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return G of a material at arrays of cosines that broadcast, computed without a table."""
        common = self.path.common(cos_i, cos_o, cos_turn)
        ends = *(np.maximum(c, LEAST_COSINE) for c in (cos_i, cos_o)), np.asarray(cos_turn)
        return common * self._ratio(*ends)

    @cached_property
    def _table(self) -> Real:
        """G over `Path.common` at `_nodes`, (polar, polar, AZIMUTHS).

        Finer of a thick film, and where facets reflect totally from some angle on, with a kink.
        """
        index = self.path.index
        fine = thick(index) or (isinstance(index, float) and index < 1.0)
        polar = 2 * POLAR - 1 if fine else POLAR
        cosine, cos_turn = _nodes(polar)
        if self.path.came != self.path.left:
            return self._ratio(cosine[:, None, None], cosine[:, None], cos_turn)
        i, o = np.triu_indices(polar)  # G is symmetric
        table = np.empty((polar, polar, AZIMUTHS))
        table[i, o] = table[o, i] = self._ratio(cosine[i, None], cosine[o, None], cos_turn)
        return table

    def _ratio(self, cos_i: Real, cos_o: Real, cos_turn: Real) -> Real:
        """G over `Path.common` at these cosines."""
        path, k = self.path, self.wavenumber
        assert path.index is not None
        w = np.maximum(path.width(cos_i, cos_o), path.least)
        model, heights = model_of(path.model), None
        if model.statistic is not None:
            q = k * path.tangential(cos_i, cos_o, cos_turn)
            variance = model.statistic(self.roughness).at(q)
            heights = Heights(k * w * self.height_scale, variance)
        q_i, q_o = path.came.normal(cos_i), path.left.normal(cos_o)
        common = path.common(cos_i, cos_o, cos_turn)
        ratio = 4.0 * q_i * q_o / (w**2 * common)
        return np.asarray(ratio * path.power(cos_i, cos_o, cos_turn, heights))


def thick(index: object) -> bool:
    """Whether fringes of a film vary quickly with the angle."""
    return isinstance(index, Filmed) and index.advance > THICK


def _nodes(polar: int) -> tuple[Real, Real]:
    """Return cosines of θi or θo, and of the azimuth between, at which G is tabulated."""
    angle = 0.5 * np.pi * (1.0 - np.linspace(1.0, 0.0, polar) ** 2)  # denser towards grazing
    cosine = np.maximum(np.cos(angle), LEAST_COSINE)
    return cosine, np.cos(np.linspace(0.0, np.pi, AZIMUTHS))
