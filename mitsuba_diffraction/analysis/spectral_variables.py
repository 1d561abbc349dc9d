"""Variables of spectra as biologists publish them.

References
----------
R. Maia, H. Gruson, J. A. Endler and T. E. White, pavo 2: New tools for the spectral and spatial
analysis of colour in R, Methods in Ecology and Evolution 10, 1097-1107 (2019): names of variables
follow R. Montgomerie in Bird Coloration 1 (2006).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import rgb_to_hsv

from ..arrays import Real
from ..optics.colour import encode_srgb, linear_srgb, response
from .spectra import Spectra

#: Range of wavelengths of birds' vision, nm, over which pavo's variables are taken.
RANGE = (300.0, 700.0)

# A spectrum darker than this, of a white standard, has no colour.
_DARK = 1e-6


def colours_of(spectra: Spectra) -> list[dict[str, Any]]:
    """Return the variables of each geometry, in per cent, nm and degrees.

    srgb : colour in daylight, its brightest channel 255; `hue` and `chroma` (0 to 1), the angle and
    saturation of HSV of the same. B1, B2, B3 : sum over nanometres, mean and maximum; H1 : peak;
    S8 : (maximum − minimum)/B2; FWHM : full width at half of the maximum over the minimum, empty
    where the spectrum ends before.
    """
    lam, values = spectra.wavelength, spectra.value.T
    rows = []
    for name, curve, colour in zip(spectra.geometry.names, values, daylit(spectra), strict=True):
        row: dict[str, Any] = {"spectrum": name}
        if colour.max() > _DARK:
            encoded = encode_srgb(colour / colour.max())
            hue, chroma, _ = rgb_to_hsv(encoded)
            row |= {"srgb": "#" + "".join(f"{round(255 * c):02x}" for c in encoded)}
            row |= {"hue": round(360.0 * float(hue), 1), "chroma": round(float(chroma), 4)}
        rows.append(row | _pavo(lam, 100.0 * curve))
    return rows


def daylit(spectra: Spectra) -> Real:
    """Return the colours in daylight, linear sRGB without negative parts, (detectors, 3)."""
    lam = spectra.wavelength
    step = np.gradient(lam) if lam.size > 1 else np.ones(1)
    return np.maximum(linear_srgb(spectra.value.T @ (response(lam) * step[:, None])), 0.0)


def whole_nanometres(lam: Real) -> Real:
    """Return whole nanometres within wavelengths (n,), at which pavo has the variables."""
    return np.arange(np.ceil(max(lam[0], RANGE[0])), min(lam[-1], RANGE[1]) + 0.5)


def _pavo(lam: Real, curve: Real) -> dict[str, Any]:
    """Return pavo's variables of a spectrum (n,) in per cent."""
    grid = whole_nanometres(lam)
    if grid.size < 2:
        return {}
    fine = np.interp(grid, lam, curve)
    peak, least, mean = int(fine.argmax()), float(fine.min()), float(fine.mean())
    row: dict[str, Any] = {"B1": float(fine.sum()), "B2": mean, "B3": float(fine.max())}
    row["S8"] = (row["B3"] - least) / mean if mean > 0.0 else ""
    row["H1"] = float(grid[peak])
    below = fine <= 0.5 * (row["B3"] + least)
    left, right = np.flatnonzero(below[:peak]), np.flatnonzero(below[peak:])
    if left.size and right.size:
        row["FWHM"] = float(grid[peak + right[0]] - grid[left[-1]])
    return {name: round(x, 4) if isinstance(x, float) else x for name, x in row.items()}
