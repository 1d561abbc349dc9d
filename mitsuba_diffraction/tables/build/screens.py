"""Phase screens of patches: a tile each, or a scan's tapered windows, whose powers are averaged.

A scan is part of a larger surface: its edges do not meet, so it must not tile the plane. Windows
W = 4σ wide overlap by half (Welch 1967, IEEE Transactions on Audio and Electroacoustics 15, 70);
`heights.coherence` has their width and their places. The mean of a window's phase screen exp(iκh),
weighted with its taper's square, is order 0. The rest fades with a taper and is filled up with
zeros to 2 W, so that orders lie π/W apart and no edge meets another. Neighbouring powers are
subtracted in part (`sharpened`): under the look-up's window an order's lobe is that of σ.
Windows are cut out when they are asked for: memory does not grow with the scan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ...arrays import Real
from ...heights import HeightField
from ...heights.coherence import SHARPENING, TAPER, window_corners, window_places
from ...heights.preprocess import plane_of
from ...optics.blend import ScaleRoughness
from ...optics.geometry import sigma_of, wavenumber
from ..table import build_error
from .spectrum import GLOSSY_RADIUS, Spectrum, Tapers, filled

#: Windows that the roughness by spatial frequency is taken from, which is smooth.
_ROUGHNESS_OF = 16
_GREEN = 550.0  # nm, where the standard error is stated
#: Points of a scan that a batch of windows lies in, at most, unless one window is larger.
BATCH_POINTS = 2**24

#: As `map`: calls of a function, here or on workers, results in the order of the arguments.
Run = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]


@dataclass(frozen=True)
class _Axis:
    """Where windows lie along one axis of a scan, in pixels.

    Attributes
    ----------
    starts, length : first pixels of the windows, and their length.
    taper : of mean square 1; None along an axis without any change of height.
    """

    starts: Sequence[int]
    length: int
    taper: Real | None

    @classmethod
    def of(cls, pixels: int, window: float) -> _Axis:
        """Windows some `window` pixels long."""
        starts, length = window_places(pixels, window)
        turn = 2.0 * np.pi / length * (np.arange(length) - 0.5 * (length - 1))
        taper = 1.0 + sum(c * np.cos(n * turn) for n, c in enumerate(TAPER, 1))
        return cls(starts, length, taper / np.sqrt(np.mean(taper**2)))

    def alike(self) -> Real:
        """Share that the powers of two windows have in common, by how many steps they are apart."""
        count = len(self.starts)
        if count == 1 or self.taper is None:
            return np.eye(count)[0]
        step = (self.starts[-1] - self.starts[0]) / (count - 1)
        shares = np.zeros(count)
        for n in range(count):
            left = max(0, self.length - round(n * step))
            overlap = self.taper[self.length - left :] @ self.taper[:left]
            shares[n] = (overlap / self.length) ** 2
        return shares


class Screens:
    """The windows of one or several scans, all of one size, or patches that tile the plane.

    Parameters
    ----------
    scans : with pixels of one size; patches of one extent.
    width : of a window, µm; None of patches, each of which is a window without a taper.
    run : what does the work of batches, as `map` does here.

    Attributes
    ----------
    windowed : whether they are windows of scans.
    shape : (ny, nx) of a window, of the largest patch.
    tapers : along y and x, of mean square 1; None where heights do not change, and of patches.
    variance_factor : variance of the mean over all windows, of one window's.
    """

    def __init__(
        self, scans: Sequence[HeightField], width: float | None = None, run: Run = map
    ) -> None:
        self.scans, self.windowed, self.run = list(scans), width is not None, run
        changes = [any(scan.varies_along(axis) for scan in scans) for axis in (0, 1)]

        def axis_of(pixels: int, pixel: float, varies: bool) -> _Axis:
            if width is None or not varies:
                return _Axis([0], pixels, None)
            return _Axis.of(pixels, width / pixel)

        axes = [
            [axis_of(*each) for each in zip(scan.shape, self._pixels, changes, strict=True)]
            for scan in self.scans
        ]
        if self.windowed:
            self._check(axes)
        self._places = [
            (scan, top, left)
            for scan, (along_y, along_x) in zip(self.scans, axes, strict=True)
            for top, left in window_corners(along_y.starts, along_x.starts)
        ]
        self.shape = max(y.length for y, _ in axes), max(x.length for _, x in axes)
        self.tapers: Tapers = axes[0][0].taper, axes[0][1].taper
        self._several = [any(len(each[n].starts) > 1 for each in axes) for n in (0, 1)]
        self.counts = [(len(x.starts), len(y.starts)) for y, x in axes]
        self.variance_factor = sum(_pairs(y, x) for y, x in axes) / len(self) ** 2

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

    def __iter__(self) -> Iterator[HeightField]:
        return (self[n] for n in range(len(self)))

    def __getitem__(self, n: int) -> HeightField:
        scan, top, left = self._places[n]
        if not self.windowed:
            return scan
        ny, nx = self.shape
        heights = scan.heights[top : top + ny, left : left + nx].copy()
        heights.setflags(write=False)  # so that it is not copied once more
        slopes = plane_of(HeightField(heights, scan.pixel_size), self.tapers)
        heights.setflags(write=True)
        # A tilt turns the mirror direction; part of a wave that an edge cuts off is none, so that
        # pixels there count less. A scan of one window has been levelled, or is not to be
        dx, dy = scan.pixel_size
        if self._several[1]:
            heights -= slopes[0] * dx * np.arange(nx)
        if self._several[0]:
            heights -= (slopes[1] * dy * np.arange(ny))[:, None]
        heights.setflags(write=False)
        return HeightField(heights, scan.pixel_size, name=f"{scan.name}, window {n + 1}")

    @property
    def tile(self) -> tuple[int, int]:
        """(ny, nx) of a screen with the zeros around it."""
        return filled(self.shape, self.tapers)

    @property
    def extent(self) -> tuple[float, float]:
        """Period (x, y) of the transforms, µm: of a patch, or of a window with its zeros."""
        if not self.windowed:
            return self.scans[0].extent
        (dx, dy), (ny, nx) = self.scans[0].pixel_size, self.tile
        return nx * dx, ny * dy

    def batches(self) -> list[Screens]:
        """All windows, some neighbours at a time; the same whoever does their work."""
        ny, nx = self.shape
        most = max(1, int(BATCH_POINTS / (ny * nx)))
        batches = []
        for _, row in groupby(self._places, key=lambda place: (id(place[0]), place[1])):
            places = list(row)
            for start in range(0, len(places), most):
                batch = Screens.__new__(Screens)
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

    def spectrum(
        self, n: int, last: tuple[int, int], double: bool = False, threaded: bool = True
    ) -> Spectrum:
        """Transforms of one window."""
        return Spectrum(self[n], last, double, self.tapers, threaded)

    def standard_error(self, coherence_width: float) -> dict[str, float]:
        """Relative standard error of the mean over windows, from their scatter.

        Of what look-ups find at 550 nm, normal incidence and reflection: Σ error / Σ mean over
        directions, near order 0 and in all others, as a table's own error is summed.
        """
        sigma, kappa = sigma_of(coherence_width), 2.0 * float(wavenumber(_GREEN))
        bins = [2.0 * math.pi / (n * d) for n, d in zip(self.tile, self._pixels, strict=True)]
        last = [min(int(kappa / q), n // 2) for q, n in zip(bins, self.tile, strict=True)]
        lobe = [1.0 / (math.sqrt(2.0) * sigma * q) for q in bins]
        scatter = partial(_scatter, (last[1], last[0]), kappa, lobe)
        sums: Any = sum(self.run(scatter, self.batches()))
        count = len(self)
        mean, squares = sums / count
        variance = np.maximum(squares - mean**2, 0.0) * (count / (count - 1))
        error = np.sqrt(variance * self.variance_factor)
        y, x = (q * np.arange(-n, n + 1) for q, n in zip(bins, last, strict=True))
        near = np.hypot(x, y[:, None]) <= GLOSSY_RADIUS / sigma
        return {
            name: float(error[part].sum() / mean[part].sum()) if part.any() else 0.0
            for name, part in (("glossy", near), ("colours", ~near))
        }

    def roughness(self) -> list[ScaleRoughness]:
        """Roughness of some of the windows, evenly spread, their heights tapered like screens."""
        numbers = np.unique(np.linspace(0, len(self) - 1, _ROUGHNESS_OF).round().astype(int))
        return [
            ScaleRoughness.from_heights((w.heights - w.heights.mean()) * self.taper, w.pixel_size)
            for w in (self[int(n)] for n in numbers)
        ]

    def sharpened(self, powers: NDArray[Any]) -> NDArray[Any]:
        """Powers of all orders but 0, (ny, nx), without the share that their neighbours have.

        P_j − b (P_{j+1} − 2 P_j + P_{j−1}) along each axis that fades: the lag window (Blackman and
        Tukey 1958, The Measurement of Power Spectra) grows by 1 + 2b (1 − cos πr/W). The sum stays.
        The bin of order 0 counts as the mean of its neighbours, and is empty again.
        """
        middle = powers.shape[0] // 2, powers.shape[1] // 2
        around: list[float] = []
        for axis, taper in enumerate(self.tapers):
            if taper is not None:
                line = np.moveaxis(powers, axis, 0)[:, middle[1 - axis]]
                around += line[[middle[axis] - 1, middle[axis] + 1]].tolist()
        if not around:
            return powers
        powers = powers.copy()
        powers[middle] = np.mean(around)
        for axis, taper in enumerate(self.tapers):
            if taper is not None:
                steps = SHARPENING * np.diff(powers, axis=axis)
                rows = np.moveaxis(powers, axis, 0), np.moveaxis(steps, axis, 0)
                rows[0][:-1] -= rows[1]
                rows[0][1:] += rows[1]
        powers[middle] = 0.0
        return powers

    @property
    def taper(self) -> Real:
        """Factor by which screens fade towards the edges: (ny or 1, nx or 1)."""
        return np.outer(*(np.ones(1) if t is None else t for t in self.tapers))

    @property
    def _pixels(self) -> tuple[float, float]:
        """µm along y and x."""
        dx, dy = self.scans[0].pixel_size
        return dy, dx


def _pairs(along_y: _Axis, along_x: _Axis) -> float:
    """Sum the share in common over all pairs of windows of a scan, with itself too (Welch 1967).

    For independent windows it is their number.
    """
    corners = window_corners(range(len(along_y.starts)), range(len(along_x.starts)))
    taken = np.zeros((len(along_y.starts), len(along_x.starts)))
    taken[tuple(np.transpose(corners))] = 1.0
    shares = (np.concatenate([a[:0:-1], a]) for a in (along_y.alike(), along_x.alike()))
    if taken.size == 1:
        return 1.0
    both = scipy.signal.fftconvolve(taken, np.outer(*shares), mode="same")
    return float((taken * both).sum())


def _scatter(last: tuple[int, int], kappa: float, lobe: Sequence[float], windows: Screens) -> Real:
    """Sums over windows of what look-ups find in them, and of its square, (2, ny, nx)."""
    sums: Real = np.zeros(2)[:, None, None]
    for n in range(len(windows)):
        power = np.abs(windows.spectrum(n, last).of_phase(kappa)) ** 2
        power = scipy.ndimage.gaussian_filter(power.astype(np.float64), lobe, mode="constant")
        sums = sums + np.stack([power, power**2])
    return sums
