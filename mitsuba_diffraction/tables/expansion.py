"""Expansions of the spectrum in κ: which basis functions, with which weights (NumPy only).

A table holds one of two things per bin j, both as a short series in κ:

- the *power* |a_j(κ)|², real, enough for `ensemble`;
- the *amplitude* a_j(κ), complex, needed for `patch` and by the Taylor series.

Order 0, the glossy reflection, is stored apart in single precision and keeps its whole lobe, since
next to it the colours may be a thousandth.

**Chebyshev.** [0, κ_max] is cut into equal intervals, each with its own short Chebyshev series
(after Boyd 2001, ch. 2): a look-up reads the terms of one interval only, so that its cost does not
grow with the depth of the surface. In the first interval what is expanded is (|a_j|² − δ_j0)/κ̂²
(or (a_j − δ_j0)/κ̂, with κ̂ = κ over the interval's length): both are smooth, and the light that
leaves the specular direction keeps its relative accuracy down to κ → 0, where it fades as κ².

**Taylor.** a_j(κ) = δ_j0 + Σ_n xⁿ/n! · DFT[iⁿ(2h/H)ⁿ]_j with x = κH/2 and centred heights
(Stam 1999, eq. 12, after the source documents), one interval. The terms grow to e^x before they
cancel, which single precision survives for shallow surfaces only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln

BASES = ("taylor", "chebyshev")
KINDS = ("power", "amplitude")

_INSIDE = 1e-9  # keeps the ends of an interval on its own side of floor()


@dataclass(frozen=True)
class Expansion:
    """A series in κ over [0, kappa_max].

    Attributes
    ----------
    basis : "taylor" or "chebyshev".
    kind : "power" or "amplitude", what is expanded.
    terms : coefficients per interval. Taylor's count starts at n = 1: n = 0 is δ_j0 itself.
    intervals : equal parts of [0, kappa_max].
    kappa_max : rad/µm.
    half_range : H/2 in µm, which scales Taylor's x.
    """

    basis: str
    kind: str
    terms: int
    intervals: int
    kappa_max: float
    half_range: float

    @property
    def length(self) -> float:
        """Length of one interval in rad/µm."""
        return self.kappa_max / self.intervals

    def interval(self, kappa: ArrayLike) -> NDArray[np.int64]:
        """Index of the interval that holds κ."""
        index = np.floor(np.asarray(kappa, float) / self.length).astype(np.int64)
        return np.clip(index, 0, self.intervals - 1)

    def specular(self, interval: ArrayLike) -> NDArray[np.float64]:
        """How much of δ_j0 is added to the series: 1 where it was taken out, else 0."""
        return np.where(self._factored(interval), 1.0, 0.0)

    def weights(self, kappa: ArrayLike) -> NDArray[np.float64]:
        """What each coefficient is multiplied with, shape κ.shape + (terms,)."""
        kappa = np.asarray(kappa, float)
        if self.basis == "taylor":
            n = np.arange(1, self.terms + 1)
            x = kappa[..., None] * self.half_range
            with np.errstate(divide="ignore"):
                return np.exp(n * np.log(x) - gammaln(n + 1))
        index = self.interval(kappa)
        t = np.clip(2.0 * (kappa / self.length - index) - 1.0, -1.0, 1.0)
        polynomials = np.cos(np.arange(self.terms) * np.arccos(t)[..., None])
        return polynomials * self._prefactor(kappa, index)[..., None]

    def nodes(self, interval: int) -> NDArray[np.float64]:
        """κ of the interval's Chebyshev points of the first kind, as many as terms."""
        angle = np.pi * (np.arange(self.terms) + 0.5) / self.terms
        return self.length * (interval + 0.5 * (1.0 + np.cos(angle)))

    def extrema(self, interval: int) -> NDArray[np.float64]:
        """κ where an interpolation through `nodes` is worst: between them, and at the ends.

        These are the extrema of the first Chebyshev polynomial left out; κ = 0 itself, where only
        the specular order is left, gives way to a small κ.
        """
        angle = np.pi * np.arange(self.terms + 1) / self.terms
        lowest = 1e-3 if interval == 0 else _INSIDE
        inside = np.clip(0.5 * (1.0 - np.cos(angle)), lowest, 1.0 - _INSIDE)
        return self.length * (interval + inside)

    def fit(self, interval: int) -> NDArray[np.float64]:
        """Matrix (nodes, terms) that takes values at the nodes to coefficients.

        The values are those of the power or amplitude less `specular`·δ_j0; the matrix divides out
        the factor κ̂² or κ̂ of the first interval.
        """
        nodes = self.nodes(interval)
        order = np.arange(self.terms)
        angle = np.pi * (order + 0.5) / self.terms
        cosines = np.cos(np.outer(angle, order)) * np.where(order == 0, 1.0, 2.0) / self.terms
        index = np.full(len(nodes), interval)
        return cosines / self._prefactor(nodes, index)[:, None]

    def _factored(self, interval: ArrayLike) -> NDArray[np.bool_]:
        first = np.asarray(interval) == 0
        return np.ones_like(first) if self.basis == "taylor" else first

    def _prefactor(
        self, kappa: NDArray[np.float64], index: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        power = 2 if self.kind == "power" else 1
        return np.where(index == 0, (kappa / self.length) ** power, 1.0)
