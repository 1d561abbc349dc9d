"""Orders for integrals over directions: a few strong ones, and a density of all others."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy
from numpy.typing import NDArray

from .powers import order_0_power, parts_at
from .table import DiffractionTable
from .window import tap_matrix

#: An order whose power ever exceeds this is summed on its own, if it is among the strongest.
STRONG, MOST_STRONG = 2e-3, 96
#: Samples of an order's power over one period in κ (that of a squared Bessel function).
PER_PERIOD = 16
FEWEST_KAPPAS, MOST_KAPPAS = 16, 160

_FADED = 12.0  # exp(−12) = 6e-6 of a Gaussian's peak is nothing
#: Distances between samples of a window's power, in 1/σ: in full, and where its lobes are so wide
#: that smoothing of the samples would widen them.
_SAMPLED, _FINE = 0.8, 0.15
#: Least deviation that smooths samples, in their distance.
_BRIDGED = 0.7
#: Distance of a window's densities, in that deviation: they are read at the nearest place. With 1.0
#: albedos were up to 0.005 off, twice as much as with 0.7 or less.
_READ = 0.7
#: κ of the limit for κ → 0, in steps.
_NEAR_0 = 0.02
#: Bins farther apart than this, in 1/σ, have lobes that show: sums of lobes s/σ apart ripple by
#: 2 exp(−π²/s²), 0.025 at 1.5 and 0.17 at 2. Albedos of few such orders were 0.02 off with samples
#: at half a lobe's deviation, and are 0.01 off with a quarter.
_SEPARATE = 1.5
#: Widest such lobes, in the density's smoothing, that are summed one by one where the strong orders
#: have all light: under 7 µm on an index of 2.1 albedos of steps were 0.03 off in a density.
_ONE_BY_ONE = 2.0
#: Largest lobe, in the density's smoothing, of a window's samples that are summed on their own.
NARROW = 0.25


@dataclass(frozen=True)
class OrderMixture:
    """Powers as functions of κ = 0, step, 2·step, … (κ already divided by the height scale).

    The power of an order fades as κ². Over κ² it is nearly linear between two κ: the power itself
    was up to twice too large below the first step, where light grazes the surface.

    Attributes
    ----------
    kappa_step : rad/µm.
    frequency : (n, 2) of the strong orders, rad/µm.
    powers : (kappas, n) of the strong orders, over κ².
    central : (kappas,), power of order 0.
    density : (kappas, ny, nx), power of all others over κ² and per (rad/µm)², smoothed; q = 0 in
        the middle.
    beats : the same of their interference with order 0, of either sign and not over κ², where lobes
        are so wide that its factor is not the others'; None where `density` has it.
    pitch : rad/µm between samples of the density.
    weak : largest power of all in `density` at any κ.
    lobe : standard deviation of lobes that are apart in `density`, rad/µm; infinite where all is
        smooth.
    """

    kappa_step: float
    frequency: NDArray[np.float64]
    powers: NDArray[np.float32]
    central: NDArray[np.float64]
    density: NDArray[np.float32]
    beats: NDArray[np.float32] | None
    pitch: float
    weak: float
    lobe: float

    def strong_at(
        self, kappa: NDArray[np.float64], order: NDArray[np.integer]
    ) -> NDArray[np.float64]:
        """Powers of strong orders, 0 … n − 1, each at its own κ, (m,)."""
        position = np.minimum(kappa / self.kappa_step, len(self.powers) - 1.001)
        kappa, lower = position * self.kappa_step, position.astype(int)
        share = (position - lower).astype(np.float32)
        low, high = self.powers[lower, order], self.powers[lower + 1, order]
        return np.asarray((low * (1.0 - share) + high * share) * kappa**2)


def order_mixture(
    table: DiffractionTable,
    height_scale: float,
    reach: float,
    smoothing: float,
) -> OrderMixture:
    """Sort a table's orders.

    Parameters
    ----------
    table : the diffraction table.
    height_scale : factor on its heights.
    reach : largest frequency that the light probes, rad/µm, at most `DiffractionTable.q_limit`.
    smoothing : standard deviation of the density's smoothing, rad/µm, the lobe's own included.
    """
    expansion = table.expansion
    kappa_max = reach * height_scale
    periods = kappa_max * expansion.half_range / math.pi
    count = int(np.clip(math.ceil(PER_PERIOD * periods), FEWEST_KAPPAS, MOST_KAPPAS)) + 1
    kappas = np.linspace(0.0, min(kappa_max, expansion.kappa_max), count)
    lobe = 1.0 / (math.sqrt(2.0) * table.sigma)  # standard deviation
    # samples of a window's power have its lobes in them already: as strong orders, with lobes of
    # their own, they are for lobes that are narrow beside the smoothing
    all_smooth = lobe >= (NARROW if table.grid.overlapping else 1.0) * smoothing
    separate = all_smooth and max(table.grid.steps) > _SEPARATE
    few_apart = separate and not table.grid.overlapping and lobe < _ONE_BY_ONE * smoothing
    axes = [_Axis(table, axis, fine=2.0 * lobe > smoothing) for axis in (0, 1)]
    if table.grid.overlapping:  # powers between the bins have the lobes in them
        apart_by = max(axis.frequency[1] - axis.frequency[0] for axis in axes)
        smoothing = math.sqrt(max(smoothing**2 - lobe**2, (_BRIDGED * apart_by) ** 2))
        pitch = min(0.5 * math.hypot(smoothing, lobe), _READ * smoothing)
    else:
        smoothing = max(smoothing, lobe)
        pitch = (0.25 if separate else 0.5) * smoothing
    half = math.ceil(reach / pitch) + 1
    grid = pitch * (np.arange(2 * half, dtype=float) - half + 0.5)
    splats = [_splat(axis.frequency, grid, smoothing) for axis in axes]
    density = np.empty((count, 2 * half, 2 * half), np.float32)
    apart = all_smooth and table.grid.overlapping
    beats = np.empty_like(density) if apart else None
    central = np.empty(count)
    powers = np.empty((count, 0), np.float32)
    strongest = np.zeros((len(axes[1].frequency), len(axes[0].frequency)), np.float32)
    stored = []
    powers_at = partial(_powers_at, table, axes, apart=apart)

    def smoothed(power: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.asarray((splats[0] @ (splats[1] @ power).T).T)

    # the limit for κ → 0 is taken close to it
    squares = np.maximum(kappas, _NEAR_0 * kappas[1]) ** 2
    for n, kappa in enumerate(np.sqrt(squares)):
        power, central[n], interference = powers_at(float(kappa))
        np.maximum(strongest, power, out=strongest)
        power = power / np.float32(squares[n])
        density[n] = smoothed(power)
        if beats is not None:
            beats[n] = smoothed(interference)
        stored.append(power if power.nbytes * count < 400e6 else None)
    chosen = _choose(strongest)
    rows, columns = chosen.T
    left = strongest.sum() - strongest[rows, columns].sum()
    if all_smooth and not (few_apart and left < STRONG):
        rows, columns = np.zeros((2, 0), int)
    if len(rows):
        powers = np.empty((count, len(rows)), np.float32)
        for n, kappa in enumerate(np.sqrt(squares)):
            held = stored[n]
            power = held if held is not None else powers_at(float(kappa))[0] / squares[n]
            powers[n] = power[rows, columns]
            chosen_splats = splats[1][:, rows].multiply(powers[n]) @ splats[0][:, columns].T
            density[n] -= chosen_splats.toarray()
    np.maximum(density, 0.0, out=density)
    frequency = np.stack([axes[0].frequency[columns], axes[1].frequency[rows]], axis=1)
    step, per = float(kappas[1]) / height_scale, np.float32(height_scale**2)
    weak = float((density.sum(axis=(1, 2)) * squares).max()) * pitch**2
    width = lobe if separate else math.inf
    return OrderMixture(
        step, frequency, powers * per, central, density * per, beats, pitch, weak, width
    )


class _Axis:
    """Where the powers along one axis are: at the bins, or between them where these overlap."""

    def __init__(self, table: DiffractionTable, axis: int, *, fine: bool) -> None:
        last, spacing = table.grid.last[axis], table.spacing[axis]
        step = table.grid.steps[axis]
        bins = np.arange(-last, last + 1)
        if table.grid.overlapping:
            # The window's power is as smooth as a lobe: sampled densely, its sum is its integral
            density = max(1, math.ceil(step / (_FINE if fine else _SAMPLED)))
            positions = np.arange(-last * density, last * density + 1) / density
            self.frequency = positions * spacing
            self.lobe = np.exp(-table.grid.exponents[axis] * positions**2)
            self.matrix = tap_matrix(positions, -last, len(bins), table.grid.exponents[axis], None)
            self.weight = step / density / math.sqrt(math.pi)
            return
        self.frequency = np.asarray(bins * spacing, np.float64)


def _powers_at(
    table: DiffractionTable, axes: list[_Axis], kappa: float, *, apart: bool
) -> tuple[NDArray[np.float32], float, NDArray[np.float32]]:
    """Powers (ny, nx) of all orders but 0, the power of order 0, and their interference.

    apart : whether the interference of a window's order 0 is not among the others' powers.
    """
    parts = parts_at(table, kappa)
    if table.grid.overlapping:
        amplitude = parts[..., 0] + 1j * parts[..., 1]
        amplitude[table.grid.middle] = centre = complex(*table.order_0_at(kappa))
        field = (axes[0].matrix @ (axes[1].matrix @ amplitude).T).T
        weight = axes[0].weight * axes[1].weight
        mean = centre * axes[1].lobe[:, None] * axes[0].lobe
        total, order_0, power = (
            np.abs(part).astype(np.float32) ** 2 * weight for part in (field, mean, field - mean)
        )
        if apart:
            return power, float(order_0.sum()), total - order_0 - power
        # order 0 is the mean's lobe, or all light where the speckle is darker than that
        order_0 = np.minimum(order_0, total)
        return total - order_0, float(order_0.sum()), np.zeros_like(total)
    # a scan's sharpened powers may be below 0, and their sum is right
    power = table.expansion.power_of(parts)
    return power, float(order_0_power(table, kappa)), np.zeros(0, np.float32)


def _splat(
    frequency: NDArray[np.floating], grid: NDArray[np.floating], deviation: float
) -> scipy.sparse.csr_array:
    """Gaussian weights from frequencies to a grid, (grid, frequencies), of integral 1."""
    exponent = 0.5 * ((frequency - grid[:, None]) / deviation) ** 2
    weights = np.exp(-exponent) / (math.sqrt(2.0 * math.pi) * deviation)
    weights[exponent > _FADED] = 0.0
    return scipy.sparse.csr_array(weights.astype(np.float32))


def _choose(strongest: NDArray[np.float32]) -> NDArray[np.int64]:
    """(row, column) of the orders worth a sum of their own, strongest first."""
    flat = strongest.ravel()
    many = min(MOST_STRONG, flat.size)
    candidates = np.argpartition(flat, flat.size - many)[-many:]
    candidates = candidates[flat[candidates] > STRONG]
    candidates = candidates[np.argsort(-flat[candidates])]
    return np.stack(np.unravel_index(candidates, strongest.shape), axis=1)
