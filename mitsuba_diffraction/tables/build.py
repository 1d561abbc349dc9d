"""Building a table: which series, how many terms and taps, and the proof that they suffice."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import sigma_of
from ..heightfield import HeightField
from ..reference import check_coherence
from .checks import check_parameters, check_patches, check_size, check_taylor, restricted
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
from .error import FLOOR, NEAR, ErrorMeter, Grid, Parts, Progress, alternate, worst
from .expansion import Expansion, principal_functions
from .spectrum import Spectrum
from .table import DiffractionTable, reach_of, refuse
from .window import FULL_REACH, MAX_TAPS, reach_error, taps_for, trims_for

#: What taps may use up of the tolerance when their number is chosen, and series of what they leave.
TAPS_SHARE, SERIES_SHARE = 0.5, 0.8
#: What the taps may use up, if leaving out corners then still meets the tolerance.
TRIMMED_SHARE = 0.8
#: Half floats (rounding 2⁻¹², a few of them added) are tried from this tolerance on.
HALF_FROM = 7e-4
#: Below it single precision transforms would spend a share of the tolerance themselves.
DOUBLE_BELOW = 2e-4

_ATTEMPTS = 8
_SUBNORMAL, _ROUNDS = np.float32(2.0**-14), np.float32(0.75)
_HALF_PEAK = 2.0**14  # largest stored half float: far from its overflow, the rest far from its zero


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
    tell = progress or (lambda done, total, text: None)

    half = expansion.basis == "chebyshev" and tolerance >= HALF_FROM
    for _ in range(_ATTEMPTS):
        grid = _grid(spacing, steps, radii, chosen_taps, coherent, patches)
        attempt = _Attempt(patches, grid, expansion, functions, half, tolerance, tell)
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


class _Attempt:
    """A table with one setting, and its error.

    Attributes
    ----------
    coefficients, order_0, scale, expansion : of the table.
    measured : the error last measured, see `tables.error.worst`.
    """

    def __init__(
        self,
        patches: Sequence[HeightField],
        grid: Grid,
        expansion: Expansion,
        functions: int | None,
        half: bool,
        tolerance: float,
        tell: Progress,
    ) -> None:
        check_size(grid, expansion, functions)
        double = expansion.basis == "taylor" or tolerance < DOUBLE_BELOW
        margin = math.ceil(FULL_REACH * math.sqrt(2.0) / min(grid.steps)) + 2
        outer = (grid.last[0] + margin, grid.last[1] + margin)
        self._spectra = [Spectrum(patch, outer, double) for patch in patches]
        self._checks = [expansion.extrema(interval) for interval in range(expansion.intervals)]
        self._transforms = expansion.intervals * expansion.series_terms
        self._total = self._transforms + sum(map(len, self._checks))
        self._tell, self._grid = tell, grid
        self.measured: dict[str, float] = {}
        self._parts: list[Parts] = []
        self._trims: tuple[int, ...] | None = None
        self.coefficients: NDArray[Any]
        self.coefficients, self.order_0, self.expansion = _coefficients(
            self._spectra,
            grid,
            expansion,
            functions,
            lambda done: tell(done, self._total, "transforming"),
        )
        self.scale = 1.0
        if half:
            self.coefficients, self.scale = _halved(self.coefficients)

    def error(self, trims: tuple[int, ...] = ()) -> float:
        """The larger of both errors, with some taps left out."""
        if trims != self._trims:
            self._meter = ErrorMeter(
                self._spectra, replace(self._grid, trims=trims), self.expansion
            )
            self._parts = []
            for values, centre, kappas in zip(
                self.coefficients, self.order_0, self._checks, strict=True
            ):
                for part in self._meter.series(values, centre, kappas, self.scale):
                    self._parts.append(part)
                    done = self._transforms + len(self._parts)
                    self._tell(done, self._total, "measuring the error")
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


def _coefficients(
    spectra: Sequence[Spectrum],
    grid: Grid,
    expansion: Expansion,
    functions: int | None,
    done: Callable[[int], None],
) -> tuple[NDArray[np.float32], NDArray[np.float64], Expansion]:
    """Series coefficients of every bin, (intervals, ny, nx, components, terms), and of order 0.

    functions : how many functions of basis "svd" the Chebyshev series is made into, if it is; the
        expansion returned then has them.
    """
    ny, nx = 2 * grid.last[1] + 1, 2 * grid.last[0] + 1
    centre = (grid.last[1], grid.last[0])
    components = 1 if expansion.kind == "power" else 2
    terms = functions or expansion.terms
    result = np.empty((expansion.intervals, ny, nx, components, terms), np.float32)
    order_0 = np.empty((expansion.intervals, components, expansion.terms))
    if expansion.basis == "taylor":
        inner = _inner(spectra[0], grid)
        for n in range(1, expansion.terms + 1):
            power_of_height = partial(_height_power, expansion.half_range, n)
            amplitude = spectra[0].of(power_of_height)[inner]
            if grid.coherent:
                alternate(amplitude, grid.last)
            amplitude *= 1j**n
            result[0, :, :, 0, n - 1], result[0, :, :, 1, n - 1] = amplitude.real, amplitude.imag
            done(n)
        order_0[0] = result[0, *centre]
        result[0, *centre] = 0.0
        return result, order_0, expansion
    values = np.empty((expansion.terms, ny, nx, components), np.float32)
    flat = values.reshape(expansion.terms, -1)
    near = _near(grid, components)
    found = []
    for interval in range(expansion.intervals):
        powers = []
        for n, kappa in enumerate(expansion.nodes(interval)):
            powers.append(_values_at(kappa, spectra, grid, expansion, interval, values[n]))
            done(interval * expansion.terms + n + 1)
        fit = expansion.fit(interval)
        order_0[interval] = np.transpose(powers) @ fit
        if functions is not None:
            fit, series = principal_functions(flat, expansion, interval, functions, near)
            found.append(series)
        np.matmul(flat.T, fit.astype(np.float32), out=result[interval].reshape(-1, terms))
    if functions is not None:
        expansion = replace(expansion, basis="svd", terms=terms, functions=np.array(found))
    return result, order_0, expansion


def _near(grid: Grid, components: int) -> NDArray[np.int64]:
    """Indices of the bins close to order 0, which it is none of, in (ny, nx, components)."""
    x, y = (
        step * np.arange(-last, last + 1) for step, last in zip(grid.steps, grid.last, strict=True)
    )
    distance = np.hypot(x, y[:, None])
    rows, columns = np.nonzero((distance <= NEAR) & (distance > 0.0))
    bins = rows * len(x) + columns
    return np.asarray((bins[:, None] * components + np.arange(components)).ravel())


def _values_at(
    kappa: float,
    spectra: Sequence[Spectrum],
    grid: Grid,
    expansion: Expansion,
    interval: int,
    values: NDArray[np.float32],
) -> list[float]:
    """What is expanded, of all bins (ny, nx, components) at one κ, written to `values`.

    Returns
    -------
    that of order 0, whose bin is left empty: a grating may put it out nearly altogether, so that it
    takes double precision.
    """
    centre = (grid.last[1], grid.last[0])
    specular = float(expansion.specular(interval))
    values[...] = 0.0
    order_0 = np.zeros(values.shape[-1])
    for spectrum in spectra:
        # The transform is of exp(iκh) − 1, so this is a_0 − 1
        amplitude = spectrum.of_phase(kappa, minus_one=True)[_inner(spectrum, grid)]
        less = complex(amplitude[centre])
        amplitude[centre] = 0.0
        if expansion.kind == "power":
            values[..., 0] += amplitude.real**2
            values[..., 0] += amplitude.imag**2
            # |a_0|² − 1 without cancellation as κ → 0, or |a_0|² without it where that vanishes
            order_0 += abs(less) ** 2 + 2.0 * less.real if specular else abs(1.0 + less) ** 2
        else:
            if grid.coherent:
                alternate(amplitude, grid.last)
            values[..., 0], values[..., 1] = amplitude.real, amplitude.imag
            order_0 += less.real + 1.0 - specular, less.imag
    if len(spectra) > 1:
        values /= len(spectra)
    return list(order_0 / len(spectra))


def _inner(spectrum: Spectrum, grid: Grid) -> tuple[slice, slice]:
    """Where a spectrum, which has a margin for the error's sake, has the grid's bins."""
    rows, columns = (
        slice(outer - last, outer + last + 1)
        for outer, last in zip(spectrum.last[::-1], grid.last[::-1], strict=True)
    )
    return rows, columns


def _height_power(half_range: float, n: int, heights: NDArray[Any]) -> NDArray[Any]:
    """(2h/H)ⁿ."""
    return (heights / half_range) ** n if half_range > 0.0 else np.zeros_like(heights)


def _halved(coefficients: NDArray[np.float32]) -> tuple[NDArray[np.float16], float]:
    """The coefficients as half floats, scaled so that the largest is far from overflow."""
    largest = float(max(coefficients.max(), -coefficients.min()))
    # Next to nothing is left unscaled: a factor beyond single precision's range helps nobody
    scale = 2.0 ** math.floor(math.log2(_HALF_PEAK / largest)) if largest > 1e-30 else 1.0
    halves = np.empty(coefficients.shape, np.float16)
    for interval in range(len(coefficients)):
        for row, half in zip(coefficients[interval], halves[interval], strict=True):
            row *= np.float32(scale)
            # The smallest half floats are multiples of 2⁻²⁴, and so is what this leaves of small
            # numbers; NumPy is twenty times slower where its conversion has to round them.
            np.subtract(row + _ROUNDS, _ROUNDS, out=row, where=np.abs(row) < _SUBNORMAL)
            half[...] = row
    return halves, scale


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
