"""JSON of the BiRD project's universal BRDF format (Lanevski et al. 2022, Color Research and
Application 47, 1177; layout: version 1.0 of the schema in github.com/BiRD-project/BiRD_view).
"""

from __future__ import annotations

import json
import uuid
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np

from ...atomic import atomic_path
from ...plugin.types import Float
from ...progress import Progress, silent
from .cells import Cells, CellSample, ExportGrid, means, unit_vector

#: Default directions to the light, degrees, nodes of θ of the eye, and wavelengths, nm.
DEFAULT = ExportGrid(
    np.arange(0.0, 76.0, 15.0), np.arange(0.0, 360.0, 45.0), np.arange(400.0, 701.0, 50.0), 18
)
# Nodes of φ of the eye over those of θ.
_AZIMUTHS = 4
_SCHEMA = (
    "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/"
    "brdf_json_schema_v1.0.json"
)


def save_bird(
    bsdf: Any, path: Path, grid: ExportGrid = DEFAULT, text: str = "", progress: Progress = silent
) -> None:
    """Write f in 1/sr, one value for each wavelength and pair of directions.

    grid : its resolution is the number of θ of the eye, at the middle of equal parts of 0 to 90°;
    there are four times as many φ. text : name of the sample.
    """
    n = grid.resolution
    grid.checked(_AZIMUTHS * n * n)
    step = 90.0 / n
    axes = (
        grid.theta, np.unique(grid.phi % 360.0), step * (np.arange(n) + 0.5),
        step * np.arange(_AZIMUTHS * n),
    )  # fmt: skip
    angles = [axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")]
    size = np.radians(step)

    def sample(
        theta_i: Float, phi_i: Float, theta_r: Float, phi_r: Float, a: Float, b: Float
    ) -> CellSample:
        tilted = theta_r + a * size
        wo = unit_vector(tilted, phi_r + b * size)
        return CellSample(unit_vector(theta_i, phi_i), wo, dr.abs(dr.sin(tilted)))

    cells = Cells([np.radians(angle) for angle in angles], sample)
    values = means(bsdf, cells, grid.wavelengths, size, False, progress)
    count = len(grid.wavelengths)
    units = ("°", "°", "°", "°", "nm", "sr^-1")
    names = ("theta_i", "phi_i", "theta_r", "phi_r", "wavelength_i", "BRDF")
    columns = [np.repeat(angle, count) for angle in angles]
    columns += [np.tile(grid.wavelengths, len(values)), values.ravel()]
    now = datetime.now(UTC)
    content = {
        "metadata": {
            "schema": _SCHEMA, "id": uuid.uuid4().urn, "type": "BRDF",
            "timestamp": now.strftime("%Y-%m-%dT%H:%M:%S+00"), "provenance": {},
            "method": "simulation", "instrumentation": "NA",
            "software": {"name": "mitsuba_diffraction", "version": version("mitsuba_diffraction")},
            "sample": {"name": text or path.stem}, "environment": "NA",
        },
        "data": {
            name: {"unit": unit, "values": [float(f"{x:.6g}") for x in column.tolist()]}
            for name, unit, column in zip(names, units, columns, strict=True)
        },
    }  # fmt: skip
    with atomic_path(path) as temporary:
        temporary.write_text(
            json.dumps(content, separators=(",", ":"), ensure_ascii=False), "utf-8"
        )
