"""Building a table: which series, how many terms and taps, and the proof that they suffice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..geometry import sigma_of
from ..heightfield import HeightField
from ..progress import Progress, silent
from ..reference import check_coherence
from .attempt import Attempt
from .checks import check_parameters, check_patches, check_taylor, restricted
from .choose import (
    MAX_INTERVALS,
    PACKET,
    chebyshev_expansion,
    svd_expansion,
    taylor_expansion,
    too_many_intervals,
)
from .coarse import coarse_table
from .describe import describe
from .error import Grid
from .expansion import Expansion
from .table import DiffractionTable, reach_of, refuse
from .window import MAX_TAPS, reach_error, taps_for, trims_for

#: What taps may use up of the tolerance when their number is chosen, and series of what they leave.
TAPS_SHARE, SERIES_SHARE = 0.5, 0.8
#: What the taps may use up, if leaving out corners then still meets the tolerance.
TRIMMED_SHARE = 0.8
#: Half floats (rounding 2⁻¹², a few of them added) are tried from this tolerance on.
HALF_FROM = 7e-4


_ATTEMPTS = 8


def build_table(
    heights: HeightField | Sequence[HeightField],
    *,
    coherence_width: float,
    coherence: str,
    basis: str,
    tolerance: float,
    terms: int | None,
    wavelength_range: tuple[float, float],
    height_scale_max: float,
    taps: int | None,
    crop: float | tuple[float, float] | None,
    kappa_max: float | None,
    progress: Progress | None,
) -> DiffractionTable:
    """See `DiffractionTable.build`."""
    check_coherence(coherence_width, coherence)
    check_parameters(basis, tolerance, terms, wavelength_range, height_scale_max, taps)
    patches = [heights] if isinstance(heights, HeightField) else list(heights)
    check_patches(patches, coherence, basis)
    deepest = max(patches, key=lambda patch: patch.range)
    extent = patches[0].extent
    spacing = (2 * np.pi / extent[0], 2 * np.pi / extent[1])
    sigma = sigma_of(coherence_width)
    steps = (sigma * spacing[0], sigma * spacing[1])
    coherent = coherence == "patch"
    reach = reach_of(wavelength_range)
    radii, kappa_max = restricted(crop, kappa_max, reach, reach * height_scale_max)
    everywhere = radii == (reach, reach)
    whole = everywhere and kappa_max == reach * height_scale_max
    chosen_taps = (taps, taps) if taps else taps_for(steps, tolerance * TAPS_SHARE, coherent)
    spare = tolerance - reach_error(steps, chosen_taps, coherent)
    budget = SERIES_SHARE * max(spare, tolerance * TAPS_SHARE)
    functions = None
    if basis in ("auto", "svd"):
        expansion, functions = svd_expansion(deepest, coherence, kappa_max, budget, terms)
    else:
        choose = taylor_expansion if basis == "taylor" else chebyshev_expansion
        expansion = choose(deepest, coherence, kappa_max, budget, terms)
    trims: tuple[int, ...] = ()
    if taps is None:
        trims = trims_for(steps, chosen_taps, tolerance * TRIMMED_SHARE, coherent)

    if basis == "taylor":
        check_taylor(deepest, expansion, tolerance)
    tell = progress or silent

    half = expansion.basis == "chebyshev" and tolerance >= HALF_FROM
    for _ in range(_ATTEMPTS):
        grid = _grid(spacing, steps, radii, chosen_taps, coherent, patches)
        attempt = Attempt(patches, grid, expansion, functions, half, tolerance, tell)
        if trims and attempt.error(trims) > tolerance:
            trims = ()
        if attempt.error(trims) <= tolerance:
            return DiffractionTable(
                coefficients=attempt.coefficients,
                order_0=attempt.order_0,
                scale=attempt.scale,
                expansion=attempt.expansion,
                grid=replace(grid, trims=trims),
                spacing=spacing,
                coherence_width=float(coherence_width),
                coherence=coherence,
                tolerance=float(tolerance),
                wavelength_range=(float(wavelength_range[0]), float(wavelength_range[1])),
                height_scale_max=float(height_scale_max),
                error=attempt.measured,
                source=describe(patches, coherence_width, wavelength_range, chosen_taps),
                crop=None if everywhere else radii,
                coarse=None
                if whole
                else coarse_table(
                    patches,
                    coherence_width=coherence_width,
                    wavelength_range=wavelength_range,
                    height_scale_max=height_scale_max,
                    progress=tell,
                ),
            )
        if attempt.taps_error() > TAPS_SHARE * tolerance:
            if taps is not None:
                raise refuse(
                    f"taps={taps} leave an error of {attempt.error():.2g}, more than "
                    f"tolerance={tolerance:g}; leave taps out, or raise the tolerance"
                )
            chosen_taps = (_more(chosen_taps[0]), _more(chosen_taps[1]))
        elif half:
            half = False
        elif functions is not None and terms is None and functions < PACKET:
            functions = PACKET  # a cut-out looked simpler than the whole patch
        else:
            expansion = _extended(expansion, functions, terms, attempt.error(), tolerance)
        found = attempt.error()
        del attempt
    raise refuse(
        f"the error is still {found:.2g} with {expansion.intervals}×{functions or expansion.terms} "
        f"terms and {chosen_taps[0]}×{chosen_taps[1]} taps; raise tolerance={tolerance:g}"
    )


def _grid(
    spacing: tuple[float, float],
    steps: tuple[float, float],
    radii: tuple[float, float],
    taps: tuple[int, int],
    coherent: bool,
    patches: Sequence[HeightField],
) -> Grid:
    if max(taps) > MAX_TAPS:
        raise refuse(
            f"the patch is {max(patches[0].extent):.4g} µm wide, so much more than the coherence "
            f"window that a look-up would read {taps[0]}×{taps[1]} orders; crop the patch, or "
            "raise coherence_width or tolerance"
        )
    radius = (radii[0] / spacing[0], radii[1] / spacing[1])
    ny, nx = np.max([patch.shape for patch in patches], axis=0)
    # A margin as wide as the taps: see tables.lookup
    last_x = min(math.ceil(radius[0]), int(nx) // 2) + taps[0]
    last_y = min(math.ceil(radius[1]), int(ny) // 2) + taps[1]
    return Grid((last_x, last_y), steps, radius, taps, coherent)


def _more(taps: int) -> int:
    """By one where few are read; by a sixth under a window far narrower than the patch."""
    return taps + max(1, taps // 6)


def _extended(
    expansion: Expansion, functions: int | None, terms: int | None, error: float, tolerance: float
) -> Expansion:
    """A longer series, or an error where the user fixed its length."""
    if expansion.basis == "chebyshev":
        if expansion.intervals >= MAX_INTERVALS:
            raise too_many_intervals(expansion, functions or expansion.terms, error)
        return replace(
            expansion, intervals=max(expansion.intervals + 1, expansion.intervals * 5 // 4)
        )
    if terms is not None:
        raise refuse(
            f"terms={terms} of basis='taylor' leave an error of {error:.2g}, more than "
            f"tolerance={tolerance:g}; leave terms out, raise it, or use basis='svd'"
        )
    return replace(expansion, terms=expansion.terms + 3)
