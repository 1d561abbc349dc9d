"""Random surfaces in a white furnace: none sends on more light than it gets, on either side."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.fuzz.surfaces import log_uniform
from tests.support.directions import polar
from tests.support.lanes import interaction

_SAMPLES, _DIRECTIONS = 1 << 12, 3
#: R + T may exceed 1 by this, and by so many standard errors of its mean.
_EXCESS, _ERRORS = 0.005, 5.0


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


def parameters(rng: np.random.Generator, field: md.HeightField) -> dict[str, Any]:
    """A material that reflects, an interface or a sheet; contrasts of indices from 1.01 on."""
    kind = rng.choice(["mirror", "metal", "dielectric", "interface", "sheet"])
    index = 1.0 + log_uniform(rng, 0.01, 1.5)
    chosen: dict[str, Any] = {
        "mirror": {"material": "none"},
        "metal": {"material": str(rng.choice(["Al", "Au", "Cr"]))},
        "dielectric": {"int_ior": index, "ext_ior": 1.0},
        "interface": {"plugin": "diffraction_dielectric", "int_ior": index, "ext_ior": 1.0},
        "sheet": {
            "plugin": "diffraction_dielectric", "int_ior": index, "ext_ior": 1.0, "thin": True,
        },
    }[str(kind)]  # fmt: skip
    chosen |= {
        "coherence_width": float(np.mean(field.extent)) * log_uniform(rng, 0.5, 20.0),
        "model": str(rng.choice(["small_slope", "kirchhoff"])),
        "wavelength": float(rng.uniform(400.0, 700.0)),
    }
    if rng.random() < 0.5:
        chosen["height_scale"] = log_uniform(rng, 1e-3, 1.0)
    return chosen


def check(rng: np.random.Generator) -> None:
    """Load a surface and sample what it sends on, from both sides where light goes through."""
    mi.set_variant("llvm_ad_mono")
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
    both = "plugin" in asked
    for _ in range(_DIRECTIONS):
        theta = float(rng.uniform(0.0, 85.0))
        theta = 180.0 - theta if both and rng.random() < 0.5 else theta
        mean, error = _albedo(bsdf, theta, float(rng.uniform(0.0, 360.0)))
        assert np.isfinite(mean), f"{asked}: {mean} from {theta:.1f}°"
        most = 1.0 + _EXCESS + _ERRORS * error
        assert mean <= most, f"{asked}: sends on {mean:.4f} ± {error:.4f} from {theta:.1f}°"


def _albedo(bsdf: Any, theta: float, phi: float) -> tuple[float, float]:
    """Mean weight of samples and its standard error, in light from a direction in degrees."""
    si = interaction(np.tile(polar(theta, phi), (_SAMPLES, 1)), 550.0)
    rng = mi.PCG32(_SAMPLES)
    one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    # importance: radiance would be n² times as large in the dielectric
    _, weight = bsdf.sample(mi.BSDFContext(mi.TransportMode.Importance), si, one, two)
    values = np.array(dr.ravel(mi.unpolarized_spectrum(weight)), float)
    return float(values.mean()), float(values.std() / np.sqrt(_SAMPLES))
