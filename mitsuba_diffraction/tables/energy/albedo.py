"""The directional albedo of the raw Kirchhoff BRDF with R = 1, for any direction (NumPy only).

Kirchhoff's form gains energy at grazing angles; to take it back one has to know how much. With
q = k(ωi + ωo) in the tangent plane, dωo = d²q/(k² cosθo) turns ∫f cosθo dωo into

    a(ωi; λ) = Σ_j ∫ |a_j(κ)|² (σ²/π) exp(−σ²|q − q_j|²) G d²q,   G = (1 + ωi·ωo)²/(w² cosθi cosθo),

over the frequencies that are visible, with κ = k w times the height scale. Each order's lobe thus
contributes its power times the mean of G. G is smooth but for its 1/cosθo: an order that grazes the
horizon (a Rayleigh anomaly) is a spike of the albedo as narrow as the lobe. Hence three sums:

- order 0, the mirror direction, by quadrature over its lobe;
- the few *strong* orders, one by one, with the mean over the lobe tabulated near the horizon;
- the many *weak* ones as a smooth density, by quadrature over directions, where no 1/cosθo is left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter1d

from ...optics.geometry import wavenumber
from ..sampling.order_mixture import OrderMixture, order_mixture
from ..table import DiffractionTable

Array = NDArray[np.float32]

#: Directions of the quadrature over the weak orders: rings, and steps of azimuth on the widest.
RINGS, STEPS = 36, 80
#: The weak orders are smoothed by this share of the distance between those directions, at least.
SMOOTHING = 0.6

#: A smaller spike, as a share of the albedo, is left to the margin of the bound.
LEAST_SPIKE = 0.03

_LOBE = 3.5  # a lobe ends here, in units of 1/σ: exp(−3.5²) = 5e-6
_SPIKE = 2.0  # a spike peaks where its order is 0.8/σ above the horizon
_GLOSSY_NODES = 96  # across the mirror lobe
_HORIZON_NODES = 96  # cosθo across a lobe at the horizon
_COSINES = 64  # steps of cosθo for an order's power as a function of κ
_HERMITE = np.polynomial.hermite.hermgauss(5)


class AlbedoModel:
    """Sums over a table's orders, prepared for one height scale.

    Parameters
    ----------
    table : the diffraction table.
    height_scale : factor on its heights.
    """

    def __init__(self, table: DiffractionTable, height_scale: float = 1.0) -> None:
        self.table, self.height_scale = table, height_scale
        self.spread = table.sigma  # exp(−spread²Δq²) is a lobe
        longest = float(wavenumber(table.wavelength_range[0]))
        spacing = longest * 0.5 * math.pi / RINGS
        self.mixture: OrderMixture = order_mixture(table, height_scale, SMOOTHING * spacing)
        self._nodes, self._weights = _directions()
        self._length = np.hypot(*self.mixture.frequency.T)
        self._azimuth = np.arctan2(*self.mixture.frequency.T[::-1])
        self._near: dict[float, _NearHorizon] = {}
        self._turned: tuple[NDArray[np.floating], Array] | None = None

    def albedo(self, theta: float, phi: ArrayLike, wavelength: float) -> NDArray[np.floating]:
        """a(ωi; λ) for one polar angle (rad), azimuths (rad, shape (n,)) and a wavelength (nm)."""
        azimuths = np.atleast_1d(np.asarray(phi, float))
        return (
            self.order_0(theta, wavelength)
            + self.weak(theta, azimuths, wavelength)
            + self.strong(theta, azimuths, wavelength)
        )

    def order_0(self, theta: float, wavelength: float) -> float:
        """Order 0: its power times the mean of G over the visible part of its lobe."""
        k = float(wavenumber(wavelength))
        sin_i, cos_i = math.sin(theta), math.cos(theta)
        width = 1.0 / (self.spread * k)  # in direction cosines
        low, high = max(sin_i - _LOBE * width, 0.0), min(sin_i + _LOBE * width, 1.0)
        # In cosθo instead of sinθo: d(sinθo)/cosθo = d(cosθo)/sinθo has no pole at the horizon
        edges = math.sqrt(1.0 - high**2), math.sqrt(1.0 - low**2)
        if low == 0.0 or edges[1] - edges[0] < 1e-12:
            return float(self.mixture.order_0(np.array([2.0 * k * cos_i]))[0])
        nodes = (np.arange(_GLOSSY_NODES) + 0.5) / _GLOSSY_NODES
        cos_o = edges[0] + nodes * (edges[1] - edges[0])
        sin_o = np.sqrt(1.0 - cos_o**2)
        radial = np.exp(-(((sin_o - sin_i) / width) ** 2)) / (math.sqrt(math.pi) * width)
        radial *= (edges[1] - edges[0]) / _GLOSSY_NODES / sin_o
        across = width * _HERMITE[0][:, None]
        along = 1.0 + cos_i * cos_o - sin_i * np.sqrt(np.maximum(sin_o**2 - across**2, 0.0))
        square = _HERMITE[1] @ along**2 / math.sqrt(math.pi)
        power = self.mixture.order_0(k * (cos_i + cos_o))
        return float(np.sum(radial * power * square / ((cos_i + cos_o) ** 2 * cos_i)))

    def weak(self, theta: float, phi: NDArray[np.floating], wavelength: float) -> Array:
        """All orders that are not worth a sum of their own, shape (n,)."""
        mixture = self.mixture
        k = float(wavenumber(wavelength))
        sin_i, cos_i = math.sin(theta), math.cos(theta)
        x, y, cos_o = self._nodes
        w = cos_i + cos_o
        # |ωi + ωo|² = 2(1 + ωi·ωo), with ωi in the plane y = 0
        one_plus_dot = 0.5 * ((x + sin_i) ** 2 + y**2 + w**2)
        factor = (k**2 * self._weights * (one_plus_dot / w) ** 2 / cos_i).astype(np.float32)
        position = np.minimum(k * w / mixture.kappa_step, len(mixture.density) - 1.001)
        lower = position.astype(np.int32)
        upper_share = (position - lower).astype(np.float32)
        layer = mixture.density[0].size
        base = lower * layer
        scale = k / mixture.pitch
        bx, by = (scale * (x + sin_i)).astype(np.float32), (scale * y).astype(np.float32)
        sin, cos = np.sin(phi).astype(np.float32)[:, None], np.cos(phi).astype(np.float32)[:, None]
        rows, columns = mixture.density.shape[1:]
        column = (cos * bx - sin * by + np.float32(0.5 * columns)).astype(np.int32)
        row = (sin * bx + cos * by + np.float32(0.5 * rows)).astype(np.int32)
        np.clip(column, 0, columns - 1, out=column)
        np.clip(row, 0, rows - 1, out=row)
        index = row * columns
        index += column
        index += base
        flat = mixture.density.ravel()
        result = flat.take(index) @ (factor * (1.0 - upper_share))
        index += layer
        result += flat.take(index) @ (factor * upper_share)
        return result

    def strong(
        self, theta: float, phi: NDArray[np.floating], wavelength: float, shift: float = 0.0
    ) -> Array:
        """The orders that are summed one by one, shape (n,).

        With `shift`, every order that could make a spike by moving that far (in direction cosines)
        is counted with its spike: a bound over neighbouring directions and wavelengths.
        """
        mixture = self.mixture
        if not len(mixture.frequency):
            return np.zeros(len(phi), np.float32)
        k = float(wavenumber(wavelength))
        sin_i, cos_i = math.sin(theta), math.cos(theta)
        horizon = self._horizon(k, cos_i, shift + mixture.uncertainty / k if shift > 0.0 else 0.0)
        power = mixture.strong(k * (cos_i + np.arange(_COSINES + 1) / _COSINES))
        length = self._length / k
        # ωo's tangential part is q/k − ωi's; along = (q/k)·ωi
        along = (sin_i * length).astype(np.float32) * self._cosines(phi)
        index = (length**2 + sin_i**2).astype(np.float32) - np.float32(2.0) * along
        index *= np.float32(1.0 / horizon.step)
        index = np.clip(index, 0.0, len(horizon.mean) - 1.0).astype(np.int32)
        along += np.float32(cos_i**2)  # 1 + ωi·ωo without cosθi cosθo
        square = np.square(along + horizon.product[index])
        order = np.arange(len(power))
        result = square * horizon.mean[index] * power[order, horizon.cosine[index]]
        if shift > 0.0:
            bottom = np.float32(cos_i * horizon.low)
            spike = np.square(np.maximum(along + bottom, 0.0)) * horizon.spike[index]
            spike *= power[:, : math.ceil(horizon.low * _COSINES) + 2].max(axis=1)
            np.maximum(result, spike, out=result, where=spike > LEAST_SPIKE)
        return result.sum(axis=1)

    def _cosines(self, phi: NDArray[np.floating]) -> Array:
        """cos of the azimuth between ωi and each strong order; kept, as φ is mostly the same."""
        kept = self._turned
        if kept is None or kept[0] is not phi:
            kept = phi, np.cos(phi[:, None] - self._azimuth).astype(np.float32)
            self._turned = kept
        return kept[1]

    def _near_horizon(self, k: float) -> _NearHorizon:
        """What does not depend on ωi there, once a wavelength."""
        if k not in self._near:
            width = 1.0 / (self.spread * k)
            edge = 1.0 - 2.0 * _LOBE * width
            deepest = math.sqrt(1.0 - max(edge - _LOBE * width, 0.0) ** 2)
            nodes = (np.arange(_HORIZON_NODES) + 0.5) * (deepest / _HORIZON_NODES)
            sines = np.sqrt(1.0 - nodes**2)
            places = np.linspace(edge, 1.0 + _LOBE * width, 96)
            lobes = np.exp(-(((sines - places[:, None]) / width) ** 2))
            lobes *= deepest / _HORIZON_NODES / (math.sqrt(math.pi) * width)
            self._near[k] = _NearHorizon(places, nodes, sines, lobes)
        return self._near[k]

    def _horizon(self, k: float, cos_i: float, shift: float) -> _Horizon:
        width = 1.0 / (self.spread * k)  # of a lobe, in direction cosines
        most = (1.0 + _LOBE * width + shift) ** 2
        count = math.ceil(10.0 * most / width)
        step = most / count
        squared = (np.arange(count) + 0.5) * step
        radius = np.sqrt(squared)
        cos_o = np.sqrt(np.maximum(1.0 - squared, 0.0))
        with np.errstate(divide="ignore"):
            mean = 1.0 / (cos_o * (cos_i + cos_o) ** 2 * cos_i)
        # Within a lobe of the horizon: the mean over the lobe, in cosθo (see `order_0`)
        near = self._near_horizon(k)
        averaged = near.lobes @ (1.0 / (near.sines * (cos_i + near.cosines) ** 2 * cos_i))
        inside = radius > near.places[0]
        mean[inside] = np.interp(radius[inside], near.places, averaged)
        spike = mean
        if shift > 0.0:
            reach = math.ceil(2.0 * shift / step)
            spike = np.where(radius > 1.0 - _SPIKE * width, mean, 0.0)
            spike = maximum_filter1d(spike, 2 * reach + 1, mode="nearest")
        return _Horizon(
            step=step,
            mean=mean.astype(np.float32),
            spike=spike.astype(np.float32),
            product=(cos_i * cos_o).astype(np.float32),
            cosine=np.rint(cos_o * _COSINES).astype(np.int32),
            low=math.sqrt(2.0 * _SPIKE * width),
        )


@dataclass(frozen=True)
class _NearHorizon:
    """Quadrature over lobes that reach the horizon.

    Attributes
    ----------
    places : (n,) distances of lobes' centres from the normal, in direction cosines.
    cosines, sines : (m,) cosθo and sinθo of the nodes.
    lobes : (n, m) weight of each node in each lobe.
    """

    places: NDArray[np.floating]
    cosines: NDArray[np.floating]
    sines: NDArray[np.floating]
    lobes: NDArray[np.floating]


@dataclass(frozen=True)
class _Horizon:
    """Tables over |ωo's tangential part|², from 0 in steps of `step`.

    Attributes
    ----------
    mean : of 1/(w² cosθi cosθo) over a lobe's visible part.
    spike : the largest `mean` of a spike within the shift asked for, 0 where there is none.
    product : cosθi cosθo.
    cosine : index of cosθo, in steps of 1/_COSINES.
    low : cosθo up to which a lobe makes a spike.
    """

    step: float
    mean: Array
    spike: Array
    product: Array
    cosine: NDArray[np.int32]
    low: float


def _directions() -> tuple[tuple[Any, Any, Any], NDArray[np.float64]]:
    """Quadrature over the hemisphere: (x, y, cosθ) of the nodes and their solid angles."""
    position, share = np.polynomial.legendre.leggauss(RINGS)
    theta = 0.25 * np.pi * (position + 1.0)
    parts: list[list[NDArray[np.float64]]] = [[], [], [], []]
    for n, (angle, weight) in enumerate(zip(theta, share * 0.25 * np.pi, strict=True)):
        steps = max(8, round(STEPS * math.sin(angle)))
        azimuth = (np.arange(steps) + 0.381966 * n) * (2.0 * np.pi / steps)
        sine = math.sin(angle)
        parts[0].append(sine * np.cos(azimuth))
        parts[1].append(sine * np.sin(azimuth))
        parts[2].append(np.full(steps, math.cos(angle)))
        parts[3].append(np.full(steps, weight * sine * 2.0 * np.pi / steps))
    x, y, cosine, weights = (np.concatenate(part) for part in parts)
    return (x, y, cosine), weights
