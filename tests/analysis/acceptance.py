"""Spectra of surfaces of a material, and the reference summed over the detector's cone."""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction.analysis.media import in_medium, medium_index
from mitsuba_diffraction.optics.materials import SODIUM, TISSUES
from tests.support.directions import Array, rough_patch

ANGLES, LIGHT, AZIMUTH, ACCEPTANCE = (0.0, 35.0), 20.0, 30.0, 5.0


def _parts(name, lam):
    index = TISSUES[name].index(lam)
    return {"eta": float(index.real), "k": float(index.imag)}


WET = _parts("water", SODIUM)["eta"]
#: Parameters of a BSDF by name, and those of the reference at a wavelength in nm.
MATERIALS = {
    "dielectric": ({"int_ior": 1.5}, lambda lam: {"eta": 1.5}),
    "absorbing": ({"material": "1.56+0.05i"}, lambda lam: {"eta": 1.56, "k": 0.05}),
    "melanin": ({"material": "melanin"}, lambda lam: _parts("melanin", lam)),
    "wet keratin": (
        {"material": "keratin", "coat_ior": "water"},
        # light's path in the coat has water's index at sodium's line, the contrast that at lam
        lambda lam: {
            "eta": _parts("keratin", lam)["eta"] * WET / _parts("water", lam)["eta"],
            "coat": WET,
        },
    ),
    "keratin under water": (
        {"material": "keratin", "ext_ior": "water"},
        lambda lam: {"eta": _parts("keratin", lam)["eta"] / _parts("water", lam)["eta"]},
    ),
}


def spectra_and_reference(name: str, wavelengths: Array) -> tuple[Array, Array]:
    """Reflectance factors (n, 2) of a rough surface, and those of `md.reference`."""
    patch = rough_patch((24, 24), (0.15, 0.15), 0.08)
    parameters, index = MATERIALS[name]
    medium = parameters.get("ext_ior")
    above = medium_index(medium)
    within = in_medium(md.TableSource.of(patch), medium).field()
    found = md.spectrum(
        mi.load_dict(md.bsdf_dict(within, **parameters)), LIGHT, ANGLES, light_azimuth=AZIMUTH,
        acceptance=ACCEPTANCE, wavelengths=wavelengths,
    ).value  # fmt: skip
    phi = math.radians(AZIMUTH)
    side = np.array([-math.sin(phi), math.cos(phi), 0.0])
    expected = [
        # waves in a medium are shorter by its index
        [_factor(patch, phi, _cone(angle, phi, side), lam / above, index(lam)) for angle in ANGLES]
        for lam in wavelengths
    ]
    return found, np.array(expected)


def _cone(angle: float, phi: float, side: Array, n: int = 400) -> Array:
    """Directions (n, 3) of equal solid angles around a detector's, by the golden angle."""
    half, theta = math.radians(ACCEPTANCE / 2), math.radians(angle)
    alpha = np.arccos(1 - (np.arange(n) + 0.5) / n * (1 - math.cos(half)))[:, None]
    psi = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(n)[:, None]
    flat = math.sin(theta)
    axis = np.array([-flat * math.cos(phi), -flat * math.sin(phi), math.cos(theta)])
    up = np.cross(axis, side)
    return np.cos(alpha) * axis + np.sin(alpha) * (np.cos(psi) * side + np.sin(psi) * up)


def _factor(patch, phi, wo, lam, index) -> float:
    theta = math.radians(LIGHT)
    wi = np.array(
        [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]
    )
    f = md.reference.brdf(patch, wi, wo, lam, **index)
    return float((f * wo[:, 2]).sum() / (wo[:, 2] / np.pi).sum())
