"""A patch of surface: heights on a regular grid, in µm."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ..arrays import Real
from ..errors import DiffractionError, quoted
from ..limits import MOST_PIXELS
from .lengths import LONGEST_HEIGHT, PixelSize, pixel_size_of

#: Statistics of fields with more than LARGE pixels are summed over blocks of ROWS rows.
LARGE, ROWS = 2**25, 256


@dataclass(frozen=True, init=False, eq=False, repr=False)
class HeightField:
    """Heights of one patch of surface, which tiles the plane.

    Raises a DiffractionError if the heights are not a two-dimensional array of finite real numbers,
    too small or too large, or the pixel size is not one or two positive lengths.

    Parameters
    ----------
    heights
        Heights in µm, shape (ny, nx), at least 2 × 2, finite. `heights[iy, ix]` lies at
        x = ix·dx, y = iy·dy. They are copied, and read-only afterwards. Only differences of height
        matter: where a constant offset takes heights beyond 10 mm, their mean is subtracted.
    pixel_size
        µm, one number for square pixels or a pair (dx, dy); "0.05" and "0.05, 0.1" also work.
    name
        Name of the patch in messages, for instance its file.
    history
        One line per treatment of the heights (levelling, filling, ...), oldest first.
    cut_out
        Whether the patch is a part of a larger surface, as a scan or a cropped patch is: opposite
        edges need not meet, and `validity` warns if they do not.
    periodic
        Whether the patch is whole periods of a surface that repeats exactly, as a grating by a
        formula. Any other patch limits the coherence width (`heights.coherence`).
    stated
        Lengths whose units the file states, "pixel_size" and "heights": `validity` does not ask
        about them.
    """

    heights: Real
    pixel_size: tuple[float, float]
    name: str = field(default="height field", kw_only=True)
    history: tuple[str, ...] = field(default=(), kw_only=True)
    cut_out: bool = field(default=False, kw_only=True)
    periodic: bool = field(default=False, kw_only=True)
    stated: tuple[str, ...] = field(default=(), kw_only=True)

    # The package `heights` sets these: their modules import this class.
    load: ClassVar[Callable[..., HeightField]]  #: `source.load`: read a file
    treated: ClassVar[Callable[..., HeightField]]  #: `source.treated`: apply treatments
    validity: ClassVar[Callable[..., list[str]]]  #: `validity.validity`: warn of the model's limits

    def __init__(
        self,
        heights: npt.ArrayLike,
        pixel_size: PixelSize,
        *,
        name: str = "height field",
        history: Iterable[str] = (),
        cut_out: bool = False,
        periodic: bool = False,
        stated: Iterable[str] = (),
    ) -> None:
        size = pixel_size_of(pixel_size, f"{name}: pixel_size")
        if size is None:
            raise DiffractionError(
                f"{name}: pixel_size is missing; give the distance between samples in µm, "
                "one number or (dx, dy)"
            )
        for flag, value in (("cut_out", cut_out), ("periodic", periodic)):
            if not isinstance(value, bool | np.bool_):  # "open" would be true
                raise DiffractionError(f"{name}: {flag}={quoted(value)} must be True or False")
        checked, offset = _checked_heights(heights, name)
        if offset:
            history = (*history, f"a constant offset of {offset:.6g} µm was subtracted")
        vars(self).update(
            heights=checked,
            pixel_size=size,
            name=" ".join(str(name).split()),
            history=tuple(history),
            cut_out=bool(cut_out),
            periodic=bool(periodic),
            stated=tuple(stated),
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of samples (ny, nx)."""
        ny, nx = self.heights.shape
        return ny, nx

    @property
    def extent(self) -> tuple[float, float]:
        """Size (Lx, Ly) of the patch in µm: the periods of the tiling."""
        ny, nx = self.shape
        dx, dy = self.pixel_size
        return nx * dx, ny * dy

    @cached_property
    def range(self) -> float:
        """Highest minus lowest point, µm."""
        return float(self.heights.max() - self.heights.min())

    @cached_property
    def rms_height(self) -> float:
        """Root-mean-square deviation from the mean height, µm."""
        mean = float(self.heights.mean())
        total = sum(float(np.square(rows - mean).sum()) for rows in blocks(self.heights))
        return math.sqrt(total / self.heights.size)

    @cached_property
    def rms_slope(self) -> float:
        """Root-mean-square of |∇h|, dimensionless, from differences of neighbouring samples.

        Steps at the seams between tiles are left out: they are not part of the surface.
        """
        squares = (
            sum(
                float(np.vdot(steps := np.diff(rows, axis=axis), steps))
                for rows in blocks(self.heights, 1 - axis)
            )
            for axis in (1, 0)
        )
        (ny, nx), (dx, dy), (along_x, along_y) = self.shape, self.pixel_size, squares
        return math.sqrt(along_x / (ny * (nx - 1)) / dx**2 + along_y / ((ny - 1) * nx) / dy**2)

    def varies_along(self, axis: int) -> bool:
        """Return whether any height changes along y (axis 0) or x (axis 1)."""
        first = self.heights[0]
        return any(
            bool(np.any(rows != (first if axis == 0 else rows[:, :1])))
            for rows in blocks(self.heights)
        )

    def changed(self, heights: npt.ArrayLike, line: str, **flags: bool) -> HeightField:
        """Return the patch with other heights on the same pixels and `line` added to `history`.

        flags : `cut_out` and `periodic`, if they change.
        """
        changes: dict[str, Any] = {"heights": heights, "history": (*self.history, line), **flags}
        return replace(self, **changes)

    def stretched(self, factor: float) -> HeightField:
        """Return the patch with its lengths in the plane, but not its heights, times a factor."""
        if factor == 1.0:
            return self
        line = f"stretched in its plane by {factor:g}"
        size = (self.pixel_size[0] * factor, self.pixel_size[1] * factor)
        return replace(self, pixel_size=size, history=(*self.history, line))

    @cached_property
    def _digest(self) -> str:
        flags = [name for name in ("periodic", "cut_out") if getattr(self, name)]
        shape = (self.shape, self.pixel_size, *flags)
        content = hashlib.sha256(repr(shape).encode())
        content.update(np.ascontiguousarray(self.heights, dtype="<f8").data)
        return content.hexdigest()

    def digest(self) -> str:
        """Return the SHA-256 of shape, pixel size, flags and heights in hexadecimal."""
        return self._digest

    def summary(self) -> dict[str, Any]:
        """Return name, size, statistics and history as plain numbers and strings; lengths in µm."""
        return {
            "name": self.name,
            "shape": list(self.shape),
            "pixel_size": list(self.pixel_size),
            "extent": list(self.extent),
            "range": self.range,
            "rms_height": self.rms_height,
            "rms_slope": self.rms_slope,
            "history": list(self.history),
        }

    def __repr__(self) -> str:
        ny, nx = self.shape
        dx, dy = self.pixel_size
        return (
            f"HeightField({self.name!r}, {nx} x {ny} pixels of {dx:.4g} x {dy:.4g} µm, "
            f"range {self.range:.4g} µm, RMS height {self.rms_height:.4g} µm, "
            f"RMS slope {self.rms_slope:.3g})"
        )


def check_pixel_count(ny: int, nx: int, name: str) -> None:
    """Refuse a shape that is too small or too large, before memory is allocated for it."""
    if ny < 2 or nx < 2:
        raise DiffractionError(f"{name}: {nx} x {ny} pixels are too few; at least 2 x 2 are needed")
    if ny * nx > MOST_PIXELS:
        raise DiffractionError(
            f"{name}: {nx} x {ny} pixels are more than the {MOST_PIXELS} that are supported "
            f"(about {math.isqrt(MOST_PIXELS)}²); crop the file or use coarser pixels"
        )


def _checked_heights(heights: npt.ArrayLike, name: str) -> tuple[Real, float]:
    """Check heights and copy them to a read-only C-ordered float64 array, unless they are one.

    Returns
    -------
    Real, float
        The heights, and the constant offset that was subtracted from them, µm.
    """
    if np.ma.isMaskedArray(heights) and np.ma.is_masked(heights):
        raise DiffractionError(f"{name}: heights have masked points; fill them first")
    try:
        array = np.asarray(heights)
    except ValueError as error:  # rows of different lengths
        raise DiffractionError(f"{name}: heights are not an array (ny, nx) of numbers") from error
    if array.dtype.kind not in "fiu":
        raise DiffractionError(
            f"{name}: heights are {array.dtype.name}, expected real numbers in µm"
        )
    if array.ndim != 2:
        raise DiffractionError(
            f"{name}: heights have shape {array.shape}, expected two dimensions (ny, nx)"
        )
    ny, nx = array.shape
    check_pixel_count(ny, nx, name)
    immutable = array is heights and array.base is None and not array.flags.writeable
    if not (immutable and array.dtype == np.float64 and array.flags.c_contiguous):
        array = np.array(array, dtype=np.float64, order="C")
        array.setflags(write=False)
    low, high = float(array.min()), float(array.max())  # NaN if any height is
    if not (math.isfinite(low) and math.isfinite(high)):
        if not np.isfinite(array).any():
            raise DiffractionError(f"{name}: no height is a finite number; the patch is empty")
        raise DiffractionError(
            f"{name}: {np.count_nonzero(np.isnan(array))} of {array.size} heights are NaN and "
            f"{np.count_nonzero(np.isinf(array))} infinite; fill or crop them"
        )
    if high - low > LONGEST_HEIGHT:
        raise DiffractionError(
            f"{name}: heights span {high - low:.3g} µm, at most {LONGEST_HEIGHT:g} is supported; "
            "heights are in µm"
        )
    if max(abs(low), abs(high)) <= LONGEST_HEIGHT:
        return array, 0.0
    offset = float(array.mean())
    array = array - offset
    array.setflags(write=False)
    return array, offset


def blocks(heights: Real, overlap: int = 0) -> Iterator[Real]:
    """Yield `ROWS` rows of large heights at a time, and `overlap` of the next ones; else all."""
    rows = len(heights) if heights.size <= LARGE else ROWS
    for start in range(0, len(heights), rows):
        yield heights[start : start + rows + overlap]
