"""The hologram of the sticker in `scenes/hologram.xml`: a rosette, a wheel and rays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.scene.hologram import Hologram, hologram

#: Degrees across the grooves of areas that the lamp and the window light.
LAMP, WINDOW = 104.0, 50.0
#: Periods of the rosette's rings, µm: blue to red in the light of the lamp.
RINGS = (0.86, 0.98, 1.1, 1.22)
#: Period of the whole patch, µm.
LONGEST = 1.3

Floats = NDArray[np.float64]


def sticker(dots: int = 384) -> Hologram:
    """Return the textures of a square sticker of so many dots a side."""
    x, y = np.meshgrid(*[(np.arange(dots) + 0.5) / dots * 2.0 - 1.0] * 2)
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    periods, turns = np.full(x.shape, np.nan), np.zeros(x.shape)

    def fill(where: NDArray[np.bool_], period: Floats | float, turn: Floats | float) -> None:
        periods[where] = np.broadcast_to(period, x.shape)[where]
        turns[where] = np.broadcast_to(turn, x.shape)[where]

    # Rays in the corners, lit by lamp and window in turn
    rays = np.floor((angle + np.pi) / (2.0 * np.pi) * 72.0)
    fill((radius > 1.0) & (rays % 3 == 0), 0.92, LAMP)
    fill((radius > 1.0) & (rays % 3 == 1), 1.14, WINDOW)
    # A wheel of sectors, each turned by 7.5° more: a spot of light runs around it
    sector = np.floor((angle + np.pi) / (2.0 * np.pi) * 48.0)
    fill((radius > 0.8) & (radius < 0.96), 1.04, sector * 7.5)
    # A rosette of rings, whose petals are lit by lamp and window in turn
    petals = 0.56 + 0.16 * np.cos(8.0 * angle)
    for n, period in enumerate(RINGS):
        share = 1.0 - n / len(RINGS) * 0.72
        lamp = np.cos(8.0 * angle + n * np.pi) > -0.3
        fill(radius < petals * share, period, np.where(lamp, LAMP, WINDOW))
    # A star in the middle
    star = 0.12 + 0.05 * np.cos(5.0 * angle - 2.5 * np.pi)
    fill(radius < star, LONGEST, LAMP)
    image = np.isfinite(periods)
    return hologram(image, periods=periods, orientations=turns, period=LONGEST)
