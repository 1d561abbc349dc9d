"""The texture of solved orders, read as shaders read it, against the table."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates

from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.shading.orders import (
    order_row,
    order_texel,
    pack_orders,
    texture_constants,
)
from tests.support.orders import thin_grating


def test_texture_has_the_efficiencies_of_the_table() -> None:
    table: OrderTable = thin_grating(period=1.2)
    packed = pack_orders(table, 4 << 20)
    constants = texture_constants(table, packed)
    cells = [constants.pop(f"{name}_cells") for name in ("tau", "rho", "w")]
    across, _ = constants.pop("tiles_across"), constants.pop("kept")
    x, y = 0.6 * np.random.default_rng(3).uniform(-1.0, 1.0, (2, 200))
    wavelength = np.linspace(0.41, 0.69, 200)
    row = order_row(x, y, wavelength, **constants)
    channels = packed.pixels.astype(float).transpose(2, 0, 1)
    for order in range(-2, 3):
        q = row.channel - order
        leaves = (q >= 0) & (q < row.channels)
        column, line, along = order_texel(
            row.tile + np.where(leaves, q, 0), *row.place, *cells, across
        )
        four = [map_coordinates(channel, [line - 0.5, column - 0.5], order=1, mode="nearest")
                for channel in channels]  # fmt: skip
        read = sum(n * np.maximum(1.0 - abs(along - at), 0.0) for at, n in enumerate(four))
        exact = table.efficiency(-x, -y, 1e3 * wavelength, order)
        # half floats and linear cells: 0.1 % of the light
        assert np.abs(np.where(leaves, row.lit * read, 0.0) - exact).max() < 2e-3
