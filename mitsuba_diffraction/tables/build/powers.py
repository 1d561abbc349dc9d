"""The mean power of the orders of screens, κ after κ: by batches, on workers if given.

Sums are of the same batches in the same order whoever makes them, in double precision: a table is
the same, to the last bit, with any number of workers.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .screens import Screens
from .spectrum import Spectrum

#: Bytes of sums that a batch of windows gives at once: of several κ, for which it is read once.
_GROUP = 2**26
#: Windows that are transformed at a time: each holds its powers at several κ.
_MOST_THREADS = 8


@dataclass
class Power:
    """|a_j|² at one κ: of one patch, the sum over several, or their mean.

    Attributes
    ----------
    bins : (ny, nx), without order 0, whose bin is empty.
    change : |a_0|² − 1, without cancellation as κ → 0.
    order_0 : |a_0|², without it where that vanishes.
    """

    bins: NDArray[Any]
    change: float
    order_0: float

    @classmethod
    def of(cls, spectrum: Spectrum, kappa: float) -> Power:
        """Power of one patch, in the precision of its spectrum."""
        amplitude = spectrum.of_phase(kappa, minus_one=True)  # so that bin 0 is a_0 − 1
        middle = spectrum.last[1], spectrum.last[0]
        less = complex(amplitude[middle])
        amplitude[middle] = 0.0
        bins = np.square(amplitude.real)
        bins += np.square(amplitude.imag)
        return cls(bins, abs(less) ** 2 + 2.0 * less.real, abs(1.0 + less) ** 2)

    def add(self, other: Power) -> None:
        """Add up, in double precision."""
        self.bins = np.asarray(self.bins, np.float64)
        self.bins += other.bins
        self.change += other.change
        self.order_0 += other.order_0

    def over(self, count: int) -> Power:
        """Divide a sum of so many powers by their number."""
        if count > 1:
            self.bins /= count
        return Power(self.bins, self.change / count, self.order_0 / count)


class PatchSpectra:
    """Transforms of screens.

    Parameters
    ----------
    last, double : as in `Spectrum`.
    tick : called when one of the `count` parts of a κ's work is done.
    """

    def __init__(
        self,
        screens: Screens,
        last: tuple[int, int],
        double: bool = False,
        tick: Callable[[], None] = lambda: None,
    ) -> None:
        self.tick, self.last, self.double, self._screens = tick, last, double, screens
        self._batches = screens.batches()
        self.shape = 2 * last[1] + 1, 2 * last[0] + 1

    @cached_property
    def first(self) -> Spectrum:
        """Spectrum of the only patch."""
        return self._screens.spectrum(0, self.last, self.double)

    @property
    def count(self) -> int:
        """Calls of `tick` for a κ."""
        return len(self._batches)

    def amplitudes(self, kappa: float, centred: bool) -> NDArray[np.complexfloating]:
        """Amplitudes a_j − δ_j0 of the only patch; centred : under a window on its middle."""
        amplitudes = self.first.of_phase(kappa, minus_one=True)
        if centred:
            alternate(amplitudes, self.last)
        self.tick()
        return amplitudes

    def powers(self, kappas: Sequence[float]) -> Iterator[Power]:
        """The mean over all screens, at one κ after the other."""
        size = max(1, _GROUP // (8 * math.prod(self.shape)))
        for start in range(0, len(kappas), size):
            few, total = tuple(kappas[start : start + size]), list[Power]()
            sums_of = partial(_batch_sums, self.last, self.double, few)
            for powers in self._screens.run(sums_of, self._batches):
                _add(total, powers)
                for _ in few:
                    self.tick()
            for power in total:
                mean = power.over(len(self._screens))
                mean.bins = self._screens.sharpened(mean.bins)
                yield mean


def alternate(amplitude: NDArray[Any], last: tuple[int, int]) -> None:
    """Multiply bin (jx, jy) by (−1)^(jx+jy), in place: exp(−i q_j·x₀) for x₀ = half the patch."""
    parity = (last[0] + last[1]) % 2
    amplitude[0::2, 1 - parity :: 2] *= -1
    amplitude[1::2, parity::2] *= -1


def _batch_sums(
    last: tuple[int, int], double: bool, kappas: tuple[float, ...], windows: Screens
) -> list[Power]:
    """Sums over some windows, one for every κ; as many windows at a time as there are threads."""
    threads = min(os.cpu_count() or 1, _MOST_THREADS, len(windows))

    def powers_of(n: int) -> list[Power]:
        spectrum = windows.spectrum(n, last, double, threaded=threads == 1)
        return [Power.of(spectrum, kappa) for kappa in kappas]

    total: list[Power] = []
    with ThreadPoolExecutor(threads) as pool:
        for start in range(0, len(windows), threads):
            for powers in pool.map(powers_of, range(start, min(start + threads, len(windows)))):
                _add(total, powers)
    return total


def _add(total: list[Power], more: list[Power]) -> None:
    """Add a power for every κ to the sums; empty sums are replaced."""
    for power, other in zip(total, more, strict=False):
        power.add(other)
    total += more[len(total) :]
