"""Surfaces to map, and where the pixels of a map are."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import hemisphere

# The raw model, which is what the reference computes.
RAW = {"material": "none", "energy_conserving": False}
GRATING = md.gratings.sinusoidal(period=2.5, depth=0.2)


def plugin(field, **parameters):
    """The BSDF of a field, raw unless said otherwise."""
    return mi.load_dict(md.bsdf_dict(field, **(RAW | parameters)))


def mirror(**parameters):
    """A flat patch as wide as the coherence, so that its lobe is the window's."""
    return plugin(HeightField(np.zeros((4, 4)), 16.25), **parameters)


def centres(resolution):
    """x or y of the middles of the pixels."""
    return hemisphere.corners(resolution) + 1.0 / resolution
