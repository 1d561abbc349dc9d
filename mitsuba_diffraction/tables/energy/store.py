"""Scales that conserve energy, in the cache, by what they are made of."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics import mean_second_order
from ...optics.fresnel import Filmed
from ..height_scales import HeightScales
from ..order_mixture import MOST_STRONG, STRONG
from ..store import Record, cached, key_of
from ..table import DiffractionTable
from .conservation import Conservation, Index, Surface
from .grid import DirectionalTable
from .settings import VERSION, energy_settings
from .transmission import Medium, Sides
from .transport import Orders

#: Wavelengths at which a material is told from another.
PROBES = 24

_known: weakref.WeakKeyDictionary[DiffractionTable, dict[str, list[DirectionalTable]]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True)
class Energy(HeightScales):
    """Conserved energy of a table, a model and a material; attributes as of `Surface`."""

    model: str
    index: Index
    wavelength_range: tuple[float, float]

    def at(self, height_scale: float) -> Conservation:
        """Conserve energy at a height scale: from memory, from disk, or computed."""

        def make() -> list[DirectionalTable]:
            surface = Surface(Orders(self.table, height_scale), self.model, self.index)
            energy = surface.conservation(self.wavelength_range)
            return [energy.albedo] if energy.scale is None else [energy.albedo, energy.scale]

        index = rounded(self.index(np.geomspace(*self.wavelength_range, PROBES)))
        made_of = [height_scale, self.model, index, *self.wavelength_range]
        albedo, *scale = cached_directions("energy", self.table, made_of, make)
        return Conservation(albedo, scale[0] if scale else None)


@dataclass(frozen=True)
class SidesEnergy(HeightScales):
    """Conserved energy of a table and a dielectric that lets light through."""

    medium: Medium
    wavelength_range: tuple[float, float]

    def at(self, height_scale: float) -> list[DirectionalTable]:
        """`Sides.scale` from memory, from disk, or computed; empty where it is None."""

        def make() -> list[DirectionalTable]:
            return Sides(self.table, height_scale, self.medium).scale(self.wavelength_range) or []

        made_of = [height_scale, *astuple(self.medium), *self.wavelength_range]
        return cached_directions("sides", self.table, made_of, make)


def cached_directions(
    kind: str,
    table: DiffractionTable,
    made_of: list[Any],
    make: Callable[[], list[DirectionalTable]],
) -> list[DirectionalTable]:
    """Return tables of directions by all that they are made of: from memory, disk, or made."""
    versions = VERSION, mean_second_order.VERSION, STRONG, MOST_STRONG, astuple(energy_settings())
    key = key_of(kind, versions, table.digest(), made_of)
    return cached(kind, key, _known.setdefault(table, {}), make, record, tables)


def rounded(index: NDArray[np.complex128] | Filmed | None) -> list[str] | None:
    """Round indices to five digits: single precision's noise makes no other material."""
    if index is None:
        return None
    if isinstance(index, Filmed):
        index = np.concatenate([np.ravel(part) for part in index.parts])
    return [f"{n.real:.5g} {n.imag:.5g}" for n in index]


def record(pages: list[DirectionalTable]) -> Record:
    """Pack tables of directions for the cache."""
    return Record(
        [table.wavelengths.tolist() for table in pages], [table.values for table in pages]
    )


def tables(record: Record) -> list[DirectionalTable]:
    """Unpack and check them."""
    pages = []
    for wavelengths, values in zip(record.document, record.arrays, strict=True):
        if values.ndim != 3 or len(values) != len(wavelengths) or not np.isfinite(values).all():
            raise ValueError(
                f"directional table of shape {values.shape}; expected (wavelengths, polar, "
                "azimuthal), finite"
            )
        pages.append(DirectionalTable(np.array(wavelengths, float), values))
    return pages
