"""A BRDF map: what was computed, and how bright to show it (NumPy only)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import encode_srgb, linear_srgb
from .light import Bands, Light

Image = NDArray[np.float32]

# Stops for a map without any light.
_NO_EXPOSURE = 0.0
# Less than this share of the light, beside the mirror's lobe, is not worth an exposure.
_WORTH_SHOWING = 1e-3
# At most this share of the map may be this many times as bright as white.
_CLIPPED, _CLIPPED_FROM = 1e-3, 8.0


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
