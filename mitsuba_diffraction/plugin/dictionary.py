"""Dictionaries for `mi.load_dict` from arrays in memory."""

from __future__ import annotations

import os
from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError, quoted
from ..heights.field import HeightField

# By digest, what the patches are that dictionaries were made of: tensors do not carry it. The last
# few suffice, as dictionaries are loaded soon after they are made.
_given: dict[str, tuple[str, bool]] = {}
_REMEMBERED = 256


def bsdf_dict(field: HeightField | str | os.PathLike[str], **parameters: Any) -> dict[str, Any]:
    """The plugin `diffraction` for a height field in memory, or for a file.

    Parameters
    ----------
    field : heights in µm; or the path of a file, as for the parameter `heightfield`.
    parameters : any other parameter of the plugin, e.g. material="Al", tolerance=1e-4.

    Returns
    -------
    dict for `mi.load_dict`, alone or inside a shape. A variant must be set.

    Raises
    ------
    DiffractionError
        If `field` is neither heights nor a path.
    """
    if isinstance(field, str | os.PathLike):
        return {"type": "diffraction", "heightfield": os.fspath(field), **parameters}
    if not isinstance(field, HeightField):
        raise DiffractionError(
            f"bsdf_dict: expected a HeightField or the path of a file, got {quoted(field)}; make "
            "one of an array with HeightField(heights, pixel_size)"
        )
    dx, dy = field.pixel_size
    heights = field.heights.astype(np.float32)
    _given[HeightField(heights, (dx, dy)).digest()] = (field.name, field.cut_out)
    while len(_given) > _REMEMBERED:
        del _given[next(iter(_given))]
    return {
        "type": "diffraction",
        "data": mi.TensorXf(heights),
        "pixel_size": f"{dx!r}, {dy!r}",
        **parameters,
    }


def as_given(data: HeightField) -> HeightField:
    """The heights of a tensor with the name that they had when `bsdf_dict` made it."""
    name, cut_out = _given.get(data.digest(), (data.name, data.cut_out))
    return HeightField(data.heights, data.pixel_size, name=name, cut_out=cut_out)
