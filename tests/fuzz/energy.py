"""Random combinations in a white furnace: scales, layers, speckle, nested light, to the horizon."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.fuzz.light import surface
from tests.fuzz.surfaces import log_uniform
from tests.support.directions import polar
from tests.support.lanes import interaction, spectra, vectors

_SAMPLES, _DIRECTIONS, _VALUES = 1 << 13, 3, 256
#: Least angle (degrees) beyond which R + T may exceed 1 by the second share, not the first; and the
#: standard errors of its mean that are added.
_GRAZING, _EXCESS, _ERRORS = 85.0, (0.01, 0.05), 5.0
#: Reflectances of the BSDF beneath, which Mitsuba accepts.
_HOSTILE = (-1.0, -1e-9, 0.0, 0.5, 1.0, 1e30, float("nan"))


def parameters(rng: np.random.Generator, field: md.HeightField) -> dict[str, Any]:
    """A material with layers, a sheet or an interface; scales and speckle of any of them."""
    kind = str(rng.choice(["mirror", "metal", "dielectric", "interface", "sheet"]))
    index = 1.0 + log_uniform(rng, 0.01, 1.5)
    through = {"plugin": "diffraction_dielectric", "int_ior": index, "ext_ior": 1.0}
    chosen: dict[str, Any] = {
        "mirror": {"material": "none"},
        "metal": {"material": str(rng.choice(["Al", "Au", "Cr"]))},
        "dielectric": {"int_ior": index, "ext_ior": 1.0},
        "interface": through,
        "sheet": through | {"thin": True},
    }[kind]
    layer = rng.choice(["none", "coat", "film"]) if kind in ("metal", "dielectric") else "none"
    if layer == "coat":
        chosen["coat_ior"] = 1.0 + log_uniform(rng, 0.01, 1.0)
    elif layer == "film":
        chosen["film_ior"] = 1.0 + log_uniform(rng, 0.05, 1.4)
        chosen["film_thickness"] = log_uniform(rng, 10.0, min(3e3, 6e3 / chosen["film_ior"]))
    if kind == "dielectric" and rng.random() < 0.5:
        value = float(rng.choice(_HOSTILE))
        chosen["beneath"] = {
            "type": "diffuse", "reflectance": {"type": "uniform", "value": value},
        }  # fmt: skip
    chosen |= {
        "coherence_width": max(1.5, float(np.mean(field.extent)) * log_uniform(rng, 0.5, 20.0)),
        "model": str(rng.choice(["small_slope", "kirchhoff"])),
        "wavelength": float(rng.uniform(400.0, 700.0)),
    }
    if rng.random() < 0.3:
        chosen["lateral_scale"] = log_uniform(rng, 0.2, 2.0)
    if rng.random() < 0.3:
        chosen["coherence"] = "patch"
    if rng.random() < 0.3:
        chosen["height_scale"] = log_uniform(rng, 1e-3, 1.5)
    return chosen


def check(rng: np.random.Generator) -> None:
    """Sample what a surface sends on, and look at values; one in ten in a spectral variant."""
    spectral = rng.random() < 0.1
    mi.set_variant("llvm_ad_spectral" if spectral else "llvm_ad_mono")
    try:
        field = surface(rng)
        asked = parameters(rng, field)
        bsdf = mi.load_dict(md.bsdf_dict(field, **asked))
    except md.DiffractionError:
        return
    except RuntimeError as error:
        # what a plugin refuses comes through Mitsuba
        assert "DiffractionError: " in str(error), str(error)[-200:]
        return
    for _ in range(_DIRECTIONS):
        theta = float(rng.choice([rng.uniform(0.0, 85.0), rng.uniform(85.0, 89.9)]))
        grazing = theta > _GRAZING
        theta = 180.0 - theta if "plugin" in asked and rng.random() < 0.5 else theta
        wi = polar(theta, float(rng.uniform(0.0, 360.0)))
        mean, error = _sent_on(bsdf, wi, rng)
        where = f"{asked}: from {theta:.2f}°"
        assert np.isfinite(mean).all(), f"{where} {mean}"
        most = _albedo_beneath(asked) * (1.0 + _EXCESS[int(grazing)]) + _ERRORS * error
        assert np.all(mean <= most), f"{where} {np.max(mean - _ERRORS * error):.4f} at least"
        _check_values(bsdf, wi, rng, where)


def _albedo_beneath(asked: dict[str, Any]) -> float:
    """Return the albedo of the BSDF beneath, at least 1."""
    value = asked["beneath"]["reflectance"]["value"] if "beneath" in asked else 1.0
    return max(1.0, value)  # 1 for NaN


def _sent_on(bsdf: Any, wi: Any, rng: np.random.Generator) -> tuple[Any, Any]:
    """Mean weight of samples at each wavelength and its standard error, in light along wi."""
    wavelengths = np.tile(rng.uniform(200.0, 1500.0, 4), (_SAMPLES, 1))
    si = interaction(np.tile(wi, (_SAMPLES, 1)), wavelengths)
    numbers = mi.PCG32(_SAMPLES)
    one, two = numbers.next_float32(), mi.Point2f(numbers.next_float32(), numbers.next_float32())
    # importance: radiance would be n² times as large in the dielectric
    _, weight = bsdf.sample(mi.BSDFContext(mi.TransportMode.Importance), si, one, two)
    values = np.array(mi.unpolarized_spectrum(weight), float)
    return values.mean(axis=1), values.std(axis=1) / np.sqrt(_SAMPLES)


def _check_values(bsdf: Any, wi: Any, rng: np.random.Generator, where: str) -> None:
    """Values in all directions are finite and not negative."""
    wo = rng.standard_normal((_VALUES, 3))
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    si = interaction(np.tile(wi, (_VALUES, 1)), rng.uniform(200.0, 1500.0, (_VALUES, 4)))
    values = spectra(bsdf.eval(mi.BSDFContext(), si, vectors(wo)))
    assert np.isfinite(values).all(), f"{where}: a value is not finite"
    assert values.min() >= 0.0, f"{where}: a value is {values.min():.3g}"
    assert dr.all(bsdf.pdf(mi.BSDFContext(), si, vectors(wo)) >= 0.0)
