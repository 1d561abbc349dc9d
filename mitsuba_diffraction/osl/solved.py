"""Constants of a table of solved orders, and the error of its texture."""

from __future__ import annotations

import numpy as np

from ..orders import OrderTable
from ..orders.rows import kinds_of, leaving_transmittance
from ..shading.orders import PackedOrders, centres, texture_constants
from .spectrum import NODES, drawn_spectrum

#: Largest size of the efficiencies, bytes.
MOST_BYTES = 16 << 20
#: Lobes of a sample: Cycles has at most 64 closures, a lobe takes two, and the pigment takes one.
_LOBES = 31
_MOST_SAMPLES = 2
#: Transmittance of the layer's face below which light counts as trapped.
_TRAPPED = 2e-3


def interpolation_error(table: OrderTable, packed: PackedOrders) -> dict[str, float]:
    """Return errors of the centres of the texture's cells, as shares of the incident light."""
    differences = []
    for of in kinds_of(table):
        centre, through, read = centres(
            table, of, packed.counts, lambda nodes: nodes.astype(np.float16)
        )
        # transmittance of the face for light of a channel; what cannot leave is never seen
        face = (through / np.maximum(centre, 1e-30)).max(axis=-2)
        face = np.where(face > _TRAPPED, face, 0.0)
        error = np.abs(read - centre) * face[..., :, None] * face[..., None, :]
        differences.append(error[np.broadcast_to(face[..., :, None] > 0.0, error.shape)])
    joined = np.concatenate(differences)
    return {"mean": float(joined.mean()), "largest of 99.9 %": float(np.quantile(joined, 0.999))}


def order_constants(table: OrderTable, packed: PackedOrders) -> dict[str, float | int]:
    """Return the constants of `shaders/orders.osl`; lengths in µm."""
    height, width = packed.pixels.shape[:2]
    return {
        **{name.upper(): value for name, value in texture_constants(table, packed).items()},
        "WIDTH": width,
        "HEIGHT": height,
        "SAMPLES": _samples(table.period),
        "LEAST": 1e-5,
        "PIGMENT_SHARE": _mean_remainder(table),
    }


def _samples(period: float) -> int:
    """Return the number of wavelengths whose orders are lobes of a sample; period : µm."""
    wavelengths, _ = drawn_spectrum()
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
