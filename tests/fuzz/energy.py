"""Random combinations in a white furnace: layers, scales, speckle, nested light, to the horizon."""

from __future__ import annotations

import json
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.fuzz.surfaces import log_uniform
from tests.support.directions import polar
from tests.support.furnace import loaded
from tests.support.lanes import interaction, lanes, spectra, vectors

_DIRECTIONS, _VALUES = 3, 256
#: Samples of a direction, and of those that may send on too much.
_SAMPLES = 1 << 13, 1 << 17
#: Angle (degrees) beyond which half of the directions are; share by which R + T may exceed 1, and
#: the standard errors of its mean that are added.
_GRAZING, _EXCESS, _ERRORS = 85.0, 0.005, 5.0
#: Reflectances of the BSDF beneath, which Mitsuba accepts.
_HOSTILE = (-1.0, -1e-9, 0.0, 0.5, 1.0, 1e30, float("nan"))
#: Variants by their share. Spectral variants have scales of energy at 16 wavelengths or more, which
#: take 10 to 100 times as long as one. RGB variants have colours outside the gamut, which are
#: negative, or above 1 as the red of gold: their luminance is at most 1.
_VARIANTS = {
    "llvm_ad_mono": 0.82, "llvm_ad_spectral": 0.07, "llvm_ad_mono_polarized": 0.07,
    "llvm_ad_rgb": 0.04,
}  # fmt: skip
#: Materials by their share. Light that goes through has scales on both sides, along four paths.
_KINDS = {"mirror": 0.2, "metal": 0.3, "dielectric": 0.26, "interface": 0.12, "sheet": 0.12}
#: Share of surfaces whose window is one patch, which take ten times as long.
_PATCHES = 0.12
_TEXELS = (4, 4, 1)
#: Of linear sRGB's channels.
_LUMINANCE = (0.2126, 0.7152, 0.0722)


def parameters(rng: np.random.Generator, field: md.HeightField) -> dict[str, Any]:
    """A material with layers, a sheet or an interface; scales and speckle of any of them."""
    kind = str(rng.choice(list(_KINDS), p=list(_KINDS.values())))
    index = 1.0 + log_uniform(rng, 0.01, 1.5)
    through = {"plugin": "diffraction_dielectric", "int_ior": index, "ext_ior": 1.0}
    chosen: dict[str, Any] = {
        "mirror": {"material": "none"},
        "metal": {"material": str(rng.choice(["Al", "Au", "Cr"]))},
        "dielectric": {"int_ior": index, "ext_ior": 1.0},
        "interface": through,
        "sheet": through | {"thin": True},
    }[kind]
    solid = kind in ("metal", "dielectric")
    layer = rng.choice(["none", "coat", "film", "stack"]) if solid else "none"
    if layer == "coat":
        chosen["coat_ior"] = 1.0 + log_uniform(rng, 0.01, 1.0)
    elif layer == "film":
        chosen["film_ior"] = 1.0 + log_uniform(rng, 0.05, 1.4)
        chosen["film_thickness"] = log_uniform(rng, 10.0, min(3e3, 6e3 / chosen["film_ior"]))
        if kind == "metal" and rng.random() < 0.3:
            chosen["film_k"] = log_uniform(rng, 1e-4, 1.0)
    if kind == "dielectric" and rng.random() < 0.5:
        value = float(rng.choice(_HOSTILE))
        plain = {"type": "uniform", "value": value}
        # Mitsuba looks at no texel
        reflectance = np.full(_TEXELS, value) if rng.random() < 0.5 else plain
        chosen["beneath"] = {"type": "diffuse", "reflectance": reflectance}
    chosen |= {
        "coherence_width": max(0.5, float(np.mean(field.extent)) * log_uniform(rng, 0.1, 20.0)),
        "model": str(rng.choice(["small_slope", "kirchhoff"])),
        "wavelength": float(rng.uniform(400.0, 700.0)),
    }
    if "plugin" not in chosen and rng.random() < 0.1:
        chosen["shadowing"] = "vcavity"
    if layer == "stack":
        chosen |= {"layers": _stack(rng), "model": "kirchhoff"}
    if rng.random() < _PATCHES:
        chosen["coherence"] = "patch"
    for name, low, high in (("lateral_scale", 0.1, 2.0), ("height_scale", 1e-3, 1.5)):
        factor, drawn = log_uniform(rng, low, high), rng.random()
        # scales of energy of a varying sheet or patch, or of all wavelengths, take a minute
        if drawn < 0.05 and mi.is_monochromatic and not {"plugin", "coherence"} & set(chosen):
            chosen[name] = rng.uniform(0.6, 1.0, _TEXELS) * factor
        # scales of energy of stretched heights that let light through take 10 s
        elif drawn < (0.12 if name == "lateral_scale" and "plugin" in chosen else 0.35):
            chosen[name] = factor
    return chosen


def _stack(rng: np.random.Generator) -> str:
    """A file of layers: pairs of any indices, repeated, of uncertain thickness."""
    pairs = [
        [f"{1.0 + log_uniform(rng, 0.05, 1.5):.4f}", log_uniform(rng, 0.01, 0.3)]
        for _ in range(int(rng.integers(1, 4)))
    ]
    if rng.random() < 0.2:  # a gap, or a layer of the index above
        pairs[-1][0] = "1.0"
    if rng.random() < 0.2 and pairs[0][0] != "1.0":
        pairs[0][0] += f"+{log_uniform(rng, 1e-4, 0.3):.5f}i"
    repeat, spread = int(rng.integers(1, 6)), rng.choice([0.0, 0.05])
    return f"layers = {json.dumps(pairs)}\nrepeat = {repeat}\nspread = {spread}\n"


def surface(rng: np.random.Generator) -> md.HeightField:
    """Flat, shallow or rough; noise, waves along x, or steps."""
    ny, nx = (int(rng.integers(8, 49)) for _ in range(2))
    x, y = np.arange(nx), np.arange(ny)[:, None]
    shapes = (
        rng.random((ny, nx)),
        np.sin(2 * np.pi * int(rng.integers(1, 4)) * x / nx) + 0.0 * y,
        1.0 * (x % 8 < 4) + 0.0 * y,
    )
    depth = (0.0, log_uniform(rng, 1e-4, 0.03), log_uniform(rng, 0.03, 0.2))[rng.integers(3)]
    pixel = log_uniform(rng, 0.05, 0.1)
    heights = depth * shapes[rng.integers(len(shapes))]
    return md.HeightField(heights, (pixel, pixel * log_uniform(rng, 0.5, 2.0)))


def grooves(rng: np.random.Generator) -> md.HeightField:
    """Periods of a blazed grating, whose orders leave in kinks of the albedo."""
    pixel, count = log_uniform(rng, 0.03, 0.08), int(rng.integers(20, 60))
    heights = log_uniform(rng, 0.01, 0.3) * np.tile(np.arange(count) / count, (8, 1))
    return md.HeightField(heights, pixel, periodic=True)


def domes(rng: np.random.Generator) -> md.HeightField:
    """Spherical caps side by side, of slopes up to 0.5, that end in edges."""
    count, pixel = int(rng.integers(16, 48)), log_uniform(rng, 0.03, 0.1)
    x = np.linspace(-1.0, 1.0, count, endpoint=False)
    squared = x**2 + x[:, None] ** 2
    height = 0.25 * log_uniform(rng, 0.05, 0.5) * count * pixel
    return md.HeightField(height * np.maximum(1.0 - squared, 0.0), pixel, periodic=True)


def check(rng: np.random.Generator) -> None:
    """Sample what a surface sends on, and look at values."""
    mi.set_variant(str(rng.choice(list(_VARIANTS), p=list(_VARIANTS.values()))))
    try:
        shape = (grooves, domes, surface)[rng.choice(3, p=[0.1, 0.1, 0.8])]
        field = shape(rng)
        asked = parameters(rng, field)
        bsdf = loaded(field, asked)
    except md.DiffractionError:
        return
    except RuntimeError as error:
        # what a plugin refuses comes through Mitsuba
        assert "DiffractionError: " in str(error), str(error)[-200:]
        return
    grazing = rng.random(_DIRECTIONS) < 0.5
    theta = rng.uniform(np.where(grazing, _GRAZING, 0.0), np.where(grazing, 89.9, _GRAZING))
    phi = rng.uniform(0.0, 360.0, _DIRECTIONS)
    wi = np.stack([polar(*angles) for angles in zip(theta, phi, strict=True)])
    if "plugin" in asked:
        wi[:, 2] *= rng.choice([-1.0, 1.0], _DIRECTIONS)
    uv, wavelengths = rng.random((_DIRECTIONS, 2)), rng.uniform(0.0, 1500.0, (_DIRECTIONS, 4))
    where = f"{asked}: from {theta}°, on the side {np.sign(wi[:, 2])}, at {wavelengths} nm"
    most = _albedo_beneath(asked) * (1.0 + _EXCESS)

    def light(count: int) -> Any:
        directions, spectrum = (np.repeat(part, count, axis=0) for part in (wi, wavelengths))
        si = interaction(directions, spectrum)
        si.uv = mi.Point2f(*map(lanes, np.repeat(uv, count, axis=0).T))
        return si

    for count in _SAMPLES:
        mean, error = _sent_on(bsdf, light(count), count)
        assert np.isfinite(mean).all(), f"{where} {mean}"
        if np.all(mean <= most):
            break
    least = mean - _ERRORS * error
    assert np.all(least <= most), f"{where} {least.max(axis=0)} at least"
    wo = rng.standard_normal((_DIRECTIONS * _VALUES, 3))
    _check_values(bsdf, light(_VALUES), wo, where)


def _albedo_beneath(asked: dict[str, Any]) -> float:
    """Return the albedo of the BSDF beneath, at least 1."""
    if "beneath" not in asked:
        return 1.0
    reflectance = asked["beneath"]["reflectance"]
    value = reflectance["value"] if isinstance(reflectance, dict) else reflectance.min()
    return max(1.0, float(value))  # 1 for NaN


def _sent_on(bsdf: Any, si: Any, count: int) -> tuple[Any, Any]:
    """Mean weight of `count` samples a direction, and its error, (wavelengths, directions)."""
    numbers = mi.PCG32(dr.width(si.wi))
    one, two = numbers.next_float32(), mi.Point2f(numbers.next_float32(), numbers.next_float32())
    # importance: radiance would be n² times as large in the dielectric
    _, weight = bsdf.sample(mi.BSDFContext(mi.TransportMode.Importance), si, one, two)
    values = np.array(mi.unpolarized_spectrum(weight), float).reshape(-1, _DIRECTIONS, count)
    if mi.is_rgb:
        values = np.einsum("c,c...->...", _LUMINANCE, values)[None]
    return values.mean(axis=2), values.std(axis=2) / np.sqrt(count)


def _check_values(bsdf: Any, si: Any, wo: Any, where: str) -> None:
    """Values in all directions are finite and not negative."""
    wo = wo / np.linalg.norm(wo, axis=1, keepdims=True)
    value, density = bsdf.eval_pdf(mi.BSDFContext(), si, vectors(wo))
    values = spectra(mi.unpolarized_spectrum(value))
    assert np.isfinite(values).all(), f"{where}: a value is not finite"
    assert mi.is_rgb or values.min() >= 0.0, f"{where}: a value is {values.min():.3g}"
    assert dr.all(density >= 0.0), f"{where}: a density is negative"
