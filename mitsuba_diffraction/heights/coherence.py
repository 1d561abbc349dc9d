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
from typing import NamedTuple

from ..settings import COHERENCES, USUAL_WIDTH, TableSettings
from .field import HeightField

#: A side narrower than this fraction of the window is reported: lobes vary by 8 % there.
SMALLER = 0.9
#: Mark of results under such a window.
REPEATS = "wider than the patch: its repetition shows as a grating"
_GREEN = 0.55  # µm
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
    """Return the width of one window for all orders, µm: at most `widest_window`."""
    return widths_of(width, patches, COHERENCES[1]).window


class Widths(NamedTuple):
    """Widths of coherence windows, 4σ in µm: of all orders but 0, and of order 0."""

    window: float
    light: float


def widths_of(width: str | float, patches: Sequence[HeightField], coherence: str) -> Widths:
    """Return the widths for a coherence width of the light in µm or "auto", 65 µm.

    The patches limit the window of all orders but 0; if a width is asked for, scans and other parts
    of larger surfaces do (`HeightField.cut_out`). One window, of coherence "patch" or "surface",
    has one width for all orders, and as asked.
    """
    averaged, asked = coherence == COHERENCES[0], not isinstance(width, str)
    light = USUAL_WIDTH if isinstance(width, str) else width
    if asked:
        patches = [patch for patch in patches if patch.cut_out and averaged]
    window = min(light, widest_window(patches))
    return Widths(window, light if averaged else window)


def resolved(settings: TableSettings, patches: Sequence[HeightField]) -> TableSettings:
    """Return settings whose widths are numbers, limited by patches and windows of a scan."""
    window, light = widths_of(settings.coherence_width, patches, settings.coherence)
    if isinstance(settings.windows, float):
        window = min(window, settings.windows)
    return replace(settings, coherence_width=light, window_width=window)


def repeats(width: float, patches: Sequence[HeightField]) -> bool:
    """Return whether the repetition of the patches shows under a window, µm, as a grating."""
    return widest_window(patches) < SMALLER * width


def width_reason(settings: TableSettings, patches: Sequence[HeightField]) -> str:
    """Say in one line what speaks for the widths of resolved settings, or against them."""
    width, light = settings.width, settings.light_width
    if repeats(width, patches):
        return f"{width:.4g} µm, {REPEATS}"
    if width < light:
        return f"{light:.4g} µm for the mirror direction, {width:.4g} µm for orders: {blur(width)}"
    if width < resolved_width("auto", patches):
        return f"{width:.4g} µm, as asked"
    if width < USUAL_WIDTH:
        return f"{width:.4g} µm, the patch's smaller side; a wider window shows its repetition"
    return f"{width:.4g} µm, over which sunlight is coherent"


def blur(width: float, medium: float = 1.0) -> str:
    """Say within which angle of the mirror a scan of a width, µm, knows no light but the mirror.

    medium : index of the medium above, by which the width has been multiplied.
    """
    angle = math.degrees(math.asin(min(_GREEN / width, 1.0)))  # of the longest wave in the scan
    return (
        f"a scan of {width / medium:.4g} µm knows nothing of light within {angle:.2g}° of the "
        "mirror but the mirror"
    )


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
