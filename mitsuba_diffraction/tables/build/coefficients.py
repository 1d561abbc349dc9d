"""Series coefficients of a table, from transforms of its heights at some κ; as half floats."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..expansion import Expansion, principal_functions
from ..layout import LEAST_HALF, Grid
from .powers import PatchSpectra, alternate
from .spectrum import GLOSSY_RADIUS


def coefficients_of(
    spectra: PatchSpectra, grid: Grid, expansion: Expansion, functions: int | None
) -> tuple[NDArray[np.float32], NDArray[np.float64], Expansion]:
    """Series coefficients of every bin, and of order 0.

    functions : number of functions of basis "svd", or None.

    Returns
    -------
    Coefficients (intervals, ny, nx, components, terms), 0 for order 0; order 0's (intervals,
    components, series_terms); and the expansion of the bins, with its functions.
    """
    if expansion.basis == "taylor":
        return *_taylor(spectra, grid, expansion), expansion
    components, terms = expansion.components, functions or expansion.terms
    near = _near(grid, components)
    inner = _inner(spectra, grid)
    shape = *grid.shape, components
    result = np.empty((expansion.intervals, *shape, terms), np.float32)
    order_0 = np.empty((expansion.intervals, components, expansion.terms))
    values = np.empty((expansion.terms, *shape), np.float32)  # at the nodes of an interval
    flat = values.reshape(expansion.terms, -1)
    all_series = []
    for interval in range(expansion.intervals):
        nodes, specular = expansion.nodes(interval).tolist(), expansion.order_0_offset(interval)
        # Order 0, whose bin is left empty: a grating may put it out nearly altogether, so that it
        # takes double precision
        at_nodes: list[tuple[float, ...]] = []
        if expansion.kind == "power":
            for out, power in zip(values, spectra.powers(nodes), strict=True):
                out[..., 0] = power.bins[inner]
                at_nodes.append((power.change if specular else power.order_0,))
        else:  # of the only patch
            for out, kappa in zip(values, nodes, strict=True):
                amplitude = spectra.amplitudes(kappa, grid.coherent)[inner]
                less = complex(amplitude[grid.middle])  # a_0 − 1
                amplitude[grid.middle] = 0.0
                out[..., 0], out[..., 1] = amplitude.real, amplitude.imag
                at_nodes.append((less.real + 1.0 - float(specular), less.imag))
        fit = expansion.fit(interval)
        order_0[interval] = np.transpose(at_nodes) @ fit
        if functions is not None:
            fit, series = principal_functions(flat, expansion, interval, functions, near)
            all_series.append(series)
        np.matmul(flat.T, fit.astype(np.float32), out=result[interval].reshape(-1, terms))
    if functions is not None:
        expansion = replace(expansion, basis="svd", terms=terms, functions=np.array(all_series))
    return result, order_0, expansion


def _taylor(
    spectra: PatchSpectra, grid: Grid, expansion: Expansion
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Coefficients DFT[iⁿ(2h/H)ⁿ] of all bins, and of order 0."""
    result = np.empty((1, *grid.shape, 2, expansion.terms), np.float32)
    half = expansion.half_range or 1.0  # flat heights are 0
    for n in range(1, expansion.terms + 1):

        def powered(heights: NDArray[Any], n: int = n) -> NDArray[Any]:
            return (heights / half) ** n

        amplitude = spectra.first.of(powered)
        amplitude = amplitude[_inner(spectra, grid)]
        if grid.coherent:
            alternate(amplitude, grid.last)
        amplitude *= 1j**n
        result[0, :, :, 0, n - 1], result[0, :, :, 1, n - 1] = amplitude.real, amplitude.imag
        spectra.tick()
    order_0 = result[:, *grid.middle].astype(float)
    result[0, *grid.middle] = 0.0
    return result, order_0


def _near(grid: Grid, components: int) -> NDArray[np.int64]:
    """Indices of the bins close to order 0 (excluded), in (ny, nx, components)."""
    x, y = (
        step * np.arange(-last, last + 1) for step, last in zip(grid.steps, grid.last, strict=True)
    )
    distance = np.hypot(x, y[:, None])
    rows, columns = np.nonzero((distance <= GLOSSY_RADIUS) & (distance > 0.0))
    bins = rows * len(x) + columns
    return np.asarray((bins[:, None] * components + np.arange(components)).ravel())


def _inner(spectra: PatchSpectra, grid: Grid) -> tuple[slice, slice]:
    """Slices of the grid's bins within a spectrum, whose margin serves the error estimate."""
    rows, columns = (
        slice(outer - last, outer + last + 1)
        for outer, last in zip(spectra.last[::-1], grid.last[::-1], strict=True)
    )
    return rows, columns


_HALF_PEAK = 2.0**14  # largest stored half float: far from its overflow, the rest far from its zero


def half_scale(largest: float) -> float:
    """The power of two that half floats up to `largest` in size are multiplied with."""
    # Next to nothing is left unscaled: a factor beyond single precision's range helps nobody
    return 2.0 ** math.floor(math.log2(_HALF_PEAK / largest)) if largest > 1e-30 else 1.0


def half_precision(coefficients: NDArray[np.float32]) -> tuple[NDArray[np.float16], float]:
    """The coefficients as half floats, scaled so that the largest is far from overflow."""
    scale = half_scale(float(max(coefficients.max(), -coefficients.min())))
    halves = np.empty(coefficients.shape, np.float16)
    for interval in range(len(coefficients)):
        for row, half in zip(coefficients[interval], halves[interval], strict=True):
            row *= np.float32(scale)
            row[np.abs(row) < LEAST_HALF] = 0.0
            half[...] = row
    return halves, scale
