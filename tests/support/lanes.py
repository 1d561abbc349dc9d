"""Between NumPy arrays and the lanes of a Mitsuba variant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from mitsuba_diffraction.plugin.memory import upload


def lanes(values: ArrayLike) -> Any:
    """mi.Float of numbers (n,), in Dr.Jit's own memory.

    NumPy's is aligned by chance, and kernels that read it differ by that: they would be compiled
    again in every run instead of being found in Dr.Jit's cache.
    """
    return upload(mi.Float, np.asarray(values, np.float32))


def vectors(directions: ArrayLike) -> Any:
    """mi.Vector3f of directions (n, 3), in scalar variants of one."""
    rows = np.atleast_2d(np.asarray(directions, np.float32))
    if not dr.is_jit_v(mi.Float):
        return mi.Vector3f(*rows[0].tolist())
    return mi.Vector3f(*map(lanes, rows.T))


def interaction(wi: ArrayLike, wavelengths: ArrayLike) -> Any:
    """Surface interactions in a frame of their own, for wi (n, 3) and nm: (n, 4), (n,) or one.

    Scalar variants have one, for wi (3,) and nm: (4,) or one.
    """
    n = len(np.atleast_2d(wi))
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = vectors(wi)
    lam = np.asarray(wavelengths, np.float32)
    if mi.is_spectral and not dr.is_jit_v(mi.Float):
        si.wavelengths = mi.UnpolarizedSpectrum(*np.broadcast_to(lam.ravel(), 4).tolist())
    elif mi.is_spectral:
        lam = np.broadcast_to(lam if lam.ndim == 2 else lam.reshape(-1, 1), (n, 4))
        si.wavelengths = mi.UnpolarizedSpectrum(*map(lanes, lam.T))
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    return si


def bitmap(values: ArrayLike, **more: Any) -> dict[str, Any]:
    """A raw bitmap of numbers (height, width) or (height, width, channels), not interpolated."""
    texels = np.asarray(values, np.float32)
    texels = texels[..., None] if texels.ndim == 2 else texels
    data = mi.TensorXf(np.ascontiguousarray(texels))
    return {"type": "bitmap", "raw": True, "data": data, "filter_type": "nearest"} | more


def with_bitmaps(value: Any, **more: Any) -> Any:
    """Replace arrays of texels in a dictionary by bitmaps of the variant that is set."""
    if isinstance(value, dict):
        return {name: with_bitmaps(part, **more) for name, part in value.items()}
    return bitmap(value, **more) if isinstance(value, np.ndarray) else value


def spectra(value: Any) -> NDArray[np.float64]:
    """Values (n, 4) of a mi.Spectrum."""
    return np.array(value, np.float64).T


def evaluated(bsdf: Any, wi: ArrayLike, wo: ArrayLike, wavelengths: ArrayLike) -> NDArray[Any]:
    """bsdf.eval, f·cosθo, shape (n, 4)."""
    outgoing = np.atleast_2d(np.asarray(wo, np.float32))
    incident = np.broadcast_to(np.asarray(wi, np.float32), outgoing.shape)
    si = interaction(incident, wavelengths)
    return spectra(bsdf.eval(mi.BSDFContext(), si, vectors(outgoing)))


def brdf_values(bsdf: Any, wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike) -> NDArray[Any]:
    """f of one wavelength a pair, (n,): taken from the four in turn, so that all are looked at."""
    values = evaluated(bsdf, wi, wo, wavelength)
    n = np.arange(len(values))
    return values[n, n % 4] / np.asarray(wo, float)[:, 2]


def refusal(load: Callable[[], object]) -> str:
    """What a plugin that cannot be loaded says: one line, ours, after Mitsuba's own."""
    with pytest.raises(RuntimeError) as caught:
        load()
    *_, last = str(caught.value).splitlines()
    assert last.startswith("DiffractionError: "), last
    return last.removeprefix("DiffractionError: ")
