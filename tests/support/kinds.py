"""Surfaces of every kind, each beside the reference: a new kind is one row, and gets all tests."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from tests.support.directions import Array, as_single
from tests.support.layered import PATCH, WIDTH, load, pairs
from tests.support.transmitting import BELOW, INDICES, SIDES, both

METAL = {"eta": 0.9, "k": 6.0}
COATED = METAL | {"coat_ior": 1.58}, METAL | {"coat": 1.58}
FILMED = METAL | {"film_ior": 1.77, "film_thickness": 250.0}, METAL | {"film": (1.77, 250.0)}
PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}}
SCALES = np.full((2, 2, 1), 0.7, np.float32)
PLANE = {"model": "kirchhoff"}
SLOPE = {"model": "small_slope"}

Row = tuple[dict[str, Any], dict[str, Any] | None]

#: Parameters of the plugin, and of the reference where it knows the kind.
KINDS: dict[str, Row] = {
    "mirror": ({"material": "none"}, {}),
    "dielectric": (INDICES, SLOPE | {"eta": 1.5}),
    "metal": (METAL, METAL | SLOPE),
    "coat": (COATED[0], COATED[1] | SLOPE),
    "film": (FILMED[0], FILMED[1] | SLOPE),
    "pigment": (INDICES | {"pigment": PIGMENT}, None),
    "height scales": ({"material": "none", "height_scale": {"type": "bitmap", "raw": True}}, None),
    "surface": ({"material": "none", "coherence": "surface", "uv_scale": 10.0}, None),
}
#: Of `make test-all` alone.
MORE: dict[str, Row] = {
    "less dense": ({"int_ior": 1.0, "ext_ior": 1.4}, SLOPE | {"eta": 1.0 / 1.4}),
    "nearly a dielectric": ({"eta": 1.56, "k": 1e-3}, SLOPE | {"eta": 1.56, "k": 1e-3}),
    "coat on a dielectric": (
        {"int_ior": 1.7, "ext_ior": 1.0, "coat_ior": 1.4}, SLOPE | {"eta": 1.7, "coat": 1.4},
    ),
    "film on a dielectric": (
        INDICES | {"film_ior": 2.4, "film_k": 0.1, "film_thickness": 150.0},
        SLOPE | {"eta": 1.5, "film": (2.4 + 0.1j, 150.0)},
    ),
    "one window": ({"material": "none", "coherence": "patch"}, {"coherence": "patch"}),
    "turned, powers of the phase": (
        {"material": "none", "basis": "taylor", "orientation": 25.0, "height_scale": 0.8}, None,
    ),
    "in its own shade": (METAL | {"shadowing": "vcavity"}, None),
    "dielectric, tangent plane": (INDICES | PLANE, PLANE | {"eta": 1.5}),
    "metal, tangent plane": (METAL | PLANE, METAL | PLANE),
    "coat, tangent plane": (COATED[0] | PLANE, COATED[1] | PLANE),
    "film, tangent plane": (FILMED[0] | PLANE, FILMED[1] | PLANE),
}  # fmt: skip

#: Light that goes through.
THROUGH = {f"through a {name}": parameters for name, parameters in SIDES.items()}


def made(kind: str, field: md.HeightField = PATCH) -> Any:
    """The BSDF of a kind that reflects or transmits, or a mix, in the variant that is set."""
    if kind == "blended patches":
        one = md.bsdf_dict(field, coherence_width=WIDTH, material="none", energy_conserving=False)
        return mi.load_dict({"type": "diffraction_mix", "one": one, "two": one, "weight_one": 0.3})
    if kind in THROUGH:
        return both(field, wavelength=600.0, **THROUGH[kind])
    parameters = dict((KINDS | MORE)[kind][0])
    if kind == "height scales":
        parameters["height_scale"] = parameters["height_scale"] | {"data": mi.TensorXf(SCALES)}
    return load(field, wavelength=600.0, **parameters)


def exact(kind: str, wi: Array, wo: Array, wavelengths: Array) -> Array | None:
    """The reference's f |cosθo| (n, channels) of wavelengths of that shape, if it knows the kind.

    Radiance of what goes through is that of equal media on both sides.
    """
    if kind in THROUGH:
        own, function = SLOPE | {"eta": 1.5} | THROUGH[kind], reference.btdf
    else:
        found = (KINDS | MORE)[kind][1]
        if found is None:
            return None
        own, function = found, reference.brdf
    columns = [function(PATCH, wi, wo, one, coherence_width=WIDTH, **own) for one in wavelengths.T]
    return np.stack(columns, axis=1) * np.abs(wo[:, 2:])


def lit(kind: str, count: int) -> tuple[Array, Array, Array]:
    """Directions of light and eye, to where the kind sends light, and wavelengths (count, 4)."""
    wi, wo, lam = (part[:count] for part in pairs())
    return wi, as_single(wo * BELOW) if kind in THROUGH else wo, lam
