"""Ideal gratings, whose orders have powers in closed form.

With φ = κ·depth, the power of order m (light turned towards +x for m > 0) is

- sinusoidal: J_m²(φ/2), the Jacobi–Anger expansion;
- lamellar, half high: cos²(φ/2) at m = 0, 4/(πm)²·sin²(φ/2) at odd m, nothing at even m;
- blazed: sinc²(m − φ/2π) descending towards +x, sinc²(m + φ/2π) ascending

(Goodman, Introduction to Fourier Optics, section 4.4, for the phase gratings exp(iφ(x))).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from ...errors import DiffractionError, check_choice
from ...limits import MOST_PIXELS
from ...settings import USUAL_WIDTH
from ..field import HeightField, check_pixel_count
from ..lengths import count_between, number_between, pixel_size_of

Axis = Literal["x", "y"]


def sinusoidal(
    period: float,
    depth: float,
    *,
    axis: Axis = "x",
    periods: int | None = None,
    pixels_per_period: int = 32,
    rows: int | None = None,
) -> HeightField:
    """Generate a sinusoidal grating of height depth/2·(1 + cos(2πx/period)).

    Raises a DiffractionError if a length is not positive, a count not a whole number, or the patch
    too large.

    Parameters
    ----------
    period
        Distance between grooves, µm.
    depth
        Peak to valley, µm; the amplitude h₀ of the closed form J_m²(κh₀) is half the depth.
    axis
        Direction along which the height changes.
    periods
        Number of periods in the patch; by default the width is as close as possible to 65 µm.
    pixels_per_period
        Samples per period; pixels are square.
    rows
        Samples along the grooves; by default the patch is square.
    """
    n = count_between(pixels_per_period, "sinusoidal: pixels_per_period", 2, 65536)
    profile = 0.5 + 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    return _grating("sinusoidal", profile, period, depth, axis, periods, rows)


def blazed(
    period: float,
    depth: float,
    *,
    direction: Literal["descending", "ascending"] = "descending",
    axis: Axis = "x",
    periods: int | None = None,
    pixels_per_period: int = 64,
    rows: int | None = None,
) -> HeightField:
    """Generate a sawtooth grating that descends (or ascends) towards +x, or +y with `axis="y"`.

    The n-th of N samples is depth·n/N high, not depth·n/(N − 1): the step back spans one pixel,
    too, so the slope is depth/period. Parameters and errors as in `sinusoidal`; `depth` is the
    height of the ideal tooth, of which (N − 1)/N is sampled.
    """
    n = count_between(pixels_per_period, "blazed: pixels_per_period", 2, 65536)
    check_choice("blazed: direction", direction, ("descending", "ascending"))
    profile = np.arange(n) / n
    if direction == "descending":
        profile = profile[::-1]
    return _grating("blazed", profile, period, depth, axis, periods, rows)


def lamellar(
    period: float,
    depth: float,
    *,
    duty: float = 0.5,
    axis: Axis = "x",
    periods: int | None = None,
    pixels_per_period: int = 64,
    rows: int | None = None,
) -> HeightField:
    """Generate a rectangular grating: ridges of width duty·period, in whole pixels, and `depth`.

    Parameters and errors as in `sinusoidal`; `duty` must leave at least one pixel high and one low.
    """
    n = count_between(pixels_per_period, "lamellar: pixels_per_period", 2, 65536)
    high = round(number_between(duty, "lamellar: duty", 0, 1) * n)
    if not 1 <= high <= n - 1:
        raise DiffractionError(
            f"lamellar: duty: expected a fraction between 0 and 1 that leaves a pixel of each "
            f"height among {n}, got {duty!r}"
        )
    profile = (np.arange(n) < high).astype(np.float64)
    return _grating("lamellar", profile, period, depth, axis, periods, rows)


def _grating(
    kind: str,
    profile: npt.NDArray[np.float64],
    period: float,
    depth: float,
    axis: str,
    periods: int | None,
    rows: int | None,
) -> HeightField:
    """Repeat the `profile` (N,) of one period, 0 to 1, along `axis` and scale it to `depth`."""
    length = number_between(period, f"{kind}: period", 1e-3, 1e4, " µm")
    height = number_between(depth, f"{kind}: depth", 0, 1e3, " µm")
    check_choice(f"{kind}: axis", axis, ("x", "y"))
    pixel = pixel_size_of(length / profile.size, f"{kind}: pixel size (period/pixels_per_period)")
    assert pixel is not None  # a number never means "auto"
    if periods is None:
        periods = max(1, round(USUAL_WIDTH / length))
    along = count_between(periods, f"{kind}: periods", 1, MOST_PIXELS) * profile.size
    across = along if rows is None else count_between(rows, f"{kind}: rows", 2, MOST_PIXELS)
    name = f"{kind} grating"
    check_pixel_count(across, along, name)
    line = height * np.tile(profile, along // profile.size)
    heights = np.broadcast_to(line, (across, along))
    heights = heights if axis == "x" else heights.T
    return HeightField(heights, pixel, name=name, periodic=True)
