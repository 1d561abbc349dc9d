"""Cropping, and whether what was cut out of a surface may tile the plane: tilt and seams."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...errors import DiffractionError
from ..field import LARGE, ROWS, HeightField
from .levelling import level_plane, plane_of

FloatArray = npt.NDArray[np.float64]

#: A plane that rises by λ/8 tilts the reflected wave by λ/4, Rayleigh's limit of what can be left
#: alone: a flat patch then sends 19 % of its mirror light, 1 − sinc²(1/4), into other orders.
QUARTER_WAVE = 8.0
#: Below this share of the RMS height a best plane is what any rough patch has by chance.
CHANCE = 0.5
#: What levelling leaves of a ramp in 8-bit grey is 0.4 % of its RMS height: a patch of which no
#: more is left is one facet, a whole period of a blazed grating, and its seams are the steps.
FACET = 0.01
#: An edge of the surface's own, as gratings have, is found inside the patch, too.
OWN_STEP = 2.0
#: Share of the mean-square slope from which on seams are said. For gentle heights it is their share
#: of the light outside the mirror direction, weighted with the square of the angle's sine.
SEAM_SHARE = 0.1


@dataclass(frozen=True)
class _Seam:
    """Steps along one axis, µm: RMS over the seam, and the largest RMS over a line inside.

    `rise` is the mean of last minus first; `slope` and `inside` are sums of squared slopes over
    the seam and between neighbours.
    """

    step: float
    largest: float
    rise: float
    slope: float
    inside: float

    @property
    def foreign(self) -> bool:
        """Whether the surface has no such step inside."""
        return self.step > OWN_STEP * self.largest


def edge_lines(field: HeightField, shortest: float) -> list[str]:
    """What to say of a patch whose opposite edges need not meet: tilt, then the seams that stay.

    Parameters
    ----------
    field : the patch.
    shortest : shortest wavelength, µm.

    Returns
    -------
    list of str
        At most one line on the tilt and one on the seams.
    """
    if field.range == 0:
        return []
    level = level_plane(field)
    if level.rms_height < FACET * field.rms_height:
        return []
    lines = []
    judged, once = field, ""
    if _tilted(field, level, shortest):
        slope_x, slope_y = plane_of(field)
        turn = math.degrees(2 * math.atan(math.hypot(slope_x, slope_y)))
        lines.append(
            f"{field.name}: not levelled: the best plane rises {plane_rise(field):.3g} µm across "
            f"the patch and turns the mirror direction by {turn:.2g}°; try level=plane "
            "(--level plane)"
        )
        judged, once = level, " even once levelled"
    seams = _seams(judged)
    foreign = [seam for seam in seams if seam.foreign]
    slope = sum(seam.slope for seam in foreign)
    inside = sum(seam.inside for seam in seams)
    if slope > SEAM_SHARE * (slope + inside):
        worst = max(foreign, key=lambda seam: seam.slope)
        share = slope / (slope + inside)
        times = f"{worst.step / worst.largest:.2g} times" if worst.largest > 0 else "unlike"
        lines.append(
            f"{field.name}: opposite edges differ by {worst.step:.3g} µm RMS{once}, {times} the "
            f"largest step between neighbours inside: the patch tiles the surface, and its seams, "
            f"{share:.0%} of the mean-square slope, diffract as a grating of their own; try "
            "periodic=smooth (--periodic smooth)"
        )
    return lines


def plane_rise(field: HeightField) -> float:
    """How much the best plane rises across the patch, µm."""
    slope_x, slope_y = plane_of(field)
    return math.hypot(slope_x * field.extent[0], slope_y * field.extent[1])


def seam_share(field: HeightField) -> float:
    """Share of the mean-square slope, seams included, that the steps at the seams are.

    A patch that fits itself has about (1/nx + 1/ny)/2, a flat one 0.
    """
    seams = _seams(field)
    slope, inside = (sum(getattr(s, name) for s in seams) for name in ("slope", "inside"))
    return float(slope / (slope + inside)) if slope > 0 else 0.0


def _tilted(field: HeightField, level: HeightField, shortest: float) -> bool:
    """Whether the best plane is a tilt that matters, along one axis at least.

    A tilt raises one edge over the opposite one by what it rises. The plane that fits a few
    periods of a grating does not: their edges meet, or differ by a step as inside.
    """
    least = max(shortest / QUARTER_WAVE, CHANCE * level.rms_height)
    for slope, length, seam in zip(plane_of(field), field.extent, _seams(field), strict=True):
        rise = slope * length
        if abs(rise) > least and abs(seam.rise - rise) < 0.5 * abs(seam.rise) and seam.foreign:
            return True
    return False


def _seams(field: HeightField) -> tuple[_Seam, _Seam]:
    """The seams across which x goes on, and y."""
    dx, dy = field.pixel_size
    return _seam(field.heights.T, dx), _seam(field.heights, dy)


def _seam(h: FloatArray, pixel: float) -> _Seam:
    """The seam between the last and the first row."""
    rows = len(h) if h.size <= LARGE else ROWS
    within = np.concatenate(
        [
            np.mean(np.diff(h[start : start + rows + 1], axis=0) ** 2, axis=1)
            for start in range(0, len(h) - 1, rows)
        ]
    )
    across = float(np.mean((h[-1] - h[0]) ** 2))
    lines = h.shape[1] / pixel**2
    return _Seam(
        step=math.sqrt(across),
        largest=math.sqrt(float(within.max())),
        rise=float(np.mean(h[-1] - h[0])),
        slope=across * lines,
        inside=float(within.sum()) * lines,
    )


Size = tuple[float, float]


def middle(shape: tuple[int, int], pixel_size: Size, size: Size, name: str) -> tuple[slice, slice]:
    """Rows and columns of the middle of a patch.

    Parameters
    ----------
    shape : (ny, nx).
    pixel_size : (dx, dy), µm.
    size : (width, height) that is wanted, µm, met to half a pixel.
    name : what to call the patch in errors.

    Raises
    ------
    DiffractionError
        If that is more than there is, or less than two pixels.
    """
    slices = []
    for count, pixel, length in zip(shape, pixel_size[::-1], size[::-1], strict=True):
        kept = round(length / pixel)
        if not 2 <= kept <= count:
            (ny, nx), (dx, dy) = shape, pixel_size
            raise DiffractionError(
                f"{name}: crop to {size[0]:g} x {size[1]:g} µm is "
                f"{'larger than the patch' if kept > count else 'less than two pixels'}: it is "
                f"{nx * dx:.4g} x {ny * dy:.4g} µm with pixels of {dx:.4g} x {dy:.4g} µm"
            )
        start = (count - kept) // 2
        slices.append(slice(start, start + kept))
    return slices[0], slices[1]


def crop_line(before: tuple[int, int], after: tuple[int, int], pixel_size: Size) -> str:
    """What to say of a crop between shapes (ny, nx)."""
    (dx, dy), (ny, nx) = pixel_size, after
    return (
        f"cropped to the middle {nx * dx:.4g} x {ny * dy:.4g} µm of "
        f"{before[1] * dx:.4g} x {before[0] * dy:.4g} µm ({nx} x {ny} of "
        f"{before[1]} x {before[0]} pixels)"
    )


def crop(field: HeightField, size: Size) -> HeightField:
    """The central region of `size` = (width, height) in µm; its edges need not meet any more.

    Raises
    ------
    DiffractionError
        If that is more than there is, or less than two pixels.
    """
    rows, columns = middle(field.shape, field.pixel_size, size, field.name)
    heights = field.heights[rows, columns]
    if heights.shape == field.shape:
        return field
    line = crop_line(field.shape, (heights.shape[0], heights.shape[1]), field.pixel_size)
    return field.changed(heights, line, cut_out=True)
