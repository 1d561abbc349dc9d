"""Scatter in 1/sr at pairs of directions: JSON of the BiRD project, and long CSV.

JSON: universal BRDF format (Lanevski et al. 2022, Color Research and Application 47, 1177; layout:
version 1.0 of the schema in github.com/BiRD-project/BiRD_view). CSV: a header line, then a line for
each wavelength and pair of directions, with the weight, sr, by which f has to be summed over the
eye's directions for the reflected share of the light: ∫ cosθ dω about the node.
"""

from __future__ import annotations

import json
import uuid
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Real
from ...atomic import atomic_path
from ...columns import save_rows
from ...progress import Progress, silent
from ..maps.hemisphere import polar
from .nodes import ExportGrid, Nodes, laid, light_vectors

#: Default directions to the light, degrees, nodes of θ of the eye, and wavelengths, nm.
DEFAULT = ExportGrid(
    np.arange(0.0, 76.0, 15.0), np.arange(0.0, 360.0, 45.0), np.arange(400.0, 701.0, 50.0), 18
)
#: Columns of a CSV: the light's direction, then the eye's.
CSV_COLUMNS = (
    "theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", "wavelength_nm", "f_per_sr",
    "weight_sr",
)  # fmt: skip
# Nodes of φ of the eye over those of θ.
_AZIMUTHS = 4
_SCHEMA = (
    "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/"
    "brdf_json_schema_v1.0.json"
)


def save_bird(
    bsdf: Any, path: Path, grid: ExportGrid = DEFAULT, text: str = "", progress: Progress = silent
) -> None:
    """Write the JSON: f in 1/sr, one value for each wavelength and pair of directions.

    grid : its resolution is the number of θ of the eye, at the middle of equal parts of 0 to 90°;
    there are four times as many φ. text : name of the sample.
    """
    units = ("°", "°", "°", "°", "nm", "sr^-1")
    names = ("theta_i", "phi_i", "theta_r", "phi_r", "wavelength_i", "BRDF")
    columns = _columns(bsdf, grid, progress).T[: len(names)]
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


def save_csv(
    bsdf: Any, path: Path, grid: ExportGrid = DEFAULT, text: str = "", progress: Progress = silent
) -> None:
    """Write the CSV, with the directions of `save_bird`; text is not in it."""
    save_rows(path, CSV_COLUMNS, _columns(bsdf, grid, progress), digits=7)


def _columns(bsdf: Any, grid: ExportGrid, progress: Progress) -> Real:
    """Return θ and φ of the light and of the eye, degrees, wavelength, f and weight, (n, 7)."""
    n = grid.resolution
    grid.checked(_AZIMUTHS * n * n)
    grid = grid._replace(phi=np.unique(grid.phi % 360.0))
    step = 90.0 / n
    tilts = step * (np.arange(n) + 0.5)
    nodes = Nodes(
        _AZIMUTHS * n, np.radians(tilts), (0.0, 0.5 * np.pi), _directions, _place,
        lambda q: (np.sin(q), 1.0),
    )  # fmt: skip
    lights = np.stack(np.meshgrid(grid.phi, grid.theta, indexing="ij"), axis=-1).reshape(-1, 2)
    blocks = []
    of_lights = laid(bsdf, nodes, grid, light_vectors(grid), progress)
    for (phi, theta), of_light in zip(lights.tolist(), of_lights, strict=True):
        axes = (step * np.arange(_AZIMUTHS * n), tilts, grid.wavelengths)
        phi_o, theta_o, lam = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
        sides = np.full(len(lam), theta), np.full(len(lam), phi)
        weights = np.repeat(of_light.weights.ravel(), grid.wavelengths.size)
        values = of_light.values.ravel()
        blocks.append(np.column_stack([*sides, theta_o, phi_o, lam, values, weights]))
    return np.concatenate(blocks)


def _directions(wi: Real, p: Real, q: Real) -> tuple[Real, Real]:
    return polar(q, p), np.sin(q)


def _place(wi: Real, wo: Real) -> tuple[Real, Real]:
    x, y, z = wo.T
    return np.arctan2(y, x) % (2.0 * np.pi), np.arctan2(np.hypot(x, y), z)
