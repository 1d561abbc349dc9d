"""Tabular BSDF of OpticStudio (.bsdf): text, f in 1/sr at one wavelength.

Layout: "Zemax Tabular BSDF data file format" of Zemax' knowledge base, ASymmetrical4D. The
scattered direction lies at a radial angle from the mirror direction, and at an azimuth around it:
from the normal, counter-clockwise as seen against the light that leaves.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Real
from ...atomic import atomic_path
from ...errors import DiffractionError
from ...progress import Progress, silent
from .nodes import ExportGrid, Nodes, laid, light_vectors

#: Default directions of the mirror, degrees, nodes of the radial angle to 170°, and wavelength, nm.
DEFAULT = ExportGrid(np.arange(0.0, 81.0, 10.0), np.arange(0.0, 360.0, 30.0), np.array([550.0]), 86)
# Nodes of the azimuth; the last is the first.
_AZIMUTHS = 73
_REACH = 170.0
# Letters of units in comments, which are ASCII.
_ASCII = str.maketrans({"µ": "u", "μ": "u", "°": " deg", "×": "x", "–": "-"})


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
    nodes = Nodes(
        _AZIMUTHS - 1, np.radians(radials), (0.0, np.radians(_REACH)), _directions, _place,
        lambda q: (np.sin(q), 1.0), lambda q: q, pole=True,
    )  # fmt: skip
    axes = grid.phi, grid.theta, azimuths, radials
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
    # light comes from the other side of the normal
    for of_light in laid(bsdf, nodes, grid, light_vectors(grid) * [-1.0, -1.0, 1.0], progress):
        table = of_light.values[..., 0]
        lines.append(f"TIS {of_light.light.sum():.6g}")
        lines += [_row(row) for row in (*table, table[0])]
    content = "\n".join([*lines, "DataEnd", ""]).translate(_ASCII)
    with atomic_path(path) as temporary:
        temporary.write_text(content, "ascii", "replace")


def _frame(wi: Real) -> tuple[Real, Real, Real]:
    """Return the mirror direction, and the axes of azimuth 0 (towards the normal) and 90°."""
    mirror = wi * [-1.0, -1.0, 1.0]
    sine = np.hypot(*mirror[:2])
    up = np.array([*(-mirror[:2] / sine * mirror[2]), sine])
    return mirror, up, np.cross(mirror, up)


def _directions(wi: Real, p: Real, q: Real) -> tuple[Real, Real]:
    mirror, up, left = _frame(wi)
    across = np.cos(p)[:, None] * up + np.sin(p)[:, None] * left
    return np.cos(q)[:, None] * mirror + np.sin(q)[:, None] * across, np.sin(q)


def _place(wi: Real, wo: Real) -> tuple[Real, Real]:
    mirror, up, left = _frame(wi)
    x, y = wo @ up, wo @ left
    return np.arctan2(y, x) % (2.0 * np.pi), np.arctan2(np.hypot(x, y), wo @ mirror)


def _row(values: Real) -> str:
    return "  ".join(f"{value:.5g}" for value in values.tolist())
