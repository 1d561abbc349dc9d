"""Power spectra of height fields and of the light that they reflect.

Frequencies are in 1/µm along x and y, as `numpy.fft.fftfreq` gives them; arrays of spectra have
frequency (0, 0) in the middle (`numpy.fft.fftshift`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from ..arrays import Real
from .field import HeightField
from .preprocess import arc_of, hann

#: Least ratio of a grating's peak to the median of all directions at its frequency, and to that of
#: lower frequencies in its direction. Rough surfaces reach 20 by chance, snakes' fingers 1e4.
CONTRAST = 50.0
#: Least share of the variance that a grating holds; peaks with less are details of the surface.
LEAST_SHARE = 0.1
# Share of the variance that is constant along one axis, from which on a patch is a profile.
_PROFILE = 0.9
# Fewer periods than this in a patch cannot be told from its tilt and bending.
_FEWEST_PERIODS = 2.5
#: Repeats below which a period is "perhaps" one: chance and a bow that remains look alike.
FEWEST_CERTAIN = 4.0
# Fewest periods of a fundamental. A plane that is subtracted from few periods of a grating leaves
# power below it.
_FEWEST_FUNDAMENTAL = 1.75
# Least share of a weak structure that is worth mentioning.
_LEAST_WEAK = 0.01
# Least height of a fundamental, relative to the harmonic that is examined. The side lobes of a Hann
# window are below 1e-3.
_LEAST_FUNDAMENTAL = 0.02
# Peaks closer in direction than this, degrees, are harmonics or irregularities of one grating.
_SAME = 15.0
# Background along a peak's direction: frequencies that are the peak's divided by these factors.
_BESIDE = (1.25, 2.0)
# A peak that has no other direction to stand out from has to stand out from its direction's
# frequencies up to so many times its own: between harmonics, or from all if so few are between.
_BEYOND, _FEW = 3.0, 4
# Number of peaks that are examined, strongest first.
_CANDIDATES = 12
# Around a peak: bins of a Hann window's main lobe, and the spread of an irregular grating's
# frequency (relative) and direction (radians).
_LOBE, _SPREAD, _FAN = 2, 0.12, math.radians(8)
# Pixels a side of the central region that is examined in larger patches.
_LARGEST = 1024


def frequencies(field: HeightField) -> tuple[Real, Real]:
    """Return the frequencies (nx,) along x and (ny, 1) along y of a spectrum of `field`, 1/µm."""
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    fx, fy = np.fft.fftfreq(nx, dx), np.fft.fftfreq(ny, dy)
    return np.fft.fftshift(fx), np.fft.fftshift(fy)[:, None]


def height_spectrum(field: HeightField, windowed: bool = True) -> Real:
    """Return the two-sided power spectral density of the heights, (ny, nx) in µm⁴.

    The integral over frequencies is the variance. A Hann window, normalised to mean square 1,
    suppresses the seams of a measured patch (Welch, 1967); periodic patches are windowed, too, so
    that spectra can be compared.

    windowed : False for the spectrum of a patch that tiles, as it is.
    """
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    # without the zeros at the window's ends, which would be the whole window of two rows
    window = np.outer(*hann(field))
    window /= np.sqrt(np.mean(window**2))
    heights = field.heights - field.heights.mean()
    amplitude = np.fft.fft2(heights * window if windowed else heights)
    return np.fft.fftshift(np.abs(amplitude) ** 2) * (dx * dy / (nx * ny))


@dataclass(frozen=True)
class Periodicity:
    """Period and direction of a grating in a patch, and its share of the variance."""

    period: float  # µm, from one groove to the next, across them
    direction: float  # degrees from x towards y across the grooves, −89.5 to 90.5
    share: float  # of the variance of the heights, 0 to 1, without harmonics
    repeats: float = math.inf  # number of periods in the patch; of a patch that tiles, without end

    def __str__(self) -> str:
        degrees = round(self.direction)
        text = f"{self.period:.4g} µm along {degrees}°, {self.share:.0%} of the variance"
        if math.isinf(self.repeats):
            return text
        perhaps = "perhaps " if self.repeats < FEWEST_CERTAIN else ""
        return f"{perhaps}{text}, {self.repeats:.2g} repeats"


class Periods(NamedTuple):
    """Gratings of a patch, and the strongest periodic structure that is too weak for a grating."""

    gratings: list[Periodicity]  # the largest share of variance first
    weak: Periodicity | None  # holds less than `LEAST_SHARE`; None if no other peak stands out


def seen_slope(field: HeightField, shortest: float) -> float:
    """Return the RMS slope of frequencies that light can see, up to 2/λ.

    Noise of finer structure than half a wavelength diffracts into no direction, unless it is as
    high as λ/50, a layer of its own. The windowed spectrum's share below 2/λ scales the slope.

    shortest : shortest wavelength, µm.
    """
    central = _central(field.heights)
    part = HeightField(central, field.pixel_size)
    fx, fy = frequencies(part)
    square = fx**2 + fy**2
    heights = height_spectrum(part)
    hidden = square > (2.0 / shortest) ** 2
    if heights[hidden].sum() > (shortest / (50.0 * field.rms_height)) ** 2 * heights.sum():
        return field.rms_slope
    power = heights * square
    total, seen = float(power.sum()), float(power[~hidden].sum())
    return field.rms_slope * math.sqrt(seen / total) if total > 0.0 else field.rms_slope


def dominant_periods(field: HeightField) -> list[Periodicity]:
    """Return the gratings of `examine_periods`."""
    return examine_periods(field).gratings


def examine_periods(field: HeightField, most: int = 3) -> Periods:
    """Find at most `most` gratings in a patch's spectrum.

    A peak is a grating if it is `CONTRAST` times above its surroundings and holds `LEAST_SHARE` of
    the variance. The frequency is the centre of mass of the power around the peak. Of several peaks
    in one direction only the strongest counts. If a peak at a half or a third of its frequency
    stands out, too, it is a harmonic, and the lower peak is the grating.

    Tilt and bow of a scan are subtracted first, as the best surface of second degree. A grating has
    two and a half periods at least, unless the patch is whole periods (not `cut_out`) and hardly
    changes along the other axis: the patch tiles the plane, so such a profile is a grating.
    """
    central = _central(field.heights)
    if field.cut_out or central.shape != field.shape:
        central = central - arc_of(central)
    spectrum = _Spectrum(HeightField(central, field.pixel_size))
    if not spectrum.total > 0.0:
        return Periods([], None)
    candidates = spectrum.summits & spectrum.half & (spectrum.repeats >= _FEWEST_PERIODS)
    left = np.where(candidates, spectrum.power, 0.0)
    gratings: list[Periodicity] = []
    weak: list[Periodicity] = []
    for _ in range(_CANDIDATES):
        index = np.unravel_index(left.argmax(), left.shape)
        if len(gratings) == most or not left[index] > 0.0:
            break
        peak = spectrum.peak(int(index[0]), int(index[1]))
        if not (peak.repeats >= _FEWEST_PERIODS and peak.contrast > CONTRAST):
            left[peak.near] = 0.0
            continue
        lower = spectrum.fundamental(peak)
        share = peak.share if lower is None else peak.share + lower.share
        lowest = lower or peak
        if share < LEAST_SHARE:
            if share >= _LEAST_WEAK:
                weak.append(_periodicity(lowest.centre, share, lowest.repeats))
            left[peak.near] = 0.0
            continue
        if lowest.repeats >= _FEWEST_PERIODS:
            gratings.append(_periodicity(lowest.centre, min(share, 1.0), lowest.repeats))
        left[peak.explained] = spectrum.power[peak.explained] = 0.0
    gratings.sort(key=lambda grating: -grating.share)
    if not gratings and not field.cut_out:
        for axis, direction in ((1, 0.0), (0, 90.0)):
            profile = field.heights.mean(axis=1 - axis)
            share = float(profile.var() / field.heights.var())
            if share >= _PROFILE:  # the heights change along one axis only
                strongest = 1 + int(np.abs(np.fft.rfft(profile))[1:].argmax())
                gratings = [Periodicity(field.extent[1 - axis] / strongest, direction, share)]
                break
    weak.sort(key=lambda structure: -structure.share)
    return Periods(gratings, weak[0] if weak else None)


@dataclass(frozen=True, eq=False)
class _Peak:
    """Peak of a spectrum; masks have the spectrum's shape."""

    centre: Real  # centre of mass (fx, fy), 1/µm
    highest: tuple[int, int]  # row and column of the highest value
    near: npt.NDArray[np.bool_]  # bins of the peak
    line: npt.NDArray[np.bool_]  # bins of its direction, of all frequencies
    explained: npt.NDArray[np.bool_]  # its line and directions that count as the same
    share: float  # of the variance
    repeats: float  # periods in the patch
    contrast: float  # highest value over the largest median of the surroundings


class _Spectrum:
    """Power spectrum of a patch, in which peaks are examined."""

    def __init__(self, patch: HeightField) -> None:
        self.power = height_spectrum(patch)
        self.total = float(self.power.sum())
        self.fx, self.fy = np.broadcast_arrays(*frequencies(patch))
        self.extent = patch.extent
        self.repeats = np.hypot(self.fx * patch.extent[0], self.fy * patch.extent[1])
        # bins above their neighbours: the skirts of a peak are not
        self.summits = self.power == scipy.ndimage.maximum_filter(self.power, 3, mode="wrap")
        self.half = (self.fy > 0) | ((self.fy == 0) & (self.fx > 0))

    def peak(self, iy: int, ix: int, without: npt.NDArray[np.bool_] | None = None) -> _Peak:
        """Return the peak around the bin in row `iy` and column `ix`.

        without : bins of another peak, which do not count.
        """
        (ny, nx), (width, height) = self.power.shape, self.extent
        fx, fy, power = self.fx, self.fy, self.power
        top = np.array([fx[iy, ix], fy[iy, ix]])
        rows, columns = np.abs(np.arange(ny) - iy), np.abs(np.arange(nx) - ix)
        near = (rows[:, None] <= _LOBE) & (columns <= _LOBE)
        along = (fx * top[0] + fy * top[1]) / (top @ top)  # in units of the peak's frequency
        across = (fx * top[1] - fy * top[0]) / (top @ top)
        near |= (np.abs(along - 1) < _SPREAD) & (np.abs(across) < _FAN * along)
        if without is not None:
            near &= ~without
        weight = power[near]
        mass = max(float(weight.sum()), 1e-300)
        centre = np.array([weight @ fx[near], weight @ fy[near]]) / mass
        aside = np.hypot((fx - along * top[0]) * width, (fy - along * top[1]) * height)
        line = aside < _LOBE + 1
        repeats = self.repeats[iy, ix]
        # of one frequency, not of one number of repeats: sides of a patch differ, noise does not
        frequency = np.maximum(np.hypot(fx, fy), 1e-300)
        ring = self.repeats * np.abs(1.0 - np.hypot(*top) / frequency) < 1.5
        ring &= ~line & self.half
        beside = line & (along > 1 / _BESIDE[1]) & (along < 1 / _BESIDE[0])
        beside &= self.repeats < repeats - _LOBE - 0.5  # the lobe lies between two bins
        # a bin that a stronger peak explains is 0, and does not count as background
        seen = (part & (power > 0.0) for part in (ring, beside))
        background = [float(np.median(power[part])) for part in seen if part.any()]
        if not ring.any():
            background.append(self._beyond(np.where(aside < 0.5, along, 0.0), repeats))
        return _Peak(
            centre=centre,
            highest=(iy, ix),
            near=near,
            line=line,
            explained=line | (np.abs(across) <= math.tan(math.radians(_SAME)) * np.abs(along)),
            share=2.0 * mass / self.total,  # twice: the mirror image holds as much
            repeats=float(np.hypot(*(centre * (width, height)))),
            contrast=float(power[iy, ix] / max(*background, 1e-30 * power[iy, ix], 1e-300)),
        )

    def _beyond(self, along: Real, repeats: float) -> float:
        """Return the mean power of other frequencies in a peak's direction, between its harmonics.

        In a strip no other direction has the frequency of a peak whose period exceeds the width.

        along : frequency over the peak's, 0 where the direction differs.
        """
        other = (along > 1 / _BESIDE[1]) & (along < _BEYOND) & (np.abs(along - 1) * repeats > _LOBE)
        part = other & (np.abs(along - np.maximum(np.rint(along), 1)) * repeats > _LOBE - 0.25)
        part = part if np.count_nonzero(part) >= _FEW else other
        return float(self.power[part].mean()) if part.any() else math.inf

    def fundamental(self, peak: _Peak) -> _Peak | None:
        """Return the fundamental of a peak that is its second or third harmonic, or None."""
        top = np.array([self.fx[peak.highest], self.fy[peak.highest]])
        along = (self.fx * top[0] + self.fy * top[1]) / (top @ top)
        bin_width = 1.0 / self.repeats[peak.highest]
        for harmonic in (2, 3):
            middle = 1.0 / harmonic
            half = max(_SPREAD * middle, 0.75 * bin_width)
            band = peak.line & self.summits & (np.abs(along - middle) <= half)
            if peak.repeats < harmonic * _FEWEST_FUNDAMENTAL or not band.any():
                continue
            if not self.power[band].max() > 0.0:
                continue
            index = np.unravel_index(np.where(band, self.power, 0.0).argmax(), band.shape)
            lower = self.peak(int(index[0]), int(index[1]), peak.near)
            # what remains of a bow decreases with the frequency, a fundamental does not
            below = peak.line & (along > 0.5 * bin_width) & (along < middle - half)
            tops_bow = self.power[index] > self.power[below].max(initial=0.0)
            if (
                lower.contrast > CONTRAST
                and self.power[index] > _LEAST_FUNDAMENTAL * self.power[peak.highest]
                and (tops_bow or lower.repeats >= 2 * _FEWEST_PERIODS)
            ):
                # the harmonic's frequency is known better, since it repeats more often
                centre, repeats = peak.centre / harmonic, peak.repeats / harmonic
                return replace(lower, centre=centre, repeats=repeats)
        return None


def _central(heights: Real) -> Real:
    """Return the central `_LARGEST` samples at most along both axes."""
    y, x = (max(n - _LARGEST, 0) // 2 for n in heights.shape)
    return heights[y : y + _LARGEST, x : x + _LARGEST]


def _periodicity(frequency: Real, share: float, repeats: float) -> Periodicity:
    """Convert a frequency (fx, fy) in 1/µm to a period and a direction."""
    direction = math.degrees(math.atan2(frequency[1], frequency[0]))
    direction -= 180.0 * math.ceil((direction - 90.5) / 180.0)  # the same grooves seen from x
    return Periodicity(float(1.0 / np.hypot(*frequency)), round(direction, 2) + 0.0, share, repeats)


def order_powers(field: HeightField, wavelength: float) -> Real:
    """Return the share |a_j(κ)|² of the light in each order j, (ny, nx), at normal incidence.

    a_j(κ) = mean(exp(iκh)·exp(i q_j·x)) with κ = 4π/λ, `wavelength` λ in nm. Orders j > 0 are
    turned towards +x, as by facets that descend towards +x. The shares add up to 1 (Parseval).
    """
    kappa = 4 * np.pi / (wavelength / 1000)
    amplitude = np.fft.ifft2(np.exp(1j * kappa * field.heights))  # +i, divided by the number
    return np.fft.fftshift(np.abs(amplitude) ** 2)


def profile(
    spectrum: Real,
    field: HeightField,
    edges: Real,
    direction: Literal["all", "x", "y"] = "all",
) -> Real:
    """Average a spectrum (ny, nx) over rings of frequency between `edges` (n + 1,): shape (n,).

    With a `direction`, only frequencies that are at least twice as high along it as across it
    count. Empty rings are NaN.
    """
    fx, fy = frequencies(field)
    along, across = {"all": (np.ones(1), np.zeros(1)), "x": (fx, fy), "y": (fy, fx)}[direction]
    used = np.broadcast_to(np.abs(along) >= 2 * np.abs(across), spectrum.shape)
    radius = np.hypot(fx, fy)[used]
    total, count = (np.histogram(radius, edges, weights=w)[0] for w in (spectrum[used], None))
    with np.errstate(invalid="ignore"):  # empty rings
        return np.asarray(total / count)


def far_field(field: HeightField, wavelength: float, size: int = 201) -> Real:
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
    density = scipy.ndimage.gaussian_filter(order_powers(field, wavelength), 1.5, mode="wrap")
    sines = np.linspace(-1, 1, size)
    # order j of fftshift's array lies at index j + n//2
    iu = sines[None, :] * (width / micrometres) + nx // 2
    iv = sines[:, None] * (height / micrometres) + ny // 2
    light = scipy.ndimage.map_coordinates(density, np.broadcast_arrays(iv, iu), order=1, cval=0.0)
    light = np.maximum(light, 0) * (width * height / micrometres**2)
    light[sines[None, :] ** 2 + sines[:, None] ** 2 > 1] = np.nan
    return np.asarray(light)
