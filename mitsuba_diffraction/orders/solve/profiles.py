"""Profiles of gratings: one period as a polygon across the grooves."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Real
from ...columns import read_columns
from ...errors import DiffractionError, check_choice, counted, quoted, warn
from ...files import FileKind, kind_of
from ...heights.lengths import micrometres_of, number_between

#: Vertices of a sinusoid: their secants are within 1e-4 of the depth.
_SINUSOID = 256
#: Angle between sides from which on a vertex counts as a corner, degrees; gratinglab's.
CORNER = 10.0
#: Vertices of a profile at most: a measured line has some thousands.
MOST_VERTICES = 10_000
# Angle between sides from which on they lie on each other, degrees.
_FOLDED = 179.9
# Difference of the ends of a measured line, over its depth, from which on it is no period.
_STEP = 0.01


@dataclass(frozen=True, eq=False)
class Profile:
    """Cross-section of one period of the grooves, an open polygon.

    It continues at (x[0] + period, z[0]), and the material lies below it. Undercut profiles, whose
    x turns back, are allowed.

    Raises a DiffractionError if there are fewer than two vertices, a number is not finite, the
    polygon does not fit into the period, crosses itself, or turns back on itself.

    Attributes
    ----------
    x, z : (n,) µm, from left to right; x begins at 0 or above and ends at `period` at most. Points
        beyond, of ridges that lean over the next period, are shifted by `_begun_elsewhere`.
    period : µm.
    name : for people.
    """

    x: Real
    z: Real
    period: float
    name: str = "profile"

    def __post_init__(self) -> None:
        number_between(self.period, f"{self.name}: period", 0.01, 1e3, " µm")
        x, z = (np.asarray(values, np.float64) for values in (self.x, self.z))
        if x.ndim != 1 or x.shape != z.shape or not 2 <= len(x) <= MOST_VERTICES:
            raise DiffractionError(
                f"{self.name}: expected 2 to {MOST_VERTICES} pairs (x, z), got x {x.shape}, "
                f"z {z.shape}"
            )
        if not (np.isfinite(x).all() and np.isfinite(z).all()):
            raise DiffractionError(f"{self.name}: all x and z must be finite numbers")
        slack = 1e-6 * self.period
        if (x.min() < -slack or x.max() > self.period + slack) and np.ptp(x) < 2.0 * self.period:
            x, z = _begun_elsewhere(x, z, self.period)
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "z", z)
        if x.min() < -slack or x.max() > self.period + slack:
            raise DiffractionError(
                f"{self.name}: x runs from {x.min():g} to {x.max():g} µm, but one period is 0 to "
                f"{self.period:g} µm; give one period, in µm, or the right length of the period"
            )
        if (np.abs(self._turns()) > _FOLDED).any():
            raise DiffractionError(
                f"{self.name}: the line turns back on itself; leave out its spikes"
            )
        if self._crosses_itself():
            raise DiffractionError(
                f"{self.name}: the line crosses itself; list its points from left to right"
            )

    def __repr__(self) -> str:
        return self.name

    @property
    def closed(self) -> tuple[Real, Real]:
        """Vertices (n + 1,) with the first one of the next period."""
        return np.append(self.x, self.x[0] + self.period), np.append(self.z, self.z[0])

    @property
    def length(self) -> float:
        """Length of the line over one period, µm."""
        x, z = self.closed
        return float(np.hypot(np.diff(x), np.diff(z)).sum())

    @property
    def depth(self) -> float:
        """Height of the highest over the lowest point, µm."""
        return float(np.ptp(self.z))

    @property
    def is_lamellar(self) -> bool:
        """Whether all sides are level or vertical, from left to right."""
        x, z = (np.diff(values) for values in self.closed)
        return bool(((x == 0) | (z == 0)).all() and (x >= 0).all())

    @property
    def corners(self) -> int:
        """Number of vertices that turn by more than `CORNER` degrees."""
        return int((np.abs(self._turns()) > CORNER).sum())

    def _turns(self) -> Real:
        """Angles between sides, degrees; points that are listed twice make no side."""
        x, z = (np.diff(values) for values in self.closed)
        angles = np.arctan2(z, x)[(x != 0) | (z != 0)]
        return np.asarray(np.degrees(np.angle(np.exp(1j * np.diff(angles, append=angles[:1])))))

    def _crosses_itself(self) -> bool:
        """Whether two sides cross; a line whose x never turns back cannot."""
        x, z = self.closed
        if (np.diff(x) >= 0).all():
            return False
        # a ridge may lean into the next period
        x, z = np.append(x, x[1:] + self.period), np.append(z, z[1:])
        if len(self.x) > 1000:  # n² pairs; gratinglab would take hours
            raise DiffractionError(
                f"{self.name}: an undercut line may have 1000 points, this one has {len(self.x)}"
            )
        start = np.stack([x[:-1], z[:-1]], axis=-1)
        end = np.stack([x[1:], z[1:]], axis=-1)

        def side(a: Real, b: Real, c: Real) -> Real:
            u, v = b - a, c - a
            return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

        a, b, c, d = start[:, None], end[:, None], start[None], end[None]
        crossing = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
        return bool(crossing.any())


@dataclass(frozen=True, eq=False)
class UnitCell:
    """Period of the heights of a crossed grating, in x and y.

    Raises a DiffractionError if a period is out of its range.

    Attributes
    ----------
    heights : (rows, columns) µm, rows along y; the material lies below.
    periods : along x and y, µm.
    """

    heights: Real
    periods: tuple[float, float]

    def __post_init__(self) -> None:
        for period in self.periods:
            number_between(period, "crossed grating: period", 0.01, 1e3, " µm")

    @property
    def name(self) -> str:
        """Name for people."""
        return f"crossed, {self.depth:.3g} µm deep"

    @property
    def period(self) -> float:
        """The longer period, µm."""
        return max(self.periods)

    @property
    def depth(self) -> float:
        """Height of the highest over the lowest point, µm."""
        return float(np.ptp(self.heights))


def lamellar(period: float, depth: float, duty: float = 0.5) -> Profile:
    """Rectangular grooves between ridges of width duty·period, at x = 0 to duty·period; µm."""
    width = period * number_between(duty, "lamellar: duty", 0.01, 0.99)
    depth = _depth("lamellar", depth)
    name = f"lamellar {period:g}/{depth:g} µm, duty {duty:g}"
    return Profile(
        np.array([0, width, width, period]), depth * np.array([1, 1, 0, 0]), period, name
    )


def blazed(period: float, depth: float, direction: str = "descending") -> Profile:
    """Sawtooth that descends (or ascends) towards +x, with a vertical step back; µm."""
    check_choice("blazed: direction", direction, ("descending", "ascending"))
    ends = [1, 0] if direction == "descending" else [0, 1]
    name = f"blazed {period:g}/{_depth('blazed', depth):g} µm, {direction}"
    return Profile(np.array([0, period]), depth * np.array(ends, float), period, name)


def sinusoidal(period: float, depth: float) -> Profile:
    """Sinusoid of height depth/2·(1 + cos(2πx/period)); µm."""
    phase = np.arange(_SINUSOID) / _SINUSOID
    name = f"sinusoidal {period:g}/{_depth('sinusoidal', depth):g} µm"
    return Profile(phase * period, 0.5 * depth * (1 + np.cos(2 * np.pi * phase)), period, name)


#: Generators by name, as in `heights.gratings`.
GENERATORS: dict[str, Callable[..., Profile]] = {
    "blazed": blazed, "lamellar": lamellar, "sinusoidal": sinusoidal,
}  # fmt: skip


def read_profile(path: str | os.PathLike[str], period: float) -> Profile:
    """Read a line: two columns x and z in µm, or in the units and order that a header line names.

    Raises a DiffractionError if the file cannot be read, a line has no two numbers, or the line is
    no `Profile`, or x leaves a wider gap in the period than between any of its points.
    """
    if (kind := kind_of(path)) in (FileKind.IMAGE, FileKind.EXR, FileKind.NPY, FileKind.JPEG):
        raise DiffractionError(
            f"'{path}' ({kind}): profiles are one-dimensional, one period of a line, CSV of x, z "
            "in µm; crossed gratings: one period of heights, with --crossed"
        )
    what = "two columns x, z in µm ('solve --import', or read_orders, reads efficiencies)"
    table = read_columns(path)
    if not len(table.numbers):
        raise DiffractionError(f"'{path}' has no points; expected {what}")
    if table.numbers.shape[1] != 2:
        raise DiffractionError(
            f"'{path}', line {table.lines[0]}: {counted(table.numbers.shape[1], 'number')}; "
            f"expected {what}"
        )
    factors = [micrometres_of(unit) if unit else 1.0 for unit in table.units]
    if None in factors:
        unit = table.units[factors.index(None)]
        raise DiffractionError(f"'{path}': {quoted(unit)} is not a unit of length; expected µm, nm")
    lengths = table.finite((0, 1), what) * np.array(factors, np.float64)
    x, z = lengths[:, table.order("x")].T
    x = x - x.min()
    # the side that closes the period may be as long as the longest listed one; a line sampled
    # over a nominal period may lack a point more
    longest = np.abs(np.diff(x)).max(initial=0.0)
    widest = max(longest, min(2.0 * longest, 0.1 * period)) + 1e-6 * period
    if len(x) > 2 and period - x.max() > widest:
        raise DiffractionError(
            f"'{path}': x covers {x.max():g} µm of a period of {period:g} µm; give one whole "
            "period, in µm, with the point that ends it, or the right length of the period"
        )
    # the end of a period is the beginning of the next
    if len(x) > 2 and abs(x[-1] - period) < 1e-6 * period and abs(z[-1] - z[0]) < 1e-6 * period:
        x, z = x[:-1], z[:-1]
    profile = Profile(x, z, period, f"'{os.fspath(path)}'")
    step = abs(z[-1] - z[0])
    if len(x) > 2 and x[-1] > (1.0 - 1e-6) * period and step > _STEP * profile.depth:
        warn(
            f"'{path}': the line ends {step:g} µm {'above' if z[-1] > z[0] else 'below'} its "
            "beginning, where a vertical wall joins the periods; level the line if there is none"
        )
    return profile


def polygon(points: ArrayLike, period: float) -> Profile:
    """Return the profile of points (n, 2), x and z in µm."""
    array = np.asarray(points, np.float64)
    if array.ndim != 2 or array.shape[1] != 2:
        raise DiffractionError(f"profile: expected points (n, 2), x and z in µm, got {array.shape}")
    return Profile(array[:, 0], array[:, 1], period, f"polygon of {len(array)} points")


def _begun_elsewhere(x: Real, z: Real, period: float) -> tuple[Real, Real]:
    """Begin a periodic line at the point from which it keeps within a period, moved to x ≥ 0.

    It stays as it is if no point is such: then one period is not all that it covers.
    """
    for first in range(1, len(x)):
        begun = np.append(x[first:], x[:first] + period)
        if np.ptp(begun) <= period:
            return begun - begun.min(), np.append(z[first:], z[:first])
    return x, z


def _depth(name: str, depth: float) -> float:
    return number_between(depth, f"{name}: depth", 0, 100, " µm")
