"""Tables of orders that need no solver."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from scipy.special import jv

import mitsuba_diffraction as md
from mitsuba_diffraction.orders import Band, CellResponse, OrderTable, cells
from mitsuba_diffraction.orders.cells import Counts
from mitsuba_diffraction.orders.listing import list_orders
from mitsuba_diffraction.reference.boundary import mueller, polarisation_axes, turn
from mitsuba_diffraction.reference.model import small_slope
from tests.support.directions import Array

PERIOD = 1.6  # µm
#: Light of a thin sheet from above (first row) and below that stays above (first column) or below.
SHARES = np.array([[0.3, 0.7], [0.7, 0.2]])


def thin_grating(
    period: float = PERIOD,
    depth: float = 0.12,
    reflectance: float = 0.75,
    wavelengths: tuple[float, float] = (380.0, 780.0),
    counts: Counts = Counts(6, 5, 3),  # noqa: B008 - immutable
    superstrate: float = 1.0,
    thin: bool = False,
) -> OrderTable:
    """A sinusoidal phase grating: J_m² of its phase, which is reciprocal, times a reflectance.

    The phase of order m is π depth (cosθ_j + cosθ_q)/λ, the mean of both directions': sums over
    orders are about 1, below the reflectance's headroom. A thin sheet divides the light
    by `SHARES`.
    """
    optical = superstrate * period

    def kind(k: int, kind: int) -> np.ndarray:
        channels = np.arange(k + 1 - kind)
        tau, rho, w = (cells.nodes(n) for n in counts)
        tau, rho, w = (part[..., None] for part in np.meshgrid(tau, rho, w, indexing="ij"))
        big_k = k + cells.sine_squared(rho)
        lam = cells.wavelength_of(big_k, w, wavelengths, optical)
        at = cells.from_cell(k, kind, channels, tau, rho, lam, optical)
        cosine = np.sqrt(np.maximum(1.0 - at.x**2 - at.y**2, 0.0))
        phase = np.pi * depth * superstrate * 1e3 / lam[..., None]
        phase = phase * (cosine[..., :, None] + cosine[..., None, :])
        order = channels[:, None] - channels
        # light grows from 0 at the horizon, as Maxwell's does
        grazing = cosine[..., :, None] * cosine[..., None, :]
        power = reflectance * jv(order, phase) ** 2 * (1.0 - np.exp(-20.0 * grazing))
        values = np.where(order == 0, reflectance * jv(0, phase) ** 2, power)
        if thin:
            values = np.kron(SHARES, values)
        return np.stack([values, 0.0 * values], axis=-1).astype(np.float32)

    bands = tuple(
        Band(k, kind(k, cells.A), kind(k, cells.B) if k else None)
        for k in range(cells.largest_band(wavelengths, optical) + 1)
    )
    header = {"profile": "thin sinusoid"}
    return OrderTable((period, np.inf), wavelengths, CellResponse(bands), superstrate, header, thin)


@functools.cache
def listed_grating() -> OrderTable:
    """`thin_grating` in light from -20, 0 and 20° alone."""
    nm = np.arange(380.0, 781.0, 50.0)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "thin_sinusoid.csv")
        list_orders(thin_grating(), nm, [-20.0, 0.0, 20.0]).save(file)
        return md.read_orders(file, PERIOD)


@functools.cache
def shallow_grating(
    index: complex,
    strength: float = 0.0,
    counts: Counts = Counts(20, 12, 4),  # noqa: B008 - immutable
    superstrate: float = 1.0,
) -> OrderTable:
    """A polarised table of the first-order small-slope model: a mirror with weak orders ±1.

    index : over that of the superstrate.
    strength : amplitude of orders ±1, over the root of both cosines and the boundary's matrix.
    """
    period, wavelengths = 0.6, (500.0, 600.0)
    optical = superstrate * period

    def matrices(k: int, kind: int) -> np.ndarray:
        channels = np.arange(k + 1 - kind)
        tau, rho, w = (cells.nodes(n) for n in counts)
        tau, rho, w = (part[..., None] for part in np.meshgrid(tau, rho, w, indexing="ij"))
        big_k = k + cells.sine_squared(rho)
        lam = cells.wavelength_of(big_k, w, wavelengths, optical)
        longest = 2e3 * optical / big_k * np.sqrt(1.0 - cells.LEAST_ALONG**2)
        at = cells.from_cell(k, kind, channels, tau, rho, np.minimum(lam, longest), optical)
        z = np.sqrt(np.maximum(1.0 - at.x**2 - at.y**2, 0.0))
        wi, wo = (np.stack([sign * at.x, sign * at.y, z], axis=-1) for sign in (-1.0, 1.0))
        wi, wo = wi[..., :, None, :], wo[..., None, :, :]
        jones = groove_matrices(wi, wo, small_slope(wi, wo, index))
        first = strength * np.sqrt(z[..., :, None] * z[..., None, :])
        order = np.abs(channels[:, None] - channels)
        factor = np.select([order == 0, order == 1], [1.0, first], 0.0)
        return mueller(factor[..., None, None] * jones)

    bands = []
    for k in range(cells.largest_band(wavelengths, optical) + 1):
        of_kinds = [matrices(k, kind) for kind in ((cells.A, cells.B) if k else (cells.A,))]
        flat = [m.reshape(*m.shape[:-2], 16).astype(np.float32) for m in of_kinds]
        bands.append(Band(k, *flat))
    response, header = CellResponse(tuple(bands)), {"profile": "shallow"}
    return OrderTable((period, np.inf), wavelengths, response, superstrate, header)


def groove_matrices(wi: Array, wo: Array, jones: Array) -> Array:
    """Jones matrices about the axes of tables, from those about s and p."""
    s_in, s_out = polarisation_axes(wi, wo)
    return turn(groove_axis(wo), s_out, wo) @ jones @ turn(s_in, groove_axis(wi), -wi)


def groove_axis(direction: Array) -> Array:
    """y made perpendicular to directions (…, 3)."""
    across = np.array([0.0, 1.0, 0.0]) - direction[..., 1:2] * direction
    return across / np.linalg.norm(across, axis=-1, keepdims=True)


def load(table: Any, **parameters: Any) -> Any:
    """A table or heights as a BSDF of the current variant."""
    return mi.load_dict(md.bsdf_dict(table, **parameters))


def digest_in_file(table: OrderTable, folder: Path) -> str:
    """Return the digest of a table's file: rounded to 16 bits, past what BLAS adds in any order."""
    table.save(folder / "digest.nc")
    digest = OrderTable.load(folder / "digest.nc").digest()
    (folder / "digest.nc").unlink()
    return digest
