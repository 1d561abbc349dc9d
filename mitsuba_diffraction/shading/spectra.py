"""Values of Mitsuba's textures, BSDFs and emitters at many wavelengths."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..plugin.memory import upload


def spectra_of(
    evaluate: Callable[[Any], Any], wavelengths: Real, count: int = 1
) -> NDArray[np.float32]:
    """Evaluate samples: (count, wavelengths), (count, 3) in RGB variants, (count, 1) in mono.

    Parameters
    ----------
    evaluate : function of `count` interactions with four wavelengths, all else zero, that returns
        a spectrum; it is called for all wavelengths in turn.
    wavelengths : (4 n,) nm.
    """
    import drjit as dr
    import mitsuba as mi

    parts = []
    for four in wavelengths.reshape(-1, 4) if mi.is_spectral else wavelengths[None, :4]:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        if mi.is_spectral:
            # opaque numbers: all wavelengths share a kernel
            si.wavelengths = mi.UnpolarizedSpectrum(*(dr.opaque(mi.Float, float(n)) for n in four))
        value = np.array(mi.unpolarized_spectrum(evaluate(si)), np.float32)
        parts.append(np.broadcast_to(value.reshape(len(value), -1), (len(value), count)))
    return np.concatenate(parts).T


def evaluated(texture: Any, uv: Real, wavelengths: Real) -> NDArray[np.float32]:
    """Evaluate a texture at points (n, 2): (n, wavelengths), or (n, 3) in RGB variants."""
    import mitsuba as mi

    places = mi.Point2f(*uploaded(uv))

    def look_up(si: Any) -> Any:
        si.uv = places
        return texture.eval(si)

    return spectra_of(look_up, wavelengths, len(uv))


def uploaded(rows: NDArray[np.generic]) -> list[Any]:
    """Upload the columns of an array (n, m) in single precision."""
    import mitsuba as mi

    return [upload(mi.Float, column.astype(np.float32)) for column in rows.T]


def vectors_of(values: Any, count: int) -> Real:
    """Read vectors (count, 3), which may be one for all."""
    return np.broadcast_to(np.array(values, np.float64).reshape(3, -1).T, (count, 3))
