"""eval / (R cosθo) against the reference: the accuracy asked for, on every kind of surface.

The measure is the package's (`tables.error`): Σ|plugin − reference| / Σ reference of ⟨|P|²⟩, near
order 0 and elsewhere, here over directions drawn where the surface sends its light.
"""

from __future__ import annotations

import functools
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import kirchhoff_factor, sigma_of
from tests.support.directions import lit_pairs, rough_patch
from tests.support.lanes import brdf_values

# measured and made surfaces alike may be steeper than the model likes; that is not the point here
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning"),
]

FINE_CHEBYSHEV = [("chebyshev", 1e-4), ("taylor", 1e-3)]
FINE_TAYLOR = [("chebyshev", 1e-3), ("taylor", 1e-4)]
#: Name: (coherence width in µm, pairs of directions, what to ask for).
SURFACES = {
    # the defaults; finer tables of all its pixels take ten seconds
    "elaphe": (65.0, 40, [("svd", 1e-3)]),
    "blazed along x": (20.0, 200, FINE_CHEBYSHEV),
    "blazed along y": (20.0, 200, FINE_TAYLOR),
    "oblong": (6.0, 200, [*FINE_CHEBYSHEV, *FINE_TAYLOR]),
}


@functools.cache
def surface(name: str, shared_afm: Path | None) -> md.HeightField:
    """The height field of that name."""
    if name.startswith("elaphe"):
        file = shared_afm / "elaphe-65um.png"
        field = md.HeightField.load(file, pixel_size=65 / 1332, max_height=0.375)
        return md.HeightField(field.heights, field.pixel_size)
    if name.startswith("blazed"):
        # a quarter as wide as it is long, so that the taps differ too
        return md.gratings.blazed(
            2.5, 0.25, periods=8, pixels_per_period=40, rows=80, axis=name[-1]
        )
    return rough_patch((64, 91), (0.085, 0.07), 0.2)


@functools.cache
def expected(name: str, coherence: str, shared_afm: Path | None):
    """Directions and wavelengths, which are near order 0, and the reference's ⟨|P|²⟩ there."""
    width, n, _ = SURFACES[name]
    field = surface(name, shared_afm)
    wi, wo, lam, near = lit_pairs(field, sigma_of(width), n, seed=11)
    value = md.reference.brdf(field, wi, wo, lam, coherence_width=width, coherence=coherence)
    return wi, wo, lam, near, value / kirchhoff_factor(wi, wo, lam, sigma_of(width))


def errors(bsdf, wi, wo, lam, near, exact, sigma):
    """Relative error near order 0 and elsewhere."""
    value = brdf_values(bsdf, wi, wo, lam[:, None]) / kirchhoff_factor(wi, wo, lam, sigma)
    difference = np.abs(value - exact)
    return [float(difference[m].sum() / exact[m].sum()) for m in (near, ~near)]


# all of the elaphe as by default alone: its reference takes as long as all of the others'
@pytest.mark.parametrize(
    ("name", "coherence"),
    [(n, c) for n in SURFACES for c in md.reference.COHERENCES if (n, c) != ("elaphe", "patch")],
)
def test_the_plugin_meets_its_tolerance(variant, request, name, coherence):
    afm = request.getfixturevalue("shared_afm") if "elaphe" in name else None
    width, _, asked = SURFACES[name]
    sample = expected(name, coherence, afm)
    measured = {}
    for basis, tolerance in asked:
        bsdf = mi.load_dict(
            md.bsdf_dict(
                surface(name, afm),
                material="none",
                energy_conserving=False,
                coherence_width=width,
                coherence=coherence,
                basis=basis,
                tolerance=tolerance,
            )
        )
        measured[basis, tolerance] = errors(bsdf, *sample, sigma_of(width))
    # no allowance: the plugin's own arithmetic in single precision counts
    assert {k: v for k, v in measured.items() if not max(v) <= k[1]} == {}
