"""Descriptions of surfaces with each feature."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping

import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.description import Feature, Quantity, Surface
from mitsuba_diffraction.tables.directional import FINE, DirectionalTable
from tests.support.patches import DEFAULTS, PATCH

TEXTURE = object()  # stands for an object of Mitsuba, which features do not read


def half(height_scale: float) -> DirectionalTable:
    """A scale of energy, 0.5 everywhere."""
    return DirectionalTable(np.array([400.0, 700.0]), np.stack([0.5 * FINE.ones] * 2))


def constant(index: float) -> Callable:
    """An index of all wavelengths."""
    return lambda lam: np.full(lam.shape, index + 0j)


@functools.cache
def base() -> Surface:
    """A dielectric patch."""
    table = md.DiffractionTable.build(PATCH, **DEFAULTS)
    return Surface(
        table, "dielectric", DEFAULTS["coherence_width"], Quantity(0.0), kind=Feature.DIELECTRIC,
        index=constant(1.5), model="small_slope",
    )  # fmt: skip


#: Change of the description that gives a surface the feature.
CHANGES: Mapping[Feature, dict] = {
    Feature.TRANSMISSION: {"transmits": True},
    Feature.MIRROR: {"kind": Feature.MIRROR, "index": None, "model": "kirchhoff"},
    Feature.RARER: {"kind": Feature.RARER, "index": constant(0.8)},
    Feature.CONDUCTOR: {"kind": Feature.CONDUCTOR, "index": lambda lam: 0.01 * lam / 5 + 6j},
    Feature.COAT: {"coat": 1.4},
    Feature.FILM: {"layer": Feature.FILM},
    Feature.VARYING_FILM: {"film_varies": True},
    Feature.KIRCHHOFF: {"model": "kirchhoff"},
    Feature.OWN_MODEL: {"model": "level"},
    Feature.ENERGY_SCALE: {"energy_scale": half},
    Feature.SHADOWING: {"shadowing": True},
    Feature.PATCH: {"coherence": "patch"},
    Feature.PLACED: {"coherence": "surface"},
    Feature.HEIGHT_SCALE: {"height_scale": Quantity(0.5)},
    Feature.VARYING_HEIGHT: {"height_scale": Quantity(1.0, TEXTURE)},
    Feature.LATERAL_SCALE: {"lateral_scale": Quantity(0.5)},
    Feature.VARYING_LENGTH: {"lateral_scale": Quantity(1.0, TEXTURE)},
    Feature.ORIENTATION: {"orientation": Quantity(30.0)},
    Feature.VARYING_ORIENTATION: {"orientation": Quantity(0.0, TEXTURE)},
    Feature.NESTED: {"nested": TEXTURE},
}
#: Features of tables, mixes, textures, users' models and variants: tests of these show them.
ELSEWHERE = {
    Feature.HEIGHTS, Feature.ORDERS, Feature.MIX, Feature.LIMITED, Feature.PATCH,
    Feature.VARYING_WEIGHTS, Feature.VARYING_LENGTH, Feature.VARYING_ORIENTATION,
    Feature.DIELECTRIC, Feature.SMALL_SLOPE, Feature.OWN_MODEL, Feature.OPAQUE, Feature.COLOURS,
}  # fmt: skip
