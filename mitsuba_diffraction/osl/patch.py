"""Textures and constants of a diffraction table: powers of a patch's orders, densities of them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..optics.blend import NODES_PER_OCTAVE, RoughnessTable
from ..optics.coat import coated_reflectance, cosine_within, face_transmittance
from ..optics.fresnel import reflectance
from ..plugin.description import Surface
from ..tables.directional import FINE, SHARE
from ..tables.powers import order_0_power, powers_at
from ..tables.table import DiffractionTable

#: Nodes of an interval of κ, Chebyshev's of the first kind on 0 to 1, in the channels of a pixel.
NODES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(4) + 0.5) / 4)
#: Phase (rad) of the highest over the deepest point that an interval of κ spans: its cosine is
#: off by 0.003.
_PHASE = 2.0
#: Orders drawn in a sample, each of a wavelength.
DRAWS = 2
#: Bands of κ, each with a density to draw from, up to 3/4 of the largest as in `tables.sampling`.
BANDS, BANDED = 4, 0.75
#: Part of the density that is the mean over all κ, so that no order with power has none.
_EVEN = 0.1
#: Orders 0 over κ.
ORDER_0_NODES = 256
#: Width of the window of a patch that sets no limit, µm.
_UNLIMITED = 1e9
#: Width of the texture of draws, a power of 2: coordinates of its pixels are exact.
DRAWS_WIDTH = 1024


class PatchTextures(NamedTuple):
    """Textures of a patch.

    Attributes
    ----------
    powers : (intervals · ny, nx, 4) float16, |a_j|² times `scale` at four nodes of κ.
    draws : (height, DRAWS_WIDTH, 4) float32, cells of alias tables, those of a band from a row of
        its own on: threshold, the other order, and the orders' probabilities.
    intervals, scale : of `powers`.
    rows : rows of `draws` of a band.
    order_0 : (ORDER_0_NODES,) |a_0|² at even steps from κ = 0 to the largest.
    """

    powers: NDArray[np.float16]
    draws: NDArray[np.float32]
    intervals: int
    scale: float
    rows: int
    order_0: NDArray[np.float64]


class EnergyTexture(NamedTuple):
    """Scales of energy over directions.

    Attributes
    ----------
    pixels : (wavelengths · (polar + 1), azimuthal + 1, 4) float32 on `FINE`, the first column
        repeated at the end; channels are the scales of the surface's height scale and of the
        largest of its table, and two of 1. Wavelengths lie evenly in their logarithm.
    constants : of `shaders/patch.osl`.
    """

    pixels: NDArray[np.float32]
    constants: dict[str, float | int]


def energy_texture(described: Surface) -> EnergyTexture | None:
    """Tabulate the scales of energy at two height scales; None where all are 1."""
    nodes = described.height_scale.number, float(described.patch.height_scale_max)
    tables = [described.energy_scale(node) for node in nodes]
    if not (known := [table for table in tables if table is not None]):
        return None
    lam = known[0].wavelengths
    values = np.ones((len(lam), FINE.polar + 1, FINE.azimuthal + 1, 4), np.float32)
    for channel, table in enumerate(tables):
        if table is not None:
            pages = np.stack([table.page(float(wavelength)) for wavelength in lam])
            values[..., channel] = np.pad(pages, [(0, 0), (0, 0), (0, 1)], mode="wrap")
    constants = {
        "ENERGY_POLAR": FINE.polar,
        "ENERGY_AZIMUTHAL": FINE.azimuthal,
        "ENERGY_SHARE": SHARE,
        "ENERGY_HEIGHT": nodes[0],
        "ENERGY_MOST": nodes[1],
        "ENERGY_PAGES": len(lam),
        "ENERGY_FIRST": float(np.log(lam[0])),
        "ENERGY_LAST": float(np.log(lam[-1])),
    }
    return EnergyTexture(values.reshape(-1, *values.shape[2:]), constants)


def mean_transmittance(
    index: NDArray[np.complexfloating] | None, coat: float | None = None
) -> float:
    """Return the mean of 1 − R over diffuse light, 0 of what lets no light through.

    index, coat : indices of the material under its coat, if any, and of that coat.
    """
    if index is None or np.any(np.imag(index) > 0.0):
        return 0.0
    cosine = np.sqrt((np.arange(64) + 0.5) / 64)
    inside = cosine if coat is None else cosine_within(cosine, coat)
    found = reflectance(inside, float(np.real(index[0])))
    if coat is not None:
        found = coated_reflectance(1.0 - face_transmittance(cosine, coat), found)
    return float(np.mean(1.0 - found))


def patch_textures(table: DiffractionTable) -> PatchTextures:
    """Resample the powers of all orders but order 0 over κ, and tabulate densities of them."""
    largest = table.expansion.kappa_max
    depth = 2.0 * table.expansion.half_range
    intervals = max(1, math.ceil(largest * depth / _PHASE))
    kappas = largest * (np.arange(intervals)[:, None] + NODES) / intervals
    powers = np.stack([powers_at(table, kappa) for kappa in kappas.ravel()])
    scale = 3e4 / max(float(powers.max()), 1e-30)
    pixels = (powers * scale).reshape(intervals, 4, *powers.shape[1:])
    pixels = pixels.transpose(0, 2, 3, 1).reshape(-1, powers.shape[2], 4).astype(np.float16)
    flat = powers.reshape(len(powers), -1).astype(np.float64)
    shares = flat / np.maximum(flat.sum(axis=1, keepdims=True), 1e-30)
    distance = np.abs(kappas.ravel() / largest - BANDED * (np.arange(BANDS) + 0.5)[:, None] / BANDS)
    near = np.maximum(1.0 - distance / (BANDED * 1.5 / BANDS), 0.0)
    cells = -(-flat.shape[1] // DRAWS_WIDTH) * DRAWS_WIDTH
    bands = np.zeros((BANDS, cells, 4), np.float32)
    for n, weights in enumerate(near / near.sum(axis=1, keepdims=True)):
        density = (1.0 - _EVEN) * (weights @ shares) + _EVEN * shares.mean(axis=0)
        bands[n, : flat.shape[1]] = _alias(density / max(density.sum(), 1e-30))
    order_0 = order_0_power(table, np.linspace(0.0, largest, ORDER_0_NODES))
    draws = bands.reshape(-1, DRAWS_WIDTH, 4)
    return PatchTextures(pixels, draws, intervals, scale, cells // DRAWS_WIDTH, order_0)


def interpolated(textures: PatchTextures, largest: float, kappa: float) -> NDArray[np.float64]:
    """Return the powers that the shader reads, (ny, nx); largest : κ of the table."""
    place = np.clip(kappa / largest, 0.0, 1.0) * textures.intervals
    interval = min(int(place), textures.intervals - 1)
    rows = len(textures.powers) // textures.intervals
    four = textures.powers[interval * rows : (interval + 1) * rows].astype(np.float64)
    distance = place - interval - NODES
    weights = [
        np.prod(np.delete(distance, n)) / np.prod(NODES[n] - np.delete(NODES, n)) for n in range(4)
    ]
    return np.asarray(np.maximum(four @ weights, 0.0) / textures.scale)


def patch_error(table: DiffractionTable, textures: PatchTextures) -> dict[str, float]:
    """Return errors of the powers that the shader reads, summed over orders; shares of light."""
    largest = table.expansion.kappa_max
    errors = []
    for kappa in largest * (np.arange(12) + 0.5) / 12:
        exact = powers_at(table, float(kappa)).astype(np.float64)
        errors.append(np.abs(interpolated(textures, largest, float(kappa)) - exact).sum())
    return {"mean": float(np.mean(errors)), "worst κ": float(np.max(errors))}


def patch_constants(
    table: DiffractionTable, textures: PatchTextures, statistic: RoughnessTable
) -> dict[str, float | int]:
    """Return the constants of `shaders/patch.osl`; lengths in µm.

    statistic : of the heights, see `boundary.Model`.
    """
    rows, columns = table.grid.shape
    limit = table.settings.window_width or _UNLIMITED
    return {
        "DRAWS": DRAWS,
        "ORDERS": rows * columns,
        "COLUMNS": columns,
        "ROWS": rows,
        "LAST_X": table.grid.last[0],
        "LAST_Y": table.grid.last[1],
        "SPACING_X": table.spacing[0],
        "SPACING_Y": table.spacing[1],
        "KAPPA_MAX": table.expansion.kappa_max,
        "INTERVALS": textures.intervals,
        "SCALE": textures.scale,
        "BANDS": BANDS,
        "BANDED": BANDED,
        "DRAWS_WIDTH": DRAWS_WIDTH,
        "DRAWS_ROWS": textures.rows,
        "FIRST_OCTAVE": statistic.first,
        "NODES_PER_OCTAVE": NODES_PER_OCTAVE,
        "SCAN_WIDTH": table.window_width if table.inverse_taper else limit,
        "INVERSE_TAPER": table.inverse_taper,
        "STATISTIC_NODES": len(statistic.nodes),
        "ORDER_0_NODES": ORDER_0_NODES,
        **{f"NODE_{n}": float(node) for n, node in enumerate(NODES)},
    }


def _alias(probabilities: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return an alias table (n, 4): threshold, other, probability of itself and of the other.

    A cell drawn evenly keeps itself below the threshold, else it is the other (Vose 1991).
    """
    count = len(probabilities)
    scaled = probabilities * count
    threshold, other = np.ones(count), np.arange(count)
    small, large = (np.flatnonzero(chosen).tolist() for chosen in (scaled < 1.0, scaled >= 1.0))
    left = scaled.tolist()
    while small and large:
        less, more = small.pop(), large[-1]
        threshold[less], other[less] = left[less], more
        left[more] -= 1.0 - left[less]
        if left[more] < 1.0:
            small.append(large.pop())
    return np.stack(
        [threshold, other, probabilities, probabilities[other]], axis=1, dtype=np.float32
    )
