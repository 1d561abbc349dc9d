"""RGL's tensors of a BRDF, which Mitsuba's BSDF `measured` reads (Dupuy and Jakob 2018, ACM
Transactions on Graphics 37, 274; layout: Mitsuba's src/core/tensor.cpp and src/bsdfs/measured.cpp).

f cosθo is stored over the half vector m, at u = √(2θ_m/π) and v = (φ_m + π)/2π, for some directions
to the light. Without `jacobian` and with an even `vndf` the tensors are f cosθo itself.
"""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...plugin.types import Float
from ...progress import Progress, silent
from .cells import Cells, CellSample, ExportGrid, means, unit_vector

#: Default directions to the light, degrees, nodes of the half vector, and step of wavelengths, nm.
DEFAULT = ExportGrid(
    np.arange(0.0, 86.0, 8.5), np.linspace(-180.0, 180.0, 25), np.arange(360.0, 831.0, 20.0), 64
)


def save_rgl(
    bsdf: Any, path: Path, grid: ExportGrid = DEFAULT, text: str = "", progress: Progress = silent
) -> None:
    """Write a BSDF of the current variant for `measured`.

    grid : φ from −180 to 180; its resolution is the number of nodes of u and of v. text : a
    description.
    """
    n = grid.resolution
    grid.checked(n * n)
    theta, phi = np.radians(grid.theta), np.radians(grid.phi)
    nodes = np.linspace(0.0, 1.0, n)
    axes = np.meshgrid(phi, theta, nodes, nodes, indexing="ij")

    def sample(
        azimuth: Float, elevation: Float, v: Float, u: Float, a: Float, b: Float
    ) -> CellSample:
        place = dr.minimum(dr.abs(u + a / (n - 1)), 1.0)
        theta_m = 0.5 * np.pi * dr.square(place)
        half = unit_vector(theta_m, np.pi * (2.0 * (v + b / (n - 1)) - 1.0))
        wi = unit_vector(elevation, azimuth)
        cosine = dr.dot(wi, half)
        solid = place * dr.sin(theta_m) * dr.maximum(cosine, 0.0)
        return CellSample(wi, 2.0 * cosine * half - wi, solid)

    cells = Cells([axis.ravel() for axis in axes], sample)
    values = means(bsdf, cells, grid.wavelengths, np.pi / (n - 1), True, progress)
    shape = len(phi), len(theta), n, n
    # density in u and v by which light is drawn: f cosθo times dω/(du dv), and an even share
    density = (values.mean(axis=1) * np.array(cells.middle().weight)).reshape(shape)
    density += 1e-2 * density.mean(axis=(2, 3), keepdims=True) + 1e-9
    ones = np.ones((2, 2))
    spectra = np.moveaxis(values.reshape(*shape, -1), -1, 2)
    tensors = {
        "phi_i": phi, "theta_i": theta, "wavelengths": grid.wavelengths, "ndf": ones, "sigma": ones,
        "vndf": np.ones((*shape[:2], 2, 2)), "luminance": density, "spectra": spectra,
    }  # fmt: skip
    numbers = {name: array.astype(np.float32) for name, array in tensors.items()}
    # Mitsuba's writer prints the file's name, and loses the error of a full disk when it closes
    with atomic_path(path) as temporary:
        with contextlib.redirect_stdout(None):
            mi.tensor_io.write(
                str(temporary), description=text or "-", jacobian=np.zeros(1, np.uint8), **numbers
            )
        _check_written(temporary, numbers)


def _check_written(file: Path, tensors: Mapping[str, NDArray[np.float32]]) -> None:
    """Raise an OSError if a file does not hold these tensors."""
    try:
        with contextlib.redirect_stdout(None):
            found = mi.tensor_io.read(str(file))
        whole = all(np.array_equal(found[name], array) for name, array in tensors.items())
    except Exception:  # whatever Mitsuba's reader makes of a file that is cut short
        whole = False
    if not whole:
        raise OSError(errno.ENOSPC, "the file is cut short; is the disk full?")
