"""Solved orders in the shaders, against the BRDF in NumPy summed over wavelengths."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_diffraction as md
import mitsuba_diffraction.thesis.shaders  # registers its methods
from mitsuba_diffraction.optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.realtime.glsl.export import make_shader
from mitsuba_diffraction.realtime.glsl.lobes import pack_lobes
from mitsuba_diffraction.realtime.glsl.packing import pack_responses
from mitsuba_diffraction.realtime.glsl.solved import order_power, pack_orders
from tests.realtime.glsl.shaders import DAYLIGHT, difference, paired, probed, shaded
from tests.support.orders import load, thin_grating

WIDTH = 65.0  # µm
_LAM = np.arange(381.0, 780.0, 2.0)  # nm; lobes are at least 4 nm wide

Array = NDArray[np.float64]


@pytest.fixture(scope="module", params=[1.0, 1.5], ids=["air", "layer"])
def table(request: pytest.FixtureRequest) -> OrderTable:
    return thin_grating(period=0.5, superstrate=request.param)


def pairs(table: OrderTable, count: int = 12) -> tuple[Array, Array]:
    """Directions in lobes of orders −1 to 1."""
    rng = np.random.default_rng(4)
    found: list[tuple[Array, list[float]]] = []
    while len(found) < count:
        wi = rng.normal(size=3) * [1, 1, 0.5]
        wi = np.abs(wi) * [np.sign(wi[0]), np.sign(wi[1]), 1] / np.linalg.norm(wi)
        shift = rng.integers(-1, 2) * rng.uniform(0.45, 0.65) / table.period
        xy = [shift, 0.0] - wi[:2] + rng.normal(0.0, 0.005, 2)
        if wi[2] > 0.15 and xy @ xy < 0.97:
            found.append((wi, [*xy, np.sqrt(1.0 - xy @ xy)]))
    wi, wo = np.array(found).transpose(1, 0, 2)
    return wi, wo


@pytest.fixture(scope="module")
def colours(table: OrderTable) -> Array:
    """f cosθo of the pairs under daylight, (n, 3)."""
    wi, wo = pairs(table)
    weights = 2.0 * linear_srgb(response(_LAM))
    values = md.reference.orders_brdf(
        table.efficiency, table.period, np.repeat(wi, len(_LAM), 0), np.repeat(wo, len(_LAM), 0),
        np.tile(_LAM, len(wi)), coherence_width=WIDTH, superstrate=table.superstrate,
    )  # fmt: skip
    return wo[:, 2:] * (values.reshape(len(wi), -1) @ weights)


@pytest.mark.parametrize("method", ["fast", "exact"])
def test_colours_are_the_sum_over_wavelengths(
    gl: Any, table: OrderTable, colours: Array, method: str
) -> None:
    wi, wo = pairs(table)
    parts = pack_orders(method, table, sigma_of(WIDTH)) | pack_responses(DAYLIGHT) | paired(wi, wo)
    drawn = probed(gl, method, parts, np.zeros((len(wi), 4)))
    # one or two wavelengths stand for a lobe, within which efficiencies change
    assert difference(drawn, colours) < (0.02 if method == "fast" else 0.01)


def test_drawn_directions_hold_all_light() -> None:
    """The mean of f cosθ over the density of drawn directions is the sum of all efficiencies."""
    table = thin_grating(period=0.7)
    sigma, wavelength, wi = sigma_of(WIDTH), 550.0, np.array([0.3, 0.2, np.sqrt(0.87)])
    packed = pack_lobes(lambda edges: order_power(table, sigma, edges), sigma)
    textures = {texture.name: texture.data for texture in packed.textures}
    uv = textures["lobe_places"].reshape(-1, 2).astype(float)
    rings, azimuths = textures["lobe_densities"].shape[:2]
    smallest, step = (packed.uniforms[f"lobe_{name}"] for name in ("smallest", "step"))
    ring = np.floor(np.log(np.maximum(np.hypot(*uv.T), 1e-10) / smallest) / step) + 1
    turn = np.arctan2(uv[:, 1], uv[:, 0]) / (2 * np.pi) % 1.0
    cell = np.clip(ring, 0, rings - 1).astype(int), (turn * azimuths).astype(int) % azimuths
    density = textures["lobe_densities"][..., 0][cell]
    xy = uv - wi[:2]
    squared = (xy**2).sum(axis=1)
    wo = np.column_stack([xy, np.sqrt(np.maximum(1.0 - squared, 1e-6))])
    near = (squared < 0.999) & (np.abs(uv[:, 1]) < 0.03)
    f = md.reference.orders_brdf(
        table.efficiency, table.period, wi, wo[near], wavelength, coherence_width=WIDTH
    )
    light = sum(float(table.efficiency(*-wi[:2], wavelength, m)) for m in range(-3, 4))
    # a lobe of one wavelength holds about a thousand of the directions
    assert float((f / density[near]).sum()) / len(uv) == pytest.approx(light, rel=0.03)


def test_the_exported_shader_has_the_same_colours(
    gl: Any, table: OrderTable, colours: Array, some_variant: str
) -> None:
    wi, wo = pairs(table)
    shader = make_shader(load(table, coherence_width=WIDTH))
    assert difference(shaded(gl, shader, wi, wo), colours) < 0.02
    assert difference(shaded(gl, shader, wi, wo, "diffraction_exact"), colours) < 0.01
    if table.superstrate == 1.0:
        reflected = [
            sum(table.efficiency(-w[:, :1], -w[:, 1:2], RGB_WAVELENGTHS, m) for m in range(-3, 4))
            for w in (wi, wo)
        ]
        beneath = (1.0 - reflected[0]) * (1.0 - reflected[1])
        passed = shaded(gl, shader, wi, wo, "diffraction_transmission")
        np.testing.assert_allclose(passed, beneath, atol=2e-3)  # half floats, linear cells
