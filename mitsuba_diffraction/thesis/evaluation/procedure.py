"""The procedure behind the thesis' published periods, so that they can be understood.

It differs from the model in three ways: the phase is exp(ikh) where it should be exp(ikwh), the
window sits on the patch's first pixel, and what is followed is the brightest speckle of that one
window. What is plotted is its relative reflectance. For an exact grating none of that matters.
"""

from __future__ import annotations

import numpy as np

from ...optics.geometry import diffraction_coordinates, wavenumber
from ...tables.table import DiffractionTable
from ..methods.gain import Gain
from .beam import Array, Beam, Response, measure
from .ridge import Fit, fit_period, ridge_of
from .windows import moved_window


def thesis_response(
    table: DiffractionTable, beam: Beam, wavelengths: Array, angles: Array
) -> Response:
    """Its response: C·S at κ = k, the window on the corner; in `values`, times cosθo.

    Parameters
    ----------
    table : with coherence="patch".
    """
    corner = moved_window(table, (0.0, 0.0))
    gain = Gain()

    def relative(wi: Array, wo: Array, wavelength: Array) -> Array:
        k = wavenumber(wavelength)
        u, v, _ = diffraction_coordinates(wi, wo)
        return gain.factor(wi, wo) * corner.window_sum(k * u, k * v, np.asarray(k))

    label = "thesis' procedure"
    return measure(relative, beam, wavelengths, angles, sigma=table.sigma, label=label)


def thesis_fit(
    table: DiffractionTable, beam: Beam, wavelengths: Array, angles: Array, order: int = 1
) -> Fit:
    """The period that its procedure finds, at viewing angles across the normal from the light.

    That is where it looks; on the light's own side its response grows towards the horizon.
    """
    across = angles[angles <= 0.0]
    return fit_period(ridge_of(thesis_response(table, beam, wavelengths, across), order))
