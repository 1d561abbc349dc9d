"""Dictionaries for `mi.load_dict` from arrays in memory."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from .heightfield import HeightField


def bsdf_dict(field: HeightField, **parameters: Any) -> dict[str, Any]:
    """The plugin `diffraction` for a height field in memory.

    Parameters
    ----------
    field : heights in µm.
    parameters : any other parameter of the plugin, e.g. material="Al", tolerance=1e-4.

    Returns
    -------
    dict for `mi.load_dict`, alone or inside a shape. A variant must be set.
    """
    dx, dy = field.pixel_size
    return {
        "type": "diffraction",
        "data": mi.TensorXf(field.heights.astype(np.float32)),
        "pixel_size": f"{dx!r}, {dy!r}",
        **parameters,
    }
