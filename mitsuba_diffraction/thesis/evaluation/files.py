"""Evaluations on disk: the ridge as CSV, everything as NPZ."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping

import numpy as np

from ...atomic import atomic_path
from .beam import Response
from .ridge import Ridge

COLUMNS = ("wavelength_nm", "ridge_deg", "grating_deg", "difference_deg", "scatter_per_sr")


def save_csv(
    path: str | os.PathLike[str], response: Response, ridge: Ridge, period: float, order: int
) -> None:
    """Write the ridge and the grating equation for a period (µm), a wavelength a line.

    What does not exist (no maximum, no such order) is an empty field.
    """
    expected = response.beam.grating_angles(response.wavelengths, period, order)
    columns = (
        response.wavelengths, ridge.angles, expected, ridge.angles - expected, ridge.heights,
    )  # fmt: skip
    with (
        atomic_path(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as stream,
    ):
        writer = csv.writer(stream)
        writer.writerow(COLUMNS)
        for row in zip(*columns, strict=True):
            writer.writerow([f"{value:.8g}" if np.isfinite(value) else "" for value in row])


def save_npz(
    path: str | os.PathLike[str],
    response: Response,
    ridge: Ridge,
    period: float,
    order: int,
    more: Mapping[str, object],
) -> None:
    """Write the response (wavelengths, angles, f·cosθo), both curves, and `more` entries."""
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(
            stream,
            wavelengths=response.wavelengths,
            angles=response.angles,
            scatter=response.values,
            ridge=ridge.angles,
            grating=response.beam.grating_angles(response.wavelengths, period, order),
            theta=response.beam.theta,
            phi=response.beam.phi,
            period=period,
            order=order,
            method=response.label,
            **more,  # type: ignore[arg-type]
        )
