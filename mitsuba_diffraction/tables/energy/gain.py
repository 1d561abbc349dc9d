"""Factor of |a_j|² in the albedo: what the boundary makes of one order's light (NumPy, float64).

An order of a surface sends the share η = G |a_j|² of the light along −ωi to ωo, with

    G = 4 cosθi cosθo N / w²,

N the mean power of the boundary's Jones matrix (`optics.boundary`): for Kirchhoff's and R = 1 it is
(1 + ωi·ωo)²/(w² cosθi cosθo). G is symmetric in ωi and ωo.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from ...optics import blend, boundary, fresnel
from ...optics.blend import RoughnessTable
from ...optics.mean_second_order import mean_gain

Real = NDArray[np.float64]

#: Polar angles of both directions and azimuths between them at which G is computed.
POLAR_NODES, AZIMUTH_NODES = 31, 15
#: Polar angles θo and cosines of the azimuth between which its table is then bilinear.
POLAR_FINE, AZIMUTH_FINE = 61, 65
#: Least cosine: the horizon itself would divide by zero in the facets' frame.
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

    def at(self, theta: Real, faded: bool) -> list[Callable[[Real, Real], Real]]:
        """Return G as a function of cosθo and φo − φi, for each polar angle θi (rad).

        faded : whether it is attenuated by `fade`.
        """
        cosines, sines = np.cos(theta), np.sin(theta)
        tables = [None] * len(theta) if self.index is None else self.tables(theta)

        def of_angle(cos_i: float, sin_i: float, table: Real | None) -> Callable[..., Real]:
            def gain(cos_o: Real, turn: Real) -> Real:
                one_plus_dot = 1.0 + cos_i * cos_o + sin_i * np.sqrt(1.0 - cos_o**2) * np.cos(turn)
                kirchhoff = (one_plus_dot / (cos_i + cos_o)) ** 2 / (cos_i * cos_o)
                if table is not None:
                    kirchhoff = kirchhoff * read(table, cos_o, turn)
                return kirchhoff * fade(cos_i, cos_o) if faded else kirchhoff

            return gain

        return [of_angle(*each) for each in zip(cosines, sines, tables, strict=True)]

    def tables(self, theta: Real) -> Real:
        """`ratio` at θi = theta (t,), rad, for `read`: (t, POLAR_FINE, AZIMUTH_FINE)."""
        return np.tensordot(_spline(theta), self._nodes, 1)

    @cached_property
    def _nodes(self) -> Real:
        """`ratio` at θi of the nodes, (POLAR_NODES, POLAR_FINE, AZIMUTH_FINE)."""
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
    """Interpolate a table, even in θo from 0 to π/2 and in cos(φo − φi), at cosθo and φo − φi."""
    last, columns = len(table) - 2, table.shape[1]
    row = np.arccos(np.minimum(cos_o, 1.0)) * ((len(table) - 1) / (0.5 * np.pi))
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


#: cosθ of `fade`: light that leaves or comes within 5° of the horizon.
GRAZING = float(np.cos(np.radians(85.0)))


def fade(cos_i: ArrayLike, cos_o: ArrayLike) -> Real:
    """(min/max)² of the two cosines, those above cos 85° taken for cos 85°: symmetric.

    Kirchhoff's G grows as 1/cosθo towards the horizon: an order that becomes propagating there is a
    spike of the albedo as narrow as the coherence window's lobe, whose scaling would cost all light
    beside it. Mirrors, and all light within 85° of the normal, are left as they are.
    """
    incident, outgoing = np.minimum(cos_i, GRAZING), np.minimum(cos_o, GRAZING)
    return np.asarray((np.minimum(incident, outgoing) / np.maximum(incident, outgoing)) ** 2)


def fades(model: str) -> bool:
    """Whether what is scaled is attenuated by `fade`: Kirchhoff's model."""
    return model == "kirchhoff"
