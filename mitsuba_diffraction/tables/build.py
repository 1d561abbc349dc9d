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
from .choose import MAX_INTERVALS, chebyshev_expansion, taylor_expansion, too_many_intervals
from .coarse import coarse_table
from .describe import describe
from .error import FLOOR, ErrorMeter, Grid, Parts, Progress, alternate, worst
from .expansion import Expansion
from .spectrum import Spectrum
from .table import DiffractionTable, reach_of, refuse
from .window import FULL_REACH, MAX_TAPS, taps_for

#: Shares of the tolerance that taps and series may use up when their sizes are chosen.
TAPS_SHARE, SERIES_SHARE = 0.5, 0.4
#: Half floats (rounding 2⁻¹², a few of them added) are tried from this tolerance on.
HALF_FROM = 7e-4
#: Below it single precision transforms would spend a share of the tolerance themselves.
DOUBLE_BELOW = 3e-5

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
    crop: float | None,
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
    crop, kappa_max = restricted(crop, kappa_max, reach, reach * height_scale_max)
    whole = crop == reach and kappa_max == reach * height_scale_max
    choose = taylor_expansion if basis == "taylor" else chebyshev_expansion
    expansion = choose(deepest, coherence, kappa_max, tolerance * SERIES_SHARE, terms)
    chosen_taps = (taps, taps) if taps else taps_for(steps, tolerance * TAPS_SHARE, coherent)

    if basis == "taylor":
        check_taylor(deepest, expansion, tolerance)
    tell = progress or (lambda done, total, text: None)

    half = expansion.basis == "chebyshev" and tolerance >= HALF_FROM
    for _ in range(_ATTEMPTS):
        grid = _grid(spacing, steps, crop, chosen_taps, coherent, patches)
        coefficients, order_0, scale, meter, error, parts = _attempt(
            patches, grid, expansion, half, tolerance, tell
        )
        if max(error["near"], error["far"]) <= tolerance:
            return DiffractionTable(
                coefficients=coefficients,
                order_0=order_0,
                scale=scale,
                expansion=expansion,
                grid=grid,
                spacing=spacing,
                coherence_width=float(coherence_width),
                coherence=coherence,
                tolerance=float(tolerance),
                wavelength_range=(float(wavelength_range[0]), float(wavelength_range[1])),
                height_scale_max=float(height_scale_max),
                error=error,
                source=describe(patches, coherence_width, wavelength_range, chosen_taps),
                crop=None if crop == reach else crop,
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
        del coefficients
        if _taps_error(meter, error, parts) > TAPS_SHARE * tolerance:
            if taps is not None:
                raise refuse(
                    f"taps={taps} leave an error of {_larger(error):.2g}, more than "
                    f"tolerance={tolerance:g}; leave taps out, or raise the tolerance"
                )
            chosen_taps = (chosen_taps[0] + 1, chosen_taps[1] + 1)
        elif half:
            half = False
        else:
            expansion = _extended(expansion, terms, error, tolerance)
    raise refuse(
        f"the error is still {_larger(error):.2g} with {expansion.intervals}×{expansion.terms} "
        f"terms and {chosen_taps[0]}×{chosen_taps[1]} taps; raise tolerance={tolerance:g}"
    )


def _attempt(
    patches: Sequence[HeightField],
    grid: Grid,
    expansion: Expansion,
    half: bool,
    tolerance: float,
    tell: Progress,
) -> tuple[
    NDArray[np.floating], NDArray[np.float32], float, ErrorMeter, dict[str, float], list[Parts]
]:
    """Tabulate with one setting, and measure it."""
    check_size(grid, expansion)
    double = expansion.basis == "taylor" or tolerance < DOUBLE_BELOW
    margin = math.ceil(FULL_REACH * math.sqrt(2.0) / min(grid.steps)) + 2
    outer = (grid.last[0] + margin, grid.last[1] + margin)
    spectra = [Spectrum(patch, outer, double) for patch in patches]
    checks = [expansion.extrema(interval) for interval in range(expansion.intervals)]
    transforms = expansion.intervals * expansion.terms
    total = transforms + sum(map(len, checks))
    coefficients: NDArray[Any] = _coefficients(
        spectra, grid, expansion, lambda done: tell(done, total, "transforming")
    )
    centre = coefficients[:, grid.last[1], grid.last[0]]
    order_0 = centre.copy()
    centre[...] = 0.0
    scale = 1.0
    if half:
        coefficients, scale = _halved(coefficients)
    meter = ErrorMeter(spectra, grid, expansion)
    parts: list[Parts] = []
    for values, centre, kappas in zip(coefficients, order_0, checks, strict=True):
        for part in meter.series(values, centre, kappas, scale):
            parts.append(part)
            tell(transforms + len(parts), total, "measuring the error")
    error = worst(np.concatenate(checks).tolist(), parts)
    return coefficients, order_0, scale, meter, error, parts


def _coefficients(
    spectra: Sequence[Spectrum], grid: Grid, expansion: Expansion, done: Callable[[int], None]
) -> NDArray[np.float32]:
    """Series coefficients of every bin, shape (intervals, ny, nx, components, terms)."""
    ny, nx = 2 * grid.last[1] + 1, 2 * grid.last[0] + 1
    components = 1 if expansion.kind == "power" else 2
    shape = (expansion.intervals, ny, nx, components, expansion.terms)
    inner = tuple(
        slice(outer - last, outer + last + 1)
        for outer, last in zip(spectra[0].last[::-1], grid.last[::-1], strict=True)
    )
    result = np.empty(shape, np.float32)
    if expansion.basis == "taylor":
        for n in range(1, expansion.terms + 1):
            power_of_height = partial(_height_power, expansion.half_range, n)
            amplitude = spectra[0].of(power_of_height)[inner]
            if grid.coherent:
                alternate(amplitude, grid.last)
            amplitude *= 1j**n
            result[0, :, :, 0, n - 1], result[0, :, :, 1, n - 1] = amplitude.real, amplitude.imag
            done(n)
        return result
    values = np.empty((expansion.terms, ny, nx, components), np.float32)
    centre = (grid.last[1], grid.last[0])
    for interval in range(expansion.intervals):
        specular = float(expansion.specular(interval))
        for n, kappa in enumerate(expansion.nodes(interval)):
            values[n] = 0.0
            # The transform is of exp(iκh) − 1, so what is left of order 0 here is a_0 − 1
            for spectrum in spectra:
                amplitude = spectrum.of_phase(kappa, minus_one=True)[inner]
                if expansion.kind == "power":
                    values[n, ..., 0] += amplitude.real**2
                    values[n, ..., 0] += amplitude.imag**2
                    values[n, *centre, 0] += 2.0 * amplitude[centre].real + 1.0 - specular
                else:
                    amplitude[centre] += 1.0 - specular
                    if grid.coherent:
                        alternate(amplitude, grid.last)
                    values[n, ..., 0], values[n, ..., 1] = amplitude.real, amplitude.imag
            if len(spectra) > 1:
                values[n] /= len(spectra)
            done(interval * expansion.terms + n + 1)
        fit = expansion.fit(interval).astype(np.float32)
        flat = values.reshape(expansion.terms, -1)
        np.matmul(flat.T, fit, out=result[interval].reshape(-1, expansion.terms))
    return result


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
    reach: float,
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
    radius = (reach / spacing[0], reach / spacing[1])
    ny, nx = np.max([patch.shape for patch in patches], axis=0)
    # A margin as wide as the taps: see tables.lookup
    last_x = min(math.ceil(radius[0]), int(nx) // 2) + taps[0]
    last_y = min(math.ceil(radius[1]), int(ny) // 2) + taps[1]
    return Grid((last_x, last_y), steps, radius, taps, coherent)


def _taps_error(meter: ErrorMeter, error: dict[str, float], parts: list[Parts]) -> float:
    """The taps' own share of the error where it was worst."""
    floor = FLOOR * np.array(parts)[:, 1].max(axis=0)
    shares = []
    for n, name in enumerate(("near", "far")):
        alone = meter.taps_alone(error[f"kappa_{name}"])
        shares.append(float(alone[0, n] / max(alone[1, n], floor[n], 1e-30)))
    return max(shares)


def _extended(
    expansion: Expansion, terms: int | None, error: dict[str, float], tolerance: float
) -> Expansion:
    """A longer series, or an error where the user fixed its length."""
    if expansion.basis == "chebyshev":
        if expansion.intervals >= MAX_INTERVALS:
            raise too_many_intervals(expansion, _larger(error))
        return replace(
            expansion, intervals=max(expansion.intervals + 1, expansion.intervals * 5 // 4)
        )
    if terms is not None:
        raise refuse(
            f"terms={terms} of basis='taylor' leave an error of {_larger(error):.2g}, more than "
            f"tolerance={tolerance:g}; leave terms out, raise it, or use basis='chebyshev'"
        )
    return replace(expansion, terms=expansion.terms + 3)


def _larger(error: dict[str, float]) -> float:
    return max(error["near"], error["far"])
