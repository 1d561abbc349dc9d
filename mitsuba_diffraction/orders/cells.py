"""Coordinates in which the efficiencies of a grating's orders are smooth.

A grating of period d repeats along x; its grooves run along y. It lies in a medium of index n.
(x, y) are direction cosines, within that medium, of the mirror direction of the incident light:
the tangential part of −ωi. With the vacuum wavelength λ,

    c = √(1 − y²),   s = x/c,   g = λ/(c n d),   K = 2/g,   p = (1 − s)/g.

Order m leaves at s + m g, that is, at p − m: the tangential part of ωo has x + m λ/(n d) and y.
It propagates if 0 ≤ p − m ≤ K, so all orders that begin or cease to propagate lie where p or K − p
is a whole number. The *band* is k = ⌊K⌋, and r = K − k; the *channel* is j = ⌊p⌋, and f = p − j.

    kind A, f < r:   t = f/r,               channels 0 … k propagate
    kind B, f ≥ r:   t = (f − r)/(1 − r),   channels 0 … k − 1 propagate

Order m leaves through channel q = j − m, with the same f, kind and t. Within a kind, efficiencies
are smooth functions of t, r and λ, but for square roots at the ends (Rayleigh 1907; Wood's
anomalies), which vanish in τ and ρ:

    t = sin²(πτ/2),   r = sin²(πρ/2).

The third variable w is the wavelength at constant s and K, from min(λ_min, 2nd/K) to
min(λ_max, 2nd/K): longer wavelengths have no direction of this K. For a perfect conductor
efficiencies do not depend on w (the conical mount is the classical one at s and g; Petit 1980,
"Electromagnetic theory of gratings", section 1.2).

Reversed light enters through channel k − q of kind A, or k − 1 − q of kind B, at 1 − t.

A thin sheet has the same medium on both sides, hence the same channels. Its *ports* are the n
channels of light above the sheet, then the n of light below it: a side has the ports side·n + j.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import ArrayLike

from ..arrays import Real, Whole
from ..optics.orders import (
    cell_wavelengths,
    order_cell,
    wavelength_coordinate,
)

#: Kinds, as numbers: that of the channel count band + 1, and that of the channel count band.
A, B = 0, 1
#: Least direction cosine y of light that is solved, for the ratios of `polarised`: in its powers
#: nobody sees it (1e-5).
LEAST_ALONG = 3e-3
#: Least width of a kind or y-range, against division by 0: rounding in double precision.
_MIN_WIDTH = 1e-12


class Counts(NamedTuple):
    """Numbers of nodes, or of cells, along τ, ρ and w."""

    tau: int
    rho: int
    w: int


class Cell(NamedTuple):
    """Coordinates of incident light; arrays of one shape.

    Attributes
    ----------
    band : k = ⌊K⌋.
    kind : `A` or `B`.
    channel : j = ⌊p⌋ of the mirror direction; below 0 where the light has no direction.
    tau, rho : τ and ρ, 0 to 1.
    k_continuous : K.
    """

    band: Whole
    kind: Whole
    channel: Whole
    tau: Real
    rho: Real
    k_continuous: Real

    @property
    def channels(self) -> Whole:
        """Number of propagating channels."""
        return np.asarray(self.band + 1 - self.kind)


class Conditions(NamedTuple):
    """Incident light of a cell.

    Attributes
    ----------
    x, y : direction cosines of the mirror direction, within the medium; y ≥ 0.
    wavelength : in vacuum, nm.
    """

    x: Real
    y: Real
    wavelength: Real


def to_cell(x: ArrayLike, y: ArrayLike, wavelength: ArrayLike, optical_period: float) -> Cell:
    """Return the coordinates of incident light.

    Parameters
    ----------
    x, y : direction cosines of the mirror direction, within the medium.
    wavelength : in vacuum, nm.
    optical_period : n d, µm.
    """
    x, y, lam = np.broadcast_arrays(
        *(np.asarray(value, np.float64) for value in (x, y, wavelength))
    )
    cell = order_cell(x, y, 1e3 * optical_period / lam, math.inf, _MIN_WIDTH)
    channel = np.where(np.abs(x / cell.c) > 1.0, -1, cell.channel).astype(np.int64)
    return Cell(
        cell.band.astype(np.int64), np.where(cell.kind_a, A, B), channel,
        _tau(cell.t), _tau(cell.r), cell.k_continuous,
    )  # fmt: skip


def from_cell(
    band: ArrayLike,
    kind: ArrayLike,
    channel: ArrayLike,
    tau: ArrayLike,
    rho: ArrayLike,
    wavelength: ArrayLike,
    optical_period: float,
) -> Conditions:
    """Return the incident light of coordinates; the inverse of `to_cell` for y ≥ 0.

    wavelength : in vacuum, nm, at most 2nd/K; see `wavelength_of`.
    """
    r = sine_squared(rho)
    big_k = np.asarray(band) + r
    t = sine_squared(tau)
    f = np.where(np.asarray(kind) == A, t * r, r + t * (1.0 - r))
    p = np.asarray(channel) + f
    lam = np.asarray(wavelength, np.float64)
    c = np.minimum(big_k * lam / (2e3 * optical_period), 1.0)
    s = np.clip(1.0 - 2.0 * p / np.maximum(big_k, _MIN_WIDTH), -1.0, 1.0)
    return Conditions(*np.broadcast_arrays(s * c, np.sqrt(1.0 - c * c), lam))


def wavelength_of(
    k_continuous: ArrayLike,
    w: ArrayLike,
    wavelengths: tuple[float, float],
    optical_period: float,
    least_c: float = 0.0,
) -> Real:
    """Return the wavelength in vacuum, nm, at w (0 to 1) for K; see the module.

    least_c : least c of the light, at which w = 0 if the table has shorter wavelengths.
    """
    low, high = _ends(k_continuous, wavelengths, optical_period, least_c)
    return np.asarray(low + np.asarray(w) * (high - low))


def w_of(
    k_continuous: ArrayLike,
    wavelength: ArrayLike,
    wavelengths: tuple[float, float],
    optical_period: float,
) -> Real:
    """Return w of a wavelength in vacuum (nm); wavelengths outside the table get 0 or 1."""
    low, high = _ends(k_continuous, wavelengths, optical_period)
    lam = np.asarray(wavelength, np.float64)
    return np.asarray(wavelength_coordinate(lam, low, high, _MIN_WIDTH))


def largest_band(wavelengths: tuple[float, float], optical_period: float) -> int:
    """Return the band of in-plane light of the shortest wavelength, the last of a table."""
    return int(np.floor(2e3 * optical_period / wavelengths[0]))


def reversed_ports(ports: int, sides: int) -> Whole:
    """Return the port of the reversed light of each port, (ports,); sides : 2 of a sheet, or 1."""
    return np.asarray(np.flip(np.arange(ports).reshape(sides, -1), 1).ravel())


def nodes(count: int) -> Real:
    """Return the Chebyshev nodes between 0 and 1 (roots of T_count), ascending."""
    angles = np.pi * (np.arange(count) + 0.5) / count
    return np.asarray(0.5 - 0.5 * np.cos(angles))


def even_nodes(count: int) -> Real:
    """Return even nodes from 0 to 1: twice as many cells have them, too."""
    return np.linspace(0.0, 1.0, count)


def linear(count: int, at: ArrayLike) -> Real:
    """Return the matrix that takes values at `even_nodes(count)` to values between, (n, count)."""
    places = np.asarray(at, np.float64)[..., None] * (count - 1)
    return np.maximum(1.0 - np.abs(places - np.arange(count)), 0.0)


def interpolation(count: int, at: ArrayLike) -> Real:
    """Return the matrix (n, count) that takes values at `nodes(count)` to a polynomial's values."""
    terms, known = (chebvander(2.0 * np.asarray(x) - 1.0, count - 1) for x in (at, nodes(count)))
    return np.asarray(terms @ np.linalg.inv(known))


def sine_squared(tau: ArrayLike) -> Real:
    """Return t = sin²(πτ/2)."""
    return np.asarray(np.sin(0.5 * np.pi * np.asarray(tau, np.float64)) ** 2)


def _tau(t: Real) -> Real:
    """Return τ of t = sin²(πτ/2), as exact as `optics.orders.smooth_coordinate` is fast."""
    return np.asarray(np.arcsin(np.sqrt(np.clip(t, 0.0, 1.0))) * (2.0 / np.pi))


def _ends(
    k_continuous: ArrayLike,
    wavelengths: tuple[float, float],
    optical_period: float,
    least_c: float = 0.0,
) -> tuple[Real, Real]:
    """Return the ends of w, nm; least_c : least c of the light."""
    big_k = np.maximum(np.asarray(k_continuous, np.float64), _MIN_WIDTH)
    return cell_wavelengths(2e3 * optical_period / big_k, *wavelengths, least_c)
