"""A scan much wider than the coherence window, as overlapping windows whose powers are averaged.

Welch's method (1967, IEEE Transactions on Audio and Electroacoustics 15, 70) for the screen
exp(iκh): windows overlap by half, each is levelled, and what is left of its screen once the mean is
taken out fades at the edges (Hann, of mean square 1), so that the seams of the tiles diffract
nothing. The mean itself is order 0, and has no seams. Windows are cut out when they are asked for:
memory does not grow with the scan.

A Hann window L wide widens every lobe. Its power has the variance 1/3 in bins of 2π/L, the
coherence window's 1/(2σ²): with L = 8σ, twice the coherence width, lobes are 19 % wider.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any, overload

import numpy as np
import scipy
from numpy.typing import NDArray

from ...heights.field import HeightField
from ...heights.preprocess import plane_of
from ...optics.blend import ScaleRoughness
from ...optics.geometry import sigma_of, wavenumber
from ...settings import TableSettings
from ..table import build_error
from .spectrum import GLOSSY_RADIUS, Spectrum

#: Width of a window, in coherence widths, of `windows="auto"`.
AUTO = 2.0
#: An axis with less than so many windows' widths is one window, as wide as the scan and untapered.
_WIDE = 1.5
#: Windows that the roughness by spatial frequency is taken from, which is smooth.
_ROUGHNESS_OF = 16
_GREEN = 550.0  # nm, where the standard error is stated
#: Points of a scan that a batch of windows lies in, at most, unless one window is larger.
BATCH_POINTS = 2**24

Reals = NDArray[np.float64]
#: As `map`: calls of a function, here or on workers, results in the order of the arguments.
Run = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]


@dataclass(frozen=True)
class _Axis:
    """Where windows lie along one axis of a scan, in pixels; `taper` is None for a single one."""

    starts: Sequence[int]
    length: int
    taper: Reals | None

    @classmethod
    def of(cls, pixels: int, wanted: float) -> _Axis:
        if pixels < _WIDE * wanted:
            return cls([0], pixels, None)
        length = int(scipy.fft.next_fast_len(round(wanted)))
        count = 1 + max(1, round((pixels - length) / (0.5 * length)))
        starts = np.linspace(0, pixels - length, count).round().astype(int).tolist()
        taper = np.hanning(length + 1)[:-1]
        return cls(starts, length, taper / np.sqrt(np.mean(taper**2)))

    @property
    def variance_factor(self) -> float:
        """Variance of the mean over the windows of one: 1/n if they were independent (Welch)."""
        count = len(self.starts)
        if self.taper is None:
            return 1.0
        step = (self.starts[-1] - self.starts[0]) / (count - 1)
        total = 1.0
        for n in range(1, count):
            shift = round(n * step)
            if shift >= self.length:
                break
            overlap = float(np.mean(self.taper[shift:] * self.taper[: self.length - shift]))
            overlap *= (self.length - shift) / self.length
            total += 2.0 * (1.0 - n / count) * overlap**2
        return total / count


class Windows(Sequence[HeightField]):
    """The windows of one or several scans, all of one size.

    Parameters
    ----------
    scans : with pixels of one size.
    width : of a window, µm.
    run : what does the work of batches, as `map` does here.

    Attributes
    ----------
    tapers : along y and x, of mean square 1; None where a window is as wide as its scan.
    variance_factor : variance of the mean over all windows, of one window's.
    """

    def __init__(self, scans: Sequence[HeightField], width: float, run: Run = map) -> None:
        self.scans, self.run = list(scans), run
        axes = [
            [_Axis.of(n, width / d) for n, d in zip(s.shape, self._pixels, strict=True)]
            for s in scans
        ]
        self._check(axes)
        self._places = [
            (scan, top, left)
            for scan, (along_y, along_x) in zip(self.scans, axes, strict=True)
            for top in along_y.starts
            for left in along_x.starts
        ]
        self.shape = axes[0][0].length, axes[0][1].length
        self.tapers = axes[0][0].taper, axes[0][1].taper
        self.counts = [(len(x.starts), len(y.starts)) for y, x in axes]
        weights = [nx * ny / len(self) for nx, ny in self.counts]
        self.variance_factor = sum(
            w**2 * y.variance_factor * x.variance_factor
            for w, (y, x) in zip(weights, axes, strict=True)
        )

    def _check(self, axes: Sequence[Sequence[_Axis]]) -> None:
        first = self.scans[0]
        for scan, scan_axes in zip(self.scans[1:], axes[1:], strict=True):
            alike = np.allclose(scan.pixel_size, first.pixel_size, rtol=1e-6, atol=0.0)
            if not alike or [a.length for a in scan_axes] != [a.length for a in axes[0]]:
                raise build_error(
                    f"'{scan.name}' and '{first.name}' have no windows of one size: their pixels "
                    "differ, or one is narrower than a window; build a table of each"
                )

    def __len__(self) -> int:
        return len(self._places)

    @overload
    def __getitem__(self, n: int) -> HeightField: ...
    @overload
    def __getitem__(self, n: slice) -> Sequence[HeightField]: ...
    def __getitem__(self, n: int | slice) -> HeightField | Sequence[HeightField]:
        if isinstance(n, slice):
            return [self[m] for m in range(*n.indices(len(self)))]
        scan, top, left = self._places[n]
        ny, nx = self.shape
        heights = scan.heights[top : top + ny, left : left + nx].copy()
        heights.setflags(write=False)  # so that it is not copied once more
        slopes, (dx, dy) = plane_of(HeightField(heights, scan.pixel_size)), scan.pixel_size
        heights.setflags(write=True)
        # A tilt turns the mirror direction; an axis of one window is periodic, and its own
        if self.tapers[1] is not None:
            heights -= slopes[0] * dx * np.arange(nx)
        if self.tapers[0] is not None:
            heights -= (slopes[1] * dy * np.arange(ny))[:, None]
        heights.setflags(write=False)
        return HeightField(heights, scan.pixel_size, name=f"{scan.name}, window {n + 1}")

    def batches(self) -> list[Windows]:
        """All windows, some neighbours at a time; the same whoever does their work."""
        ny, nx = self.shape
        most = 1 + max(0, int((BATCH_POINTS / ny - nx) / (0.5 * nx)))
        batches = []
        for _, row in groupby(self._places, key=lambda place: (id(place[0]), place[1])):
            places = list(row)
            for start in range(0, len(places), most):
                batch = Windows.__new__(Windows)
                part = {"scans": [places[0][0]], "_places": places[start : start + most]}
                vars(batch).update(vars(self), **part)
                batches.append(batch)
        return batches

    def __getstate__(self) -> dict[str, Any]:
        """State of a batch for workers: of its scan, only the part that it covers."""
        (scan,) = self.scans
        corners = np.array([(top, left) for _, top, left in self._places])
        (top, left), (bottom, right) = corners.min(axis=0), corners.max(axis=0) + self.shape
        part = HeightField(scan.heights[top:bottom, left:right], scan.pixel_size, name=scan.name)
        places = [(part, y - int(top), x - int(left)) for _, y, x in self._places]
        return {**self.__dict__, "scans": [part], "_places": places, "run": map}

    def spectrum(self, n: int, last: tuple[int, int], double: bool = False) -> Spectrum:
        """Transforms of one window."""
        return Spectrum(self[n], last, double, self.tapers)

    def standard_error(self, coherence_width: float) -> dict[str, float]:
        """Relative standard error of the mean over windows, from their scatter.

        Of what look-ups find at 550 nm, normal incidence and reflection: Σ error / Σ mean over
        directions, near order 0 and in all others, as a table's own error is summed.
        """
        sigma, kappa = sigma_of(coherence_width), 2.0 * float(wavenumber(_GREEN))
        bins = [2.0 * math.pi / (n * d) for n, d in zip(self.shape, self._pixels, strict=True)]
        last = [min(int(kappa / q), n // 2) for q, n in zip(bins, self.shape, strict=True)]
        lobe = [1.0 / (math.sqrt(2.0) * sigma * q) for q in bins]
        scatter = partial(_scatter, (last[1], last[0]), kappa, lobe)
        count, mean, squares = 0, np.zeros(1), np.zeros(1)
        for more, their_mean, their_squares in self.run(scatter, self.batches()):
            # Chan, Golub & LeVeque (1983, The American Statistician 37, 242), equation 2.1
            change, count = their_mean - mean, count + more
            mean = mean + change * (more / count)
            squares = squares + their_squares + np.square(change) * (more * (count - more) / count)
        error = np.sqrt(squares / (count - 1) * self.variance_factor)
        y, x = (q * np.arange(-n, n + 1) for q, n in zip(bins, last, strict=True))
        near = np.hypot(x, y[:, None]) <= GLOSSY_RADIUS / sigma
        return {
            name: float(error[part].sum() / mean[part].sum()) if part.any() else 0.0
            for name, part in (("glossy", near), ("colours", ~near))
        }

    def roughness(self) -> list[ScaleRoughness]:
        """Roughness of some of the windows, their heights tapered like the screens."""
        return [
            ScaleRoughness.from_heights((w.heights - w.heights.mean()) * self.taper, w.pixel_size)
            for w in self.some()
        ]

    @property
    def taper(self) -> Reals:
        """Factor by which screens fade towards the edges: (ny or 1, nx or 1)."""
        return np.outer(*(np.ones(1) if t is None else t for t in self.tapers))

    def some(self) -> Iterator[HeightField]:
        """Some of the windows, evenly spread."""
        numbers = np.unique(np.linspace(0, len(self) - 1, _ROUGHNESS_OF).round().astype(int))
        return (self[int(n)] for n in numbers)

    @property
    def _pixels(self) -> tuple[float, float]:
        """µm along y and x."""
        dx, dy = self.scans[0].pixel_size
        return dy, dx


def _scatter(
    last: tuple[int, int], kappa: float, lobe: Sequence[float], windows: Windows
) -> tuple[int, Reals, Reals]:
    """Number of windows, mean and sum of squared deviations of what look-ups find in them."""
    mean, squares = np.zeros(1), np.zeros(1)
    for n in range(len(windows)):
        power = np.abs(windows.spectrum(n, last).of_phase(kappa)) ** 2
        power = scipy.ndimage.gaussian_filter(power.astype(np.float64), lobe, mode="constant")
        change = power - mean
        mean = mean + change / (n + 1)
        squares = squares + change * (power - mean)
    return len(windows), mean, squares


def windows_of(
    scans: Sequence[HeightField], settings: TableSettings, run: Run = map
) -> Sequence[HeightField]:
    """The windows of scans as `settings.windows` has them; the scans where none is wide enough.

    run : what does their work.

    Raises a DiffractionError if their powers cannot be averaged.
    """
    if settings.windows is None or not scans:
        return scans
    if settings.coherent or settings.basis == "taylor":
        raise build_error(
            "windows have their powers averaged, which coherence='patch' and basis='taylor' "
            "cannot; use coherence='ensemble' and basis='svd', or leave windows out"
        )
    width = settings.windows
    if isinstance(width, str):
        width = AUTO * settings.width
    if min(width / d for d in scans[0].pixel_size) < 4:
        return scans  # pixels so coarse that something else is wrong
    windows = Windows(scans, width, run)
    return scans if len(windows) == len(scans) else windows


def shape_of(patches: Sequence[HeightField]) -> tuple[int, int]:
    """The largest (ny, nx) of all patches."""
    if isinstance(patches, Windows):
        return patches.shape
    ny, nx = np.max([patch.shape for patch in patches], axis=0)
    return int(ny), int(nx)
