"""Wrapper of the model: a thin film that follows the heights (`optics.fresnel.Filmed`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..heights.field import HeightField
from ..optics.blend import ScaleRoughness
from ..optics.fresnel import Filmed
from ..optics.geometry import wavenumber
from ..optics.mean_second_order import mean_gain
from . import boundary
from . import model as models

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def jones(field: HeightField, light: models.Light, film: Filmed) -> Complex:
    """J of the filmed boundary by small slope, times √(g(ωi) g(ωo)), the mean second order."""
    wi, wo, wavelength = light
    matrices = boundary.blended(wi, wo, film, models.share(field, light, film))
    gain = _mean_gain(field, (wi[:, 2], wo[:, 2]), wavelength, film)
    return matrices * np.sqrt(gain)[:, None, None]


def _mean_gain(
    field: HeightField, cosines: tuple[Real, Real], wavelength: Real, film: Filmed
) -> Real:
    """g(ωi) g(ωo) of `optics.mean_second_order`, (n,)."""
    roughness = ScaleRoughness.from_heights(field.heights, field.pixel_size)
    gain = np.ones(len(wavelength))
    rows = np.stack(np.broadcast_arrays(wavelength, *film.parts), axis=1)
    for row in np.unique(rows, axis=0):
        same = (rows == row).all(axis=1)
        k = float(wavenumber(row[0].real))
        for cosine in cosines:
            gain[same] *= mean_gain(cosine[same], Filmed(*row[1:]), roughness, k)
    return gain
