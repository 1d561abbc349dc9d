"""Building a table: attempts with ever more terms and taps, until the error measured suffices."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError, quoted, warn
from ...heights import HeightField, units_warning
from ...heights.coherence import resolved
from ...optics.geometry import sigma_of
from ...progress import Progress, silent
from ...settings import MAX_TAPS, TableSettings, checked
from ..expansion import Expansion
from ..layout import Grid
from ..table import DiffractionTable, build_error, q_limit_of
from ..window import FULL_REACH, reach_error, taps_for, trims_for
from .checks import (
    TAPS_SHARE,
    check_patches,
    check_size,
    check_units,
    check_window,
    too_wide,
    warnings_of,
)
from .choose import (
    MAX_INTERVALS,
    PACKET,
    series_expansion,
    taylor_expansion,
    taylor_rounding,
    too_many_intervals,
)
from .coefficients import coefficients_of, half_precision
from .describe import describe, roughness_of
from .error import FLOOR, ErrorMeter, Parts, worst
from .powers import PatchSpectra
from .screens import Run, Screens

#: Below it single precision transforms would spend a share of the tolerance themselves.
DOUBLE_BELOW = 2e-4


class Attempt:
    """A table with one setting, and its error.

    Parameters
    ----------
    wanted, setting : of the table; the least tolerances take transforms in double precision.
    tell : called as tell(done, total, text).

    Attributes
    ----------
    coefficients, order_0, scale, expansion, grid : of the table.
    measured : the error last measured, see `tables.build.error.worst`.
    """

    def __init__(self, wanted: _Wanted, setting: _Setting, tell: Progress) -> None:
        expansion, functions = setting.expansion, setting.functions
        self.grid = grid = _grid(wanted, setting.taps)
        check_size(grid, expansion, functions)
        double = expansion.basis == "taylor" or wanted.settings.tolerance < DOUBLE_BELOW
        margin = math.ceil(FULL_REACH * math.sqrt(2.0) / min(grid.steps)) + 2
        outer = (grid.last[0] + margin, grid.last[1] + margin)
        self._tick = _Ticks(tell)
        self._spectra = PatchSpectra(wanted.screens, outer, double, self._tick)
        self._checks = [expansion.extrema(interval) for interval in range(expansion.intervals)]
        transforms = expansion.intervals * expansion.series_terms * self._spectra.count
        self._tick.transforms = transforms
        self._tick.total = transforms + sum(map(len, self._checks)) * self._spectra.count
        self.measured: dict[str, float] = {}
        self._parts: list[Parts] = []
        self._trims: tuple[int, ...] | None = None
        self.coefficients: NDArray[Any]
        self.coefficients, self.order_0, self.expansion = coefficients_of(
            self._spectra, grid, expansion, functions
        )
        self.scale = 1.0
        if setting.half:
            self.coefficients, self.scale = half_precision(self.coefficients)

    def error(self, trims: tuple[int, ...] = ()) -> float:
        """The larger of both errors, with some taps left out."""
        if trims != self._trims:
            self._meter = ErrorMeter(self._spectra, replace(self.grid, trims=trims), self.expansion)
            self._parts, self._tick.done = [], self._tick.transforms
            for values, centre, kappas in zip(
                self.coefficients, self.order_0, self._checks, strict=True
            ):
                self._parts += self._meter.series(values, centre, kappas, self.scale)
            self.measured = worst(np.concatenate(self._checks).tolist(), self._parts)
            self._trims = trims
        return max(self.measured["near"], self.measured["far"])

    def taps_error(self) -> float:
        """The taps' own share of the error where it was worst."""
        floor = FLOOR * np.array(self._parts)[:, 1].max(axis=0)
        shares = []
        for n, name in enumerate(("near", "far")):
            alone = self._meter.taps_alone(self.measured[f"kappa_{name}"])
            shares.append(float(alone[0, n] / max(alone[1, n], floor[n], 1e-30)))
        return max(shares)


class _Ticks:
    """Tells of transforms; apart from the attempt, or that would keep its arrays in a cycle."""

    def __init__(self, tell: Progress) -> None:
        self._tell = tell
        self.done = self.transforms = self.total = 0

    def __call__(self) -> None:
        self.done = min(self.done + 1, self.total)
        text = "transforming" if self.done <= self.transforms else "measuring the error"
        self._tell(self.done, self.total, text)


#: Share of the tolerance that the taps leave which the series may use.
SERIES_SHARE = 0.8
#: Share of the tolerance that the taps may use if trimmed corners still meet the tolerance.
TRIMMED_SHARE = 0.8
#: Half floats (rounding 2⁻¹², a few of them added) are tried from this tolerance on.
HALF_FROM = 7e-4

_ATTEMPTS = 8


@dataclass(frozen=True)
class _Wanted:
    """Screens and settings of a table, and the limits that follow from them."""

    screens: Screens
    settings: TableSettings

    @cached_property
    def deepest(self) -> HeightField:
        return max(self.screens, key=lambda patch: patch.range)

    @property
    def spacing(self) -> tuple[float, float]:
        """rad/µm between bins."""
        extent = self.screens.extent
        return (2 * np.pi / extent[0], 2 * np.pi / extent[1])

    @property
    def steps(self) -> tuple[float, float]:
        """Spacing of the bins in units of 1/σ."""
        sigma = sigma_of(self.settings.lookup_width)
        return (sigma * self.spacing[0], sigma * self.spacing[1])

    @property
    def q_limit(self) -> float:
        """Largest spatial frequency that light can probe, rad/µm."""
        return q_limit_of(self.settings.wavelength_range)

    @property
    def frequency_limit(self) -> tuple[float, float]:
        """Half axes of the frequencies to tabulate, at most what light can probe."""
        x, y = self.settings.frequency_limit or (self.q_limit, self.q_limit)
        return (min(x, self.q_limit), min(y, self.q_limit))

    @property
    def kappa_max(self) -> float:
        """Largest κ to tabulate, rad/µm."""
        return self.q_limit * self.settings.height_scale_max


@dataclass(frozen=True)
class _Setting:
    """Parameters of an attempt: a series, the taps of a look-up, and the corners it leaves out."""

    expansion: Expansion
    functions: int | None
    half: bool
    taps: tuple[int, int]
    trims: tuple[int, ...]


def build_table(
    heights: HeightField | Sequence[HeightField],
    *,
    coherence_width: str | float = TableSettings.coherence_width,
    coherence: str = TableSettings.coherence,
    basis: str = TableSettings.basis,
    tolerance: float = TableSettings.tolerance,
    terms: int | None = None,
    wavelength_range: tuple[float, float] = TableSettings.wavelength_range,
    height_scale_max: float = TableSettings.height_scale_max,
    taps: int | None = None,
    frequency_limit: float | tuple[float, float] | None = None,
    windows: str | float = TableSettings.windows,
    progress: Progress | None = None,
) -> DiffractionTable:
    """Tabulate a height field to a tolerance, and measure that it is met.

    Raises a DiffractionError if a parameter is out of range, or the tolerance cannot be met: the
    text names the error to expect and what would meet it.

    Parameters
    ----------
    heights : the patch, which tiles the plane; or several of one size, whose powers are
        averaged (`ensemble` only).
    coherence_width, coherence, basis, tolerance, terms, wavelength_range, height_scale_max, taps,
    frequency_limit, windows : see `settings.TableSettings`.
    progress : called as progress(done, total, text) while it works.
    """
    settings = TableSettings(
        coherence_width, coherence, basis, tolerance, terms, taps, wavelength_range,
        height_scale_max, checked("frequency_limit", frequency_limit), windows,
    )  # fmt: skip
    table = build_with(heights, settings, progress)
    for line in warnings_of([heights] if isinstance(heights, HeightField) else heights, settings):
        warn(line)
    return table


def build_with(
    heights: HeightField | Sequence[HeightField],
    settings: TableSettings,
    progress: Progress | None = None,
    run: Run = map,
) -> DiffractionTable:
    """Build a table as `build_table`, without its warnings (`checks.warnings_of`).

    run : what does the work of windows, as `map` does here; tables without windows have no other.
    """
    scans = [heights] if not isinstance(heights, Iterable) else list(heights)
    if not all(isinstance(scan, HeightField) for scan in scans):
        raise DiffractionError(
            f"heights: expected a HeightField, or several, got {quoted(heights)}; HeightField.load "
            "reads a file"
        )
    settings = resolved(settings, scans)
    check_patches(scans, settings)
    if settings.taper_width is None and run is not map:
        raise DiffractionError(
            "workers build tables of windows: give a scan (periodic=open), or windows=W, or do "
            "without workers"
        )
    check_units(scans)
    width = None if settings.taper_width is None else settings.width
    screens = Screens(scans, width, run)
    try:
        check_window(scans[0], settings)
        table = _built(_Wanted(screens, settings), progress or silent)
    except DiffractionError as error:
        questions = [question for patch in scans if (question := units_warning(patch))]
        if not questions:
            raise
        raise DiffractionError(f"{error}; or {questions[0]}") from error
    return table


def _built(wanted: _Wanted, tell: Progress) -> DiffractionTable:
    """Try settings until one meets the tolerance."""
    setting, tolerance = _first(wanted), wanted.settings.tolerance
    for _ in range(_ATTEMPTS):
        attempt = Attempt(wanted, setting, tell)
        if setting.trims and attempt.error(setting.trims) > tolerance:
            setting = replace(setting, trims=())
        if attempt.error(setting.trims) <= tolerance:
            return _table(wanted, setting, attempt)
        setting = _next(wanted, setting, attempt)
        error = attempt.error()
        del attempt  # before the next one takes as much memory
    expansion, functions = setting.expansion, setting.functions
    raise build_error(
        f"the error is still {error:.2g} with {expansion.intervals}×{functions or expansion.terms} "
        f"terms and {setting.taps[0]}×{setting.taps[1]} taps; raise tolerance={tolerance:g}"
    )


def _first(wanted: _Wanted) -> _Setting:
    """The setting that should do, as trials on a cut-out of the patch have it."""
    settings, steps = wanted.settings, wanted.steps
    tolerance, coherent = settings.tolerance, settings.coherent
    trims: tuple[int, ...] = ()
    if settings.taps:
        taps = (settings.taps, settings.taps)
    else:
        taps = taps_for(steps, tolerance * TAPS_SHARE, coherent)
        trims = trims_for(steps, taps, tolerance * TRIMMED_SHARE, coherent)
    spare = tolerance - reach_error(steps, taps, coherent)
    budget = SERIES_SHARE * max(spare, tolerance * TAPS_SHARE)
    asked = (wanted.deepest, wanted.kappa_max, budget, settings.terms)
    functions = None
    if settings.basis == "taylor":
        expansion = taylor_expansion(*asked)
        # single precision does not survive some series
        rounding = taylor_rounding(wanted.deepest, expansion.kappa_max, expansion.terms)
        if rounding > tolerance:
            raise build_error(
                f"basis='taylor' cannot reach tolerance={tolerance:g} for heights of "
                f"{wanted.deepest.range:.3g} µm: its terms cancel, with a predicted error of "
                f"{rounding:.2g} in single precision; use basis='svd'"
            )
    else:
        expansion, functions = series_expansion(*asked, settings)
    half = expansion.basis == "chebyshev" and tolerance >= HALF_FROM
    return _Setting(expansion, functions, half, taps, trims)


def _next(wanted: _Wanted, setting: _Setting, attempt: Attempt) -> _Setting:
    """Return the next setting after an attempt with too large an error.

    Raises a DiffractionError where the user's own settings leave none to try.
    """
    tolerance, terms = wanted.settings.tolerance, wanted.settings.terms
    if attempt.taps_error() > TAPS_SHARE * tolerance:
        if wanted.settings.taps is not None:
            raise build_error(
                f"taps={wanted.settings.taps} leave an error of {attempt.error():.2g}, more than "
                f"tolerance={tolerance:g}; leave taps out, or raise the tolerance"
            )
        return replace(setting, taps=(_more(setting.taps[0]), _more(setting.taps[1])))
    if setting.half:
        return replace(setting, half=False)
    functions = setting.functions
    if functions is not None and terms is None and functions < PACKET:
        # A cut-out looked simpler than the whole patch; series are longer than functions are many
        longer = replace(setting.expansion, terms=max(setting.expansion.terms, PACKET + 2))
        return replace(setting, functions=PACKET, expansion=longer)
    expansion, error = setting.expansion, attempt.error()
    if expansion.basis == "chebyshev":
        if expansion.intervals >= MAX_INTERVALS:
            raise too_many_intervals(expansion, functions or expansion.terms, error)
        intervals = max(expansion.intervals + 1, expansion.intervals * 5 // 4)
        return replace(setting, expansion=replace(expansion, intervals=intervals))
    if terms is not None:
        raise build_error(
            f"terms={terms} of basis='taylor' leave an error of {error:.2g}, more than "
            f"tolerance={tolerance:g}; leave terms out, raise it, or use basis='svd'"
        )
    return replace(setting, expansion=replace(expansion, terms=expansion.terms + 3))


def _table(wanted: _Wanted, setting: _Setting, attempt: Attempt) -> DiffractionTable:
    """Make the table of an attempt, with its error, roughness and source."""
    settings = wanted.settings
    limit = None if wanted.frequency_limit == (wanted.q_limit,) * 2 else wanted.frequency_limit
    settings = replace(settings, frequency_limit=limit)
    return DiffractionTable(
        coefficients=attempt.coefficients,
        order_0=attempt.order_0,
        scale=attempt.scale,
        expansion=attempt.expansion,
        grid=replace(attempt.grid, trims=setting.trims),
        spacing=wanted.spacing,
        settings=settings,
        error=attempt.measured,
        roughness=roughness_of(wanted.screens, wanted.q_limit),
        source=describe(wanted.screens, settings),
    )


def _grid(wanted: _Wanted, taps: tuple[int, int]) -> Grid:
    """Grid of DFT bins, wide enough for window sums with so many taps (x, y)."""
    limit, spacing = wanted.frequency_limit, wanted.spacing
    if max(taps) > MAX_TAPS:
        raise too_wide(wanted.screens.extent, wanted.settings, taps)
    radius = (limit[0] / spacing[0], limit[1] / spacing[1])
    ny, nx = wanted.screens.tile
    # A margin as wide as the taps: see tables.lookup
    last_x = min(math.ceil(radius[0]), nx // 2) + taps[0]
    last_y = min(math.ceil(radius[1]), ny // 2) + taps[1]
    return Grid((last_x, last_y), wanted.steps, radius, taps, wanted.settings.coherent)


def _more(taps: int) -> int:
    """Return one tap more, or a sixth more where many are read."""
    return taps + max(1, taps // 6)
