"""Orthographic projection of the view directions of a map.

A direction (θ, φ) lies at x = sinθ cosφ, y = sinθ sinφ, the normal in the middle. Area in the map
is solid angle times cosθ, dx dy = cosθ dω: the mean of a map of f over the square [−1, 1]², times
4, is the directional albedo.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import DiffractionError
from ...plugin.memory import upload

SMALLEST, LARGEST = 8, 4096
MOST_SAMPLES = 1024

# Least and largest number of samples per pixel that is chosen automatically; 64 take a minute.
_AUTOMATIC_SAMPLES = (4, 64)


def polar(theta: ArrayLike, phi: ArrayLike) -> NDArray[np.float64]:
    """Return unit vectors (..., 3) of angles in rad from the normal, and from x towards y."""
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def vectors(directions: NDArray[np.float64]) -> Any:
    """Return directions (n, 3) as mi.Vector3f."""
    return mi.Vector3f(*(upload(mi.Float, column.astype(np.float32)) for column in directions.T))


def flat_interaction(wi: Any, count: int) -> Any:
    """Return points of a flat surface in air, with one or `count` ωi (mi.Vector3f)."""
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.n = mi.Normal3f(0.0, 0.0, 1.0)
    si.sh_frame = mi.Frame3f(si.n)
    si.wi = wi
    return si


def check_pixels(resolution: int, samples: int | None) -> None:
    """Refuse numbers of pixels, and of samples in a pixel, that are out of range."""
    if not SMALLEST <= resolution <= LARGEST:
        raise DiffractionError(
            f"resolution={resolution} must be from {SMALLEST} to {LARGEST} pixels"
        )
    if samples is not None and not 1 <= samples <= MOST_SAMPLES:
        raise DiffractionError(f"samples={samples} must be from 1 to {MOST_SAMPLES} in a pixel")


def corners(resolution: int) -> NDArray[np.float64]:
    """Return the lower corner of each pixel along an axis, (resolution,), from −1 on."""
    return np.arange(resolution, dtype=np.float64) * (2.0 / resolution) - 1.0


def inside(resolution: int) -> NDArray[np.bool_]:
    """Return the pixels (y, x) that the hemisphere touches, as a mask."""
    low = corners(resolution)
    high = low + 2.0 / resolution
    nearest = np.where(low > 0.0, low, np.where(high < 0.0, high, 0.0))
    return nearest[:, None] ** 2 + nearest[None, :] ** 2 < 1.0


@functools.cache
def sub_samples(samples: int) -> NDArray[np.float64]:
    """Return the positions of samples in each pixel and band, (samples, 3) from 0 to 1.

    Columns are x, y and wavelength; each has the middles of `samples` equal parts once, so that no
    column is biased. The pattern repeats in every pixel, so all samples are one lattice over the
    whole map, which integrates a smooth lobe without noise and more accurately than random
    positions. It is the rank-1 lattice (Korobov 1959) whose closest neighbours are farthest apart,
    first in x and y, then with the wavelength.
    """
    steps = np.arange(samples, dtype=np.int64)
    multiples = steps[:, None] * steps % samples  # row a: multiples of the generator a
    coprime = steps[np.gcd(steps, samples) == 1] if samples > 1 else steps
    columns = [steps]
    apart = _wrapped(steps, samples) ** 2.0
    for _ in ("y", "wavelength"):
        candidates = multiples[coprime]
        distances = apart + _wrapped(candidates, samples) ** 2.0
        best = distances[:, 1:].min(axis=1, initial=np.inf).argmax()
        apart = distances[best]
        columns.append(candidates[best])
    result = (np.stack(columns, axis=1) + 0.5) / samples
    result.setflags(write=False)
    return result


def samples_for(resolution: int, lobe: float) -> int:
    """Return the number of samples per pixel that resolves every lobe.

    Parameters
    ----------
    resolution : pixels along an axis.
    lobe : standard deviation of the narrowest lobe in x and y.
    """
    fewest, most = _AUTOMATIC_SAMPLES
    pixel = 2.0 / resolution
    # a lattice with steps of √2 standard deviations sums a Gaussian within about 1e-4
    return min(max(math.ceil(0.5 * (pixel / lobe) ** 2), fewest), most)


def _wrapped(steps: NDArray[np.int64], period: int) -> NDArray[np.int64]:
    """Return the distance to the nearest multiple of the period."""
    return np.minimum(steps, period - steps)
