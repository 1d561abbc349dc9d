"""Scales that conserve energy, in the cache, by what they are made of."""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics import mean_second_order
from ...optics.fresnel import Filmed
from ..sampling import MOST_STRONG, STRONG
from ..store import Record, kept, key_of
from ..table import DiffractionTable
from . import film
from .conservation import Conservation, Index, conservation
from .grid import DirectionalTable
from .settings import VERSION, energy_settings
from .transmission import Medium, Sides

#: Height scales are n/steps: this phase (rad) changes at most in between. The power of an order
#: bends by a fiftieth then, and by less at grazing angles, where there is most to take.
_PHASE = 0.8
_FEWEST_STEPS = 4
#: As good as no heights at all.
_FLAT = 1e-3
#: Wavelengths at which a material is told from another.
_PROBES = 24

_known: weakref.WeakKeyDictionary[DiffractionTable, dict[str, list[DirectionalTable]]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True)
class _HeightScales:
    """Height scales of a table at which energy is conserved when asked for.

    Attributes
    ----------
    table : the table.
    """

    table: DiffractionTable

    def nodes(self, height_scale: float, *, interval: bool = False) -> tuple[float, float]:
        """Return the two height scales around one, for which something is made; equal at a node.

        They lie evenly, 1 among them, so close that an order's power bends little in between. An
        optimisation of the heights thus sees a continuous scale with derivatives, and waits only
        where it enters an interval that nobody has been in before.

        interval : two nodes even if the scale is at one, for derivatives.
        """
        steps, most = self._lattice

        def node(n: int) -> float:
            return min(max(n / steps, _FLAT), most)

        position = height_scale * steps  # of a scale in single precision
        lower = min(math.floor(position + 1e-4), math.ceil(most * steps - 1e-4) - 1)
        at_node = abs(position - lower) < 1e-4
        return node(lower), node(lower if at_node and not interval else lower + 1)

    @property
    def _lattice(self) -> tuple[int, float]:
        """Height scales a unit, and the largest."""
        phase = 2.0 * self.table.q_limit * self.table.expansion.half_range
        # Beyond the table's own limit nothing can be looked up, so the last interval is shorter
        most = max(self.table.height_scale_max, _FLAT)
        return max(_FEWEST_STEPS, math.ceil(phase / _PHASE)), most

    def between(self, low: float, high: float) -> list[float]:
        """Height scales at even distances, as close together, for all between two."""
        steps, most = self._lattice
        first = max(math.floor(low * steps) / steps, _FLAT)
        last = min(math.ceil(high * steps) / steps, most)
        return np.linspace(first, last, 1 + max(1, math.ceil((last - first) * steps))).tolist()


@dataclass(frozen=True)
class Energy(_HeightScales):
    """Conserved energy of a table, a model and a material.

    Attributes
    ----------
    model, index, wavelength_range : as in `tables.energy.conservation`.
    """

    model: str
    index: Index
    wavelength_range: tuple[float, float]

    def at(self, height_scale: float) -> Conservation:
        """Conserve energy at a height scale: from memory, from disk, or computed."""
        probes = self.index(np.geomspace(*self.wavelength_range, _PROBES))
        made_of = [self.model, _rounded(probes), *self.wavelength_range]

        def make() -> list[DirectionalTable]:
            arguments = self.table, height_scale, self.model, self.index, self.wavelength_range
            found = conservation(*arguments)
            return [found.albedo] if found.scale is None else [found.albedo, found.scale]

        albedo, *scale = _kept("energy", self.table, [height_scale, made_of], make)
        return Conservation(albedo, scale[0] if scale else None)


@dataclass(frozen=True)
class SidesEnergy(_HeightScales):
    """Conserved energy of a table and a dielectric that lets light through."""

    medium: Medium
    wavelength_range: tuple[float, float]

    def at(self, height_scale: float) -> list[DirectionalTable]:
        """`Sides.scale` from memory, from disk, or computed; empty where it is None."""

        def make() -> list[DirectionalTable]:
            return Sides(self.table, height_scale, self.medium).scale(self.wavelength_range) or []

        made_of = [height_scale, *astuple(self.medium), *self.wavelength_range]
        return _kept("sides", self.table, made_of, make)


def mean_exponents(
    table: DiffractionTable, index: Index, wavelength_range: tuple[float, float]
) -> DirectionalTable:
    """`film.exponents`, from memory, from disk, or computed; arguments as of `Energy`."""
    made_of = [_rounded(index(np.geomspace(*wavelength_range, _PROBES))), *wavelength_range]
    exponents = (film.STEP, film.MOST)

    def make() -> list[DirectionalTable]:
        return [film.exponents(table.roughness, index, wavelength_range)]

    return _kept("film", table, [*exponents, *made_of], make)[0]


def _kept(
    kind: str,
    table: DiffractionTable,
    made_of: list[Any],
    make: Callable[[], list[DirectionalTable]],
) -> list[DirectionalTable]:
    """Tables of directions, by all that they are made of."""
    versions = VERSION, mean_second_order.VERSION, STRONG, MOST_STRONG, astuple(energy_settings())
    key = key_of(kind, versions, table.digest(), made_of)
    return kept(kind, key, _known.setdefault(table, {}), make, _record, _tables)


def _rounded(index: NDArray[np.complex128] | Filmed | None) -> list[str] | None:
    """Single precision's noise makes no other material."""
    if index is None:
        return None
    if isinstance(index, Filmed):
        index = np.concatenate([np.ravel(part) for part in index.parts])
    return [f"{n.real:.5g} {n.imag:.5g}" for n in index]


def _record(tables: list[DirectionalTable]) -> Record:
    return Record(
        [table.wavelengths.tolist() for table in tables], [table.values for table in tables]
    )


def _tables(record: Record) -> list[DirectionalTable]:
    tables = []
    for wavelengths, values in zip(record.document, record.arrays, strict=True):
        if values.ndim != 3 or len(values) != len(wavelengths) or not np.isfinite(values).all():
            raise ValueError(f"values of shape {values.shape}")
        tables.append(DirectionalTable(np.array(wavelengths, float), values))
    return tables
