"""The grid of a colour table: rings even in ln r, with the more azimuths the larger they are.

Orders are smeared along the radius by the wavelengths and sharp in azimuth only, where a lobe is
1/(σ√2|q|) wide: on rings even in ln r, with azimuths as far apart as a share of that width, the
memory goes where the features are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

#: |(u, v)| is at most 2.
LARGEST_RADIUS = 2.0
#: Only grazing light probes larger ones: they get no finer azimuths and wavelengths than this one.
RESOLVED_RADIUS = 1.4


@dataclass(frozen=True)
class PolarGrid:
    """Rings and their azimuths; the bins of a ring are stored one after the other.

    Attributes
    ----------
    smallest : radius of ring 0.
    step : distance of rings in ln r.
    counts : azimuths of each ring, 2ⁿ or 3·2ⁿ; azimuth n of N is at φ = 2πn/N. Every ring repeats
        its first bin at its end, so that a look-up never wraps around.
    """

    smallest: float
    step: float
    counts: tuple[int, ...]

    @classmethod
    def of(cls, lobe: float, step: float, share: float) -> PolarGrid:
        """The grid for lobes of standard deviation `lobe` in (u, v).

        Parameters
        ----------
        lobe : of the narrowest lobes, those of short wavelengths.
        step : distance of rings in ln r.
        share : largest distance of azimuths, in units of `lobe`.
        """
        smallest = 0.05 * lobe
        rings = math.ceil(math.log(LARGEST_RADIUS / smallest) / step) + 2
        counts = []
        for ring in range(rings):
            radius = min(smallest * math.exp(step * ring), RESOLVED_RADIUS)
            wanted = 2 * math.pi * radius / (share * lobe)
            power = 1 << max(4, math.ceil(math.log2(wanted)))
            counts.append(3 * power // 4 if 3 * power // 4 >= wanted else power)
        return cls(smallest, step, tuple(counts))

    @property
    def rings(self) -> int:
        """How many."""
        return len(self.counts)

    @property
    def bins(self) -> int:
        """How many in all, the repeated ones included."""
        return sum(self.counts) + self.rings

    def radius(self, ring: int) -> float:
        """Of this ring, |(u, v)|."""
        return self.smallest * math.exp(self.step * ring)

    def start(self, ring: int) -> int:
        """Index of the ring's first bin."""
        return sum(self.counts[:ring]) + ring

    def bands(self) -> Iterator[range]:
        """Runs of rings with the same number of azimuths."""
        first = 0
        for ring in range(1, self.rings + 1):
            if ring == self.rings or self.counts[ring] != self.counts[first]:
                yield range(first, ring)
                first = ring
