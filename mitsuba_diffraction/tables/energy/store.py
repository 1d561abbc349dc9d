"""What conserves energy, kept by what it is made of: a second's work, a file of a megabyte."""

from __future__ import annotations

import math
import weakref
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics import mean_second_order
from ...optics.fresnel import Filmed
from ..sampling import MOST_STRONG, STRONG
from ..store import Record, kept, key_of
from ..table import DiffractionTable
from . import between, chains, film, fit, gain, grating, links, sheet, sides, sums, transport
from . import conservation as made
from .conservation import Conservation, DirectionalTable, Index, conservation
from .grating import Grating
from .grid import LAST_ANGLE
from .links import Medium

#: Raised whenever the computation changes.
VERSION = 14

#: Height scales are n/steps: this phase (rad) changes at most in between. The power of an order
#: bends by a fiftieth then, and by less at grazing angles, where there is most to take.
_PHASE = 0.8
_FEWEST_STEPS = 4
#: As good as no heights at all.
_FLAT = 1e-3
#: Wavelengths at which a material is told from another.
_PROBES = 24

_SETTINGS = (
    VERSION, str(made.FINE), str(made.COARSE), str(made.SCALE), made.COARSE_WAVELENGTHS,
    made.TARGET, made.LARGEST, made.ACROSS, made.ALONG, made.EVEN, made.NODES,
    made.MOST_NODES, made.SPIKES_ROWS, made.TRACK_ROWS, made.WAVELENGTHS, made.FILM_WAVELENGTHS,
    chains.GIVEN,
    *(fit.TOLERANCE, fit.LEAST, fit.MOST, fit.GAINS, fit.GRAZING, fit.LESS, fit.FADED, fit.GENTLE),
    fit.FEW, str(fit.FEW_ORDERS), str(fit.MANY_ORDERS), str(fit.SPIKES), grating.DENSE,
    grating.NODES, grating.LAST_NODE, grating.ENDS, grating.MOST_UNITS,
    gain.POLAR_NODES, gain.AZIMUTH_NODES, gain.GRAZING,
    transport.RINGS, transport.STEPS, transport.SMOOTHING,
    transport.LEAST_WEAK, STRONG, MOST_STRONG, LAST_ANGLE,
)  # fmt: skip

_SIDES = (
    *_SETTINGS, str(sides.SHEET), str(sides.DENSE), str(sides.FINER), sides.WAVELENGTHS,
    sides.NARROW,
    sides.PLACES, sides.MOST_UNITS, sides.EARLIER,
    sums.SWEEPS, sums.LEAST, sums.AIM, sums.MOST, sums.TOLERATED, sums.ENOUGH,
    sums.STRONGEST, sums.FAINT, sums.FALL, sums.BETWEEN, sums.MARGIN, sums.LinkedSums.certain,
    between.CEILING, between.FLOOR, between.GENTLE, between.MOST, between.LOOKED_AT, between.FALLS,
    between.FAR, between.FEW, sides.NODES_OF_INTEGRALS, sheet.ChainSides.certain,
    sheet.POLAR, links.POLAR, links.AZIMUTHS, links.FARTHEST,
)  # fmt: skip

_known: weakref.WeakKeyDictionary[DiffractionTable, dict[str, Conservation]] = (
    weakref.WeakKeyDictionary()
)
_known_means: weakref.WeakKeyDictionary[DiffractionTable, dict[str, DirectionalTable]] = (
    weakref.WeakKeyDictionary()
)
_known_sides: weakref.WeakKeyDictionary[DiffractionTable, dict[str, list[DirectionalTable]]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True)
class _HeightScales:
    """Height scales of a table for which something is made when asked for.

    Attributes
    ----------
    table : the table.
    """

    table: DiffractionTable

    def nodes(self, height_scale: float, *, interval: bool = False) -> tuple[float, float]:
        """The two height scales around one, for which something is made; equal at a node.

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
    """Of a table, a model and a material.

    Attributes
    ----------
    model, index, wavelength_range : as in `tables.energy.conservation`.
    """

    model: str
    index: Index
    wavelength_range: tuple[float, float]

    def at(self, height_scale: float) -> Conservation:
        """From memory, from disk, or computed."""
        probes = np.geomspace(*self.wavelength_range, _PROBES)
        found = self.index(probes)
        indices = None if found is None else _rounded(found)
        material: list[object] = [self.model, indices, list(self.wavelength_range)]
        if isinstance(found, Filmed):
            material.append(mean_second_order.VERSION)
        return kept(
            "energy",
            key_of(_SETTINGS, self.table.digest(), height_scale, material),
            _known.setdefault(self.table, {}),
            lambda: conservation(
                self.table, height_scale, self.model, self.index, self.wavelength_range
            ),
            _record,
            _conservation,
        )


@dataclass(frozen=True)
class SidesEnergy(_HeightScales):
    """Of a table and a dielectric that lets light through."""

    medium: Medium
    wavelength_range: tuple[float, float]

    def at(self, height_scale: float) -> list[DirectionalTable]:
        """`Sides.scale` from memory, from disk, or computed; empty where it is None."""
        given = [str(self.medium), list(self.wavelength_range)]
        return kept(
            "sides",
            key_of(_SIDES, self.table.digest(), height_scale, given),
            _known_sides.setdefault(self.table, {}),
            lambda: (
                sides.Sides(self.table, height_scale, self.medium).scale(self.wavelength_range)
                or []
            ),
            _packed,
            _tables,
        )


def mean_exponents(
    table: DiffractionTable, index: Index, wavelength_range: tuple[float, float]
) -> DirectionalTable:
    """`film.exponents`, kept likewise; arguments as of `Energy`."""
    found = index(np.geomspace(*wavelength_range, _PROBES))
    assert isinstance(found, Filmed)
    given = [
        mean_second_order.VERSION,
        film.STEP,
        film.MOST,
        _rounded(found),
        list(wavelength_range),
    ]
    return kept(
        "film",
        key_of(_SETTINGS, table.digest(), 1.0, given),
        _known_means.setdefault(table, {}),
        lambda: film.exponents(table.roughness, index, wavelength_range),
        lambda made: _packed([made]),
        lambda record: _tables(record)[0],
    )


def _rounded(index: NDArray[np.complex128] | Filmed) -> list[str]:
    """Single precision's noise makes no other material."""
    if isinstance(index, Filmed):
        index = np.concatenate([np.ravel(part) for part in index.parts])
    return [f"{n.real:.5g} {n.imag:.5g}" for n in index]


def _record(found: Conservation) -> Record:
    return _packed([found.albedo] if found.scale is None else [found.albedo, found.scale])


def _conservation(record: Record) -> Conservation:
    tables = _tables(record)
    return Conservation(tables[0], tables[1] if len(tables) > 1 else None)


def _packed(tables: list[DirectionalTable]) -> Record:
    document = [
        [table.wavelengths.tolist(), table.grating and list(astuple(table.grating))]
        for table in tables
    ]
    return Record(document, [table.values for table in tables])


def _tables(record: Record) -> list[DirectionalTable]:
    tables = []
    for (wavelengths, line), values in zip(record.document, record.arrays, strict=True):
        if values.ndim != 3 or len(values) != len(wavelengths) or not np.isfinite(values).all():
            raise ValueError(f"values of shape {values.shape}")
        grating = Grating((line[0][0], line[0][1]), *line[1:]) if line else None
        tables.append(DirectionalTable(np.array(wavelengths, float), values, grating))
    return tables
