"""The BSDF of a gentle patch, and where it sends light."""

from __future__ import annotations

import mitsuba as mi

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import sigma_of
from tests.support.directions import lit_pairs, rough_patch

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
