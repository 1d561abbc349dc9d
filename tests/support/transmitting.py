"""Interfaces and sheets that let light through."""

from __future__ import annotations

from typing import Any

import numpy as np

import mitsuba_diffraction as md
from tests.support.layered import PATCH, load

INDICES = {"int_ior": 1.5, "ext_ior": 1.0}
SIDES: dict[str, dict[str, Any]] = {"dielectric": {}, "sheet": {"thin": True}}
BELOW = np.array([1, 1, -1])


def both(field: md.HeightField = PATCH, **parameters: Any) -> Any:
    return load(field, plugin="diffraction_dielectric", **INDICES, **parameters)
