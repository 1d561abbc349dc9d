"""The BSDF of a gentle patch, and where it sends light."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import sigma_of
from tests.support.directions import Array, lit_pairs, rough_patch
from tests.support.lanes import bitmap, interaction, lanes

#: 4.76 × 5.28 µm, gentle, its pixels and its numbers of them unequal: nothing is symmetric.
PATCH = rough_patch((66, 56), (0.085, 0.08), 0.08)
WIDTH = 4.5


def load(field=PATCH, **parameters):
    """The plugin as a perfect reflector and the raw model, unless told otherwise."""
    if not {"material", "int_ior", "eta"} & set(parameters):
        parameters["material"] = "none"
    raw = {"energy_conserving": False, "coherence_width": WIDTH}
    return mi.load_dict(md.bsdf_dict(field, **(raw | parameters)))


def pairs(n=200, seed=1, field=PATCH):
    """Directions and wavelengths where light goes."""
    return lit_pairs(field, sigma_of(WIDTH), n, seed)[:3]


#: Middles of the texels of a bitmap of 2 × 2.
UV = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]], np.float32)


def directions(degrees, raw=True, channels=3, levels=None):
    """Four directions; of an integer format, which clips, where it has so many `levels`."""
    angles = np.deg2rad(np.reshape(degrees, (2, 2, 1)))
    data = np.concatenate([np.cos(angles), np.sin(angles), 0 * angles], axis=2)[..., :channels]
    if levels:
        data = np.rint(np.clip(data, 0.0, 1.0) * levels) / levels
    return bitmap(data, raw=raw)


def hits(wi: Array, uv: ArrayLike, wavelengths: ArrayLike = 550.0) -> Any:
    """Surface interactions at UV coordinates (2,) or (n, 2)."""
    si = interaction(wi, wavelengths)
    si.uv = mi.Point2f(*map(lanes, np.broadcast_to(uv, (len(wi), 2)).T))
    return si
