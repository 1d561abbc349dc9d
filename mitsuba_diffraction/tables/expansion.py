"""Expansions of the spectrum in κ: which basis functions, with which weights (NumPy only).

A table holds one of two things per bin j, both as a short series in κ:

- the *power* |a_j(κ)|², real, enough for `ensemble`;
- the *amplitude* a_j(κ), complex, needed for `patch` and by the Taylor series.

Order 0, the glossy reflection, is stored apart in double precision and keeps its whole lobe, since
next to it the colours may be a thousandth.

**Chebyshev.** [0, κ_max] is cut into equal intervals, each with its own short Chebyshev series
(after Boyd 2001, ch. 2): a look-up reads the terms of one interval only, so that its cost does not
grow with the depth of the surface. The first interval expands (|a_j|² − δ_j0)/κ̂²
(or (a_j − δ_j0)/κ̂, with κ̂ = κ over the interval's length): both are smooth, and the light that
leaves the specular direction keeps its relative accuracy down to κ → 0, where it fades as κ².

**SVD** (the default). Over one interval the powers of all bins, as functions of κ, lie close to a
space of few dimensions (their singular value decomposition; Eckart and Young 1936): fewer than
polynomials take, since most pairs of heights differ by much less than the deepest and the highest.
`principal_functions` finds that space; its functions of κ are kept as Chebyshev series of their
own, and a bin has one number for each of them. Order 0, which need not lie in that space, keeps
the plain Chebyshev series.

**Taylor.** a_j(κ) = δ_j0 + Σ_n xⁿ/n! · DFT[iⁿ(2h/H)ⁿ]_j with x = κH/2 and centred heights
(Stam 1999, eq. 12, after the thesis), one interval. The terms grow to e^x before they
cancel, which single precision survives for shallow surfaces only.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

KINDS = ("power", "amplitude")

_DARK = 1e-3  # the share of the brightest that tables.build.error compares the darkest κ with
_ROUNDING = 1e-13  # squares of what single precision leaves, and more
_BLOCK = 1 << 15  # bins at a time
_INSIDE = 1e-9  # keeps the ends of an interval on its own side of floor()


@dataclass(frozen=True)
class Expansion:
    """A series in κ over [0, kappa_max].

    Attributes
    ----------
    basis : "svd", "chebyshev" or "taylor".
    kind : "power" or "amplitude", the quantity expanded.
    terms : coefficients per interval. Taylor's count starts at n = 1: n = 0 is δ_j0 itself.
    intervals : equal parts of [0, kappa_max].
    kappa_max : rad/µm.
    half_range : H/2 in µm, which scales Taylor's x.
    functions : (intervals, series_terms, terms) of basis "svd": the Chebyshev series of each of
        its functions; None otherwise.
    """

    basis: str
    kind: str
    terms: int
    intervals: int
    kappa_max: float
    half_range: float
    functions: NDArray[np.float64] | None = field(default=None, repr=False, compare=False)

    @property
    def components(self) -> int:
        """Numbers of an order at one κ: its power, or the two parts of its amplitude."""
        return 1 if self.kind == "power" else 2

    def power_of(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the powers of orders from their numbers (…, components)."""
        return np.asarray(values[..., 0] if self.kind == "power" else np.sum(values**2, axis=-1))

    @property
    def series_terms(self) -> int:
        """Length of the series that order 0 and the functions of basis "svd" have."""
        return self.terms if self.functions is None else self.functions.shape[1]

    @property
    def length(self) -> float:
        """Length of one interval in rad/µm."""
        return self.kappa_max / self.intervals

    def interval(self, kappa: ArrayLike) -> NDArray[np.int64]:
        """Index of the interval that holds κ."""
        index = np.floor(np.asarray(kappa, float) / self.length).astype(np.int64)
        return np.clip(index, 0, self.intervals - 1)

    def order_0_offset(self, interval: ArrayLike) -> NDArray[np.float64]:
        """Return the part of δ_j0 that is added to the series: 1 where it was taken out, else 0."""
        return np.where((np.asarray(interval) == 0) | (self.basis == "taylor"), 1.0, 0.0)

    def weights(self, kappa: ArrayLike) -> NDArray[np.float64]:
        """Return the factor of each coefficient of a bin, shape κ.shape + (terms,)."""
        series = self.series_weights(kappa)
        if self.functions is None:
            return series
        weights: NDArray[np.float64] = np.einsum(
            "...s,...st->...t", series, self.functions[self.interval(kappa)]
        )
        return weights

    def series_weights(self, kappa: ArrayLike) -> NDArray[np.float64]:
        """Return the factor of each coefficient of order 0, shape κ.shape + (series_terms,)."""
        kappa = np.asarray(kappa, float)
        if self.basis == "taylor":
            n = np.arange(1, self.terms + 1)
            x = kappa[..., None] * self.half_range
            with np.errstate(divide="ignore"):
                return np.exp(n * np.log(x) - scipy.special.gammaln(n + 1))
        index = self.interval(kappa)
        t = np.clip(2.0 * (kappa / self.length - index) - 1.0, -1.0, 1.0)
        polynomials = np.cos(np.arange(self.series_terms) * np.arccos(t)[..., None])
        return polynomials * self.fading(kappa)[..., None]

    def nodes(self, interval: int) -> NDArray[np.float64]:
        """κ of the interval's Chebyshev points of the first kind, `series_terms` of them."""
        angle = np.pi * (np.arange(self.series_terms) + 0.5) / self.series_terms
        return self.length * (interval + 0.5 * (1.0 + np.cos(angle)))

    def extrema(self, interval: int) -> NDArray[np.float64]:
        """κ where an interpolation through `nodes` is worst: between them, and at the ends.

        These are the extrema of the first Chebyshev polynomial left out; κ = 0 itself, where only
        the specular order is left, gives way to a small κ.
        """
        angle = np.pi * np.arange(self.series_terms + 1) / self.series_terms
        lowest = 1e-3 if interval == 0 else _INSIDE
        inside = np.clip(0.5 * (1.0 - np.cos(angle)), lowest, 1.0 - _INSIDE)
        return self.length * (interval + inside)

    def fit(self, interval: int) -> NDArray[np.float64]:
        """Matrix (nodes, series_terms) that takes values at the nodes to Chebyshev coefficients.

        The values are powers or amplitudes minus `order_0_offset`·δ_j0; the matrix
        divides out the factor κ̂² or κ̂ of the first interval.
        """
        nodes = self.nodes(interval)
        count = self.series_terms
        order = np.arange(count)
        angle = np.pi * (order + 0.5) / count
        cosines = np.cos(np.outer(angle, order)) * np.where(order == 0, 1.0, 2.0) / count
        return cosines / self.fading(nodes)[:, None]

    def fading(self, kappa: ArrayLike) -> NDArray[np.float64]:
        """The factor κ̂² or κ̂ of the first interval, 1 in all others; not for Taylor's series."""
        kappa = np.asarray(kappa, float)
        power = 2 if self.kind == "power" else 1
        return np.where(self.interval(kappa) == 0, (kappa / self.length) ** power, 1.0)


def series_sum(
    coefficients: NDArray[np.floating], weights: NDArray[np.floating]
) -> NDArray[np.floating]:
    """Sum the series of bins: coefficients (…, terms) and weights (terms,) give an array (…).

    Weights (n, terms), of several κ, give (n, …).
    """
    if weights.size == weights.shape[-1]:
        # not by OpenBLAS: with AVX-512, the product of a matrix of five single-precision columns
        # and a vector also multiplies memory that was never set; the product is right, but NumPy
        # warns of the invalid operation (version 0.3.31)
        sums = np.einsum("...t,t->...", coefficients, weights.ravel())
        return np.asarray(sums.reshape(*weights.shape[:-1], *sums.shape))
    sums = weights @ coefficients.reshape(-1, coefficients.shape[-1]).T
    return np.asarray(sums.reshape(len(weights), *coefficients.shape[:-1]))


def principal_functions(
    values: NDArray[np.floating],
    expansion: Expansion,
    interval: int,
    terms: int,
    near: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The few functions of κ that bins are best made of, over one interval.

    Parameters
    ----------
    values : (nodes, bins), each bin's power, or part of its amplitude, at the interval's nodes.
    expansion : the Chebyshev series whose nodes they are.
    terms : how many functions.
    near : the bins close to order 0, whose error is measured separately.

    Returns
    -------
    projection : (nodes, terms); values.T @ projection are a bin's coefficients.
    functions : (nodes, terms), the functions' Chebyshev series.
    """
    nodes = expansion.nodes(interval)
    power = expansion.kind == "power"
    fading = expansion.fading(nodes)
    parts = [_sizes(values, power), _sizes(values[:, near], power)]
    parts[0] -= parts[1]
    size = parts[0] + parts[1]
    size = size if power else np.sqrt(size)
    # An error counts relative to all the light at its κ, and where there is next to none, to
    # a share of the most
    size = np.maximum(size, _DARK * (size / fading).max() * fading) + 1e-30
    covariance = np.zeros((len(nodes), len(nodes)))
    for start in range(0, values.shape[1], _BLOCK):
        covariance += _covariance(values[:, start : start + _BLOCK] / size[:, None], power)
    # Both parts count alike, however few bins the one has
    share = (parts[1] / size).sum() / max((parts[0] / size).sum(), 1e-300)
    if 0.0 < share < 1.0:
        close = _covariance(values[:, near] / size[:, None], power)
        covariance += close * min(1.0 / share - 1.0, 1e6)
    # Where fewer functions would do, rounding would choose the rest: let them be polynomials
    angle = np.pi * (np.arange(len(nodes)) + 0.5) / len(nodes)
    polynomials = np.cos(np.outer(angle, np.arange(min(terms, len(nodes)))))
    covariance += _ROUNDING * np.trace(covariance) * (polynomials @ polynomials.T)
    vectors = np.linalg.eigh(covariance)[1][:, ::-1][:, :terms]
    # Of all functions that span this space, those that are 1 at one node and 0 at the others: then
    # a coefficient is a power, and what rounding adds to it is in proportion where it is dark too
    chosen = np.sort(scipy.linalg.qr(vectors.T, mode="r", pivoting=True)[1][:terms])
    change = np.linalg.inv(vectors[chosen])
    projection = (vectors / size[:, None]) @ vectors[chosen].T
    return projection, expansion.fit(interval).T @ (size[:, None] * (vectors @ change))


def _sizes(values: NDArray[np.floating], power: bool) -> NDArray[np.float64]:
    """Sum over the bins (nodes, bins) of powers, or of squared amplitudes."""
    sizes: NDArray[np.float64] = (np.abs(values) if power else values.astype(float) ** 2).sum(
        axis=1, dtype=float
    )
    return sizes


def _covariance(scaled: NDArray[np.float64], power: bool) -> NDArray[np.float64]:
    """Σ over bins (nodes, bins) of products of their values at two nodes."""
    if power:
        # The measure is the sum of errors, not of their squares: this corrects for it as far
        # as errors are in proportion to powers
        scaled = scaled / np.sqrt(np.sqrt(np.einsum("nb,nb->b", scaled, scaled)) + 1e-12)
    product: NDArray[np.float64] = scaled @ scaled.T
    return product
