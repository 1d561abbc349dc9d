"""What cannot be built: parameters out of range, patches that do not fit, series that fail."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...heights.validity import units_warning
from ..expansion import BASES, Expansion
from ..table import refuse
from ..window import MAX_TAPS
from .choose import taylor_rounding, taylor_truncation
from .error import Grid

#: Largest table, bytes: beyond it no renderer would want it.
MAX_BYTES = 4 << 30

#: Heights of both, a slope of 89.4° and a range in µm, are some hundred nm taken for µm.
HOPELESS_SLOPE, HOPELESS_RANGE = 100.0, 50.0


def check_parameters(
    basis: str,
    tolerance: float,
    terms: int | None,
    wavelength_range: tuple[float, float],
    height_scale_max: float,
    taps: int | None,
) -> None:
    """Refuse parameters that make no sense on their own."""
    if basis not in (*BASES, "auto"):
        raise DiffractionError(
            f"basis='{basis}' is unknown; choose one of {', '.join((*BASES, 'auto'))}"
        )
    if not 1e-6 <= tolerance < 1.0:
        raise DiffractionError(
            f"tolerance={tolerance} must lie between 1e-6 (single precision) and 1 (1e-3 is usual)"
        )
    for name, value, most in (("terms", terms, 400), ("taps", taps, MAX_TAPS)):
        if value is not None and not 1 <= value <= most:
            raise DiffractionError(f"{name}={value} must be a whole number from 1 to {most}")
    low, high = wavelength_range
    if not (10.0 <= low < high <= 1e5):
        raise DiffractionError(
            f"wavelength_range=({low:g}, {high:g}) must be two rising wavelengths in nm, "
            "between 10 and 100000"
        )
    if not 0.0 < height_scale_max <= 1e3:
        raise DiffractionError(
            f"height_scale_max={height_scale_max:g} must be a positive factor, at most 1000"
        )


def restricted(
    crop: float | tuple[float, float] | None,
    kappa_max: float | None,
    reach: float,
    whole: float,
) -> tuple[tuple[float, float], float]:
    """The domain of a table, at most `reach` in x and y and `whole`; refuse what leaves nothing."""
    x, y = crop if isinstance(crop, Sequence) else (crop, crop)
    for name, value in (("crop", x), ("crop", y), ("kappa_max", kappa_max)):
        if value is not None and not value > 0.0:
            raise DiffractionError(f"{name}={value:g} must be a positive number, in rad/µm")
    radii = (float(min(x or reach, reach)), float(min(y or reach, reach)))
    return radii, float(min(kappa_max or whole, whole))


def check_patches(patches: Sequence[HeightField], coherence: str, basis: str) -> None:
    """Refuse patches whose powers cannot be averaged."""
    if not patches:
        raise refuse("there is no height field; give at least one")
    if len(patches) == 1:
        return
    if coherence != "ensemble" or basis == "taylor":
        given = "basis='taylor'" if basis == "taylor" else f"coherence='{coherence}'"
        raise refuse(
            f"{len(patches)} patches have their powers averaged, which {given} cannot; use "
            "coherence='ensemble' and basis='svd', or one patch"
        )
    for patch in patches[1:]:
        if not np.allclose(patch.extent, patches[0].extent, rtol=1e-6):
            raise refuse(
                f"'{patch.name}' is {patch.extent[0]:.6g} × {patch.extent[1]:.6g} µm, but "
                f"'{patches[0].name}' is {patches[0].extent[0]:.6g} × {patches[0].extent[1]:.6g} "
                "µm; crop them to one size (crop, --crop)"
            )


def check_units(patches: Sequence[HeightField]) -> None:
    """Refuse heights that are nanometres beyond doubt, on which minutes would be spent."""
    for patch in patches:
        if patch.rms_slope > HOPELESS_SLOPE and patch.range > HOPELESS_RANGE:
            raise refuse(
                f"'{patch.name}' has an RMS slope of {patch.rms_slope:.3g}, as no surface has: "
                f"{units_warning(patch)}"
            )


def check_taylor(heights: HeightField, expansion: Expansion, tolerance: float) -> None:
    """Refuse a Taylor series that single precision does not survive, or that is cut too short."""
    rounding = taylor_rounding(heights, expansion.kappa_max, expansion.terms)
    if rounding > tolerance:
        raise refuse(
            f"basis='taylor' cannot reach tolerance={tolerance:g} for heights of "
            f"{heights.range:.3g} µm: its terms cancel, with a predicted error of {rounding:.2g} "
            "in single precision; use basis='svd'"
        )
    truncation = taylor_truncation(heights, expansion.kappa_max, expansion.terms)
    if truncation > 100.0 * tolerance:  # a bound: anything closer is left to the measurement
        raise refuse(
            f"terms={expansion.terms} of basis='taylor' leave a predicted error of up to "
            f"{truncation:.2g}, more than tolerance={tolerance:g}; leave terms out, raise it, or "
            "use basis='svd'"
        )


def check_size(grid: Grid, expansion: Expansion, functions: int | None) -> None:
    """Refuse a table that would not fit; `functions` of basis "svd", if it is made of them."""
    components = 1 if expansion.kind == "power" else 2
    bins = (2 * grid.last[0] + 1) * (2 * grid.last[1] + 1)
    terms = functions or expansion.terms
    size = 4 * bins * components * terms * expansion.intervals
    if size > MAX_BYTES:
        raise refuse(
            f"it would take {size / 1e9:.1f} GB ({bins:.3g} orders of {expansion.intervals}×"
            f"{terms} terms); use a smaller or shallower patch (crop, --crop), a larger tolerance, "
            "or a longer shortest wavelength"
        )
