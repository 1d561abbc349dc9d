"""The shaders' small slope against the NumPy code that it is a twin of."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.optics.boundary import MODELS
from mitsuba_diffraction.optics.colour import RGB_WAVELENGTHS, linear_srgb, metal_tint, response
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.realtime.glsl.packing import (
    pack_boundary,
    pack_colours,
    pack_conductor,
    pack_powers,
    pack_responses,
)
from mitsuba_diffraction.realtime.glsl.texels import Packed
from mitsuba_diffraction.reference import boundary, fresnel, model
from mitsuba_diffraction.tables.colour import cached_colours
from tests.realtime.glsl.shaders import DAYLIGHT, PERFECT, difference, paired, probed
from tests.support.directions import as_single, uniform_directions
from tests.support.formulas import Pairs, exact_power

METAL = (np.array([360.0, 830.0]), np.array([1.4, 0.4]), np.array([2.0, 5.0]))
DIELECTRIC = Packed(uniforms={"eta": 1.5}, definitions={"SURFACE_KIND": "1"})
MATERIALS = {"dielectric": DIELECTRIC, "conductor": pack_conductor(*METAL)}
HEIGHTS = 0.8  # their scale
UNTINTED = Packed(uniforms={f"tint_{n}": tuple(np.eye(3)[n]) for n in range(3)})


def index(kind: str, wavelength: NDArray[np.float64]) -> NDArray[np.complex128]:
    if kind != "conductor":
        return np.full(len(wavelength), 1.5 + 0j)
    lam, eta, k = METAL
    return np.interp(wavelength, lam, eta) + 1j * np.interp(wavelength, lam, k)


def pairs(n: int) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """ωi, ωo (n, 3), the first along the normal, and places (n, 4)."""
    rng = np.random.default_rng(4)
    wi, wo = uniform_directions(n, rng, 0.1), uniform_directions(n, rng, 0.1)
    wi[0], wo[1], wi[2] = (0, 0, 1), (0, 0, 1), wo[2]
    wi, wo = as_single(wi), as_single(wo)
    cos_half = np.sqrt(0.5 + 0.5 * np.sum(wi * wo, axis=1))
    return wi, wo, np.concatenate([(wi + wo) * [1, 1, HEIGHTS], cos_half[:, None]], axis=1)


def apart(pair: tuple[NDArray[Any], ...], radius: float) -> tuple[NDArray[Any], ...]:
    """Pairs of `pairs` whose (u, v) lie beyond order 0's lobe, which is a mirror's."""
    beyond = np.hypot(*pair[2][:, :2].T) > radius
    assert beyond.sum() > 30
    return tuple(part[beyond] for part in pair)


def factor(
    table: DiffractionTable, kind: str, wi: NDArray[Any], wo: NDArray[Any], lam: NDArray[Any]
) -> NDArray[np.float64]:
    """N' / (1 + ωi·ωo)² at wavelengths (m,), shape (n, m)."""
    total, powers = wi + wo, []
    for k, n in zip(wavenumber(lam), index(kind, lam), strict=True):
        variance = table.roughness.at(np.hypot(*total[:, :2].T) * k)
        given = Pairs(wi, wo, HEIGHTS * total[:, 2] * k, variance)
        powers.append(exact_power(given, n) / (1 + np.sum(wi * wo, axis=1)) ** 2)
    return np.stack(powers, axis=1)


def sloped(
    gl: Any, method: str, table: DiffractionTable, parts: Packed, pair: tuple[Any, ...]
) -> NDArray[np.float64]:
    """Colours of pairs by small slope."""
    wi, wo, at = pair
    model = pack_boundary(MODELS["small_slope"], table.roughness)
    return probed(gl, method, parts | model | paired(wi, wo, height_scale=HEIGHTS), at)


@pytest.mark.parametrize("kind", MATERIALS)
def test_lut_has_the_factor_of_each_channel(gl: Any, table: DiffractionTable, kind: str) -> None:
    table_of_colours = cached_colours(table)
    colours = pack_colours(table_of_colours)
    pair = apart(pairs(600), table_of_colours.radius_end)
    plain = probed(gl, "fast", colours | PERFECT, pair[2])
    material = MATERIALS[kind] | (UNTINTED if kind == "conductor" else Packed())
    found = sloped(gl, "fast", table, colours | material, pair)
    expected = factor(table, kind, *pair[:2], np.array(RGB_WAVELENGTHS))
    if kind == "conductor":  # its colour is that of daylight, Kirchhoff's at each mean is taken out
        own = index(kind, np.array(RGB_WAVELENGTHS))
        tangent = model.kirchhoff(pair[0][:, None], pair[1][:, None], own)
        scale = 2 * pair[0][:, 2] * pair[1][:, 2] / (2 * pair[2][:, 3] ** 2)
        expected /= boundary.unpolarised(tangent) * scale[:, None] ** 2
        expected *= probed_reflectance(gl, colours, plain, pair[2])
    lit = np.abs(plain) > 1e-3 * np.abs(plain).max()
    # single precision, and fast's reading of reflectances between 129 angles
    assert found[lit] / plain[lit] == pytest.approx(expected[lit], rel=1e-3)


def probed_reflectance(
    gl: Any, colours: Packed, plain: NDArray[Any], at: NDArray[Any]
) -> NDArray[np.float64]:
    found = probed(gl, "fast", colours | MATERIALS["conductor"] | UNTINTED, at)
    return np.divide(found, plain, out=np.ones_like(plain), where=plain != 0.0)


def test_lut_has_the_tint_of_a_metal(gl: Any, table: DiffractionTable) -> None:
    pair, lam = pairs(50), np.arange(360.0, 830.5)
    colours = pack_colours(cached_colours(table)) | MATERIALS["conductor"]
    plain = sloped(gl, "fast", table, colours | UNTINTED, pair)
    spectrum = fresnel.reflectance(1.0, index("conductor", lam))
    weights = linear_srgb(response(lam))
    tint = metal_tint(lam, spectrum, spectrum @ weights / weights.sum(axis=0))
    assert np.abs(tint - np.eye(3)).max() > 0.02  # it is a metal with a colour
    expected = plain @ tint.T
    # single precision
    assert sloped(gl, "fast", table, colours, pair) == pytest.approx(
        expected, rel=1e-4, abs=1e-5 * np.abs(expected).max()
    )


@pytest.mark.parametrize("kind", ["dielectric", "conductor"])
def test_exact_has_the_factor_of_each_wavelength(
    gl: Any, table: DiffractionTable, kind: str
) -> None:
    lam = np.arange(376.0, 744.0, 0.5) + 0.25
    k = wavenumber(lam)
    # exp(−20) of the largest power
    pair = wi, wo, at = apart(pairs(400), 20**0.5 / (table.sigma_0 * k.min()))
    parts = pack_powers(table) | pack_responses(DAYLIGHT) | MATERIALS[kind]
    found = sloped(gl, "exact", table, parts, pair)
    weights = linear_srgb(response(lam)) * 0.5 / (lam[:, None] * 1e-3) ** 2
    powers = table.window_sum(*(at[:, n, None] * k for n in range(3)))
    exact = (powers * factor(table, kind, wi, wo, lam)) @ weights
    assert difference(found, exact) < 8e-3  # as for a perfect mirror
