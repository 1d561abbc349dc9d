"""A patch's diffraction in coarse cells: what a table of a restricted domain has everywhere else.

A scene sends next to no light to most spatial frequencies that light could probe. A table that
ends early (`DiffractionTable.build` with `q_max` or `kappa_max`) goes on as this one, whose bins
are cells of many orders each. A cell holds the power of all its orders, and a Gaussian about one
cell wide carries it: sums over a few cells are right, the structure within a cell (speckle, the
sharp orders of a grating) is averaged. Order 0 keeps its own lobe.

With cells of width D (rad/µm) in both directions and s = σ'D, the window σ' of the cells has the
integral π/σ'² = πD²/s² where that of the orders has π/σ²; so a cell that holds the power p has the
coefficient p·(s/σD)².
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ...heights.field import HeightField
from ...optics.geometry import sigma_of
from ...progress import Progress
from ...settings import TableSettings
from ..expansion import Expansion
from ..layout import Grid
from ..table import DiffractionTable, q_limit_of
from ..window import taps_for
from .choose import svd_expansion
from .coefficients import half_scale, series_of
from .describe import roughness_of
from .powers import Spectra
from .windows import shape_of

#: Width of a cell in units of 1/σ, and fewest cells from the middle to the edge.
CELL, FEWEST = 16.0, 24
#: s: a sum of Gaussians exp(−s²Δ²) one apart is even to 2 exp(−π²/s²) = 1 %, and 3×3 taps do.
STEP = 1.35
#: Of the series in κ and of the taps: the averaging itself costs more.
TOLERANCE = 1e-2


def coarse_table(
    patches: Sequence[HeightField], settings: TableSettings, progress: Progress
) -> DiffractionTable:
    """Sum a patch's orders over coarse cells, as far as light can probe."""
    own_settings = TableSettings(
        settings.coherence_width,
        tolerance=TOLERANCE,
        wavelength_range=settings.wavelength_range,
        height_scale_max=settings.height_scale_max,
        second_order=False,
    )
    deepest = max(patches, key=lambda patch: patch.range)
    sigma = sigma_of(settings.coherence_width)
    q_limit = q_limit_of(settings.wavelength_range)
    expansion, functions = svd_expansion(
        deepest, "ensemble", q_limit * settings.height_scale_max, 0.5 * TOLERANCE, None
    )
    orders = [2.0 * np.pi / length for length in patches[0].extent]
    wanted = min(CELL / sigma, q_limit / FEWEST)
    # An odd number of orders, so that order 0 is in the middle of a cell
    each = [2 * math.floor(0.5 * wanted / spacing) + 1 for spacing in orders]
    spacing = [n * dq for n, dq in zip(each, orders, strict=True)]
    own = [sigma * width for width in spacing]
    steps = tuple(s if n == 1 else min(s, STEP) for s, n in zip(own, each, strict=True))
    taps = taps_for((steps[0], steps[1]), TOLERANCE, False)
    radius = (q_limit / spacing[0], q_limit / spacing[1])
    ny, nx = shape_of(patches)
    last = tuple(  # beyond Nyquist's frequency there are no orders
        min(math.ceil(r), int(pixels) // (2 * n) + 1) + tap
        for r, pixels, n, tap in zip(radius, (nx, ny), each, taps, strict=True)
    )
    grid = Grid(
        (last[0], last[1]),
        (steps[0], steps[1]),
        radius,
        taps,
        False,
        order_0_steps=(own[0], own[1]),
    )
    coefficients, order_0, expansion = _coefficients(
        patches, grid, expansion, functions, (each[0], each[1]), progress
    )
    coefficients *= np.float32(steps[0] * steps[1] / (own[0] * own[1]))
    scale = half_scale(float(np.abs(coefficients).max()))
    return DiffractionTable(
        coefficients=(coefficients * np.float32(scale)).astype(np.float16),
        order_0=order_0,
        scale=scale,
        expansion=expansion,
        grid=grid,
        spacing=(spacing[0], spacing[1]),
        settings=own_settings,
        error={},
        roughness=roughness_of(patches, q_limit),
    )


def cell_powers(
    table: DiffractionTable, powers: NDArray[np.floating]
) -> tuple[NDArray[np.floating], tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """From a coarse table's coefficients at some κ to what the cells hold, and the cells' middles.

    Parameters
    ----------
    powers : (ny, nx) sums of the table's series, over its scale.

    Returns
    -------
    (ny, nx) shares of the light, and spatial frequencies (nx,), (ny,) in rad/µm.
    """
    grid = table.grid
    own = [table.sigma * width for width in table.spacing]
    middles = [
        np.asarray(width * np.arange(-n, n + 1), np.float64)
        for n, width in zip(grid.last, table.spacing, strict=True)
    ]
    factor = own[0] * own[1] / (grid.steps[0] * grid.steps[1])
    return np.maximum(powers, 0.0) * factor, (middles[0], middles[1])


def _coefficients(
    patches: Sequence[HeightField],
    grid: Grid,
    expansion: Expansion,
    functions: int | None,
    each: tuple[int, int],
    tell: Progress,
) -> tuple[NDArray[np.float32], NDArray[np.float64], Expansion]:
    """Series coefficients of the cells' power (intervals, ny, nx, 1, terms), and of order 0.

    functions : see `series_of`.
    """
    outermost = [n * last + n // 2 for n, last in zip(each, grid.last, strict=True)]
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        total = expansion.intervals * expansion.terms * spectra.count
        tell(done, total, "summing what lies outside")

    spectra = Spectra(patches, (outermost[0], outermost[1]), tick=tick)
    ny, nx = grid.shape

    def values_at(interval: int, values: NDArray[np.float32]) -> Iterator[tuple[float]]:
        specular = float(expansion.order_0_offset(interval))
        for out, power in zip(
            values, spectra.powers(expansion.nodes(interval).tolist()), strict=True
        ):
            out[..., 0] = power.bins.reshape(ny, each[1], nx, each[0]).sum(axis=(1, 3))
            yield (power.change + (1.0 - specular),)

    none = np.zeros(0, np.int64)  # a cell is much wider than the light close to order 0
    return series_of(
        values_at,
        (ny, nx, 1),
        expansion,
        functions,
        none,
    )
