"""Geometry of a spectrometer: a lamp, detectors in the plane of incidence, and their cones."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from ..arrays import Real
from ..errors import DiffractionError
from ..optics.geometry import wavenumber
from .maps.hemisphere import polar

#: Steepest direction of a lamp or of the edge of a detector's cone, degrees.
STEEPEST = 89.0

# Nodes of the cone: radii and azimuths per standard deviation of the narrowest lobe, and at least.
_PER_LOBE, _FEWEST_RADII, _FEWEST_AZIMUTHS = 1.25, 8, 16
# Most nodes of a cone, a gigabyte of memory: 120° at 300 nm have 2.5 million under 65 µm.
_MOST_NODES = 1 << 22


@dataclass(frozen=True)
class MeasurementGeometry:
    """Angles of a measurement, degrees.

    Raises a DiffractionError if an angle is out of range, there is no detector, or a cone reaches
    below the surface.

    Parameters
    ----------
    light : angle of the lamp from the normal, 0 to 89.
    detectors : angles of the detectors in the plane of incidence; the mirror's is +`light`.
    azimuth : of the lamp, from the patch's x axis towards its y axis, −360 to 360.
    acceptance : full angle of the cone that a detector collects.
    """

    light: float = 30.0
    detectors: tuple[float, ...] = (30.0,)
    azimuth: float = 0.0
    acceptance: float = 2.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.light <= STEEPEST:
            raise DiffractionError(
                f"light={self.light:g}: the lamp must be 0 to {STEEPEST:g} degrees from the normal"
            )
        if not -360.0 <= self.azimuth <= 360.0:
            raise DiffractionError(
                f"light_azimuth={self.azimuth:g} must be from -360 to 360 degrees"
            )
        if not 0.01 <= self.acceptance <= 120.0:
            raise DiffractionError(
                f"acceptance={self.acceptance:g}: the full angle of the detector's cone must be "
                "from 0.01 to 120 degrees, e.g. 2"
            )
        if not self.detectors:
            raise DiffractionError("there is no detector; give at least one angle, e.g. 30")
        furthest = STEEPEST - 0.5 * self.acceptance
        for angle in self.detectors:
            if not abs(angle) <= furthest:
                raise DiffractionError(
                    f"detector={angle:g}: a cone of {self.acceptance:g} degrees around it reaches "
                    f"below the surface; detectors must be from {-furthest:g} to {furthest:g} "
                    "degrees from the normal"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the detectors' columns that R keeps: light30_detectorm10 at −10°."""
        return tuple(
            f"light{self.light:g}_detector{angle:g}".replace("-", "m") for angle in self.detectors
        )

    @property
    def lamp(self) -> Real:
        """Unit vector (3,) towards the lamp."""
        return self.towards(-self.light)

    @property
    def across(self) -> Real:
        """Unit vector (3,) normal to the plane of incidence: s."""
        phi = math.radians(self.azimuth)
        return np.array([-math.sin(phi), math.cos(phi), 0.0])

    def towards(self, angle: float) -> Real:
        """Return the unit vector (3,) at a detector's angle in the plane of incidence."""
        return polar(math.radians(-angle), math.radians(self.azimuth))

    def cone(self, angle: float, lobe: float) -> tuple[Real, Real]:
        """Return directions (m, 3) in a detector's cone and their solid angles (m,).

        Gauss and Legendre's nodes in the angle from the axis, even ones around it: the cone's edge
        is sharp, and lobes inside are smooth.
        """
        half = math.radians(0.5 * self.acceptance)
        radii = max(math.ceil(_PER_LOBE * half / lobe), _FEWEST_RADII)
        around = max(math.ceil(_PER_LOBE * 2.0 * math.pi * half / lobe), _FEWEST_AZIMUTHS)
        if radii * around > _MOST_NODES:
            narrower = self.acceptance * math.sqrt(_MOST_NODES / (radii * around))
            raise DiffractionError(
                f"acceptance={self.acceptance:g}: the lobes of so wide a coherence window are too "
                f"fine to add up over this cone; take at most {0.99 * narrower:.2g} degrees"
            )
        nodes, weights = np.polynomial.legendre.leggauss(radii)
        alpha = 0.5 * half * (nodes + 1.0)
        psi = 2.0 * np.pi * (np.arange(around) + 0.5) / around
        alpha, psi = (a.ravel() for a in np.meshgrid(alpha, psi, indexing="ij"))
        axis = self.towards(angle)
        side = self.across
        along = np.cross(side, axis)
        directions = (
            np.cos(alpha)[:, None] * axis
            + (np.sin(alpha) * np.cos(psi))[:, None] * along
            + (np.sin(alpha) * np.sin(psi))[:, None] * side
        )
        solid = np.repeat(0.5 * half * weights, around) * np.sin(alpha) * 2.0 * np.pi / around
        return directions, solid


def column_name(group: str) -> str:
    """Return the name of a group in names of columns, as R keeps them."""
    return re.sub(r"[^\w.]", "_", group)


def lobe_width(sigma: float | None, lam: Real) -> float:
    """Return the standard deviation of the narrowest lobe, rad: of exp(−σ²k²Δ²), 1/(√2 σk)."""
    return 0.05 if sigma is None else 1.0 / (2**0.5 * sigma * float(wavenumber(lam[0])))
