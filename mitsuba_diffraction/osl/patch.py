"""Textures and constants of a diffraction table: powers of a patch's orders, densities of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..optics.blend import NODES_PER_OCTAVE, RoughnessTable
from ..optics.coat import coated_reflectance, cosine_within, face_transmittance
from ..optics.fresnel import reflectance
from ..plugin.description import Surface
from ..shading.powers import PackedPowers, pack_powers
from ..tables import DiffractionTable
from ..tables.directional import FINE, SHARE
from ..tables.powers import powers_at

#: Orders drawn in a sample, each of a wavelength.
DRAWS = 2
#: Bands of κ, each with a density to draw from, up to 3/4 of the largest as in `tables.sampling`.
#: Four would lower the noise by 3 %, and double the texture.
BANDS, BANDED = 2, 0.75
#: Part of the density that is the mean over all κ, so that no order with power has none.
_EVEN = 0.1
#: Width of the window of a patch that sets no limit, µm.
_UNLIMITED = 1e9
#: Largest probability in the texture of draws, near the largest half.
_LARGEST = 3e4
#: Phase over a cell of κ, rad: the error is its square over 8, 5e-4. Factors are an array of the
#: shader, since reads of textures take most of the time.
_CELL = 0.06
#: Nodes of κ at which densities are the mean of an order's share, for each band.
_NODES = 8


class PatchTextures(NamedTuple):
    """Textures of a patch.

    Attributes
    ----------
    powers : (intervals · rows, columns · texels, 4) terms of each order, see `PackedPowers`.
    factors : (intervals · (cells + 1) · (4 texels + 1),) factors of the terms, and order 0's power.
    draws : (BANDS · rows, columns, 4) half or single, cells of alias tables: threshold, probability
        of the order times `likelihood`, and the other order from the middle, along x and y.
    packed : the powers before they are laid out.
    scale, likelihood : of `powers` and of the probabilities.
    """

    powers: NDArray[np.float16]
    factors: NDArray[np.float32]
    draws: NDArray[np.floating]
    packed: PackedPowers
    scale: float
    likelihood: float


def energy_texture(
    described: Surface,
) -> tuple[NDArray[np.float32], dict[str, float | int]] | None:
    """Tabulate the scales of energy; None where all are 1.

    Returns pixels (wavelengths · (polar + 1), azimuthal + 1, 4) on `FINE`, the first column
    repeated at the end, and constants of `shaders/patch.osl`. Channels are the scales of the
    surface's height scale and of the largest of its table, and two of 1. Wavelengths lie evenly in
    their logarithm.
    """
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
    constants: dict[str, float | int] = {
        "ENERGY_POLAR": FINE.polar,
        "ENERGY_AZIMUTHAL": FINE.azimuthal,
        "ENERGY_SHARE": SHARE,
        "ENERGY_HEIGHT": nodes[0],
        "ENERGY_MOST": nodes[1],
        "ENERGY_PAGES": len(lam),
        "ENERGY_FIRST": float(np.log(lam[0])),
        "ENERGY_LAST": float(np.log(lam[-1])),
    }
    return values.reshape(-1, *values.shape[2:]), constants


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
    """Lay out the powers of all orders, and tabulate densities to draw orders from."""
    packed = pack_powers(table, _CELL)
    rows, columns = table.grid.shape
    # halves end at 65504
    factor = min(1.0, 6e4 / max(float(np.abs(packed.orders).max()), 1e-30))
    half = (packed.orders * factor if factor < 1.0 else packed.orders).astype(np.float16)
    densities = _densities(table)
    likelihood = _LARGEST / max(float(densities.max()), 1e-30)
    # integers up to 2048 are exact in halves
    kind = np.float16 if max(table.grid.last) <= 2048 else np.float32
    draws = np.zeros((BANDS, rows * columns, 4), kind)
    for cells, density in zip(draws, densities, strict=True):
        threshold, other = _alias(density)
        cells[:, 0], cells[:, 2] = threshold, other % columns - table.grid.last[0]
        cells[:, 3] = other // columns - table.grid.last[1]
        # with the thresholds as they are stored
        kept = cells[:, 0].astype(np.float64)
        chance = kept + np.bincount(other, 1.0 - kept, len(other))
        cells[:, 1] = chance * (likelihood / len(other))
    return PatchTextures(
        half.reshape(-1, columns * packed.texels, 4),
        packed.factors.reshape(*packed.factors.shape[:2], -1)[..., :-3].ravel(),
        draws.reshape(-1, columns, 4),
        packed,
        packed.scale * factor,
        likelihood,
    )


def _densities(table: DiffractionTable) -> NDArray[np.float64]:
    """Return the probability of each order (BANDS, orders) in bands of κ."""
    largest = table.expansion.kappa_max
    bands = []
    for band in range(BANDS):
        kappas = BANDED * largest * (band + (np.arange(_NODES) + 0.5) / _NODES) / BANDS
        powers = sum(np.maximum(powers_at(table, k), 0.0).ravel().astype(float) for k in kappas)
        bands.append(powers / np.maximum(np.sum(powers), 1e-30))
    shares = np.stack(bands)
    last = np.maximum(powers_at(table, largest), 0.0).ravel().astype(np.float64)
    even = shares.mean(axis=0) + last / np.maximum(last.sum(), 1e-30)
    mixed = (1.0 - _EVEN) * shares + 0.5 * _EVEN * even
    mixed[mixed.sum(axis=1) == 0.0] = 1.0  # a mirror has no order to draw
    return np.asarray(mixed / mixed.sum(axis=1, keepdims=True))


def interpolated(textures: PatchTextures, kappa: float) -> NDArray[np.float64]:
    """Return the powers that the shader reads at κ, (rows, columns)."""
    packed = textures.packed
    place = np.clip(kappa / packed.expansion.kappa_max, 0.0, 1.0) * packed.expansion.intervals
    interval = min(int(place), packed.expansion.intervals - 1)
    offset = place - interval
    cell = min(int(offset * packed.cells), packed.cells - 1)
    t = offset * packed.cells - cell
    ends = packed.factors[interval, cell : cell + 2, :-1].astype(np.float64)
    factors = ((1.0 - t) * ends[0] + t * ends[1]).ravel()
    fading = offset**2 if interval == 0 else 1.0
    terms = textures.powers.reshape(packed.orders.shape)[interval].astype(np.float64)
    return np.asarray(np.maximum(terms @ factors, 0.0) * (fading / textures.scale))


def patch_error(table: DiffractionTable, textures: PatchTextures) -> dict[str, float]:
    """Return errors of the powers that the shader reads, summed over orders; shares of light."""
    largest = table.expansion.kappa_max
    errors = []
    for kappa in largest * (np.arange(12) + 0.5) / 12:
        exact = np.maximum(powers_at(table, float(kappa)), 0.0).astype(np.float64)
        errors.append(np.abs(interpolated(textures, float(kappa)) - exact).sum())
    return {"mean": float(np.mean(errors)), "worst κ": float(np.max(errors))}


def _positive_share(table: DiffractionTable) -> float:
    """Return the factor that keeps all light, of orders whose powers are positive.

    Cycles has no closures of negative weight: others, of a scan, are left out.
    """
    kappas = table.expansion.kappa_max * (np.arange(_NODES) + 0.5) / _NODES
    powers = [powers_at(table, float(kappa)).astype(np.float64) for kappa in kappas]
    positive = np.sum([np.maximum(each, 0.0).sum() for each in powers])
    return float(np.sum(powers) / max(positive, 1e-30)) if positive > 0.0 else 1.0


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
        "INTERVALS": textures.packed.expansion.intervals,
        "CELLS": textures.packed.cells,
        "TEXELS": textures.packed.texels,
        "FACTORS": len(textures.factors),
        "SCALE": textures.scale,
        "LIKELIHOOD": textures.likelihood * _positive_share(table),
        "BANDS": BANDS,
        "BANDED": BANDED,
        "FIRST_OCTAVE": statistic.first,
        "NODES_PER_OCTAVE": NODES_PER_OCTAVE,
        "SCAN_WIDTH": table.window_width if table.inverse_taper else limit,
        "INVERSE_TAPER": table.inverse_taper,
        "STATISTIC_NODES": len(statistic.nodes),
    }


def _alias(probabilities: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the threshold and the other of each cell of an alias table, (n,) each.

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
    return threshold, other
