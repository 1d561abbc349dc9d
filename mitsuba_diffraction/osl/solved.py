"""Texture and constants of a table of solved orders."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..optics.orders import least_c
from ..orders import OrderTable, cells
from ..orders.cells import Counts
from ..orders.rows import constant, kept, kinds_of, leaving_transmittance, middles, rows
from .spectrum import NODES, drawn_spectrum

#: Cells along τ, ρ and w of a table in air, and under a clear layer; fewer in large tables.
_CELLS, _UNDER_LAYER = Counts(16, 12, 6), Counts(12, 8, 10)
#: Most pixels of the texture, 8 bytes each.
_MOST_PIXELS = 4 << 20
#: Lobes of a sample: Cycles has at most 64 closures, a lobe takes two, and the pigment takes one.
_LOBES = 31
_MOST_SAMPLES = 2
#: Transmittance of the layer's face below which light counts as trapped.
_TRAPPED = 2e-3


class OrderTexture(NamedTuple):
    """Efficiencies of a table on even grids, four channels q in a pixel.

    Attributes
    ----------
    pixels : (height, width, 4) float16.
    counts : cells along τ, ρ and w.
    starts : (2 × bands,) first tile of kind A and B of each band, in slices of all w.
    tiles_across : tiles in a row of the texture.
    """

    pixels: NDArray[np.float16]
    counts: Counts
    starts: NDArray[np.int64]
    tiles_across: int


def order_texture(table: OrderTable) -> OrderTexture:
    """Resample a table, with the reflections between its clear layer's face and the grating.

    A tile (ρ, τ) is a channel j of the incident light and four channels q; it has a neighbour for
    each w. `shaders/orders.osl` reads it.
    """
    counts = _counts(table)
    starts, parts, total = [], [], 0
    for of in kinds_of(table):
        starts.append(total)
        within = rows(table, of, counts).within
        packs = -(-of.ports // 4)
        padded = np.pad(within, [(0, 0)] * 4 + [(0, 4 * packs - of.ports)])
        # (τ, ρ, w, j, pack, 4) to tiles (j, pack, w) of (ρ, τ, 4)
        split = padded.reshape(*within.shape[:4], packs, 4)
        parts.append(split.transpose(3, 4, 2, 1, 0, 5).reshape(-1, *split.shape[1::-1], 4))
        total += of.ports * packs
        if (of.band, of.kind) == (0, cells.A):
            starts.append(total)  # kind B of band 0 has no light
    tiles = np.concatenate(parts)
    height, width = counts.rho + 1, counts.tau + 1
    across = math.ceil(math.sqrt(len(tiles) * height / width))
    down = math.ceil(len(tiles) / across)
    sheet = np.zeros((down * across, height, width, 4), np.float16)
    sheet[: len(tiles)] = tiles
    sheet = sheet.reshape(down, across, height, width, 4).swapaxes(1, 2)
    pixels = np.ascontiguousarray(sheet.reshape(down * height, across * width, 4))
    return OrderTexture(pixels, counts, np.array(starts), across)


def interpolation_error(table: OrderTable, texture: OrderTexture) -> dict[str, float]:
    """Return errors of the centres of the texture's cells, as shares of the incident light."""
    finer = Counts(*(2 * count for count in texture.counts))
    differences = []
    for of in kinds_of(table):
        exact = rows(table, of, finer)
        corners = exact.within[::2, ::2, ::2].astype(np.float16).astype(np.float64)
        centre, through = (part[1::2, 1::2, 1::2] for part in exact)
        # transmittance of the face for light of a channel; what cannot leave is never seen
        face = (through / np.maximum(centre, 1e-30)).max(axis=-2)
        face = np.where(face > _TRAPPED, face, 0.0)
        error = np.abs(middles(corners) - centre) * face[..., :, None] * face[..., None, :]
        differences.append(error[np.broadcast_to(face[..., :, None] > 0.0, error.shape)])
    joined = np.concatenate(differences)
    return {"mean": float(joined.mean()), "largest of 99.9 %": float(np.quantile(joined, 0.999))}


def order_constants(table: OrderTable, texture: OrderTexture) -> dict[str, float | int]:
    """Return the constants of `shaders/orders.osl`; lengths in nm but for PERIOD, µm."""
    (low, high), (least, most) = table.wavelengths, table.reach
    height, width = texture.pixels.shape[:2]
    return {
        "PERIOD": table.period,
        "OPTICAL_PERIOD": 1e3 * table.optical_period,
        "INDEX": table.superstrate,
        "KEPT": kept(table),
        "LEAST_C": least_c(table.superstrate),
        "LOW": low,
        "HIGH": high,
        "LEAST_LIT": least,
        "MOST_LIT": most,
        "BANDS": table.last_band + 1,
        "TAU": texture.counts.tau,
        "RHO": texture.counts.rho,
        "W": texture.counts.w,
        "WIDTH": width,
        "HEIGHT": height,
        "TILES_ACROSS": texture.tiles_across,
        "SAMPLES": _samples(table.period),
        "LEAST": 1e-5,
        "PIGMENT_SHARE": _mean_remainder(table),
    }


def _samples(period: float) -> int:
    """Return the number of wavelengths whose orders are lobes of a sample; period : µm."""
    wavelengths = drawn_spectrum().wavelengths
    for count in range(_MOST_SAMPLES, 1, -1):
        # the shortest wavelength of each stratum has the most orders
        shortest = np.interp(np.arange(count) / count, np.linspace(0, 1, NODES), wavelengths)
        if np.sum(np.floor(2e3 * period / shortest) + 1) <= _LOBES:
            return count
    return 1


def _mean_remainder(table: OrderTable) -> float:
    """Return the mean of 1 − Σ η_m over directions, for light from beneath at 550 nm."""
    cosine = np.sqrt((np.arange(8) + 0.5) / 8)[:, None]
    phi = (np.arange(8) + 0.5) * (2.0 * np.pi / 8)
    sine = np.sqrt(1.0 - cosine**2)
    x, y = sine * np.cos(phi), sine * np.sin(phi)
    n = table.superstrate
    most = int(2e3 * table.optical_period / 550.0) + 1
    orders = np.arange(-most, most + 1)
    light = [a[..., None] / n for a in (x, y)]
    sums = table.efficiency(light[0], light[1], 550.0, orders).sum(axis=-1)
    through = leaving_transmittance((x**2 + y**2) / n**2, n)
    return float(np.clip(np.mean((1.0 - sums) * through), 0.0, 1.0))


def _counts(table: OrderTable) -> Counts:
    """Return the numbers of cells that fit into the texture."""
    counts = _CELLS if table.superstrate == 1.0 else _UNDER_LAYER
    if table.superstrate == 1.0 and constant(table):
        return Counts(1, 1, 1)
    tiles = sum(of.ports * -(-of.ports // 4) for of in kinds_of(table))
    while tiles * math.prod(n + 1 for n in counts) > _MOST_PIXELS and max(counts) > 2:
        counts = Counts(*(max(2, 3 * n // 4) for n in counts))
    return counts
