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

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...atomic import atomic_path
from ...progress import Progress, silent
from ..maps.hemisphere import polar
from .nodes import ExportGrid, Nodes, laid, light_vectors

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
    nodes = Nodes(
        n - 1, np.linspace(0.0, 1.0, n), (0.0, 1.0), _directions, _place,
        lambda u: (2.0 * np.sin(0.5 * np.pi * u * u), 2.0 * np.pi * u), lambda u: np.pi * u * u,
        pole=True, cosine=True,
    )  # fmt: skip
    spectra = np.empty((len(phi) * len(theta), len(grid.wavelengths), n, n), np.float32)
    powers = np.empty((len(phi) * len(theta), n, n))
    for place, of_light in enumerate(laid(bsdf, nodes, grid, light_vectors(grid), progress)):
        values, light = (np.concatenate([part, part[:1]]) for part in of_light[:2])
        spectra[place], powers[place] = np.moveaxis(values, -1, 0), light.mean(axis=-1)
    spectra = spectra.reshape(len(phi), len(theta), *spectra.shape[1:])
    # density in u and v by which light is drawn: the light at each node, and an even share; nodes
    # at the ends of u have half a cell
    density = powers.reshape(len(phi), len(theta), n, n)
    density[..., [0, -1]] *= 2.0
    density += 1e-2 * density.mean(axis=(2, 3), keepdims=True) + 1e-9
    ones = np.ones((2, 2))
    tensors = {
        "phi_i": phi, "theta_i": theta, "wavelengths": grid.wavelengths, "ndf": ones, "sigma": ones,
        "vndf": np.ones((len(phi), len(theta), 2, 2)), "luminance": density, "spectra": spectra,
    }  # fmt: skip
    numbers = {name: array.astype(np.float32) for name, array in tensors.items()}
    # Mitsuba's writer prints the file's name, and loses the error of a full disk when it closes
    with atomic_path(path) as temporary:
        with contextlib.redirect_stdout(None):
            mi.tensor_io.write(
                str(temporary), description=text or "-", jacobian=np.zeros(1, np.uint8), **numbers
            )
        _check_written(temporary, numbers)


def _directions(wi: Real, p: Real, u: Real) -> tuple[Real, Real]:
    theta_m = 0.5 * np.pi * u * u
    half = polar(theta_m, p - np.pi)
    cosine = np.maximum(half @ wi, 0.0)
    # dω = 4 cos dω_m, dθ_m = π u du
    return 2.0 * cosine[:, None] * half - wi, 4.0 * cosine * np.sin(theta_m) * np.pi * u


def _place(wi: Real, wo: Real) -> tuple[Real, Real]:
    x, y, z = (wi + wo).T
    theta_m = np.arctan2(np.hypot(x, y), z)
    return (np.arctan2(y, x) + np.pi) % (2.0 * np.pi), np.sqrt(theta_m * (2.0 / np.pi))


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
