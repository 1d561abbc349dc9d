"""Power spectra of height fields and of the light that they reflect, for comparisons.

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

#: A peak of a grating stands this much above the median of all directions at its frequency, and of
#: lower frequencies in its direction. Rough surfaces reach 20 by chance, snakes' fingers 1e4.
CONTRAST = 50.0
#: A peak with less of the variance than this is a detail of the surface, not what it is made of.
LEAST_SHARE = 0.1
# Share of the variance that does not change along an axis from which on a patch is a profile.
_PROFILE = 0.9
# Fewer periods than this in a patch are not told from its tilt and bending.
_FEWEST_PERIODS = 2.5
# Peaks closer in direction than this are harmonics or the irregularity of one grating, degrees.
_SAME = 15.0
# Frequencies below a peak that it is compared with: it is so many times theirs.
_BESIDE = (1.25, 2.0)
# Peaks that are looked at.
_CANDIDATES = 12
# Around a peak: bins of a Hann window's main lobe, and the spread of an irregular grating's
# frequency (relative) and direction (radians).
_LOBE, _SPREAD, _FAN = 2, 0.12, math.radians(8)
# Pixels a side beyond which the central region says enough.
_LARGEST = 1024


def frequencies(field: HeightField) -> tuple[FloatArray, FloatArray]:
    """Frequencies (nx,) along x and (ny, 1) along y of a spectrum of `field`, 1/µm."""
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    fx, fy = np.fft.fftfreq(nx, dx), np.fft.fftfreq(ny, dy)
    return np.fft.fftshift(fx), np.fft.fftshift(fy)[:, None]


def height_spectrum(field: HeightField) -> FloatArray:
    """Two-sided power spectral density of the heights, (ny, nx) in µm⁴.

    Its integral over frequencies is the variance. A Hann window, normalised to mean square 1, keeps
    the seams of a measured patch out (Welch, 1967); it is put on periodic ones too, so that they
    compare.
    """
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    # without the zeros at its ends, which would be all of a patch of two rows
    window = np.hanning(ny + 2)[1:-1, None] * np.hanning(nx + 2)[1:-1]
    window /= np.sqrt(np.mean(window**2))
    amplitude = np.fft.fft2((field.heights - field.heights.mean()) * window)
    return np.fft.fftshift(np.abs(amplitude) ** 2) * (dx * dy / (nx * ny))


@dataclass(frozen=True)
class Periodicity:
    """A grating that a patch holds."""

    period: float  # µm, from one groove to the next, across them
    direction: float  # degrees from x towards y across the grooves, −89.5 to 90.5
    share: float  # of the variance of the heights, 0 to 1, without harmonics

    def __str__(self) -> str:
        return f"{self.period:.4g} µm along {self.direction:.0f}°, {self.share:.0%} of the variance"


def dominant_periods(field: HeightField, most: int = 3) -> list[Periodicity]:
    """The gratings that stand out of a patch's spectrum, the one with most of the variance first.

    A peak counts that stands `CONTRAST` times above its surroundings and holds `LEAST_SHARE` of the
    variance; its frequency is the centre of mass of what is around it.
    Of peaks in one direction, as harmonics are, the strongest is taken. What repeats less than two
    and a half times counts only if the heights hardly change along the other axis: the patch tiles
    the plane, so such a profile is a grating.
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
    found: list[Periodicity] = []
    for _ in range(_CANDIDATES):
        iy, ix = np.unravel_index(left.argmax(), left.shape)
        highest = float(left[iy, ix])
        if len(found) == most or not highest > 0.0:
            break
        peak = np.array([fx[iy, ix], fy[iy, ix]])
        rows, columns = np.abs(np.arange(ny) - iy), np.abs(np.arange(nx) - ix)
        near = (rows[:, None] <= _LOBE) & (columns <= _LOBE)
        along = (fx * peak[0] + fy * peak[1]) / (peak @ peak)  # in units of the peak's frequency
        across = (fx * peak[1] - fy * peak[0]) / (peak @ peak)
        near |= (np.abs(along - 1) < _SPREAD) & (np.abs(across) < _FAN * along)
        weight = power[near]
        share = 2.0 * float(weight.sum()) / total  # and its mirror image
        centre = np.array([weight @ fx[near], weight @ fy[near]]) / weight.sum()
        aside = np.hypot((fx - along * peak[0]) * width, (fy - along * peak[1]) * height)
        line = aside < _LOBE + 1
        ring = (np.abs(repeats - repeats[iy, ix]) < 1.5) & ~line & half
        beside = line & (along > 1 / _BESIDE[1]) & (along < 1 / _BESIDE[0])
        beside &= repeats < repeats[iy, ix] - _LOBE - 0.5  # the lobe lies between two bins
        background = [float(np.median(power[part])) for part in (ring, beside) if part.any()]
        repeated = np.hypot(*(centre * (width, height))) >= _FEWEST_PERIODS
        if share >= LEAST_SHARE and repeated and highest > CONTRAST * max(background, default=0.0):
            found.append(_periodicity(centre, min(share, 1.0)))
            explained = line | (np.abs(across) <= math.tan(math.radians(_SAME)) * np.abs(along))
            left[explained] = power[explained] = 0.0
        else:
            left[near] = 0.0
    return sorted(found, key=lambda one: -one.share) or _repeated_profile(field)


def _repeated_profile(field: HeightField) -> list[Periodicity]:
    """The grating of a patch whose heights change along one axis only, however few its periods."""
    for axis, direction in ((1, 0.0), (0, 90.0)):
        profile = field.heights.mean(axis=1 - axis)
        share = float(profile.var() / field.heights.var())
        if share >= _PROFILE:
            strongest = 1 + int(np.abs(np.fft.rfft(profile))[1:].argmax())
            return [Periodicity(field.extent[1 - axis] / strongest, direction, share)]
    return []


def _central(count: int) -> slice:
    kept = min(count, _LARGEST)
    return slice((count - kept) // 2, (count - kept) // 2 + kept)


def _periodicity(frequency: FloatArray, share: float) -> Periodicity:
    direction = math.degrees(math.atan2(frequency[1], frequency[0]))
    direction -= 180.0 * math.ceil((direction - 90.5) / 180.0)  # the same grooves seen from x
    return Periodicity(float(1.0 / np.hypot(*frequency)), round(direction, 2) + 0.0, share)


def order_powers(field: HeightField, wavelength: float) -> FloatArray:
    """Share of the light in every order |a_j(κ)|², (ny, nx), at normal incidence and exit.

    a_j(κ) = mean(exp(iκh)·exp(i q_j·x)) with κ = 4π/λ, `wavelength` λ in nm; order j > 0 is turned
    towards +x, as by facets that descend that way, and the shares add up to 1 (Parseval).
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
    """Mean of a spectrum (ny, nx) over rings of frequency between `edges` (n + 1,): shape (n,).

    With a direction, only where frequencies along it are at least twice those across; empty rings
    are NaN.
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
    """Light of one wavelength over the hemisphere, for light along the normal, per unit of (u, v).

    Order j goes to (u, v) = λ·(fx, fy), the direction's sine along x and y. Neighbouring orders are
    smoothed (σ 1.5), about what a coherence window as wide as the patch does; factors of the angle
    alone are left out.

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
