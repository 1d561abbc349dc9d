"""A BRDF map: its light, what was computed, how bright to show it, and how iridescent it is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.colour import encode_srgb, linear_srgb
from ...optics.geometry import check_angles

Image = NDArray[np.float32]
Reals = NDArray[np.float64]

#: nm. A finer step than this shows nothing: even a tenth of it moves no order by a pixel.
FINEST_STEP = 0.1
# Stops for a map without any light.
_NO_EXPOSURE = 0.0
# Less than this share of the light, beside the mirror's lobe, is not worth an exposure.
_WORTH_SHOWING = 1e-3
# At most this share of the map may be this many times as bright as white.
_CLIPPED, _CLIPPED_FROM = 1e-3, 8.0
#: Names of sextants of hue, from red on, each 60° wide in HSV; and of what has next to none.
HUES = ("red", "yellow", "green", "cyan", "blue", "magenta")
#: Saturation below which a colour counts as grey.
GREY = 0.1
# Of the brightest direction's luminance: what is below has no colour to speak of.
_DARK = 1e-9


@dataclass(frozen=True)
class Light:
    """Direction to the light.

    Parameters
    ----------
    theta : degrees from the normal, 0 to below 90.
    phi : degrees from the patch's x axis towards its y axis, −360 to 360.

    Raises
    ------
    DiffractionError
        If an angle is out of range.
    """

    theta: float = 0.0
    phi: float = 0.0

    def __post_init__(self) -> None:
        check_angles(self.theta, self.phi)

    @property
    def direction(self) -> NDArray[np.float64]:
        """ωi, unit vector (3,) towards the light."""
        theta, phi = math.radians(self.theta), math.radians(self.phi)
        sin = math.sin(theta)
        return np.array([sin * math.cos(phi), sin * math.sin(phi), math.cos(theta)])

    @property
    def mirror(self) -> NDArray[np.float64]:
        """Unit vector (3,) in which a flat mirror reflects it."""
        return self.direction * [-1.0, -1.0, 1.0]

    def __str__(self) -> str:
        return f"θ = {self.theta:g}°, φ = {self.phi:g}°"


@dataclass(frozen=True)
class Bands:
    """A range of wavelengths, cut into equal bands no wider than a step.

    Parameters
    ----------
    low, high : nm, above 0. Equal ones make a single wavelength.
    step : nm.

    Raises
    ------
    DiffractionError
        If the range is empty or the step does not fit it.
    """

    low: float
    high: float
    step: float = 5.0

    def __post_init__(self) -> None:
        if not (0.0 < self.low <= self.high and math.isfinite(self.high)):
            raise DiffractionError(
                f"wavelength range {self.low:g} to {self.high:g} nm is none; give the shortest "
                "first, both above 0, e.g. 380 780"
            )
        if self.is_single:
            return
        if not FINEST_STEP <= self.step <= self.high - self.low:
            raise DiffractionError(
                f"step={self.step:g} nm does not fit the range of {self.low:g} to {self.high:g} nm;"
                f" it must be from {FINEST_STEP:g} to {self.high - self.low:g} nm"
            )

    @classmethod
    def of(
        cls, wavelength_range: tuple[float, float], step: float, wavelength: float | None
    ) -> Bands:
        """A range in steps, or the one wavelength if it is not `None`."""
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
        # a range that is a whole number of steps must not get one more by rounding
        return 1 if self.is_single else math.ceil((self.high - self.low) / self.step - 1e-9)

    @property
    def width(self) -> float:
        """Of one band, nm."""
        return (self.high - self.low) / self.count

    def wavelengths(self, offset: float = 0.5) -> NDArray[np.float64]:
        """One wavelength in each band, (count,) in nm, at `offset` (0 to 1) of its width."""
        return self.low + (np.arange(self.count, dtype=np.float64) + offset) * self.width

    def __str__(self) -> str:
        if self.is_single:
            return f"{self.low:g} nm"
        return f"{self.low:g}–{self.high:g} nm in steps of {self.width:.4g} nm"


@dataclass(frozen=True, eq=False, repr=False)
class BrdfMap:
    """The BRDF for one light direction over all view directions.

    Arrays have their first row at the lowest y and their first column at the lowest x; see
    `hemisphere` for the projection. Pixels on the rim hold the mean over their whole area, which
    the hemisphere covers in part: divide by `coverage` for the mean over what it covers.

    Attributes
    ----------
    light : direction to the light.
    bands : wavelengths.
    coverage : (n, n), share of the pixel that the hemisphere covers.
    xyz : (n, n, 3), tristimulus values of f in 1/sr; a mirror's albedo has Y = 1. `None` for a
        single wavelength.
    spectrum : (bands, n, n), mean of f over each band in 1/sr; `None` unless it was asked for, or
        for a single wavelength.
    cosine : whether f was multiplied with cosθo.
    illuminant : that of the colours.
    samples : taken in each pixel.
    lobe : radius in x and y of the glossy lobe around the mirror direction; 0 if it is not known.
    """

    light: Light
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
        """Y, or f itself for a single wavelength, (n, n), 1/sr."""
        if self.xyz is not None:
            return self.xyz[..., 1]
        assert self.spectrum is not None
        return self.spectrum[0]

    def albedo(self) -> NDArray[np.float64]:
        """∫ f cosθo dωo: X, Y, Z (3,), or (1,) for a single wavelength; not for `cosine` maps."""
        if self.cosine:
            raise ValueError("a map of f·cosθo has no albedo")
        values = self.luminance[..., None] if self.xyz is None else self.xyz
        return 4.0 * values.mean(axis=(0, 1), dtype=np.float64)

    def exposure(self) -> float:
        """Stops that show what diffraction does.

        Half of the diffracted light is to be darker than white, and no more than a thousandth of
        the map brighter than eight times white, where colours are clipped to others. Light in the
        lobe around the mirror direction is not diffracted, unless there is no other.
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
        """What a display shows at f × 2^exposure: (n, n, 4) from 0 to 1, alpha not premultiplied.

        Parameters
        ----------
        exposure : stops.
        """
        covered = np.maximum(self.coverage, np.float32(1e-6))[..., None]
        colours = encode_srgb(self.linear / covered * 2.0**exposure)
        return np.concatenate([colours, self.coverage[..., None]], axis=-1)

    def away_from_mirror(self) -> NDArray[np.bool_]:
        """Pixels (n, n) outside the lobe around the mirror direction."""
        n = self.resolution
        centres = (np.arange(n) + 0.5) * (2.0 / n) - 1.0
        x, y, _ = self.light.mirror
        return np.hypot(centres[None, :] - x, centres[:, None] - y) > self.lobe + 2.0 / n


def iridescence(brdf_map: BrdfMap) -> float:
    """How much colour changes with the view direction.

    The root mean square distance of the chromaticity from its mean, in the CIE 1976 u'v' diagram
    (CIE 15:2018, 8.1), over the hemisphere of view directions (by projected solid angle), weighted
    by luminance Y:

        I = √(Σ Y |c − c̄|² / Σ Y),   c = (u', v'),   c̄ = Σ Y c / Σ Y

    It is 0 for what has one colour in all directions, white or a pigment's, however bright; the
    pure colours of the spectrum between 450 and 650 nm, alike bright, have 0.25. The mirror's lobe
    counts as all other light: colours that gloss outshines are of little weight.
    """
    xyz = _xyz(brdf_map, _seen(brdf_map))
    weight = xyz[:, 1]
    if not weight.sum() > 0.0:
        return 0.0
    chromaticity = _chromaticity(xyz)
    mean = np.average(chromaticity, axis=0, weights=weight)
    squares = np.sum(np.square(chromaticity - mean), axis=1)
    return float(np.sqrt(np.average(squares, weights=weight)))


def colours_of(brdf_map: BrdfMap) -> dict[str, float]:
    """Shares of the luminance away from the mirror's lobe, by hue; they add up to 1, or are all 0.

    Hue is that of linear sRGB, clipped to the display's gamut, in sextants of HSV around the
    primaries and their mixtures; "grey" has a saturation below `GREY`.
    """
    from matplotlib.colors import rgb_to_hsv

    names = (*HUES, "grey")
    away = _seen(brdf_map) & brdf_map.away_from_mirror()
    weight = _xyz(brdf_map, away)[:, 1]
    if not weight.sum() > 0.0:
        return dict.fromkeys(names, 0.0)
    linear = brdf_map.linear[away].astype(np.float64)
    shown = np.clip(linear, 0.0, None)
    brightest = shown.max(axis=1, keepdims=True)
    hsv = rgb_to_hsv(np.divide(shown, brightest, out=np.zeros_like(shown), where=brightest > 0))
    sextant = np.floor(hsv[:, 0] * 6.0 + 0.5).astype(int) % 6
    sextant[hsv[:, 1] < GREY] = 6
    total = np.bincount(sextant, weight, minlength=7)
    return dict(zip(names, (total / total.sum()).tolist(), strict=True))


def _seen(brdf_map: BrdfMap) -> NDArray[np.bool_]:
    lit = brdf_map.luminance > _DARK * brdf_map.luminance.max()
    return np.asarray((brdf_map.coverage > 0.0) & lit)


def _xyz(brdf_map: BrdfMap, directions: NDArray[np.bool_]) -> Reals:
    """X, Y, Z (n, 3) of some directions."""
    if brdf_map.xyz is None:
        raise ValueError("a map of a single wavelength has no colours")
    return np.asarray(brdf_map.xyz[directions], np.float64)


def _chromaticity(xyz: Reals) -> Reals:
    """u', v' of CIE 1976: 4X and 9Y over X + 15Y + 3Z."""
    weights = np.array([1.0, 15.0, 3.0])
    whole = np.maximum(xyz @ weights, 1e-300)
    return np.stack([4.0 * xyz[:, 0] / whole, 9.0 * xyz[:, 1] / whole], axis=-1)
