"""Series coefficients of a table, from transforms of its heights at some κ."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..expansion import Expansion, principal_functions
from ..packing import Grid
from .error import NEAR, alternate
from .spectrum import Spectrum

#: Fills an array with what is expanded, of all bins at one κ of an interval; returns order 0's.
ValuesAt = Callable[[float, int, NDArray[np.float32]], Sequence[float]]


def series_of(
    values_at: ValuesAt,
    shape: tuple[int, int, int],
    expansion: Expansion,
    functions: int | None,
    near: NDArray[np.int64],
    done: Callable[[int], None],
) -> tuple[NDArray[np.float32], NDArray[np.float64], Expansion]:
    """Series coefficients (intervals, ny, nx, components, terms) of whatever has values at nodes.

    Parameters
    ----------
    values_at : what is expanded, at one κ.
    shape : (ny, nx, components) of the values.
    functions : how many functions of basis "svd" the Chebyshev series is made into, if it is; the
        expansion returned then has them.
    near : indices of the values close to order 0, see `principal_functions`.
    done : called with the number of κ that are done.
    """
    terms = functions or expansion.terms
    result = np.empty((expansion.intervals, *shape, terms), np.float32)
    order_0 = np.empty((expansion.intervals, shape[2], expansion.terms))
    values = np.empty((expansion.terms, *shape), np.float32)
    flat = values.reshape(expansion.terms, -1)
    found = []
    for interval in range(expansion.intervals):
        at_nodes = []
        for n, kappa in enumerate(expansion.nodes(interval)):
            at_nodes.append(values_at(kappa, interval, values[n]))
            done(interval * expansion.terms + n + 1)
        fit = expansion.fit(interval)
        order_0[interval] = np.transpose(at_nodes) @ fit
        if functions is not None:
            fit, series = principal_functions(flat, expansion, interval, functions, near)
            found.append(series)
        np.matmul(flat.T, fit.astype(np.float32), out=result[interval].reshape(-1, terms))
    if functions is not None:
        expansion = replace(expansion, basis="svd", terms=terms, functions=np.array(found))
    return result, order_0, expansion


def coefficients_of(
    spectra: Sequence[Spectrum],
    grid: Grid,
    expansion: Expansion,
    functions: int | None,
    done: Callable[[int], None],
) -> tuple[NDArray[np.float32], NDArray[np.float64], Expansion]:
    """Series coefficients of every bin, (intervals, ny, nx, components, terms), and of order 0.

    functions : see `series_of`.
    """
    if expansion.basis == "taylor":
        return *_taylor(spectra[0], grid, expansion, done), expansion
    components = 1 if expansion.kind == "power" else 2

    def values_at(kappa: float, interval: int, values: NDArray[np.float32]) -> Sequence[float]:
        return _values_at(kappa, spectra, grid, expansion, interval, values)

    near = _near(grid, components)
    return series_of(values_at, (*grid.shape, components), expansion, functions, near, done)


def _taylor(
    spectrum: Spectrum, grid: Grid, expansion: Expansion, done: Callable[[int], None]
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Coefficients DFT[iⁿ(2h/H)ⁿ] of all bins, and of order 0."""
    result = np.empty((1, *grid.shape, 2, expansion.terms), np.float32)
    for n in range(1, expansion.terms + 1):
        amplitude = spectrum.of(partial(_height_power, expansion.half_range, n))
        amplitude = amplitude[_inner(spectrum, grid)]
        if grid.coherent:
            alternate(amplitude, grid.last)
        amplitude *= 1j**n
        result[0, :, :, 0, n - 1], result[0, :, :, 1, n - 1] = amplitude.real, amplitude.imag
        done(n)
    order_0 = result[:, *grid.middle].astype(float)
    result[0, *grid.middle] = 0.0
    return result, order_0


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
    specular = float(expansion.order_0_offset(interval))
    values[...] = 0.0
    order_0 = np.zeros(values.shape[-1])
    for spectrum in spectra:
        # The transform is of exp(iκh) − 1, so this is a_0 − 1
        amplitude = spectrum.of_phase(kappa, minus_one=True)[_inner(spectrum, grid)]
        less = complex(amplitude[grid.middle])
        amplitude[grid.middle] = 0.0
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
