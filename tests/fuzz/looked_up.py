"""Tables that may be damaged: loaded and looked up in NumPy and the plugin."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_diffraction import DiffractionTable
from tests.support.lanes import evaluated

#: LLVM, where reading outside of an array is no error but may end the process, compiles for each
#: table: of so many tables one has its turn.
_COMPILED = 40


def _check_window_sums(table: DiffractionTable) -> None:
    """Finite numbers of a sane size for all frequencies and κ that a table is for."""
    rng = np.random.default_rng(0)
    radius, turn = table.q_limit * np.sqrt(rng.random(300)), rng.uniform(0, 2 * np.pi, 300)
    limit = table.q_limit * table.height_scale_max
    kappa = np.concatenate([[0.0, limit], rng.uniform(0.0, limit, 298)])
    found = table.window_sum(radius * np.cos(turn), radius * np.sin(turn), kappa)
    assert np.isfinite(found).all()
    assert np.abs(found).max() < 1e9


def _check_compiled(path: Path) -> None:
    mi.set_variant("llvm_ad_spectral")
    rng = np.random.default_rng(1)
    tangential = rng.uniform(-0.7, 0.7, (2, 64, 2))
    wi, wo = (np.c_[uv, np.sqrt(1.0 - (uv**2).sum(axis=1))] for uv in tangential)
    value = evaluated(_loaded(path), wi, wo, rng.uniform(360.0, 830.0, (64, 4)))
    assert np.isfinite(value).all()
    assert (value >= 0.0).all()
    assert value.max() < 1e9


def use_table(path: Path) -> DiffractionTable:
    """A table whose values are sane; a DiffractionError if it is refused."""
    table = DiffractionTable.load(path)
    _check_window_sums(table)
    _look_up(table)
    mi.set_variant("scalar_spectral")  # where reading outside of an array is an error
    bsdf = _loaded(path)
    if bsdf is not None:
        look_up_in_plugin(bsdf)
        if int(table.digest(), 16) % _COMPILED == 0:
            _check_compiled(path)
    return table


def _loaded(path: Path) -> Any:
    """The plugin with a table, or None if it refuses it."""
    scene = {"type": "diffraction", "filename": str(path), "energy_conserving": False}
    try:
        return mi.load_dict({**scene, "material": "none"})
    except RuntimeError as error:
        assert "DiffractionError: " in str(error), str(error)[-200:]
        return None


def look_up_in_plugin(bsdf: Any) -> None:
    """Values, densities and samples are finite and not negative."""
    rng = np.random.default_rng(2)
    context, si = mi.BSDFContext(), dr.zeros(mi.SurfaceInteraction3f)
    for _ in range(4):
        wi, wo = (np.append(p, np.sqrt(1.0 - p @ p)) for p in rng.uniform(-0.7, 0.7, (2, 2)))
        si.wi, si.wavelengths = mi.Vector3f(wi), mi.Spectrum(rng.uniform(360.0, 830.0, 4))
        si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
        value, density = bsdf.eval_pdf(context, si, mi.Vector3f(wo))
        drawn, weight = bsdf.sample(context, si, rng.random(), mi.Point2f(rng.random(2)))
        numbers = np.array([*value, density, drawn.pdf, *weight])
        assert np.isfinite(numbers).all(), "not finite in the plugin"
        assert (numbers >= 0.0).all(), "negative in the plugin"
        assert numbers[:4].max() < 1e9, "too bright in the plugin"


def _look_up(table: DiffractionTable) -> None:
    rng = np.random.default_rng(1)
    wi, wo = rng.normal(size=(2, 16, 3))
    for w in (wi, wo):
        w[:, 2] = np.abs(w[:, 2]) + 0.1
        w /= np.linalg.norm(w, axis=1)[:, None]
    low, high = table.wavelength_range
    value = table.brdf(wi, wo, rng.uniform(low, high, 16))
    assert np.isfinite(value).all()
    assert (value >= 0.0).all()
    assert value.max() < 1e9
