"""Tabular BSDF of OpticStudio (.bsdf): text, f in 1/sr at one wavelength.

Layout: "Zemax Tabular BSDF data file format" of Zemax' knowledge base, ASymmetrical4D. The
scattered direction lies at a radial angle from the mirror direction, and at an azimuth around it:
from the normal, counter-clockwise as seen against the light that leaves.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...atomic import atomic_path
from ...errors import DiffractionError
from ...plugin.types import Float
from ...progress import Progress, silent
from .cells import Cells, CellSample, ExportGrid, Reals, means, unit_vector

#: Default directions of the mirror, degrees, nodes of the radial angle to 170°, and wavelength, nm.
DEFAULT = ExportGrid(np.arange(0.0, 81.0, 10.0), np.arange(0.0, 360.0, 30.0), np.array([550.0]), 86)
# Nodes of the azimuth; the last is the first.
_AZIMUTHS = 73
_REACH = 170.0


def save_zemax(
    bsdf: Any, path: Path, grid: ExportGrid = DEFAULT, text: str = "", progress: Progress = silent
) -> None:
    """Write the BRDF of one wavelength.

    grid : θ and φ of the mirror direction; its resolution is the number of radial angles. text : a
    comment.
    """
    if grid.wavelengths.size != 1:
        raise DiffractionError(
            f"wavelength: expected one, got {grid.wavelengths.size}; write a file for each"
        )
    grid.checked(_AZIMUTHS * grid.resolution)
    azimuths, radials = np.linspace(0.0, 360.0, _AZIMUTHS), np.linspace(0, _REACH, grid.resolution)
    axes = grid.phi, grid.theta, azimuths, radials
    nodes = [np.radians(axis.ravel()) for axis in np.meshgrid(*axes, indexing="ij")]
    steps = np.radians(azimuths[1]), np.radians(radials[1])

    def sample(
        rotation: Float, theta: Float, azimuth: Float, radial: Float, a: Float, b: Float
    ) -> CellSample:
        mirror = unit_vector(theta, rotation)
        # from the mirror direction towards the normal, and counter-clockwise from there
        up = -unit_vector(theta + 0.5 * np.pi, rotation)
        turned, away = azimuth + a * steps[0], dr.abs(radial + b * steps[1])
        around = dr.cos(turned) * up + dr.sin(turned) * dr.cross(mirror, up)
        wo = dr.cos(away) * mirror + dr.sin(away) * around
        return CellSample(mi.Vector3f(-mirror.x, -mirror.y, mirror.z), wo, dr.sin(away))

    cells = Cells(nodes, sample)
    values = means(bsdf, cells, grid.wavelengths, float(max(steps)), False, progress)[:, 0]
    azimuth, radial = nodes[2:]
    shape = tuple(len(axis) for axis in axes)
    # TIS: ∫ f cosθ dω, linear between nodes: ∫ (1 − r/h) r dr = h²/6; azimuth 0 is there twice
    solid = np.where(radial == 0.0, steps[1] ** 2 / 6.0, steps[1] * np.sin(radial)) * steps[0]
    solid *= np.where((azimuth == 0.0) | (azimuth > 2.0 * np.pi - 1e-6), 0.5, 1.0)
    cosines = np.maximum(np.array(cells.middle().wo.z), 0.0)
    tis = (values * cosines * solid).reshape(shape).sum(axis=(2, 3))
    table = values.reshape(shape)
    lines = [
        "# rotation: azimuth of the mirror direction from the structure's x axis, towards y",
        *(f"# {line}" for line in text.splitlines()),
        "Source  Measured", "Symmetry  ASymmetrical4D", "SpectralContent  Monochrome",
        "ScatterType  BRDF",
    ]  # fmt: skip
    names = "SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial"
    for name, axis in zip(names, axes, strict=True):
        lines += [f"{name}  {len(axis)}", _row(axis)]
    lines += ["", "Monochrome", "DataBegin"]
    for r in range(shape[0]):
        for t in range(shape[1]):
            lines += [f"TIS {tis[r, t]:.6g}", *(_row(row) for row in table[r, t])]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join([*lines, "DataEnd", ""]), "ascii", "replace")


def _row(values: Reals) -> str:
    return "  ".join(f"{value:.5g}" for value in values.tolist())
