"""What becomes of one order's light: the factor of |a_j|² in the albedo (NumPy, float64).

An order of a surface sends the share η = G |a_j|² of the light along −ωi to ωo, with

    G = 4 cosθi cosθo N / w²,

N the mean power of the boundary's Jones matrix (`optics.boundary`): for Kirchhoff's and R = 1 it is
(1 + ωi·ωo)²/(w² cosθi cosθo). G is symmetric in ωi and ωo.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates

from ...optics import blend, boundary, fresnel
from ...optics.blend import RoughnessTable
from ...optics.mean_second_order import mean_gain

Real = NDArray[np.float64]

#: Polar angles of both directions and azimuths between them at which G is computed.
POLAR_NODES, AZIMUTH_NODES = 31, 15
#: Polar angles θo and cosines of the azimuth between which its table is then bilinear.
POLAR_FINE, AZIMUTH_FINE = 61, 65
# The horizon itself would divide by zero in the facets' frame
LEAST_COSINE = 1e-3


@dataclass(frozen=True)
class Gain:
    """G of one model, material and wavelength.

    Attributes
    ----------
    roughness : of the table; the small-slope model follows it.
    model : "kirchhoff" or "small_slope".
    index : n + ik over that of the medium above, or that under a film; None for R = 1.
    wavenumber : 2π/λ, rad/µm.
    height_scale : factor on the table's heights.
    """

    roughness: RoughnessTable
    model: str
    index: complex | fresnel.Filmed | None
    wavenumber: float
    height_scale: float

    def ratio(self, cos_i: ArrayLike, x: Real, y: Real, cos_o: Real) -> Real:
        """G over that of Kirchhoff's with R = 1: finite, and smooth up to the horizon.

        ωi lies in the plane y = 0, towards +x; (x, y, cos_o) is ωo. All broadcast.
        """
        cos_i, x, y, cos_o = np.broadcast_arrays(cos_i, x, y, cos_o)
        if self.index is None:
            return np.ones_like(cos_o)
        sin_i, w = np.sqrt(1.0 - cos_i**2), cos_i + cos_o
        # |ωi + ωo|² = 2(1 + ωi·ωo)
        one_plus_dot = 0.5 * ((x + sin_i) ** 2 + y**2 + w**2)
        if self.model == "kirchhoff":
            cos_half, index = np.sqrt(np.minimum(0.5 * one_plus_dot, 1.0)), self.index
            if isinstance(index, fresnel.Filmed):
                index = index.tilted(0.5 * w / cos_half)
            return fresnel.reflectance(cos_half, index)
        wi = np.stack([sin_i, np.zeros_like(sin_i), cos_i], axis=-1)
        wo = np.stack([x, y, cos_o], axis=-1)
        variance = self.roughness.at(self.wavenumber * np.hypot(x + sin_i, y))
        s = blend.weight(self.wavenumber * w * self.height_scale, variance, self.index)
        power = boundary.unpolarised(blend.jones(wi, wo, self.index, s))
        if isinstance(self.index, fresnel.Filmed):
            heights = self.roughness, self.wavenumber, self.height_scale
            power = power * np.prod([mean_gain(c, self.index, *heights) for c in (cos_i, cos_o)], 0)
        return np.asarray((2.0 * cos_i * cos_o / one_plus_dot) ** 2 * power)

    def tables(self, theta: Real) -> Real:
        """`ratio` at θi = theta (t,), rad, for `read`: (t, POLAR_FINE, AZIMUTH_FINE)."""
        return np.tensordot(_spline(theta), self._nodes, 1)

    def between(self, cos_i: Real, cos_o: Real, turn: Real) -> Real:
        """`ratio`, linear between a table's nodes, at (cosθi, cosθo, φo − φi); all broadcast."""
        if self.index is None:
            return np.ones(())
        fine = (POLAR_FINE - 1) / (0.5 * np.pi)
        places = [np.arccos(np.minimum(cosine, 1.0)) * fine for cosine in (cos_i, cos_o)]
        column = (np.cos(turn) + 1.0) * (0.5 * (AZIMUTH_FINE - 1))
        at = np.stack(np.broadcast_arrays(*places, column))
        return np.asarray(map_coordinates(self._fine, at, order=1, mode="nearest"))

    def at(self, cos_i: Real, cos_o: Real, turn: Real) -> Real:
        """G likewise."""
        sines = np.sqrt(np.maximum((1.0 - cos_i**2) * (1.0 - cos_o**2), 0.0))
        dot, w = 1.0 + cos_i * cos_o + sines * np.cos(turn), self.width(cos_i, cos_o)
        return self.between(cos_i, cos_o, turn) * (dot / w) ** 2 / (cos_i * cos_o)

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        """κ over the wavenumber and the height scale."""
        return cos_i + cos_o

    @cached_property
    def _fine(self) -> Real:
        return self.tables(np.linspace(0.0, 0.5 * np.pi, POLAR_FINE))

    @cached_property
    def _nodes(self) -> Real:
        """The same at θi of the nodes."""
        cosines = np.maximum(np.cos(_POLAR), LEAST_COSINE)
        turns = np.polynomial.chebyshev.chebpts2(AZIMUTH_NODES)  # cos(φo − φi)
        i, o = np.tril_indices(POLAR_NODES)
        sines = np.sqrt(1.0 - cosines[o] ** 2)[:, None]
        half = self.ratio(
            cosines[i, None], sines * turns, sines * np.sqrt(1.0 - turns**2), cosines[o, None]
        )
        values = np.empty((POLAR_NODES, POLAR_NODES, AZIMUTH_NODES))
        values[i, o] = values[o, i] = half  # reciprocity
        # nearly a polynomial in cos(φo − φi), and smooth in the polar angles
        across = np.polynomial.chebyshev.chebvander(turns, AZIMUTH_NODES - 1)
        fine = np.polynomial.chebyshev.chebvander(
            np.linspace(-1.0, 1.0, AZIMUTH_FINE), AZIMUTH_NODES - 1
        )
        values = values @ (fine @ np.linalg.inv(across)).T
        return np.einsum("on,inf->iof", _spline(np.linspace(0.0, 0.5 * np.pi, POLAR_FINE)), values)


_POLAR = np.linspace(0.0, 0.5 * np.pi, POLAR_NODES)


def _spline(theta: Real) -> Real:
    """Matrix (t, POLAR_NODES) from values at the polar nodes to a cubic spline's at theta (rad)."""
    return np.asarray(CubicSpline(_POLAR, np.eye(POLAR_NODES))(theta))


def read(table: Real, cos_o: Real, turn: Real) -> Real:
    """One θi's table at (cosθo, φo − φi), bilinear."""
    return bilinear(
        table, np.arccos(np.minimum(cos_o, 1.0)) * ((POLAR_FINE - 1) / (0.5 * np.pi)), turn
    )


def bilinear(table: Real, row: Real, turn: Real) -> Real:
    """A table at rows and at azimuths (rad), whose cosines its columns have evenly; broadcast."""
    last, columns = len(table) - 2, table.shape[1]
    column = (np.cos(turn) + 1.0) * (0.5 * (columns - 1))
    i = np.clip(row.astype(np.int32), 0, last)
    j = np.clip(column.astype(np.int32), 0, columns - 2)
    s, t = row - i, column - j
    flat, index = table.ravel(), i * columns + j
    low = flat.take(index) * (1.0 - t) + flat.take(index + 1) * t
    index = index + columns
    return np.asarray(
        low * (1.0 - s) + (flat.take(index) * (1.0 - t) + flat.take(index + 1) * t) * s
    )


def over_lobe(gain: Real, at_horizon: Real, cos_o: Real, pole: Real) -> Real:
    """G's mean over a lobe, from G at the lobe's mean cosθo and G cosθo at the horizon.

    With G cosθo linear in cosθo over a lobe, whose mean of 1/cosθo is `pole`: Kirchhoff's G has a
    pole at the horizon, the small-slope one has little of it. All broadcast.
    """
    share = np.clip(at_horizon / np.maximum(gain * cos_o, 1e-30), 0.0, 1.0)
    return np.asarray(gain * (1.0 + share * (cos_o * pole - 1.0)))


#: cosθ of `fade`: light that leaves or comes within 5° of the horizon.
GRAZING = float(np.cos(np.radians(85.0)))


def fade(cos_i: ArrayLike, cos_o: ArrayLike) -> Real:
    """(min/max)² of the two cosines, those above cos 85° taken for cos 85°: symmetric.

    Kirchhoff's G grows as 1/cosθo towards the horizon: an order that comes up there is a spike of
    the albedo as narrow as the coherence window's lobe. So it comes up gently, and what is taken
    from light between the horizon and 5° above the other directions get back (`conservation`).
    Mirrors, and all light that comes and leaves within 85° of the normal, are left as they are.
    """
    one, other = np.minimum(cos_i, GRAZING), np.minimum(cos_o, GRAZING)
    return np.asarray((np.minimum(one, other) / np.maximum(one, other)) ** 2)


def fades(model: str) -> bool:
    """Whether what is scaled has `fade`: Kirchhoff's."""
    return model == "kirchhoff"
