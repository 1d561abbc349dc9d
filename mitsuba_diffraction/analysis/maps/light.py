"""The light of a map: its direction, where a mirror would send it, and its wavelengths."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.geometry import check_angles


@dataclass(frozen=True)
class Light:
    """Direction to the light.

    Parameters
    ----------
    theta : degrees from the normal, 0 to below 90.
    phi : degrees from the patch's x axis towards its y axis, −360 to 360.

    Raises
    ------
    DiffractionError
        If an angle is out of range.
    """

    theta: float = 0.0
    phi: float = 0.0

    def __post_init__(self) -> None:
        check_angles(self.theta, self.phi)

    @property
    def direction(self) -> NDArray[np.float64]:
        """ωi, unit vector (3,) towards the light."""
        theta, phi = math.radians(self.theta), math.radians(self.phi)
        sin = math.sin(theta)
        return np.array([sin * math.cos(phi), sin * math.sin(phi), math.cos(theta)])

    @property
    def mirror(self) -> NDArray[np.float64]:
        """Unit vector (3,) in which a flat mirror reflects it."""
        return self.direction * [-1.0, -1.0, 1.0]

    def __str__(self) -> str:
        return f"θ = {self.theta:g}°, φ = {self.phi:g}°"


#: nm. A finer step than this shows nothing: even a tenth of it moves no order by a pixel.
FINEST_STEP = 0.1


@dataclass(frozen=True)
class Bands:
    """A range of wavelengths, cut into equal bands no wider than a step.

    Parameters
    ----------
    low, high : nm, above 0. Equal ones make a single wavelength.
    step : nm.

    Raises
    ------
    DiffractionError
        If the range is empty or the step does not fit it.
    """

    low: float
    high: float
    step: float = 5.0

    def __post_init__(self) -> None:
        if not (0.0 < self.low <= self.high and math.isfinite(self.high)):
            raise DiffractionError(
                f"wavelength range {self.low:g} to {self.high:g} nm is none; give the shortest "
                "first, both above 0, e.g. 380 780"
            )
        if self.is_single:
            return
        if not FINEST_STEP <= self.step <= self.high - self.low:
            raise DiffractionError(
                f"step={self.step:g} nm does not fit the range of {self.low:g} to {self.high:g} nm;"
                f" it must be from {FINEST_STEP:g} to {self.high - self.low:g} nm"
            )

    @classmethod
    def of(
        cls, wavelength_range: tuple[float, float], step: float, wavelength: float | None
    ) -> Bands:
        """A range in steps, or the one wavelength if it is not `None`."""
        if wavelength is not None:
            return cls(wavelength, wavelength)
        return cls(*wavelength_range, step)

    @property
    def is_single(self) -> bool:
        """Whether this is one wavelength instead of a range."""
        return self.low == self.high

    @property
    def count(self) -> int:
        """Number of bands."""
        # a range that is a whole number of steps must not get one more by rounding
        return 1 if self.is_single else math.ceil((self.high - self.low) / self.step - 1e-9)

    @property
    def width(self) -> float:
        """Of one band, nm."""
        return (self.high - self.low) / self.count

    def wavelengths(self, offset: float = 0.5) -> NDArray[np.float64]:
        """One wavelength in each band, (count,) in nm, at `offset` (0 to 1) of its width."""
        return self.low + (np.arange(self.count, dtype=np.float64) + offset) * self.width

    def __str__(self) -> str:
        if self.is_single:
            return f"{self.low:g} nm"
        return f"{self.low:g}–{self.high:g} nm in steps of {self.width:.4g} nm"
