"""Gratings, lights and materials for which the model is compared with rigorous solutions.

Angles are those of the light's direction in the plane of the grooves' normal, positive towards +x;
order m leaves at sinθo = mλ/d − sinθi, positive towards +x too. Blazed gratings ascend towards +x:
light from θi > 0 falls on their steps, light from θi < 0 along the facets.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.heights.field import HeightField

PROFILES = ("sinusoidal", "lamellar", "blazed")
MATERIALS = ("perfect", "aluminium", "keratin")

#: Grooves from the size of a snake scale's microstructure to that of a coarse grating, µm.
PERIODS = (1.1, 1.6, 2.5, 5.0)
DEPTHS = (0.05, 0.1, 0.2, 0.4)

#: nm. None of them sends an order along the surface at these periods and angles, where every
#: method is delicate (Rayleigh's wavelengths).
WAVELENGTHS = (410.0, 460.0, 510.0, 560.0, 610.0, 660.0, 710.0, 760.0)
#: The same for other materials, which take longer to solve.
FEW_WAVELENGTHS = (460.0, 610.0)

#: The grating that the design was first checked with, at normal incidence, over a finer scan.
PROBE_GRATING = ("sinusoidal", 2.5, 0.1)
PROBE_WAVELENGTHS = tuple(float(w) for w in range(450, 781, 30))

#: Aluminium's index n + ik by wavelength (nm): Mitsuba's own table (material `Al`), interpolated.
ALUMINIUM = {460.0: 0.646 + 5.590j, 610.0: 1.248 + 7.368j}

#: Silicon's index by wavelength (nm): Mitsuba's own table (material `Si`), interpolated.
SILICON = {460.0: 4.577 + 0.130j, 610.0: 3.906 + 0.022j}

#: Keratin's index, the middle of what is reported for hair and scales (1.54–1.58).
KERATIN = 1.56

_METALS = {"aluminium": ALUMINIUM, "silicon": SILICON}

#: Polycarbonate's index, the coat of a CD.
COAT = 1.58

#: Samples a period: 5e-6 from the closed forms of lamellar and blazed gratings.
PIXELS = 512


@dataclass(frozen=True)
class Grating:
    """Period of a grating; `period` and `depth` (peak to valley) in µm."""

    profile: str
    period: float
    depth: float

    def heights(self, pixels: int = PIXELS) -> HeightField:
        """Heights of the period: `pixels` samples along x, two rows of them.

        Raises
        ------
        DiffractionError
            If there is no such profile.
        """
        if self.profile not in PROFILES:
            raise DiffractionError(
                f"profile '{self.profile}' is unknown; choose one of {', '.join(PROFILES)}"
            )
        ascends = {"direction": "ascending"} if self.profile == "blazed" else {}
        return getattr(gratings, self.profile)(
            self.period, self.depth, periods=1, pixels_per_period=pixels, rows=2, **ascends
        )

    def __str__(self) -> str:
        return f"{self.profile} {self.period:g}/{self.depth:g} µm"


@dataclass(frozen=True)
class Scan:
    """Grating in light from one direction (θi in degrees), at several wavelengths (nm)."""

    grating: Grating
    material: str
    theta: float
    wavelengths: tuple[float, ...]


def scans(material: str) -> list[Scan]:
    """All scans of one material, in a fixed order.

    Raises
    ------
    DiffractionError
        If the material is not one of `MATERIALS`.
    """
    if material not in MATERIALS:
        raise DiffractionError(
            f"material '{material}' is unknown; choose one of {', '.join(MATERIALS)}"
        )
    return list(_scans(material))


def index_of(material: str, wavelength: float) -> complex:
    """Index n + ik of a material at a wavelength (nm).

    Under polycarbonate both are those inside: the index is over the coat's.
    """
    if material == "aluminium under polycarbonate":
        return index_of("aluminium", wavelength * COAT) / COAT
    if material == "keratin":
        return complex(KERATIN)
    nodes = _METALS[material]  # Mitsuba's tables are smooth between them
    return complex(np.interp(wavelength, list(nodes), list(nodes.values())))


def index_text(material: str) -> str:
    """Return the index of a material in words, for files of solutions."""
    if material not in _METALS:
        return f"{KERATIN:g}" if material == "keratin" else "perfect conductor"
    return ", ".join(f"{n:g} at {w:g} nm" for w, n in _METALS[material].items())


def _scans(material: str) -> Iterator[Scan]:
    for profile in PROFILES:
        for period in PERIODS:
            for depth in DEPTHS:
                grating = Grating(profile, period, depth)
                if not _affordable(grating, material):
                    continue
                for theta in _angles(profile, material):
                    yield Scan(grating, material, theta, _wavelengths(grating, material, theta))


def _affordable(grating: Grating, material: str) -> bool:
    """Whether a grating is solved: light is short in metals, and edges require a finer mesh."""
    if material == "perfect" or grating.profile == "sinusoidal":
        return True
    return grating.period in (1.1, 2.5) or (material == "aluminium" and grating.period < 5.0)


def _angles(profile: str, material: str) -> tuple[float, ...]:
    perfect = material == "perfect"
    angles = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0) if perfect else (0.0, 30.0, 60.0)
    if profile == "blazed":  # not symmetric
        angles = (-60.0, -30.0, *angles) if perfect else (-30.0, *angles)
    return angles


def _wavelengths(grating: Grating, material: str, theta: float) -> tuple[float, ...]:
    if material != "perfect":
        return FEW_WAVELENGTHS
    probe = theta == 0.0 and grating == Grating(*PROBE_GRATING)
    return tuple(sorted({*WAVELENGTHS, *(PROBE_WAVELENGTHS if probe else ())}))


def order_sines(period: float, wavelength: float, theta: float) -> tuple[np.ndarray, np.ndarray]:
    """Propagating orders m, and sinθo of each: mλ/d − sinθi. µm, nm and degrees."""
    step, sine = wavelength / 1000 / period, np.sin(np.radians(theta))
    orders = np.arange(np.ceil((sine - 1) / step), np.floor((sine + 1) / step) + 1).astype(int)
    return orders, orders * step - sine
