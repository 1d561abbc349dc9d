"""Tables of every kind that need no solver, pairs of directions in their lobes, and their light."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import sigma_of, wavenumber
from mitsuba_diffraction.optics.mirror import horizon_correction
from mitsuba_diffraction.orders import Band, CellResponse, OrderTable, blocks, cells
from mitsuba_diffraction.orders.cells import Counts
from tests.support import crossed
from tests.support.directions import Array, as_single, turned
from tests.support.orders import listed_grating, load, shallow_grating, thin_grating

#: Index of the block.
INDEX = 1.5


def block_grating() -> OrderTable:
    """A block's face: orders ±1 have G_j G_q times a strength, order 0 F times 0.92."""
    period, wavelengths, counts = 0.45, (450.0, 650.0), Counts(5, 4, 3)
    optical = INDEX * period

    def kind(k: int, kind: int) -> np.ndarray:
        channels = np.arange(k + 1 - kind)
        tau, rho, w = (cells.even_nodes(n)[..., None] for n in counts)
        tau, rho = tau[:, None, None], rho[:, None]
        lam = cells.wavelength_of(k + cells.sine_squared(rho), w, wavelengths, optical)
        light = cells.from_cell(k, kind, channels, tau, rho, lam, optical)
        scale, _ = blocks.factors(INDEX * light.x, INDEX * light.y, INDEX)
        port = np.arange(2 * len(channels))
        order = np.abs(np.subtract.outer(port % len(channels), port % len(channels)))
        values = np.select([order == 0, order == 1], [0.92, 0.006], 0.0) * scale
        values /= np.maximum(values.sum(axis=-1, keepdims=True), 1.0)
        values[..., port, port] = np.maximum(1.0 - values.sum(axis=-1), 0.0)
        return values[..., None].astype(np.float32)

    bands = tuple(
        Band(k, kind(k, cells.A), kind(k, cells.B) if k else None)
        for k in range(cells.largest_band(wavelengths, optical) + 1)
    )
    response, header = CellResponse(bands, even=True), {"profile": "weak"}
    return OrderTable((period, np.inf), wavelengths, response, header=header, block=INDEX)


BLOCK = block_grating()
KINDS: dict[str, Callable[[], OrderTable]] = {
    "grooves": functools.cache(thin_grating),
    "sheet": functools.cache(lambda: thin_grating(thin=True)),
    "coated": functools.cache(lambda: thin_grating(superstrate=1.5)),
    "listed": listed_grating,
    "block": lambda: BLOCK,
    "polarised": lambda: shallow_grating(0.9 + 6.0j, 0.1),
    "crossed": crossed.table,
    "crossed, clear": crossed.clear_table,
}
#: Orientation of surfaces, degrees, and nm of variants without spectra.
TURN, NM = 25.0, 600.0


def loaded(kind: str, **more: Any) -> Any:
    """The BSDF of a kind, in the variant that is set."""
    table = KINDS[kind]()
    own = {"coherence_width": width_of(table), "orientation": TURN, "wavelength": NM}
    return load(table, **(own | more))


def width_of(table: OrderTable) -> float:
    """Width of a surface's window, µm: of crossed gratings narrow, of lobes cut at the horizon."""
    return 8.0 if np.isfinite(table.periods[1]) else 65.0


def sides_of(table: OrderTable) -> list[dict[str, bool]]:
    """Where light comes from and leaves to, as arguments of `OrderTable.efficiency`."""
    sides = (False, True)[: table.sides]
    return [{"from_below": below, "transmitted": passed} for below in sides for passed in sides]


def light(
    n: int = 200,
    radius: float = 0.99,
    wavelengths: tuple[float, float] = (380.0, 780.0),
    seed: int = 1,
) -> tuple[Array, Array, Array]:
    """Tangential parts of directions within a radius, evenly, and wavelengths, (n,) each."""
    rng = np.random.default_rng(seed)
    r, turn = radius * np.sqrt(rng.random(n)), rng.uniform(0.0, 2.0 * np.pi, n)
    return r * np.cos(turn), r * np.sin(turn), rng.uniform(*wavelengths, n)


def orders_of(table: OrderTable, most: int = 8) -> tuple[Array, Array]:
    """Numbers of orders along x and y, (orders, 1) each."""
    along = most if np.isfinite(table.periods[1]) else 0
    m, n = np.mgrid[-most : most + 1, -along : along + 1].reshape(2, -1, 1)
    return m, n


def indices(table: OrderTable, directions: Array) -> Array:
    """Index of the medium that directions (n, 3) are in, (n, 1)."""
    return np.where(directions[:, 2] > 0.0, 1.0, table.block or 1.0)[:, None]


def near_orders(table: OrderTable, n: int) -> tuple[Array, Array, Array, Array]:
    """Directions in lobes of orders of the first of four wavelengths, and random numbers.

    On both sides of sheets and blocks; of surfaces that are turned by TURN.
    """
    rng = np.random.default_rng(5)
    low, high = table.wavelengths
    wavelength = as_single(rng.uniform(max(low, 400.0), min(high, 700.0), (n, 4)))
    wi, wo = np.empty((2, n, 3))
    for row, lam in enumerate(wavelength[:, 0]):
        square = -1.0
        while square < 0.02:
            sides = rng.choice([1.0, -1.0][: table.sides], 2)
            came, left = np.where(sides > 0.0, 1.0, table.block or 1.0)
            radius, turn = 0.98 * np.sqrt(rng.random()), 2.0 * np.pi * rng.random()
            x, y = radius * np.cos(turn), radius * np.sin(turn)
            shift = rng.integers(-2, 3, 2) * 1e-3 * lam / np.array(table.periods)
            apart = rng.normal(0.0, 0.5 / (sigma_of(width_of(table)) * wavenumber(lam)), 2)
            out = (shift + apart - came * np.array([x, y])) / left
            square = 1.0 - out @ out
        wi[row] = x, y, sides[0] * np.sqrt(1.0 - radius**2)
        wo[row] = *out, sides[1] * np.sqrt(square)
    wi, wo = (as_single(turned(w, TURN)) for w in (wi, wo))
    return wi, wo, rng.random((n, 3)), wavelength


def light_of(
    table: OrderTable, wi: Array, wo: Array, wavelength: Array, width: float | None = None
) -> Array:
    """Radiance f |cosθo| (n,) of surfaces that are turned by TURN: the reference's for grooves.

    Else by the formula of module `lobes`, with n² of the side that the light comes from.
    """
    wi, wo, width = turned(wi, -TURN), turned(wo, -TURN), width or width_of(table)
    values, above = np.zeros(len(wi)), np.array([1.0, 1.0, 0.0])
    for sides in sides_of(table):
        passed = wi[:, 2] * wo[:, 2] < 0.0
        here = ((wi[:, 2] < 0.0) == sides["from_below"]) & (passed == sides["transmitted"])
        efficiency = functools.partial(table.efficiency, **sides)
        light = wi[here], wo[here], wavelength[here]
        if not here.any():
            continue
        if table.block or np.isfinite(table.periods[1]):
            values[here] = _by_lobes(table, efficiency, *light, width)
            continue
        came, left = (w * above + np.abs(w) * (1.0 - above) for w in light[:2])
        values[here] = md.reference.orders_brdf(
            efficiency, table.period, came, left, light[2],
            coherence_width=width, superstrate=table.superstrate,
        )  # fmt: skip
    return values * np.abs(wo[:, 2])


def _by_lobes(
    table: OrderTable, efficiency: Any, wi: Array, wo: Array, lam: Array, width: float
) -> Array:
    came, left = indices(table, wi), indices(table, wo)
    sigma, mirror = sigma_of(width), -(came * wi)[:, :2].T
    sharp, cut = sigma * wavenumber(lam), (sigma * w[:, 2] ** 2 for w in (wi, wo))
    whole = horizon_correction(*cut, wavenumber(lam))
    total, value = (came * wi + left * wo)[:, :2], np.zeros(len(wi))
    for order in np.hstack(orders_of(table, 4)):
        apart = total - order * 1e-3 * lam[:, None] / np.array(table.periods)
        lobe = sharp**2 / np.pi * np.exp(-(sharp**2) * (apart**2).sum(axis=1))
        lobe = lobe * whole if not order.any() else lobe
        lit = lobe > 1e-9 * sharp**2
        value[lit] += lobe[lit] * efficiency(*mirror[:, lit], lam[lit], *order)
    return value * came[:, 0] ** 2


def albedo_of(table: OrderTable, wi: Array, wavelength: Array) -> Array:
    """Share of the light in all orders on both sides, (n,)."""
    x, y = -(indices(table, wi) * turned(wi, -TURN))[:, :2].T
    total = np.zeros(len(wi))
    for sides in sides_of(table):
        here = (wi[:, 2] < 0.0) == sides["from_below"]
        light = x[here], y[here], wavelength[here]
        total[here] += table.efficiency(*light, *orders_of(table), **sides).sum(axis=0)
    return total
