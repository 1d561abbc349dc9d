"""Scales that conserve energy, in the cache, by what they are made of."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from ...optics import mean_second_order
from ..height_scales import HeightScales
from ..order_mixture import MOST_STRONG, STRONG
from ..store import Record, cached, key_of
from ..table import DiffractionTable
from .conservation import Conservation, Surface
from .grid import DirectionalTable
from .materials import Dielectric, Reflector
from .settings import VERSION, energy_settings

#: Tables of directions by name.
DirectionalTables = dict[str, DirectionalTable]

_known: weakref.WeakKeyDictionary[DiffractionTable, dict[str, DirectionalTables]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True)
class Energy(HeightScales):
    """Conserved energy of a table of a material, at any height scale.

    Attributes
    ----------
    material : a reflector, or a dielectric that lets light through.
    wavelength_range : nm; its ends may be one.
    """

    material: Reflector | Dielectric
    wavelength_range: tuple[float, float]

    def at(self, height_scale: float) -> Conservation:
        """Conserve energy at a height scale: from memory, from disk, or computed."""

        def make() -> DirectionalTables:
            surface = Surface(self.table, self.material, height_scale)
            conservation = surface.conservation(self.wavelength_range)
            return {name: table for name, table in vars(conservation).items() if table is not None}

        key = self.material.key(self.wavelength_range)
        made_of = [height_scale, *key, *self.wavelength_range]
        return Conservation(**cached_directions("energy", self.table, made_of, make))


def cached_directions(
    kind: str, table: DiffractionTable, made_of: list[Any], make: Callable[[], DirectionalTables]
) -> DirectionalTables:
    """Return tables of directions by all that they are made of: from memory, disk, or made."""
    versions = VERSION, mean_second_order.VERSION, STRONG, MOST_STRONG, astuple(energy_settings())
    key = key_of(kind, versions, table.digest(), made_of)
    return cached(kind, key, _known.setdefault(table, {}), make, record, tables)


def record(pages: DirectionalTables) -> Record:
    """Pack tables of directions for the cache."""
    wavelengths = {name: table.wavelengths.tolist() for name, table in pages.items()}
    return Record(wavelengths, [table.values for table in pages.values()])


def tables(record: Record) -> DirectionalTables:
    """Unpack tables of directions, and check them."""
    pages = {}
    for (name, wavelengths), values in zip(record.document.items(), record.arrays, strict=True):
        if values.ndim != 3 or len(values) != len(wavelengths) or not np.isfinite(values).all():
            raise ValueError(
                f"directional table of shape {values.shape}; expected (wavelengths, polar, "
                "azimuthal), finite"
            )
        pages[name] = DirectionalTable(np.array(wavelengths, float), values)
    return pages
