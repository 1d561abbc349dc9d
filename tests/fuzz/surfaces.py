"""Random height fields as tables: right to their tolerance in NumPy and the plugin, or refused."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import kirchhoff_factor, sigma_of
from tests.support.directions import lit_pairs
from tests.support.lanes import brdf_values

_PAIRS, _MANY = 40, 1500
#: Errors are measured at some pairs of directions, tolerances hold for sums over thousands; single
#: precision of directions and wavelengths is worth 1e-5 of the light on top (docs/accuracy.md).
_SAMPLING, _SINGLE = 2.0, 1e-5


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number spread evenly over the orders of magnitude."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def surface(rng: np.random.Generator) -> md.HeightField:
    """Noise, a spike, steps, waves or next to nothing; elongated patches and pixels among them."""
    ny, nx = (int(log_uniform(rng, 2, 40)) for _ in range(2))
    x, y = np.arange(nx), np.arange(ny)[:, None]
    shapes = (
        rng.random((ny, nx)),
        1.0 * ((x == nx // 2) & (y == ny // 3)),
        1.0 * (x % 4 < 2) + 0.0 * y,
        np.sin(2 * np.pi * x / nx) * np.cos(2 * np.pi * y / ny),
        1e-3 * rng.random((ny, nx)),
    )
    depth = log_uniform(rng, 1e-3, 2.0 if rng.random() < 0.2 else 0.5)
    pixel = log_uniform(rng, 0.03, 0.6)
    heights = depth * shapes[rng.integers(len(shapes))] + rng.choice([0.0, -3.0, 76e3])
    return md.HeightField(heights, (pixel, pixel * log_uniform(rng, 0.2, 5.0)))


def settings(rng: np.random.Generator, field: md.HeightField) -> dict[str, Any]:
    """What a table of it is asked for."""
    return {
        "coherence_width": float(np.mean(field.extent)) * log_uniform(rng, 0.2, 4.0),
        "coherence": str(rng.choice(md.reference.COHERENCES)),
        "basis": str(rng.choice(["auto", "svd", "chebyshev", "taylor"])),
        "tolerance": log_uniform(rng, 1e-5, 0.1),
    }


def check(rng: np.random.Generator) -> None:
    """Build a table, save and load it, and look it up."""
    mi.set_variant("llvm_ad_spectral")  # command lines set others
    try:
        field = surface(rng)
        asked = settings(rng, field)
        table = md.DiffractionTable.build(field, **asked)
    except md.DiffractionError:
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "table.exr")
        table.save(path)
        loaded = md.DiffractionTable.load(path)
        np.testing.assert_array_equal(loaded.coefficients, table.coefficients)
        scene = {
            "type": "diffraction", "filename": str(path), "material": "none",
            "energy_conserving": False,
        }  # fmt: skip
        bsdf = mi.load_dict(scene)
    seed = int(rng.integers(2**31))
    try:
        _check_look_ups(field, asked, loaded, bsdf, _PAIRS, seed)
    except AssertionError:
        # a few may be darker than those that a tolerance is relative to
        _check_look_ups(field, asked, loaded, bsdf, _MANY, seed)


def _check_look_ups(
    field: md.HeightField, asked: dict[str, Any], table: md.DiffractionTable, bsdf: Any,
    count: int, seed: int,
) -> None:  # fmt: skip
    """Compare as many pairs of directions with the integral, in NumPy and in the plugin."""
    sigma = sigma_of(asked["coherence_width"])
    try:
        wi, wo, wavelength, near = lit_pairs(field, sigma, count, seed)
    except (StopIteration, ValueError):
        return  # no order but the zeroth has light to look for
    given = {name: asked[name] for name in ("coherence_width", "coherence")}
    exact = md.reference.brdf(field, wi, wo, wavelength, **given)
    factor = kirchhoff_factor(wi, wo, wavelength, sigma)
    values = {
        "NumPy": table.brdf(wi, wo, wavelength),
        "plugin": np.ravel(brdf_values(bsdf, wi, wo, np.asarray(wavelength)[:, None])),
    }
    for what, value in values.items():
        if not (np.isfinite(value).all() and (value >= 0.0).all()):
            raise ArithmeticError(f"{what}: not finite, or negative")
        most = _SAMPLING * asked["tolerance"] + (_SINGLE if what == "plugin" else 0.0)
        for part in (near, ~near):
            total = (exact / factor)[part].sum()
            if total > 1e-12 * (exact / factor).sum():
                error = float((np.abs(value - exact) / factor)[part].sum() / total)
                assert error <= most, f"{what}: error {error:.3g}, allowed {most:.3g}"
