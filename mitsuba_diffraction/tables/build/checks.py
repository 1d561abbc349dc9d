"""Checks that refuse tables that cannot be built: unfit patches, failing series, large sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...errors import DiffractionError
from ...heights import HeightField, units_warning
from ...heights.coherence import SEVERAL, resolved, window_warning
from ...optics.geometry import sigma_of
from ...settings import MAX_TAPS, TableSettings
from ..document import MAX_BYTES
from ..expansion import Expansion
from ..layout import Grid
from ..table import build_error
from ..window import taps_for

#: The coherence window is at most so many patches wide: a patch of one period is tiled.
MOST_PATCHES = 400
#: What taps may use up of the tolerance when their number is chosen.
TAPS_SHARE = 0.5

#: Heights of both, a slope of 89.4° and a range in µm, are some hundred nm taken for µm.
HOPELESS_SLOPE, HOPELESS_RANGE = 100.0, 50.0


def check_patches(patches: Sequence[HeightField], settings: TableSettings) -> None:
    """Refuse patches or windows whose powers cannot be averaged, by resolved settings."""
    if not patches:
        raise build_error("there is no height field; give at least one")
    several, taylor = len(patches) > 1, settings.basis == "taylor"
    parts = [patch.name for patch in patches if patch.cut_out and not settings.coherent]
    if settings.coherent or taylor:
        setting = "basis='taylor'" if taylor else f"coherence='{settings.coherence}'"
        averaged = ""
        if settings.taper_width is not None:
            averaged, remedy = "windows have", "leave windows out"
        elif parts:
            averaged = f"the windows of '{parts[0]}', a part of a larger surface, have"
            remedy = "coherence='patch', or heights that repeat (periodic=exact)"
        elif several:
            averaged, remedy = f"{len(patches)} patches have", "one patch"
        if averaged:
            raise build_error(
                f"{averaged} their powers averaged, which {setting} cannot; use "
                f"coherence='ensemble' and basis='svd', or {remedy}"
            )
    for patch in patches[1:] if settings.taper_width is None else []:
        if not np.allclose(patch.extent, patches[0].extent, rtol=1e-6):
            raise build_error(
                f"'{patch.name}' is {patch.extent[0]:.6g} × {patch.extent[1]:.6g} µm, but "
                f"'{patches[0].name}' is {patches[0].extent[0]:.6g} × {patches[0].extent[1]:.6g} "
                "µm; crop them to one size (crop)"
            )


def check_units(patches: Sequence[HeightField]) -> None:
    """Refuse heights that are nanometres beyond doubt, on which minutes would be spent."""
    for patch in patches:
        if patch.rms_slope > HOPELESS_SLOPE and patch.range > HOPELESS_RANGE:
            raise build_error(
                f"'{patch.name}' has an RMS slope of {patch.rms_slope:.3g}, as no surface has: "
                f"{units_warning(patch)}"
            )


def check_window(field: HeightField, settings: TableSettings) -> None:
    """Refuse a patch that is much smaller or larger than the coherence window, by its size alone.

    settings : resolved.

    Raises a DiffractionError if no table of such a patch could be rendered with.
    """
    extent = field.extent
    if settings.taper_width is not None:  # the period of transforms, with zeros around a window
        dx, dy = field.pixel_size
        extent = 2.0 * max(settings.width, 2.0 * dx), 2.0 * max(settings.width, 2.0 * dy)
    width = settings.width
    # The longer side: a grating is a few pixels high, and constant along them
    if width > MOST_PATCHES * max(extent):
        raise build_error(
            f"coherence_width={width:g} µm is more than {MOST_PATCHES} times as wide as the patch "
            f"of {extent[0]:.4g} × {extent[1]:.4g} µm; check both units, or give a larger patch "
            "(of a grating: more periods)"
        )
    x, y = (sigma_of(settings.lookup_width) * 2.0 * np.pi / length for length in extent)
    taps = taps_for((x, y), settings.tolerance * TAPS_SHARE, settings.coherent)
    if settings.taps is None and max(taps) > MAX_TAPS:
        raise too_wide(extent, settings, taps)


def warnings_of(scans: Sequence[HeightField], settings: TableSettings) -> list[str]:
    """Return warnings of a table of these scans; they are not stored in the table.

    Heights that are refused have none.
    """
    settings = resolved(settings, scans)
    # windows of one scan are levelled, so that its tilt does not show
    cut = settings.taper_width is not None
    several = cut and max(scans[0].extent) > SEVERAL * settings.width
    shown = [replace(scan, cut_out=False) for scan in scans] if several else scans
    lines = [line for scan in shown for line in scan.validity(settings.wavelength_range)]
    try:
        check_units(scans)
        check_window(scans[0], settings)
    except DiffractionError:
        return []
    lines.append(window_warning(settings.width, scans))
    return [line for line in dict.fromkeys(lines) if line]


def too_wide(
    extent: tuple[float, float], settings: TableSettings, taps: tuple[int, int]
) -> DiffractionError:
    """An error about a patch so wide that a look-up would read more taps than there may be."""
    width = settings.width
    # windows have their powers averaged, and a coherent table has amplitudes
    averaged = f"average over windows of the patch, windows={width:g}, or "
    windows = "" if settings.coherent else averaged
    return build_error(
        f"the patch is {max(extent):.4g} µm wide, so much more than the coherence window that a "
        f"look-up would read {taps[0]}×{taps[1]} orders; {windows}crop the heights, crop={width:g}"
    )


def check_size(grid: Grid, expansion: Expansion, functions: int | None) -> None:
    """Refuse a table that exceeds the memory; `functions` counts functions of basis "svd"."""
    bins, terms = math.prod(grid.shape), functions or expansion.terms
    size = 4 * bins * expansion.components * terms * expansion.intervals
    if size > MAX_BYTES:
        raise build_error(
            f"it would take {size / 1e9:.1f} GB ({bins:.3g} orders of {expansion.intervals}×"
            f"{terms} terms); use a smaller or shallower patch (crop), a larger tolerance, "
            "or a longer shortest wavelength"
        )
