"""Energy conservation: scales of directions by which no more light is sent on than comes in.

docs/energy.md has the equations. All light from ωi to ωo is multiplied by s(ωi) s(ωo): such that
R + T is 1 on both sides of a dielectric that lets light through, and of a reflector where its
albedo exceeds 1. Between the grid's directions and wavelengths an order may appear or vanish (a
Rayleigh anomaly), so s is lowered last where light between them exceeds 1: there the sum over all
light is at most `EnergySettings.ceiling`, whatever surface and material it belongs to. No scale
exists where a direction's partners all gain and it does not, as between the two groups of
directions of a blazed grating: s is a compromise then.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable
from dataclasses import astuple, dataclass
from functools import partial
from typing import Any

import numpy as np

from ...arrays import Real, Single
from ...digests import key_of
from ...optics.geometry import LAST_ANGLE
from ...optics.paths import Path
from ..directional import DirectionalTable, DirectionGrid, LinearMap
from ..order_mixture import MOST_STRONG, STRONG
from ..store import Record, cached
from ..table import DiffractionTable
from .conserved import Reflector, Transmitter
from .gain import thick
from .scaling import lowered, parallel, scaled, weighted
from .settings import VERSION, energy_settings
from .transport import ScatteredOrders, Transport

#: Polar angles beyond the grid of directions. Towards the horizon a gaining albedo rises as
#: 1/cosθ or faster, and the plugin attenuates scaled light.
GRAZING = np.radians([89.8, 89.9])
#: Sine of the last critical angle that matters.
_LAST_SINE = math.sin(LAST_ANGLE)
#: Largest error of an index, which the plugin rounds, and the same as a share of its contrast.
_INDEX_ERROR, _CONTRAST_ERROR = 1e-3, 0.125
#: Least jump of the light sent on at a critical angle that a scale does not follow.
_JUMP = 0.01
#: Height scales are n/steps: this phase (rad) changes at most in between. The power of an order
#: bends by a fiftieth then, and by less at grazing angles, where there is most to take.
_PHASE = 0.8
_FEWEST_STEPS = 4
#: As good as no heights at all.
_FLAT = 1e-3
#: Height scales whose orders are kept: those on both sides of an optimised one.
_KEPT = 2


@dataclass(frozen=True)
class Conservation:
    """Albedo of a model, and scales of directions that conserve energy, None where they are 1.

    Attributes
    ----------
    albedo : albedo a of a reflector, without a scale.
    scale, scale_below : s of directions above the surface, and below one that lets light through.
    """

    albedo: DirectionalTable | None = None
    scale: DirectionalTable | None = None
    scale_below: DirectionalTable | None = None

    @property
    def scales(self) -> list[DirectionalTable] | None:
        """Scales of the sides that the surface has light on, or None where all are 1."""
        return [side for side in (self.scale, self.scale_below) if side is not None] or None

    def to_record(self) -> Record:
        """Return the record of the functions for the cache."""
        found = {name: table for name, table in vars(self).items() if table is not None}
        wavelengths = {name: table.wavelengths.tolist() for name, table in found.items()}
        return Record(wavelengths, [table.values for table in found.values()])

    @classmethod
    def from_record(cls, record: Record) -> Conservation:
        """Return the functions of such a record."""
        pairs = zip(record.document.items(), record.arrays, strict=True)
        return cls(**{name: DirectionalTable(np.array(lam), a) for (name, lam), a in pairs})


_known: weakref.WeakKeyDictionary[DiffractionTable, dict[str, Conservation]] = (
    weakref.WeakKeyDictionary()
)


_scattered_orders: weakref.WeakKeyDictionary[DiffractionTable, dict[object, ScatteredOrders]] = (
    weakref.WeakKeyDictionary()
)


def _scattered(table: DiffractionTable, *arguments: Any) -> ScatteredOrders:
    """Return a table's orders, the last `_KEPT` from memory: they are the same for all materials.

    arguments : further ones of `ScatteredOrders`.
    """
    kept = _scattered_orders.setdefault(table, {})
    key = arguments, energy_settings()
    found = kept.pop(key, None) or ScatteredOrders(table, *arguments)
    kept[key] = found
    for old in list(kept)[:-_KEPT]:
        kept.pop(old, None)
    return found


@dataclass(frozen=True)
class ScatteredLight:
    """Light of one wavelength that a surface sends on from directions (t, p) of each side.

    Sums have the shape (sides, t, p), weights and scales (sides, polar + 1, azimuthal).

    Attributes
    ----------
    paths : of the light.
    here : interpolation from the grid of the weights to the directions.
    """

    paths: list[Transport]
    here: LinearMap

    def sums(self, weights: Single) -> Single:
        """Return the light of all orders for weights."""
        sums = np.zeros((1 + self.paths[-1].came, *self.here.shape), np.float32)
        for path in self.paths:
            sums[path.came] += path(weights[path.left])
        return sums

    def sent(self, s: Single) -> Single:
        """Return the light of all orders, scaled by s at both ends."""
        return self.at_directions(s) * self.sums(s)

    def at_directions(self, scale: Single) -> Single:
        """Interpolate a scale to the directions, (sides, t, p)."""
        return np.stack([self.here(side) for side in scale])


class SurfaceEnergy:
    """A table's surface of a material at one height scale.

    Parameters
    ----------
    wavelength_range : of the light, nm; that of the table by default.
    """

    def __init__(
        self,
        table: DiffractionTable,
        material: Reflector | Transmitter,
        height_scale: float = 1.0,
        wavelength_range: tuple[float, float] | None = None,
    ) -> None:
        self.material, finer = material, 1
        self._settings = settings = energy_settings()
        self._both_sides = isinstance(material, Transmitter)
        if isinstance(material, Reflector):
            finer += thick(material.index(np.array(table.wavelength_range[:1])))
        light = wavelength_range or table.wavelength_range
        self.orders = _scattered(table, light, height_scale, material.densest, finer)
        polar = settings.side_polar if self._both_sides else settings.polar
        self._grid = DirectionGrid(polar, settings.azimuthal)
        self._ones = np.stack([self._grid.ones] * (2 if self._both_sides else 1))

    def conservation(
        self, wavelength_range: tuple[float, float], beneath: bool = False
    ) -> Conservation:
        """Conserve energy over a range of wavelengths (nm), whose ends may be one: seconds.

        beneath : whether the albedo of a reflector follows a film's fringes.
        """
        settings, grid = self._settings, self._grid
        albedo, largest = None, math.inf
        fringes = math.ceil(self.material.phase(wavelength_range) / settings.fringe_step)
        most_fringes = min(fringes, settings.fringes)
        if not self._both_sides:
            albedo, largest = self._albedo(wavelength_range, beneath, most_fringes)
        if largest <= max(settings.threshold, 1.0 - self.orders.others):
            return Conservation(albedo)
        count = settings.side_wavelengths if self._both_sides else settings.wavelengths
        nodes = spread(wavelength_range, count, max(most_fringes, min(count, 4)))
        lights = self._lights(nodes, self._polar_angles(nodes), grid.phi)
        s = np.stack(parallel(lambda light: self._solved(light()), lights))
        few = 0 < self.orders.strong <= settings.few_orders
        parts = (settings.side_parts if self._both_sides else settings.parts)[few]
        # waves are closer than orders need where a film has fringes
        places = settings.between[few and fringes <= count and not self._both_sides]
        calm = 0.0 if self._both_sides else settings.calm[few]  # all light is sent on: never calm
        for place in places if len(nodes) > 1 else (0.0,):
            self._lower_between(nodes, place, parts, calm, s)

        # light beyond the grid is attenuated wherever there is a scale
        if np.all(s == 1.0) and (self._both_sides or largest <= settings.ceiling):
            return Conservation(albedo)
        return Conservation(albedo, *(DirectionalTable(nodes, s[:, n]) for n in range(s.shape[1])))

    def albedos(
        self, conservation: Conservation, theta: Real, phi: Real, wavelength: float
    ) -> tuple[Single, Single]:
        """Return the light sent on as it is and conserved, (sides, t, p) each, at angles (rad).

        Exact sums at these directions and a wavelength (nm), not the grid's, as a furnace measures
        them.
        """
        (make_light,) = self._lights(np.array([wavelength]), theta, phi)
        light = make_light()

        scales, before = conservation.scales, light.sent(self._ones)
        if scales is None:
            return before, before
        return before, light.sent(np.stack([side.page(wavelength) for side in scales]))

    def _lights(
        self, wavelengths: Real, theta: Real, phi: Real
    ) -> list[Callable[[], ScatteredLight]]:
        """Makers of the light of wavelengths (nm) from polar angles (t,) and azimuths (p,), rad.

        Light is made when it is needed: it takes up to 100 MB.
        """
        here = self._grid.interpolation(theta[:, None], phi)

        def make(paths: list[Path], wavelength: float) -> ScatteredLight:
            directions = theta, phi, self._grid
            sent = [Transport(self.orders, path, wavelength, *directions) for path in paths]
            return ScatteredLight(sent, here)

        paths = self.material.paths(wavelengths, self.orders.least_width)
        return [partial(make, *both) for both in zip(paths, wavelengths.tolist(), strict=True)]

    def _albedo(
        self, wavelength_range: tuple[float, float], beneath: bool, fringes: int
    ) -> tuple[DirectionalTable, float]:
        """Return the albedo of a reflector as it is, and its largest value up to the horizon.

        It has fewer directions than its scale, and fewer wavelengths. Of light that goes on beneath
        it has a wavelength for each of a film's `fringes` at least, and more polar angles where
        light is totally reflected: the albedo rises to 1 there within half a lobe.
        """
        coarse = self._grid.half
        wavelengths = albedo_wavelengths(wavelength_range, fringes if beneath else 0)
        if (
            beneath
            and isinstance(self.material, Reflector)
            and self.material.total(self.material.index(wavelengths))
        ):
            coarse = DirectionGrid(self._settings.total_polar, coarse.azimuthal)
        theta = np.concatenate([coarse.theta, GRAZING])
        lights = self._lights(wavelengths, theta, coarse.phi)
        albedos = np.stack(parallel(lambda light: light().sent(self._ones)[0], lights))
        table = DirectionalTable(wavelengths, albedos[:, : len(coarse.theta)])
        return table, float(albedos.max())

    def _polar_angles(self, wavelengths: Real) -> Real:
        """Return polar angles that s is found at: the grid's, but about a critical angle.

        The light of an interface jumps there, and s is interpolated. The rows around have s of the
        side that sends more on: light of the other side is attenuated between them.
        """
        theta, paths = np.array(self._grid.theta), self.material.paths(wavelengths[:1], 0.0)[0]
        total = min(paths, key=lambda path: path.critical_sine)
        critical, sine = math.asin(total.critical_sine), total.critical_sine
        if not self._both_sides or sine > _LAST_SINE:
            return theta
        about = min(_INDEX_ERROR, _CONTRAST_ERROR * (1.0 - sine)) / math.sqrt(1.0 - sine**2)
        sides = np.array([critical - about, critical + about])
        (make_light,) = self._lights(wavelengths[:1], sides, self._grid.phi)
        within, beyond = make_light().sent(self._ones)[total.came.number].max(axis=1)
        if abs(within - beyond) > _JUMP:
            first, last = self._grid.row(sides)
            around = slice(math.floor(first), math.ceil(last) + 1)
            theta[around] = sides[int(beyond > within)]
        return theta

    def _solved(self, light: ScatteredLight) -> Single:
        """Find s at the grid's directions."""
        settings = self._settings
        albedo = light.sent(self._ones)
        # order 0 is as smooth as the reflectance: between directions it needs no margin
        target = np.float32(max(settings.target, 1.0 - self.orders.others))
        aim = self._ones if self._both_sides else np.minimum(albedo, target)
        if np.abs(albedo - aim).max() < settings.close:
            return self._ones
        # Beyond 80° part of a lobe is below the horizon. A reflector keeps that deficit: light that
        # is scaled up would reach across directions of very different s. A dielectric loses none
        end = settings.largest if self._both_sides else 1.0
        largest = np.interp(np.degrees(self._grid.theta), (70.0, 80.0), (settings.largest, end))
        return scaled(light.sums, aim, largest[:, None], settings.sweeps)

    def _lower_between(self, nodes: Real, place: float, parts: int, calm: float, s: Single) -> None:
        """Lower s for light at a place between all neighbouring wavelengths.

        calm : see `EnergySettings`; 0 for a close look at all light.
        """
        between = nodes[:-1] ** (1.0 - place) * nodes[1:] ** place if len(nodes) > 1 else nodes
        few = self._lights(between, *self._grid.half.middles(1))
        lights = self._lights(between, *self._grid.middles(parts))
        ceiling, passes = np.float32(self._settings.ceiling), self._settings.passes
        shares = np.array([1.0 - place, place])[: len(nodes)]

        def lower(n: int) -> None:
            pair = slice(n, n + 2)
            if calm and few[n]().sent(weighted(s[pair], shares)).max() <= calm:
                return
            light = lights[n]()
            s[pair] = lowered(s[pair], shares, lambda s: light.sent(s) / ceiling, passes)

        for first in (0, 1):  # every other pair at a time: neighbours share a wavelength
            parallel(lower, range(first, len(between), 2))


def albedo_wavelengths(wavelength_range: tuple[float, float], least: int = 2) -> Real:
    """Wavelengths (nm) of a reflector's albedo over a range, `least` or more."""
    count = max(4, energy_settings().wavelengths // 4)
    return spread(wavelength_range, count, max(least, 2))


def spread(wavelength_range: tuple[float, float], count: int, least: int = 2) -> Real:
    """Wavelengths (nm) evenly in their logarithm, `count` in an octave, or the only one.

    All visible light, of 1.2 octaves, has `count`; ranges of stretched patches have more.
    """
    low, high = wavelength_range
    octaves = math.log2(high / low)
    count = max(math.ceil(count * max(min(octaves, 1.0), octaves / 1.25)), least)
    return np.geomspace(low, high, count if high > low else 1)


@dataclass(frozen=True)
class Energy:
    """Conserved energy of a table of a material, at any height scale.

    Attributes
    ----------
    table : of the surface.
    material : a reflector, or a dielectric that lets light through.
    wavelength_range : nm; its ends may be one.
    stretch : least factor on lengths. A patch stretched by it is looked up with heights divided by
        it, in light of wavelengths divided by it.
    beneath : whether the albedo follows fringes of a film, for light that goes on beneath.
    """

    table: DiffractionTable
    material: Reflector | Transmitter
    wavelength_range: tuple[float, float]
    stretch: float = 1.0
    beneath: bool = False

    def nodes(self, low: float, high: float, *, interval: bool = False) -> list[float]:
        """Return even height scales around all from low to high, for which something is made.

        1 is in their lattice, which is so close that an order's power bends little in between. An
        optimisation of the heights thus sees a continuous scale with derivatives, and waits only
        where it enters an interval that nobody has been in before. There are two scales at least,
        equal where one will do.

        interval : two that differ even if a single scale is at one, for derivatives.
        """
        phase = 2.0 * self.table.q_limit * self.table.expansion.half_range
        steps = max(_FEWEST_STEPS, math.ceil(phase / _PHASE))
        # Beyond the table's own limit nothing can be looked up, so the last interval is shorter;
        # κ of a stretched patch stays within the table
        most = max(self.table.height_scale_max / self.stretch, _FLAT)
        # of scales in single precision
        first = min(math.floor(low * steps + 1e-4), math.ceil(most * steps - 1e-4) - 1)
        last = max(math.ceil(high * steps - 1e-4), first + interval)
        start, end = (min(max(n / steps, _FLAT), most) for n in (first, last))
        return np.linspace(start, end, 1 + max(1, last - first)).tolist()

    def at(self, height_scale: float) -> Conservation:
        """Conserve energy at a height scale: from memory, from disk, or computed."""

        def make() -> Conservation:
            light = self.wavelength_range
            surface = SurfaceEnergy(self.table, self.material, height_scale, light)
            return surface.conservation(light, self.beneath)

        versions = VERSION, STRONG, MOST_STRONG
        limits, material = astuple(energy_settings()), self.material.key(self.wavelength_range)
        made_of = versions, limits, height_scale, material, self.wavelength_range, self.beneath
        key, memory = key_of(self.table.digest(), made_of), _known.setdefault(self.table, {})
        both_ways = Conservation.to_record, Conservation.from_record
        return cached("energy", key, memory, make, *both_ways)
