"""Power spectra of height fields and of the light that they reflect.

Frequencies are in 1/µm along x and y, as `numpy.fft.fftfreq` gives them; arrays of spectra have
frequency (0, 0) in the middle (`numpy.fft.fftshift`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, map_coordinates

from .field import HeightField

FloatArray = npt.NDArray[np.float64]

#: Least ratio of a grating's peak to the median of all directions at its frequency, and to that of
#: lower frequencies in its direction. Rough surfaces reach 20 by chance, snakes' fingers 1e4.
CONTRAST = 50.0
#: Least share of the variance that a grating holds; peaks with less are details of the surface.
LEAST_SHARE = 0.1
# Share of the variance that is constant along one axis, from which on a patch is a profile.
_PROFILE = 0.9
# Fewer periods than this in a patch cannot be told from its tilt and bending.
_FEWEST_PERIODS = 2.5
# Peaks closer in direction than this, degrees, are harmonics or irregularities of one grating.
_SAME = 15.0
# Background along a peak's direction: frequencies that are the peak's divided by these factors.
_BESIDE = (1.25, 2.0)
# Number of peaks that are examined, strongest first.
_CANDIDATES = 12
# Around a peak: bins of a Hann window's main lobe, and the spread of an irregular grating's
# frequency (relative) and direction (radians).
_LOBE, _SPREAD, _FAN = 2, 0.12, math.radians(8)
# Pixels a side of the central region that is examined in larger patches.
_LARGEST = 1024


def frequencies(field: HeightField) -> tuple[FloatArray, FloatArray]:
    """Return the frequencies (nx,) along x and (ny, 1) along y of a spectrum of `field`, 1/µm."""
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    fx, fy = np.fft.fftfreq(nx, dx), np.fft.fftfreq(ny, dy)
    return np.fft.fftshift(fx), np.fft.fftshift(fy)[:, None]


def height_spectrum(field: HeightField) -> FloatArray:
    """Return the two-sided power spectral density of the heights, (ny, nx) in µm⁴.

    The integral over frequencies is the variance. A Hann window, normalised to mean square 1,
    suppresses the seams of a measured patch (Welch, 1967); periodic patches are windowed, too, so
    that spectra can be compared.
    """
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    # without the zeros at the window's ends, which would be the whole window of two rows
    window = np.hanning(ny + 2)[1:-1, None] * np.hanning(nx + 2)[1:-1]
    window /= np.sqrt(np.mean(window**2))
    amplitude = np.fft.fft2((field.heights - field.heights.mean()) * window)
    return np.fft.fftshift(np.abs(amplitude) ** 2) * (dx * dy / (nx * ny))


@dataclass(frozen=True)
class Periodicity:
    """Period and direction of a grating in a patch, and its share of the variance."""

    period: float  # µm, from one groove to the next, across them
    direction: float  # degrees from x towards y across the grooves, −89.5 to 90.5
    share: float  # of the variance of the heights, 0 to 1, without harmonics

    def __str__(self) -> str:
        return f"{self.period:.4g} µm along {self.direction:.0f}°, {self.share:.0%} of the variance"


def dominant_periods(field: HeightField, most: int = 3) -> list[Periodicity]:
    """Find at most `most` gratings in a patch's spectrum, the largest share of variance first.

    A peak is a grating if it is `CONTRAST` times above its surroundings and holds `LEAST_SHARE` of
    the variance. The frequency is the centre of mass of the power around the peak. Of several peaks
    in one direction, such as harmonics, only the strongest counts. A grating has two and a half
    periods at least, unless the heights hardly change along the other axis: the patch tiles the
    plane, so such a profile is a grating.
    """
    central = field.heights[tuple(_central(n) for n in field.shape)]
    patch = HeightField(central, field.pixel_size)
    power = height_spectrum(patch)
    total = float(power.sum())
    if not total > 0.0:
        return []
    fx, fy = np.broadcast_arrays(*frequencies(patch))
    (width, height), (ny, nx) = patch.extent, patch.shape
    repeats = np.hypot(fx * width, fy * height)
    half = (fy > 0) | ((fy == 0) & (fx > 0))
    left = np.where(half & (repeats >= _FEWEST_PERIODS), power, 0.0)
    gratings: list[Periodicity] = []
    for _ in range(_CANDIDATES):
        iy, ix = np.unravel_index(left.argmax(), left.shape)
        highest = float(left[iy, ix])
        if len(gratings) == most or not highest > 0.0:
            break
        peak = np.array([fx[iy, ix], fy[iy, ix]])
        rows, columns = np.abs(np.arange(ny) - iy), np.abs(np.arange(nx) - ix)
        near = (rows[:, None] <= _LOBE) & (columns <= _LOBE)
        along = (fx * peak[0] + fy * peak[1]) / (peak @ peak)  # in units of the peak's frequency
        across = (fx * peak[1] - fy * peak[0]) / (peak @ peak)
        near |= (np.abs(along - 1) < _SPREAD) & (np.abs(across) < _FAN * along)
        weight = power[near]
        share = 2.0 * float(weight.sum()) / total  # twice: the mirror image holds as much
        centre = np.array([weight @ fx[near], weight @ fy[near]]) / weight.sum()
        aside = np.hypot((fx - along * peak[0]) * width, (fy - along * peak[1]) * height)
        line = aside < _LOBE + 1
        ring = (np.abs(repeats - repeats[iy, ix]) < 1.5) & ~line & half
        beside = line & (along > 1 / _BESIDE[1]) & (along < 1 / _BESIDE[0])
        beside &= repeats < repeats[iy, ix] - _LOBE - 0.5  # the lobe lies between two bins
        background = [float(np.median(power[part])) for part in (ring, beside) if part.any()]
        repeated = np.hypot(*(centre * (width, height))) >= _FEWEST_PERIODS
        if share >= LEAST_SHARE and repeated and highest > CONTRAST * max(background, default=0.0):
            gratings.append(_periodicity(centre, min(share, 1.0)))
            explained = line | (np.abs(across) <= math.tan(math.radians(_SAME)) * np.abs(along))
            left[explained] = power[explained] = 0.0
        else:
            left[near] = 0.0
    return sorted(gratings, key=lambda grating: -grating.share) or _repeated_profile(field)


def _repeated_profile(field: HeightField) -> list[Periodicity]:
    """Return the grating of a patch whose heights change along one axis only, if they do."""
    for axis, direction in ((1, 0.0), (0, 90.0)):
        profile = field.heights.mean(axis=1 - axis)
        share = float(profile.var() / field.heights.var())
        if share >= _PROFILE:
            strongest = 1 + int(np.abs(np.fft.rfft(profile))[1:].argmax())
            return [Periodicity(field.extent[1 - axis] / strongest, direction, share)]
    return []


def _central(count: int) -> slice:
    """Return the slice of the central `_LARGEST` of `count` samples."""
    kept = min(count, _LARGEST)
    return slice((count - kept) // 2, (count - kept) // 2 + kept)


def _periodicity(frequency: FloatArray, share: float) -> Periodicity:
    """Convert a frequency (fx, fy) in 1/µm to a period and a direction."""
    direction = math.degrees(math.atan2(frequency[1], frequency[0]))
    direction -= 180.0 * math.ceil((direction - 90.5) / 180.0)  # the same grooves seen from x
    return Periodicity(float(1.0 / np.hypot(*frequency)), round(direction, 2) + 0.0, share)


def order_powers(field: HeightField, wavelength: float) -> FloatArray:
    """Return the share |a_j(κ)|² of the light in each order j, (ny, nx), at normal incidence.

    a_j(κ) = mean(exp(iκh)·exp(i q_j·x)) with κ = 4π/λ, `wavelength` λ in nm. Orders j > 0 are
    turned towards +x, as by facets that descend towards +x. The shares add up to 1 (Parseval).
    """
    kappa = 4 * np.pi / (wavelength / 1000)
    amplitude = np.fft.ifft2(np.exp(1j * kappa * field.heights))  # +i, divided by the number
    return np.fft.fftshift(np.abs(amplitude) ** 2)


def profile(
    spectrum: FloatArray,
    field: HeightField,
    edges: FloatArray,
    direction: Literal["all", "x", "y"] = "all",
) -> FloatArray:
    """Average a spectrum (ny, nx) over rings of frequency between `edges` (n + 1,): shape (n,).

    With a `direction`, only frequencies that are at least twice as high along it as across it
    count. Empty rings are NaN.
    """
    fx, fy = frequencies(field)
    ring = np.digitize(np.hypot(fx, fy), edges)
    if direction == "x":
        ring[np.abs(fx) < 2 * np.abs(fy)] = 0
    elif direction == "y":
        ring[np.abs(fy) < 2 * np.abs(fx)] = 0
    n = edges.size + 1
    total = np.bincount(ring.ravel(), spectrum.ravel(), minlength=n)
    count = np.bincount(ring.ravel(), minlength=n).astype(np.float64)
    count[count == 0] = np.nan
    return (total / count)[1:-1]


def far_field(field: HeightField, wavelength: float, size: int = 201) -> FloatArray:
    """Return the light of one wavelength over the hemisphere, per unit of (u, v).

    Light comes along the normal. Order j goes to (u, v) = λ·(fx, fy), the direction's sine along x
    and y. Neighbouring orders are smoothed (σ 1.5), about as by a coherence window as wide as the
    patch; factors that depend on the angle alone are left out.

    Returns
    -------
    array (size, size)
        `[iv, iu]`, both from −1 to 1; NaN outside the unit disc.
    """
    width, height = field.extent
    ny, nx = field.shape
    micrometres = wavelength / 1000
    density = gaussian_filter(order_powers(field, wavelength), 1.5, mode="wrap")
    sines = np.linspace(-1, 1, size)
    # order j of fftshift's array lies at index j + n//2
    iu = sines[None, :] * (width / micrometres) + nx // 2
    iv = sines[:, None] * (height / micrometres) + ny // 2
    light = map_coordinates(density, np.broadcast_arrays(iv, iu), order=1, cval=0.0)
    light = np.maximum(light, 0) * (width * height / micrometres**2)
    light[sines[None, :] ** 2 + sines[:, None] ** 2 > 1] = np.nan
    return np.asarray(light)
