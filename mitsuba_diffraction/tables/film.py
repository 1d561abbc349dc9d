"""The mean of the second order under a film, on a grid of angles and wavelengths (NumPy only)."""

from __future__ import annotations

import math

import numpy as np

from ..optics import mean_second_order
from ..optics.blend import RoughnessTable
from ..optics.fresnel import Filmed
from ..optics.geometry import wavenumber
from .directional import FINE, DirectionalTable, DirectionGrid, Real
from .energy.conserved import PROBES, Index, Reflector, rounded
from .energy.scaling import parallel
from .energy.settings import energy_settings
from .store import DirectionalTables, cached_directions
from .table import DiffractionTable

_FEWEST = 8


def exponents(
    roughness: RoughnessTable, index: Index, wavelength_range: tuple[float, float]
) -> DirectionalTable:
    """Tabulate ln g of `optics.mean_second_order`, of the angle alone: a second or two.

    Arguments as of `tables.energy.conservation.Energy`.
    """
    low, high = wavelength_range
    settings = energy_settings()
    phase = Reflector("small_slope", index).phase(wavelength_range)
    count = int(np.clip(math.ceil(phase / settings.fringe_step), _FEWEST, settings.fringes))
    wavelengths = np.geomspace(low, high, count if high > low else 1)
    films = index(wavelengths)
    assert isinstance(films, Filmed)
    return exponents_at(roughness, films, wavelengths)


def exponents_at(roughness: RoughnessTable, films: Filmed, wavelengths: Real) -> DirectionalTable:
    """Tabulate ln g of films at wavelengths (n,), nm."""
    grid = DirectionGrid(FINE.polar, 1)
    cosine = np.cos(grid.theta)

    def at_wavelength(n: int) -> Real:
        k = float(wavenumber(wavelengths[n]))
        return mean_second_order.exponents(cosine, films[n], roughness, k)

    values = np.stack(parallel(at_wavelength, list(range(len(wavelengths)))))
    return DirectionalTable(wavelengths, values[:, :, None].astype(np.float32))


def mean_exponents(
    table: DiffractionTable, index: Index, wavelength_range: tuple[float, float]
) -> DirectionalTable:
    """Return `exponents` of a table, from memory, from disk, or computed."""

    def make() -> DirectionalTables:
        return {"exponents": exponents(table.roughness, index, wavelength_range)}

    probes = rounded(index(np.geomspace(*wavelength_range, PROBES)))
    settings = energy_settings()
    made_of = mean_second_order.VERSION, settings.fringe_step, settings.fringes, probes
    return cached_directions("film", table, [*made_of, *wavelength_range], make)["exponents"]
