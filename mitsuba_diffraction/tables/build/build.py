"""Building a table: which series, how many terms and taps, and the proof that they suffice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...heights.validity import units_warning
from ...optics.geometry import sigma_of
from ...progress import Progress, silent
from ...reference import check_coherence
from ..expansion import Expansion
from ..table import DiffractionTable, reach_of, refuse
from ..window import MAX_TAPS, reach_error, taps_for, trims_for
from .attempt import Attempt
from .checks import check_parameters, check_patches, check_taylor, check_units, restricted
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

#: What taps may use up of the tolerance when their number is chosen, and series of what they leave.
TAPS_SHARE, SERIES_SHARE = 0.5, 0.8
#: What the taps may use up, if leaving out corners then still meets the tolerance.
TRIMMED_SHARE = 0.8
#: Half floats (rounding 2⁻¹², a few of them added) are tried from this tolerance on.
HALF_FROM = 7e-4

_ATTEMPTS = 8


@dataclass(frozen=True)
class _Wanted:
    """What is asked for, and what follows from it at once."""

    patches: Sequence[HeightField]
    coherence_width: float
    coherence: str
    basis: str
    tolerance: float
    terms: int | None
    wavelength_range: tuple[float, float]
    height_scale_max: float
    taps: int | None
    radii: tuple[float, float]
    kappa_max: float

    @property
    def deepest(self) -> HeightField:
        return max(self.patches, key=lambda patch: patch.range)

    @property
    def spacing(self) -> tuple[float, float]:
        """rad/µm between bins."""
        extent = self.patches[0].extent
        return (2 * np.pi / extent[0], 2 * np.pi / extent[1])

    @property
    def steps(self) -> tuple[float, float]:
        """The same in units of 1/σ."""
        sigma = sigma_of(self.coherence_width)
        return (sigma * self.spacing[0], sigma * self.spacing[1])

    @property
    def coherent(self) -> bool:
        return self.coherence == "patch"

    @property
    def everywhere(self) -> bool:
        """Whether all frequencies are wanted that light can probe."""
        reach = reach_of(self.wavelength_range)
        return self.radii == (reach, reach)

    @property
    def whole(self) -> bool:
        """And all κ."""
        reach = reach_of(self.wavelength_range)
        return self.everywhere and self.kappa_max == reach * self.height_scale_max


@dataclass(frozen=True)
class _Setting:
    """What is tried: a series, the bins that a look-up reads, and what it leaves out of them."""

    expansion: Expansion
    functions: int | None
    half: bool
    taps: tuple[int, int]
    trims: tuple[int, ...]


def build_table(
    heights: HeightField | Sequence[HeightField],
    *,
    coherence_width: float = 65.0,
    coherence: str = "ensemble",
    basis: str = "auto",
    tolerance: float = 1e-3,
    terms: int | None = None,
    wavelength_range: tuple[float, float] = (360.0, 830.0),
    height_scale_max: float = 1.5,
    taps: int | None = None,
    crop: float | tuple[float, float] | None = None,
    kappa_max: float | None = None,
    progress: Progress | None = None,
) -> DiffractionTable:
    """Tabulate a height field to a tolerance, and measure that it is met.

    Parameters
    ----------
    heights : the patch, which tiles the plane; or several of one size, whose powers are
        averaged (`ensemble` only).
    coherence_width : 4σ of the Gaussian amplitude window, µm.
    coherence : "ensemble" (window power averaged over its position) or "patch" (one window).
    basis : "svd" (also as "auto"), "chebyshev" or "taylor"; see `tables.expansion`.
    tolerance : relative error of ⟨|P|²⟩ at the worst κ, as `tables.error` measures it.
    terms : coefficients of a series; by default as many as the tolerance takes.
    wavelength_range : nm; the shortest sets how far the table reaches.
    height_scale_max : largest factor on the heights that the table serves.
    taps : bins read in each direction; by default as many as the tolerance takes.
    crop : largest spatial frequency k·|(u, v)| that is tabulated, rad/µm, or half axes of an
        ellipse along x and y; by default all that light of the shortest wavelength can probe.
    kappa_max : largest k·w·height_scale that is, rad/µm; by default likewise. Beyond either, a
        table of coarse cells answers, which is right on average (`tables.coarse`).
    progress : called as progress(done, total, text) while it works.

    Raises
    ------
    DiffractionError
        If a parameter is out of range, or the tolerance cannot be met: the text names the
        error to expect and what would meet it.
    """
    check_coherence(coherence_width, coherence)
    check_parameters(basis, tolerance, terms, wavelength_range, height_scale_max, taps)
    patches = [heights] if isinstance(heights, HeightField) else list(heights)
    check_patches(patches, coherence, basis)
    check_units(patches)
    reach = reach_of(wavelength_range)
    radii, kappa_max = restricted(crop, kappa_max, reach, reach * height_scale_max)
    wanted = _Wanted(
        patches, coherence_width, coherence, basis, tolerance, terms, wavelength_range,
        height_scale_max, taps, radii, kappa_max,
    )  # fmt: skip
    try:
        return _built(wanted, progress or silent)
    except DiffractionError as error:
        questions = [question for patch in patches if (question := units_warning(patch))]
        if not questions:
            raise
        raise DiffractionError(f"{error}; or {questions[0]}") from error


def _built(wanted: _Wanted, tell: Progress) -> DiffractionTable:
    """The first attempt that meets the tolerance."""
    patches, tolerance = wanted.patches, wanted.tolerance
    setting = _first(wanted)
    for _ in range(_ATTEMPTS):
        grid, expansion = _grid(wanted, setting.taps), setting.expansion
        attempt = Attempt(
            patches, grid, expansion, setting.functions, setting.half, tolerance, tell
        )
        if setting.trims and attempt.error(setting.trims) > tolerance:
            setting = replace(setting, trims=())
        if attempt.error(setting.trims) <= tolerance:
            return _table(wanted, setting, attempt, tell)
        setting = _next(wanted, setting, attempt)
        found = attempt.error()
        del attempt  # before the next one takes as much memory
    expansion, functions = setting.expansion, setting.functions
    raise refuse(
        f"the error is still {found:.2g} with {expansion.intervals}×{functions or expansion.terms} "
        f"terms and {setting.taps[0]}×{setting.taps[1]} taps; raise tolerance={tolerance:g}"
    )


def _first(wanted: _Wanted) -> _Setting:
    """The setting that should do, as trials on a cut-out of the patch have it."""
    tolerance, steps, coherent = wanted.tolerance, wanted.steps, wanted.coherent
    trims: tuple[int, ...] = ()
    if wanted.taps:
        taps = (wanted.taps, wanted.taps)
    else:
        taps = taps_for(steps, tolerance * TAPS_SHARE, coherent)
        trims = trims_for(steps, taps, tolerance * TRIMMED_SHARE, coherent)
    spare = tolerance - reach_error(steps, taps, coherent)
    budget = SERIES_SHARE * max(spare, tolerance * TAPS_SHARE)
    asked = (wanted.deepest, wanted.coherence, wanted.kappa_max, budget, wanted.terms)
    functions = None
    if wanted.basis == "taylor":
        expansion = taylor_expansion(*asked)
        check_taylor(wanted.deepest, expansion, tolerance)
    elif wanted.basis == "chebyshev":
        expansion = chebyshev_expansion(*asked)
    else:
        expansion, functions = svd_expansion(*asked)
    half = expansion.basis == "chebyshev" and tolerance >= HALF_FROM
    return _Setting(expansion, functions, half, taps, trims)


def _next(wanted: _Wanted, setting: _Setting, attempt: Attempt) -> _Setting:
    """What to try after an attempt that leaves too much; an error where the user forbids it."""
    tolerance = wanted.tolerance
    if attempt.taps_error() > TAPS_SHARE * tolerance:
        if wanted.taps is not None:
            raise refuse(
                f"taps={wanted.taps} leave an error of {attempt.error():.2g}, more than "
                f"tolerance={tolerance:g}; leave taps out, or raise the tolerance"
            )
        return replace(setting, taps=(_more(setting.taps[0]), _more(setting.taps[1])))
    if setting.half:
        return replace(setting, half=False)
    functions = setting.functions
    if functions is not None and wanted.terms is None and functions < PACKET:
        # A cut-out looked simpler than the whole patch; series are longer than functions are many
        terms = max(setting.expansion.terms, PACKET + 2)
        longer = replace(setting.expansion, terms=terms)
        return replace(setting, functions=PACKET, expansion=longer)
    longer = _extended(setting.expansion, functions, wanted.terms, attempt.error(), tolerance)
    return replace(setting, expansion=longer)


def _table(
    wanted: _Wanted, setting: _Setting, attempt: Attempt, tell: Progress
) -> DiffractionTable:
    """What an attempt made, with all that a table knows of itself."""
    low, high = wanted.wavelength_range
    coarse = None
    if not wanted.whole:
        coarse = coarse_table(
            wanted.patches,
            coherence_width=wanted.coherence_width,
            wavelength_range=wanted.wavelength_range,
            height_scale_max=wanted.height_scale_max,
            progress=tell,
        )
    return DiffractionTable(
        coefficients=attempt.coefficients,
        order_0=attempt.order_0,
        scale=attempt.scale,
        expansion=attempt.expansion,
        grid=replace(attempt.grid, trims=setting.trims),
        spacing=wanted.spacing,
        coherence_width=float(wanted.coherence_width),
        coherence=wanted.coherence,
        tolerance=float(wanted.tolerance),
        wavelength_range=(float(low), float(high)),
        height_scale_max=float(wanted.height_scale_max),
        error=attempt.measured,
        source=describe(
            wanted.patches, wanted.coherence_width, wanted.wavelength_range, setting.taps
        ),
        crop=None if wanted.everywhere else wanted.radii,
        coarse=coarse,
    )


def _grid(wanted: _Wanted, taps: tuple[int, int]) -> Grid:
    """The bins that these taps can read."""
    patches, radii, spacing = wanted.patches, wanted.radii, wanted.spacing
    if max(taps) > MAX_TAPS:
        raise refuse(
            f"the patch is {max(patches[0].extent):.4g} µm wide, so much more than the coherence "
            f"window that a look-up would read {taps[0]}×{taps[1]} orders; crop the patch, for "
            f"instance crop={wanted.coherence_width:g} (--crop {wanted.coherence_width:g}), or "
            "raise coherence_width or tolerance"
        )
    radius = (radii[0] / spacing[0], radii[1] / spacing[1])
    ny, nx = np.max([patch.shape for patch in patches], axis=0)
    # A margin as wide as the taps: see tables.lookup
    last_x = min(math.ceil(radius[0]), int(nx) // 2) + taps[0]
    last_y = min(math.ceil(radius[1]), int(ny) // 2) + taps[1]
    return Grid((last_x, last_y), wanted.steps, radius, taps, wanted.coherent)


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
