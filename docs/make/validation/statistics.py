"""Statistical checks: random surfaces, and windows at random places."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.heights import order_powers
from mitsuba_diffraction.optics.geometry import wavenumber

from .cases import in_plane
from .roughness import Roughness, mean_brdf, mean_order_0, shifted

#: Correlation length (µm) of all surfaces, their light's wavelength (nm) and angle (degrees).
CORRELATION, WAVELENGTH, THETA = 1.0, 550.0, 20.0
_WIDTH = 12.0  # µm, of the window of lobes


@dataclass(frozen=True)
class Estimate:
    """Means over surfaces or windows beside what they are to be, each (n,).

    Attributes
    ----------
    name : of the estimate in a table.
    places : κ·rms of order 0; exit angles of BRDFs (1/sr) in the plane of incidence, degrees.
    error : standard errors of the means.
    exact : closed form, or the mean over all windows.
    count : number of surfaces or windows.
    """

    name: str
    places: Real
    mean: Real
    error: Real
    exact: Real
    count: int

    @classmethod
    def of(cls, name: str, places: Real, samples: Real, exact: Real) -> Estimate:
        """Estimate the means of samples (count, n)."""
        error = samples.std(axis=0, ddof=1) / np.sqrt(len(samples))
        return cls(name, places, samples.mean(axis=0), error, exact, len(samples))

    @property
    def distance(self) -> Real:
        """How far the means are from `exact`, in standard errors."""
        return (self.mean - self.exact) / self.error


@dataclass(frozen=True)
class Statistics:
    """Results of all statistical checks."""

    specular: Estimate
    lobes: dict[float, Estimate]  # by rms, µm
    offsets: Estimate


def measure(surfaces: int = 200, offsets: int = 2000) -> Statistics:
    """Run all statistical checks, seeded; some ten seconds."""
    lobes = {r: lobe(r, surfaces, seed=n * surfaces) for n, r in enumerate((0.02, 0.05, 0.1))}
    return Statistics(specular(4 * surfaces), lobes, random_windows(offsets))


def specular(surfaces: int, extent: float = 30.0, pixels: int = 96) -> Estimate:
    """|a_0|² of seeded surfaces (`spectra.order_powers`) for κ·rms from 0.25 to 2."""
    kappa = 2 * float(wavenumber(WAVELENGTH))
    products = np.arange(0.25, 2.01, 0.25)
    samples, exact = np.empty((surfaces, len(products))), np.empty(len(products))
    for column, product in enumerate(products):
        rough = Roughness(product / kappa, CORRELATION)
        for n in range(surfaces):
            patch = rough.patch(extent, pixels, seed=column * surfaces + n)
            samples[n, column] = order_powers(patch, WAVELENGTH)[pixels // 2, pixels // 2]
        exact[column] = mean_order_0(rough, kappa, extent)
    return Estimate.of("order 0", products, samples, exact)


def lobe(rms: float, surfaces: int, *, seed: int = 0) -> Estimate:
    """`reference.brdf` of seeded surfaces against Beckmann and Spizzichino's series."""
    rough = Roughness(rms, CORRELATION)
    angles = np.array([-65, -55, -45, -35, -28, -24, -22, -20, -18, -16, -12, -5, 5, 15, 30.0])
    fields = (rough.patch(20.0, 96, seed + n) for n in range(surfaces))
    samples = _brdfs(fields, angles, _WIDTH)
    return Estimate.of(f"{1000 * rms:g} nm", angles, samples, exact_lobe(rms, angles))


def exact_lobe(rms: float, angles: Real) -> Real:
    """The closed form of a lobe at exit angles."""
    wi, wo = (in_plane(np.sin(np.radians(each))) for each in (THETA, angles))
    return mean_brdf(Roughness(rms, CORRELATION), wi, wo, WAVELENGTH, coherence_width=_WIDTH)


def random_windows(count: int) -> Estimate:
    """`patch` at random places of one rough surface, and its `ensemble`."""
    surface = Roughness(0.06, CORRELATION).patch(12.0, 64, seed=7)
    angles = np.array([-60, -45, -35, -28, -20, -12, -5, 5, 15, 25.0])
    patches = _brdfs(shifted(surface, count), angles, 6.0, coherence="patch")
    return Estimate.of("mean of patches", angles, patches, _brdfs([surface], angles, 6.0)[0])


def _brdfs(fields: Iterable[HeightField], angles: Real, width: float, **settings: str) -> Real:
    """`reference.brdf` of fields at exit angles, (fields, n)."""
    wi, wo = (in_plane(np.sin(np.radians(each))) for each in (THETA, angles))
    lit = wi, wo, WAVELENGTH
    return np.array(
        [reference.brdf(field, *lit, coherence_width=width, **settings) for field in fields]
    )
