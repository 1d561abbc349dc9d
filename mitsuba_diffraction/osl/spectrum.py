"""Wavelengths that a shader draws, and their weights in Blender's working spaces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..optics.colour import WORKING_SPACES, linear_in, response

#: Nodes of the wavelength over a random number from 0 to 1.
NODES = 96
#: Ends of the drawn wavelengths, nm: the observer sees less than 1e-4 of the light beyond.
ENDS = (380.0, 780.0)

_STEP = 0.25
#: Weights of red, green and blue in the density of wavelengths, as their noise is seen.
_IMPORTANCE = (0.3, 0.5, 0.2)


def drawn_spectrum() -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """Tabulate wavelengths and weights under daylight, at even steps of a number u from 0 to 1.

    Returns wavelengths (NODES,) in nm; by working space colours (NODES, 3), linear RGB, negative
    outside its gamut. Means of their linear interpolation over u are white, (1, 1, 1).
    """
    lam = np.arange(ENDS[0] + 0.5 * _STEP, ENDS[1], _STEP)
    exact = {
        space: np.asarray(linear_in(space, response(lam)), np.float64) for space in WORKING_SPACES
    }
    density = np.mean([np.abs(colours) @ _IMPORTANCE for colours in exact.values()], axis=0)
    density = np.maximum(density, 1e-3 * density.max())  # keeps the map invertible at the ends
    cumulative = np.append(0.0, np.cumsum(density))
    cumulative /= cumulative[-1]
    u = np.linspace(0.0, 1.0, NODES)
    wavelengths = np.interp(u, cumulative, np.append(lam - 0.5 * _STEP, ENDS[1]))
    return wavelengths, {space: _weights(u, cumulative, each) for space, each in exact.items()}


def _weights(
    u: NDArray[np.float64], cumulative: NDArray[np.float64], colours: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Integrate colours with the hats of linear interpolation over u; (NODES, 3), mean white."""
    middle, width = 0.5 * (cumulative[1:] + cumulative[:-1]), np.diff(cumulative)
    hats = np.stack([np.interp(middle, u, row) for row in np.eye(len(u))])
    values = (hats @ colours) / (hats @ width)[:, None]
    trapezoid = np.full(len(u), 1.0 / (len(u) - 1))
    trapezoid[[0, -1]] *= 0.5
    return np.asarray(values / (trapezoid @ values))
