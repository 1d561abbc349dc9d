"""The shaders' small slope against the NumPy code that it is a twin of."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.optics.boundary import MODELS
from mitsuba_diffraction.optics.colour import RGB_WAVELENGTHS
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.realtime.glsl.packing import pack_boundary, pack_colours, pack_conductor
from mitsuba_diffraction.realtime.glsl.texels import Packed
from mitsuba_diffraction.reference import boundary, model
from mitsuba_diffraction.tables.colour import cached_colours
from tests.realtime.glsl.shaders import PERFECT, paired, probed
from tests.support.directions import as_single, uniform_directions
from tests.support.formulas import Pairs, exact_power

WAVELENGTHS = np.array(RGB_WAVELENGTHS)
METAL = (np.array([360.0, 830.0]), np.array([1.4, 0.4]), np.array([2.0, 5.0]))
UNTINTED = Packed(uniforms={f"tint_{n}": tuple(np.eye(3)[n]) for n in range(3)})
MATERIALS = {  # and their indices at the channels' wavelengths
    "dielectric": (
        Packed(uniforms={"eta": 1.5}, definitions={"SURFACE_KIND": "1"}),
        np.full(3, 1.5 + 0j),
    ),
    "conductor": (
        pack_conductor(*METAL) | UNTINTED,
        np.interp(WAVELENGTHS, METAL[0], METAL[1])
        + 1j * np.interp(WAVELENGTHS, METAL[0], METAL[2]),
    ),
}
HEIGHTS = 0.8  # their scale


@pytest.mark.parametrize("kind", MATERIALS)
def test_lut_has_the_factor_of_each_channel(gl: Any, table: DiffractionTable, kind: str) -> None:
    """N' / (1 + ωi·ωo)² beyond order 0's lobe, which is a mirror's."""
    rng, (material, index) = np.random.default_rng(4), MATERIALS[kind]
    colours = pack_colours(cached_colours(table))
    wi, wo = (as_single(uniform_directions(600, rng, 0.1)) for _ in range(2))
    wi[0], wo[1], wi[2] = (0, 0, 1), (0, 0, 1), wo[2]
    beyond = np.hypot(*(wi + wo)[:, :2].T) > cached_colours(table).radius_end
    wi, wo = wi[beyond], wo[beyond]
    total, cosine = wi + wo, 1 + np.sum(wi * wo, axis=1)
    at = np.concatenate([total * [1, 1, HEIGHTS], np.sqrt(0.5 * cosine)[:, None]], axis=1)
    powers = []
    for k, n in zip(wavenumber(WAVELENGTHS), index, strict=True):
        variance = table.roughness.at(np.hypot(*total[:, :2].T) * k)
        powers.append(exact_power(Pairs(wi, wo, HEIGHTS * total[:, 2] * k, variance), n))
    expected = np.stack(powers, axis=1) / cosine[:, None] ** 2
    plain = probed(gl, "fast", colours | PERFECT, at)
    if kind == "conductor":  # its colour is that of daylight, Kirchhoff's at each mean is taken out
        tangent = model.kirchhoff(wi[:, None], wo[:, None], index)
        scale = 2 * wi[:, 2] * wo[:, 2] / cosine
        expected /= boundary.unpolarised(tangent) * scale[:, None] ** 2
        own = probed(gl, "fast", colours | material, at)
        expected *= np.divide(own, plain, out=np.ones_like(plain), where=plain != 0.0)
    sloped = pack_boundary(MODELS["small_slope"], table.roughness)
    found = probed(
        gl, "fast", colours | material | sloped | paired(wi, wo, height_scale=HEIGHTS), at
    )
    lit = np.abs(plain) > 1e-3 * np.abs(plain).max()
    # single precision, and fast's reading of reflectances between 129 angles
    assert found[lit] / plain[lit] == pytest.approx(expected[lit], rel=1e-3)
