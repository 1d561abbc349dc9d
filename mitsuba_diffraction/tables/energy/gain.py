"""Factor of |a_j|² in the power of an order: G of `optics.paths`, tabulated (NumPy, float64).

The roughness of the heights decides the share of small slope's matrix in N (`optics.blend`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...optics.blend import RoughnessTable
from ...optics.boundary import Heights, model_of
from ...optics.fresnel import Filmed
from ...optics.paths import Path, Side

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

    def __call__(self, cos_i: Real, row: NDArray[np.integer], cos_o: Real, turn: Real) -> Real:
        """Return G, linear between a table's nodes.

        cos_i : cosθi of few directions, (t,); row : which of them.
        cos_o, turn : cosθo and φo − φi, which broadcast with `row`.
        """
        cos_turn, came = np.cos(turn), cos_i[row]
        common = self.path.common(came, cos_o, cos_turn)
        if self.path.index is None:
            return common
        polar = len(self._table)
        lower, share = _cell(_polar_place(cos_i, self.path.came) * (polar - 1), polar)
        share = share[:, None, None]
        pages = (self._table[lower] * (1.0 - share) + self._table[lower + 1] * share).ravel()
        i, s = _cell(_polar_place(cos_o, self.path.left) * (polar - 1), polar)
        j, t = _cell(np.arccos(cos_turn) * ((AZIMUTHS - 1) / np.pi), AZIMUTHS)
        at = (row * polar + i) * AZIMUTHS + j
        near, far = (
            pages.take(at + step) * (1.0 - t) + pages.take(at + step + 1) * t
            for step in (0, AZIMUTHS)
        )
        gain = common * (near + (far - near) * s)
        if self.path.came.index + self.path.left.index > FARTHEST:
            gain *= self.path.tangential(came, cos_o, cos_turn) < FARTHEST
        return np.asarray(gain)

    def exact(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        """Return G of a material at arrays of cosines that broadcast, computed without a table."""
        common = self.path.common(cos_i, cos_o, cos_turn)
        ends = *(np.maximum(c, LEAST_COSINE) for c in (cos_i, cos_o)), np.asarray(cos_turn)
        return common * self._ratio(*ends)

    @cached_property
    def _table(self) -> Real:
        """G over `Path.common` at `_cosines`, (polar, polar, AZIMUTHS).

        Finer of a thick film, and where facets reflect totally from some angle on, with a kink.
        """
        index = self.path.index
        fine = thick(index) or (isinstance(index, float) and index < 1.0)
        polar = 2 * POLAR - 1 if fine else POLAR
        cos_i, cos_o = (_cosines(side, polar) for side in (self.path.came, self.path.left))
        cos_turn = np.cos(np.linspace(0.0, np.pi, AZIMUTHS))
        if self.path.came != self.path.left:
            return self._ratio(cos_i[:, None, None], cos_o[:, None], cos_turn)
        i, o = np.triu_indices(polar)  # G is symmetric
        table = np.empty((polar, polar, AZIMUTHS))
        table[i, o] = table[o, i] = self._ratio(cos_i[i, None], cos_o[o, None], cos_turn)
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


def _polar_place(cosine: Real, side: Side) -> Real:
    """Return the place, 0 to 1, of cosθ among `_cosines`."""
    angle, critical = np.arccos(np.minimum(cosine, 1.0)), math.asin(side.critical_sine)
    if side.critical_sine == 1.0:
        return np.asarray(1.0 - np.sqrt(1.0 - angle / critical))
    within = 0.5 - 0.5 * np.sqrt(np.maximum(1.0 - angle / critical, 0.0))
    beyond = np.maximum(angle - critical, 0.0) / (0.5 * np.pi - critical)
    return np.asarray(within + np.arcsin(np.sqrt(np.minimum(beyond, 1.0))) / np.pi)


def _cosines(side: Side, polar: int) -> Real:
    """Return cosines of θ of a side at which G is tabulated.

    Denser towards grazing, and towards a critical angle: G has the slope of a root there.
    """
    place, critical = np.linspace(0.0, 1.0, polar), math.asin(side.critical_sine)
    if side.critical_sine == 1.0:
        angle = critical * (1.0 - (1.0 - place) ** 2)
    else:
        within = critical * (1.0 - (1.0 - 2.0 * np.minimum(place, 0.5)) ** 2)
        beyond = np.sin(np.pi * np.maximum(place - 0.5, 0.0)) ** 2
        angle = within + (0.5 * np.pi - critical) * beyond
    return np.maximum(np.cos(angle), LEAST_COSINE)


def _cell(place: Real, count: int) -> tuple[NDArray[np.int32], Real]:
    """Return the node below places 0 … count − 1, and the share of the node above."""
    lower = np.minimum(place.astype(np.int32), count - 2)
    return lower, place - lower


def thick(index: object) -> bool:
    """Whether fringes of a film vary quickly with the angle."""
    return isinstance(index, Filmed) and index.advance > THICK
