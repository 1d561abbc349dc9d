"""Statistical checks: random surfaces, and windows at random places."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mitsuba_diffraction import reference
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.heights.spectra import order_powers
from mitsuba_diffraction.optics.geometry import wavenumber

from .cases import in_plane
from .roughness import Estimate, Roughness, estimate, mean_brdf, mean_order_0, shifted

_CORRELATION = 1.0  # µm
_WAVELENGTH = 550.0  # nm


@dataclass(frozen=True)
class Specular:
    """Power of order 0 of random surfaces at normal incidence and exit, against κ·rms."""

    kappa_rms: Real
    power: Estimate
    exact: Real
    surfaces: int


@dataclass(frozen=True)
class Lobe:
    """BRDF of a random surface in the plane of incidence; angles in degrees, BRDF in 1/sr."""

    roughness: Roughness
    theta: float
    wavelength: float
    coherence_width: float
    angles: Real
    measured: Estimate
    exact: Real

    @cached_property
    def fine_angles(self) -> Real:
        """Angles to draw the closed form at."""
        return np.linspace(self.angles.min(), self.angles.max(), 400)

    @cached_property
    def fine_exact(self) -> Real:
        """The closed form there."""
        return _exact(self.roughness, self.theta, self.fine_angles, self.coherence_width)


@dataclass(frozen=True)
class Offsets:
    """Mean over windows at random places of a surface, and its `ensemble`."""

    angles: Real
    patches: Estimate
    ensemble: Real
    count: int


@dataclass(frozen=True)
class Statistics:
    """Results of all statistical checks."""

    specular: Specular
    lobes: list[Lobe]
    offsets: Offsets


def measure(surfaces: int = 200, offsets: int = 2000) -> Statistics:
    """Run all statistical checks, seeded; some ten seconds."""
    lobes = [lobe(rms, surfaces, seed=n * surfaces) for n, rms in enumerate((0.02, 0.05, 0.1))]
    return Statistics(specular(4 * surfaces), lobes, random_windows(offsets))


def specular(surfaces: int, extent: float = 30.0, pixels: int = 96) -> Specular:
    """|a_0|² of seeded surfaces (`spectra.order_powers`) for κ·rms from 0.25 to 2."""
    kappa = 2 * float(wavenumber(_WAVELENGTH))
    products = np.arange(0.25, 2.01, 0.25)
    samples, exact = np.empty((surfaces, len(products))), np.empty(len(products))
    for column, product in enumerate(products):
        rough = Roughness(product / kappa, _CORRELATION)
        for n in range(surfaces):
            patch = rough.patch(extent, pixels, seed=column * surfaces + n)
            samples[n, column] = order_powers(patch, _WAVELENGTH)[pixels // 2, pixels // 2]
        exact[column] = mean_order_0(rough, kappa, extent)
    return Specular(products, Estimate.of(samples), exact, surfaces)


def lobe(
    rms: float,
    surfaces: int,
    *,
    theta: float = 20.0,
    coherence_width: float = 12.0,
    seed: int = 0,
) -> Lobe:
    """`reference.brdf` of seeded surfaces against Beckmann and Spizzichino's series."""
    rough = Roughness(rms, _CORRELATION)
    angles = np.array([-65, -55, -45, -35, -28, -24, -22, -20, -18, -16, -12, -5, 5, 15, 30.0])
    wi = in_plane(np.sin(np.radians(theta)))
    wo = in_plane(np.sin(np.radians(angles)))
    fields = (rough.patch(20.0, 96, seed + n) for n in range(surfaces))
    measured = estimate(fields, wi, wo, _WAVELENGTH, coherence_width=coherence_width)
    exact = _exact(rough, theta, angles, coherence_width)
    return Lobe(rough, theta, _WAVELENGTH, coherence_width, angles, measured, exact)


def random_windows(count: int, *, theta: float = 20.0, coherence_width: float = 6.0) -> Offsets:
    """`patch` at random places of one rough surface, and its `ensemble`."""
    surface = Roughness(0.06, _CORRELATION).patch(12.0, 64, seed=7)
    angles = np.array([-60, -45, -35, -28, -20, -12, -5, 5, 15, 25.0])
    wi = in_plane(np.sin(np.radians(theta)))
    wo = in_plane(np.sin(np.radians(angles)))
    lit, width = (wi, wo, _WAVELENGTH), coherence_width
    patches = estimate(shifted(surface, count), *lit, coherence_width=width, coherence="patch")
    ensemble = reference.brdf(surface, *lit, coherence_width=width)
    return Offsets(angles, patches, ensemble, count)


def _exact(rough: Roughness, theta: float, angles: Real, coherence_width: float) -> Real:
    wi = in_plane(np.sin(np.radians(theta)))
    wo = in_plane(np.sin(np.radians(angles)))
    return mean_brdf(rough, wi, wo, _WAVELENGTH, coherence_width=coherence_width)
