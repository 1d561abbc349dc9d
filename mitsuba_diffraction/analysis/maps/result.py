"""BRDF maps: light, wavelengths, values and exposure for display."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.colour import encode_srgb, linear_srgb
from ...optics.geometry import check_angles
from .hemisphere import polar

Image = NDArray[np.float32]

#: Least wavelength step, nm: it moves no order by as much as a pixel.
FINEST_STEP = 0.1
# Stops for a map without any light.
_NO_EXPOSURE = 0.0
# Least share of the light outside the mirror direction's lobe for which the exposure is chosen.
_WORTH_SHOWING = 1e-3
# Largest share of the map that may be brighter than white by this factor.
_CLIPPED, _CLIPPED_FROM = 1e-3, 8.0


@dataclass(frozen=True)
class LightDirection:
    """Direction to the light.

    Raises a DiffractionError if an angle is out of range.

    Parameters
    ----------
    theta : degrees from the normal, 0 to below 90.
    phi : degrees from the patch's x axis towards its y axis, −360 to 360.
    """

    theta: float = 0.0
    phi: float = 0.0

    def __post_init__(self) -> None:
        check_angles(self.theta, self.phi)

    @property
    def direction(self) -> NDArray[np.float64]:
        """Unit vector ωi (3,) towards the light."""
        return polar(math.radians(self.theta), math.radians(self.phi))

    @property
    def mirror(self) -> NDArray[np.float64]:
        """Unit vector (3,) of the mirror direction."""
        return self.direction * [-1.0, -1.0, 1.0]

    def __str__(self) -> str:
        return f"θ = {self.theta:g}°, φ = {self.phi:g}°"


@dataclass(frozen=True)
class Bands:
    """Range of wavelengths, divided into equal bands no wider than a step.

    Raises a DiffractionError if the range is empty or the step is too small or longer than the
    range.

    Parameters
    ----------
    low, high : nm, above 0; equal values are a single wavelength.
    step : nm.
    """

    low: float
    high: float
    step: float = 5.0

    def __post_init__(self) -> None:
        if not (0.0 < self.low <= self.high and math.isfinite(self.high)):
            raise DiffractionError(
                f"wavelength range {self.low:g} to {self.high:g} nm is empty; give the shortest "
                "first, both above 0, e.g. 380 to 780"
            )
        if self.is_single:
            return
        if not FINEST_STEP <= self.step <= self.high - self.low:
            raise DiffractionError(
                f"step={self.step:g} nm does not fit the range of {self.low:g} to {self.high:g} nm;"
                f" it must be from {FINEST_STEP:g} to {self.high - self.low:g} nm"
            )

    @classmethod
    def choose(
        cls, wavelength_range: tuple[float, float], step: float, wavelength: float | None
    ) -> Bands:
        """Return the bands of a range, or the single wavelength if it is not `None`."""
        if wavelength is not None:
            return cls(wavelength, wavelength)
        return cls(*wavelength_range, step)

    @property
    def is_single(self) -> bool:
        """Whether this is one wavelength instead of a range."""
        return self.low == self.high

    @property
    def count(self) -> int:
        """Number of bands."""
        # −1e-9: rounding must not add a band to a range that is a whole number of steps
        return 1 if self.is_single else math.ceil((self.high - self.low) / self.step - 1e-9)

    @property
    def width(self) -> float:
        """Width of one band, nm."""
        return (self.high - self.low) / self.count

    def wavelengths(self, offset: float = 0.5) -> NDArray[np.float64]:
        """Return a wavelength in each band, (count,) in nm, at `offset` (0 to 1) of its width."""
        return self.low + (np.arange(self.count, dtype=np.float64) + offset) * self.width

    def __str__(self) -> str:
        if self.is_single:
            return f"{self.low:g} nm"
        return f"{self.low:g}–{self.high:g} nm in steps of {self.width:.4g} nm"


@dataclass(frozen=True, eq=False, repr=False)
class BrdfMap:
    """BRDF for one light direction over all view directions.

    Arrays have their first row at the lowest y and their first column at the lowest x; see
    `hemisphere` for the projection. Pixels on the rim hold the mean over their whole area, which
    the hemisphere covers in part: divide by `coverage` for the mean over the covered part.

    Attributes
    ----------
    light : direction to the light.
    bands : wavelengths.
    coverage : (n, n), share of the pixel that the hemisphere covers.
    xyz : (n, n, 3), tristimulus values of f in 1/sr; a mirror's albedo has Y = 1. `None` for a
        single wavelength.
    spectrum : (bands, n, n), mean of f over each band in 1/sr; `None` if bands are not stored.
    cosine : whether values are f·cosθo.
    illuminant : illuminant of the colours.
    samples : directions per pixel.
    lobe : radius in x and y of the glossy lobe around the mirror direction; 0 if unknown.
    """

    light: LightDirection
    bands: Bands
    coverage: Image
    xyz: Image | None
    spectrum: Image | None
    cosine: bool
    illuminant: str
    samples: int
    lobe: float = 0.0

    @property
    def resolution(self) -> int:
        """Pixels along each axis."""
        return self.coverage.shape[0]

    @property
    def linear(self) -> Image:
        """Linear sRGB, (n, n, 3), in 1/sr, neither exposed nor clipped."""
        if self.xyz is None:
            raise ValueError("a map of a single wavelength has no colours")
        return linear_srgb(self.xyz, self.illuminant).astype(np.float32)

    @property
    def luminance(self) -> Image:
        """Luminance Y, or f of a single wavelength, (n, n), 1/sr."""
        if self.xyz is not None:
            return self.xyz[..., 1]
        assert self.spectrum is not None
        return self.spectrum[0]

    def albedo(self) -> NDArray[np.float64]:
        """Return ∫ f cosθo dωo: X, Y, Z (3,), or (1,) for a single wavelength; not of f cosθo."""
        if self.cosine:
            raise ValueError("a map of f·cosθo has no albedo")
        values = self.luminance[..., None] if self.xyz is None else self.xyz
        return 4.0 * values.mean(axis=(0, 1), dtype=np.float64)

    def exposure(self) -> float:
        """Choose an exposure for the diffracted light, in stops.

        Half of the diffracted light is darker than white, and at most a thousandth of the map is
        brighter than eight times white, where clipping changes hues. Light in the lobe around the
        mirror direction counts only if there is no other.
        """
        y = self.luminance.astype(np.float64)
        brightest = np.sort(y, axis=None)[-1 - int(_CLIPPED * y.size)]
        for values in (y[self.away_from_mirror()], y.ravel()):
            ordered = np.sort(values[values > 0.0])
            total = np.cumsum(ordered)
            if total.size and total[-1] > _WORTH_SHOWING * y.sum():
                median = ordered[np.searchsorted(total, 0.5 * total[-1])]
                return round(-math.log2(max(median, brightest / _CLIPPED_FROM)), 1)
        return _NO_EXPOSURE

    def srgb(self, exposure: float) -> NDArray[np.float64]:
        """Encode f × 2^exposure in sRGB: (n, n, 4) from 0 to 1, alpha not premultiplied.

        exposure : stops.
        """
        covered = np.maximum(self.coverage, np.float32(1e-6))[..., None]
        colours = encode_srgb(self.linear / covered * 2.0**exposure)
        return np.concatenate([colours, self.coverage[..., None]], axis=-1)

    def away_from_mirror(self) -> NDArray[np.bool_]:
        """Return the pixels (n, n) outside the lobe around the mirror direction, as a mask."""
        n = self.resolution
        centres = (np.arange(n) + 0.5) * (2.0 / n) - 1.0
        x, y, _ = self.light.mirror
        return np.hypot(centres[None, :] - x, centres[:, None] - y) > self.lobe + 2.0 / n
