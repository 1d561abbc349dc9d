"""Coherence width that a patch allows: a wider window shows the patch's repetition as a grating.

Table and BSDF repeat the patch over the plane, so that it has orders 2π/L apart. Under the window
exp(−r²/2σ²) an order is a lobe exp(−σ²Δ²) of the frequency. By Poisson's sum formula lobes of equal
power, 2π/L apart, add up to 1 + 2 exp(−(L/2σ)²) cos(LΔ) of their mean: to within 4 % for 4σ = L,
and to separate lines, a grating of period L, for a window twice as wide.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..settings import TableSettings
from .field import HeightField

#: Width over which sunlight is coherent, µm: 4σ for a source 0.53° wide.
USUAL_WIDTH = 65.0
#: A side narrower than this fraction of the window is reported: lobes vary by 8 % there.
SMALLER = 0.9
#: Mark of results under such a window.
REPEATS = "wider than the patch: its repetition shows as a grating"
#: Narrowest useful window, µm: a wavelength and a half.
NARROWEST = 1.0


def widest_window(patches: Sequence[HeightField]) -> float:
    """Return the width of the window, µm, up to which the repetition of the patches does not show.

    The width is the smaller side of the smallest patch, infinite for surfaces that repeat exactly.
    Along an axis without any change of height every repetition is exact.
    """
    return min(
        (
            length
            for patch in patches
            if not patch.periodic
            for length, axis in zip(patch.extent, (1, 0), strict=True)
            if patch.varies_along(axis)
        ),
        default=math.inf,
    )


def resolved_width(width: str | float, patches: Sequence[HeightField]) -> float:
    """Return a coherence width in µm; "auto" is the smaller of 65 µm and `widest_window`."""
    return min(USUAL_WIDTH, widest_window(patches)) if isinstance(width, str) else width


def resolved(settings: TableSettings, patches: Sequence[HeightField]) -> TableSettings:
    """Return settings whose coherence width is a number; "auto" is at most a window of a scan."""
    width = resolved_width(settings.coherence_width, patches)
    if settings.coherence_width == "auto" and isinstance(settings.windows, float):
        width = min(width, settings.windows)
    return replace(settings, coherence_width=width)


def repeats(width: float, patches: Sequence[HeightField]) -> bool:
    """Return whether the repetition of the patches shows under a window, µm, as a grating."""
    return widest_window(patches) < SMALLER * width


def width_reason(width: float, patches: Sequence[HeightField]) -> str:
    """Say in one line what speaks for a width of the window, µm, or against it."""
    if repeats(width, patches):
        return f"{width:.4g} µm, {REPEATS}"
    if width < resolved_width("auto", patches):
        return f"{width:.4g} µm, as asked"
    if width < USUAL_WIDTH:
        return f"{width:.4g} µm, the patch's smaller side; a wider window shows its repetition"
    return f"{width:.4g} µm, over which sunlight is coherent"


def window_warning(width: float, patches: Sequence[HeightField]) -> str:
    """Return a warning of a window, µm, that is wider than the patch or too narrow; else ""."""
    first, widest = patches[0], widest_window(patches)
    size = " × ".join(f"{length:.4g}" for length in first.extent)
    if widest < NARROWEST:
        return (
            f"{first.name}: use a larger scan, or check its pixel size, which is in µm: a patch of "
            f"{size} µm is narrower than two wavelengths and has no colours"
        )
    if not repeats(width, patches):
        return ""
    fitting = _two_digits(widest)
    return (
        f"{first.name}: use coherence_width={fitting:g}, a larger "
        "scan, or of whole periods periodic=exact: the window of "
        f"{width:.4g} µm is wider than the patch of {size} µm, whose repetition shows as a grating"
    )


def _two_digits(length: float) -> float:
    """Round a length down to two digits."""
    unit = 10.0 ** (math.floor(math.log10(length)) - 1)
    return float(f"{math.floor(length / unit * (1 + 1e-9)) * unit:.2g}")
