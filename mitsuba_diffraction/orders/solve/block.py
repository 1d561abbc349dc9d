"""Faces of blocks: from stations, which keep a distance from grazing, to nodes."""

from __future__ import annotations

import numpy as np

from .. import cells
from ..blocks import factors
from .nodes import Place
from .stations import Grating, Real


def to_node(grating: Grating, place: Place) -> Real:
    """Return factors (w, j, 1, q, 1) from amplitudes of a station to amplitudes of its node.

    The station's reduced efficiencies (`blocks`) are taken for the node's.
    """
    index, optical = grating.superstrate, grating.optical_period
    station = grating.station(*place)
    c, y = np.sqrt(1.0 - station.along[:, None] ** 2), station.along[:, None]
    solved = factors(index * c * station.sines, index * y, index).scale
    big_k = place.band + cells.sine_squared(place.rho)
    lam = cells.wavelength_of(big_k, place.w, grating.wavelengths, optical)[:, None]
    channels = np.arange(station.channels)
    node = cells.from_cell(place.band, place.kind, channels, place.tau, place.rho, lam, optical)
    wanted, known = factors(index * node.x, index * node.y, index)
    ratio = np.where(known, wanted / np.where(known, solved, 1.0), 1.0)
    return np.asarray(np.sqrt(ratio)[:, :, None, :, None])
