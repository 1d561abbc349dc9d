"""Coherence width that a patch allows, and the width of the windows that a scan is seen through.

A patch without edges tiles the plane, so that it has orders 2π/L apart. Under the window
exp(−r²/2σ²) an order is a lobe exp(−σ²Δ²) of the frequency. By Poisson's sum formula lobes of equal
power, 2π/L apart, add up to 1 + 2 exp(−(L/2σ)²) cos(LΔ) of their mean: to within 4 % for 4σ = L,
and to separate lines, a grating of period L, for a window twice as wide.

A scan has open edges: it is a part of a larger surface. Its table is a mean over windows, no wider
than the scan, whose phase screens fade towards their edges (`tables.build.screens`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from ..settings import COHERENCES, USUAL_WIDTH, TableSettings
from .field import HeightField

#: A side narrower than this fraction of the window is reported: lobes vary by 8 % there.
SMALLER = 0.9
#: Mark of results under such a window.
REPEATS = "wider than the patch: its repetition shows as a grating"
_GREEN = 0.55  # µm
#: Taper of a scan's windows at places u from −1 to 1: (1 + Σ c_n cos nπu)/(1 + Σ c_n).
TAPER = (0.465, -0.145)
#: σ_l of the look-up over σ of a scan's windows: narrow enough that ripples between orders π/W
#: apart are small, wide enough for four orders in each direction at a tolerance of 1e-3.
LOOKUP = 1.65
#: Share of an order's power that each neighbour takes less, along either axis: taper and look-up
#: alone would make lobes a fifth too wide.
SHARPENING = 0.165
#: An axis with less than so many windows' widths has one window, in its middle.
SEVERAL = 1.25
#: Width, µm, up to which a scan is one window. Windows of wider scans are at least as wide.
ONE_WINDOW = 32.0
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


def usual_window(side: float) -> float:
    """Return the width of the windows of a scan, µm, from its smaller side.

    A scan up to 32 µm is one window. A wider one is cut into windows of half its side, which costs
    as many orders as one tile has, and averages over several windows.
    """
    return min(side, max(ONE_WINDOW, 0.5 * side))


def window_places(pixels: int, window: float) -> tuple[list[int], int]:
    """Return the first pixels of the windows along an axis of a scan, and their common length.

    Windows overlap by half. An axis shorter than `SEVERAL` windows has one, in its middle.

    window : wanted length, in pixels.
    """
    wanted = min(pixels, max(2, round(window)))
    if pixels < SEVERAL * wanted:
        return [(pixels - wanted) // 2], wanted
    # not longer, or a look-up would read more orders
    length = next(n for n in range(wanted, 0, -1) if scipy.fft.next_fast_len(n) == n)
    count = 1 + max(1, round((pixels - length) / (0.5 * length)))
    return np.linspace(0, pixels - length, count).round().astype(int).tolist(), length


def window_corners(rows: Sequence[int], columns: Sequence[int]) -> list[tuple[int, int]]:
    """Return (row, column) of the windows' first pixels, of those along both axes.

    Of a grid of three by three or more, every second is taken, like the black squares of a
    chessboard: powers of windows that overlap by half along one axis are nearly a quarter the same,
    so that the others lower the error of the mean by 6 % and would double the transforms.
    """
    sparse = min(len(rows), len(columns)) >= 3
    return [
        (row, column)
        for n, row in enumerate(rows)
        for m, column in enumerate(columns)
        if not (sparse and (n + m) % 2)
    ]


def resolved_width(width: str | float, patches: Sequence[HeightField]) -> float:
    """Return the width of one window for all orders, µm: at most `widest_window`."""
    return widths_of(TableSettings(coherence=COHERENCES[1]), patches, width)[0]


def widths_of(
    settings: TableSettings, patches: Sequence[HeightField], width: str | float | None = None
) -> tuple[float, float, float | None]:
    """Return widths of coherence windows, µm: 4σ of all orders but 0, 4σ₀ of order 0, and 4σ_t.

    The patches limit the window of all orders but 0; if a width is asked for, scans and other parts
    of larger surfaces do (`HeightField.cut_out`). One window, of coherence "patch", has one width
    for all orders, and as asked. 4σ_t is `TableSettings.taper_width`, None for patches that tile
    the plane.

    width : of the light, µm or "auto", 65 µm; None for that of the settings.
    """
    width = settings.coherence_width if width is None else width
    light = USUAL_WIDTH if isinstance(width, str) else width
    cut_out = [] if settings.coherent else [patch for patch in patches if patch.cut_out]
    window = min(light, widest_window(patches if isinstance(width, str) else cut_out))
    light = window if settings.coherent else light
    asked = settings.windows if isinstance(settings.windows, float) else None
    scans = [] if settings.basis == "taylor" else cut_out
    if asked is None and not scans:
        return window, light, None
    side = widest_window(scans or patches)
    window = min(window, side, usual_window(side) if asked is None else asked)
    return window, light, window / math.sqrt(1.0 - LOOKUP**-2)


def resolved(settings: TableSettings, patches: Sequence[HeightField]) -> TableSettings:
    """Return settings whose widths are numbers, limited by patches and windows of a scan."""
    window, light, taper = widths_of(settings, patches)
    return replace(settings, coherence_width=light, window_width=window, taper_width=taper)


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
    """Say within which angle of the mirror windows of a width, µm, know no light but the mirror.

    medium : index of the medium above, by which the width has been multiplied.
    """
    angle = math.degrees(math.asin(min(_GREEN / width, 1.0)))  # of the longest wave in the scan
    return (
        f"windows of {width / medium:.4g} µm know nothing of light within {angle:.2g}° of the "
        "mirror but the mirror"
    )


#: Part of the warning of such a patch.
COLOURLESS = "narrower than two wavelengths and has no colours"


def window_warning(width: float, patches: Sequence[HeightField]) -> str:
    """Return a warning of a window, µm, that is wider than the patch or too narrow; else ""."""
    first, widest = patches[0], widest_window(patches)
    size = " × ".join(f"{length:.4g}" for length in first.extent)
    if widest < NARROWEST:
        return (
            f"{first.name}: use a larger scan, or check its pixel size, which is in µm: a patch of "
            f"{size} µm is {COLOURLESS}"
        )
    if not repeats(width, patches):
        return ""
    unit = 10.0 ** (math.floor(math.log10(widest)) - 1)
    fitting = float(f"{math.floor(widest / unit * (1 + 1e-9)) * unit:.2g}")  # down to two digits
    return (
        f"{first.name}: use coherence_width={fitting:g}, a larger "
        "scan, or of whole periods periodic=exact: the window of "
        f"{width:.4g} µm is wider than the patch of {size} µm, whose repetition shows as a grating"
    )
