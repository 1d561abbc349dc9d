"""A sheet whose structured side is a grating, chain by chain (NumPy only).

Both sides of a sheet are measured in one medium, so all that is peculiar lies at the same
directions for all links (`links`): orders vanish at the horizon of either side, and are lost
beyond the sheet's critical angle, where (`grating`) one of ξ₁ and ξ₂ is a whole number. The
directions of a chain, on both sides, send light to each other alone, and order 0 of light along ξ
goes to (ξ₂, ξ₁) of either side: both scales are exact at every node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from .chains import Chains, balance, reflected
from .links import AZIMUTHS, Link, Real
from .sums import LinkedSums, Sums

#: Polar angles θi of tables.
POLAR = 46


@dataclass(frozen=True)
class LinkGain:
    """G of light that goes along a link, at one wavelength: as `gain.Gain`.

    Attributes
    ----------
    table : `Link.tables` at `POLAR` even angles.
    wavenumber : rad/µm.
    least : of `width`; powers over κ² have a limit, which their first step tells.
    """

    link: Link
    table: Real
    wavenumber: float
    least: float

    model = "small_slope"

    def at(self, cos_i: Real, cos_o: Real, turn: Real) -> Real:
        """G at (cosθi, cosθo, φo − φi); all broadcast."""
        angle = np.arccos(np.minimum(cos_i, 1.0)) * ((POLAR - 1) / (0.5 * np.pi))

        def read(row: Real, turn: Real) -> Real:
            column = (np.cos(turn) + 1.0) * (0.5 * (AZIMUTHS - 1))
            place = np.stack(np.broadcast_arrays(angle, row, column))
            return np.asarray(map_coordinates(self.table, place, order=1, mode="nearest"))

        w = self.width(cos_i, cos_o) * self.link.medium.index
        return self.link.gain(read, w, cos_i, cos_o, turn)

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        """κ over the wavenumber and the height scale, of heights that are larger by the index."""
        return np.maximum(self.link.width(cos_i, cos_o) / self.link.medium.index, self.least)


class ChainSides(LinkedSums):
    """R + T of all chains of one length, from weights (2, first, second, last + 1).

    Parameters
    ----------
    links : of either side, what goes to which side.
    first, second, last : as in `Chains.shares`.
    """

    #: cells are wide in angle there
    certain = float(np.radians(80.0))

    def __init__(
        self, links: list[list[tuple[int, Chains]]], first: Real, second: Real, last: int
    ) -> None:
        self._shares: list[list[Real]] = []
        for side in links:
            found: list[Real] = [np.zeros(())] * 2
            for left, chains in side:
                found[left] = found[left] + chains.shares(first, second, last)
            self._shares.append(found)
        k = np.arange(last + 1)
        self._zeroth = [[part[..., k, last - k + 1] for part in side] for side in self._shares]
        self.angle = _angles(links[0][0][1], first, second, last)

    def __call__(self, s: Sums) -> Sums:
        return np.stack([sum(map(reflected, side, s)) for side in self._shares])

    def zeroth(self, s: Sums) -> Sums:
        """Order 0 alone."""
        mirrored = s.swapaxes(1, 2)[..., ::-1]
        return np.stack([sum(map(np.multiply, side, mirrored)) for side in self._zeroth])

    def balanced(self, aim: Sums) -> Sums:
        """As much of `aim` as reciprocity lets both halves of the chains have."""
        total = aim.sum(axis=(0, -1))
        return aim * balance(total, total.T)[..., None]


def _angles(chains: Chains, first: Real, second: Real, last: int) -> Real:
    """Polar angles (first, second, last + 1), rad; of chains that are too wide, the last ones."""
    k, width = np.arange(last + 1), last + first + second
    g = np.minimum(chains.grating.spacing / chains.gain.wavenumber, 2.0 / np.maximum(width, 1e-9))
    ends = (k + first[..., None]) * (last - k + second[..., None])
    return np.asarray(np.arccos(np.minimum(g[..., None] * np.sqrt(ends), 1.0)))
