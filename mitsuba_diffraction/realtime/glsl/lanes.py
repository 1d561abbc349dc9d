"""Values of Mitsuba's textures and emitters for many samples, at many wavelengths at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...plugin.memory import upload


class Lanes:
    """Dr.Jit's lanes of samples; in spectral variants a sample has one for four wavelengths.

    wavelengths : (4 n,) nm.
    """

    def __init__(self, samples: int, wavelengths: Real) -> None:
        import mitsuba as mi

        self.samples, self.wavelengths = samples, wavelengths
        self.quads = len(wavelengths) // 4 if mi.is_spectral else 1
        self.count = samples * self.quads

    def interaction(self) -> Any:
        """Return surface interactions that have the wavelengths."""
        import drjit as dr
        import mitsuba as mi

        si = dr.zeros(mi.SurfaceInteraction3f, self.count)
        if mi.is_spectral:
            waves = np.tile(self.wavelengths.reshape(4, self.quads), self.samples)
            si.wavelengths = mi.UnpolarizedSpectrum(*uploaded(waves.T))
        return si

    def uploaded(self, vectors: Real) -> list[Any]:
        """Upload the components of a vector per sample (samples, n) to all lanes."""
        return uploaded(np.repeat(vectors, self.quads, axis=0))

    def vectors(self, values: Any) -> Real:
        """Read one vector per sample, (samples, 3)."""
        vectors = np.array(values, np.float64).T.reshape(-1, 3)
        return np.broadcast_to(vectors, (self.count, 3))[:: self.quads]

    def spectra(self, values: Any) -> NDArray[np.float32]:
        """Read a spectrum per sample, (samples, wavelengths), or (samples, 3) in RGB variants.

        values : unpolarised spectrum of each lane, or of all.
        """
        flat = np.array(values, np.float32)
        flat = np.broadcast_to(flat.reshape(flat.shape[0], -1), (flat.shape[0], self.count))
        by_sample = flat.reshape(-1, self.samples, self.quads).transpose(1, 0, 2)
        return by_sample.reshape(self.samples, -1)


def uploaded(rows: NDArray[np.generic]) -> list[Any]:
    """Upload the columns of an array (n, m) in single precision."""
    import mitsuba as mi

    return [upload(mi.Float, column.astype(np.float32)) for column in rows.T]


def evaluated(texture: Any, uv: Real, wavelengths: Real) -> NDArray[np.float32]:
    """Evaluate a texture: (points, wavelengths), or (points, 3) in RGB variants."""
    import mitsuba as mi

    lanes = Lanes(len(uv), wavelengths)
    si = lanes.interaction()
    si.uv = mi.Point2f(*lanes.uploaded(uv))
    return lanes.spectra(texture.eval(si))
