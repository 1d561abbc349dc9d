"""Light of a picture by table, spatial frequency, κ and wavelength: a derivative of its brightness.

While the picture is rendered, the light of a surface has a factor of 1 for each bin of a quantity.
The derivative of the picture's brightness by the factor is the light that the bin adds to the
picture, on all paths. Light that several surfaces reflect counts at each of them.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...arrays import Real
from ...errors import DiffractionError
from ...optics.colour import linear_srgb
from ...plugin.description import Surface, describe
from ...plugin.directions import Pair, Site
from ...plugin.memory import tensor, upload
from ...plugin.types import BSDF, Context, Float, Mask, Powers, Spectrum
from ...tables import DiffractionTable, TableRequest, providing
from ..elements import own_id, parts_of
from ..load import shrink

Load = Callable[[], Any]

#: Longest paths that are followed, vertices and camera included.
MOST_BOUNCES = 12
#: The brightest pixels count no more than this percentile of those with light. A display shows
#: mirror images of the sun as mere white, but their light would outweigh all other.
BRIGHTEST = 99.0
#: Bins along either axis of frequency, and of κ.
BINS = 256
#: Ends of bins of wavelength, nm.
WAVELENGTHS = np.arange(360.0, 831.0)
# Pixels of the rendered picture, at most; paths share them.
_PIXELS = 1 << 12
# Pixels in which the turn of ωi is looked at.
_PAIRS = 1 << 12


@dataclass(frozen=True)
class TableLight:
    """Light that the surfaces of one table add to a picture, whose light is 1.

    Attributes
    ----------
    request : the heights and settings, as the scene has them.
    table : of all orders.
    surfaces : names of the BSDFs that look it up.
    total : light of these surfaces, nested BSDFs included.
    frequency : (BINS, BINS) light by |β| and |α|, of even bins up to the table's `q_limit`.
    kappa : (BINS,) light by κ, of even bins up to the table's largest.
    wavelength : (470,) light between `WAVELENGTHS`.
    lobe_turn : median of how far ωi turns within a pixel, in direction cosines, the largest of the
        surfaces'; NaN where the camera sees none.
    """

    request: TableRequest
    table: DiffractionTable
    surfaces: tuple[str, ...]
    total: float
    frequency: Real
    kappa: Real
    wavelength: Real
    lobe_turn: float

    @property
    def share(self) -> float:
        """Share of the surfaces' light that is diffracted."""
        return float(self.frequency.sum()) / self.total if self.total > 0.0 else 0.0

    @property
    def edges(self) -> tuple[Real, Real]:
        """Upper ends (BINS,), (BINS, 1) of the bins along |α| and |β|, rad/µm."""
        ends = self.table.q_limit / BINS * np.arange(1.0, BINS + 1.0)
        return ends, ends[:, None]


class _Factors:
    """Factors of 1 on the light of all surfaces that share a table."""

    def __init__(self, request: TableRequest, table: DiffractionTable) -> None:
        self.request, self.table = request, table
        self.surfaces: dict[str, None] = {}
        self.shapes: list[Any] = []
        counts = BINS**2, BINS, len(WAVELENGTHS) - 1, 1
        # by frequency, κ and wavelength, and on all light
        self.all = [dr.ones(mi.Float, count) for count in counts]
        dr.enable_grad(self.all)

    @contextlib.contextmanager
    def on(self, bsdf: BSDF) -> Iterator[None]:
        """Multiply the light of a BSDF by the factors inside."""
        light, evaluated, (*parts, whole) = bsdf.light, bsdf.evaluated, self.all

        def weighed(ctx: Context, site: Site, pair: Pair, power: Powers, active: Mask) -> Spectrum:
            factor = mi.UnpolarizedSpectrum(1.0)
            for n, bins in enumerate(self._bins(site, pair)):
                for part, number in zip(parts, bins, strict=True):
                    factor[n] *= dr.gather(mi.Float, part, number)
            return light(ctx, site, pair, power, active) * mi.Spectrum(factor)

        def all_light(*asked: Any) -> tuple[Spectrum, Float]:
            value, density = evaluated(*asked)
            return value * dr.gather(mi.Float, whole, mi.UInt32(0)), density

        bsdf.light, bsdf.evaluated = weighed, all_light
        try:
            yield
        finally:
            del bsdf.light, bsdf.evaluated

    def _bins(self, site: Site, pair: Pair) -> Iterator[tuple[Any, Any, Any]]:
        """Yield the bins of frequency, κ and wavelength of each channel."""
        q_limit, kappa_max = self.table.q_limit, self.table.expansion.kappa_max
        for k in site.wavenumbers:
            x, y = (_bin(dr.abs(k * part), q_limit, BINS) for part in pair.uv)
            kappa = _bin(k * pair.w * site.scale, kappa_max, BINS)
            nm = 2e3 * dr.pi / k - float(WAVELENGTHS[0])
            yield y * BINS + x, kappa, _bin(nm, len(WAVELENGTHS) - 1, len(WAVELENGTHS) - 1)


def _bin(value: Float, end: float, count: int) -> Any:
    """Return the number of a value's bin among even ones from 0 to the end."""
    return mi.UInt32(dr.clip(value * (count / end), 0.0, count - 1.0))


def light_of_tables(load: Load, sensor: Callable[[Any], Any], paths: int) -> list[TableLight]:
    """Load a scene and render it; return the light of each table, in the order of loading.

    load : loads the scene in the variant that is set, `llvm_ad_spectral` or `cuda_ad_spectral`.
    sensor : returns the sensor of the loaded scene.
    paths : number of paths, about.

    Raises a DiffractionError if no surface diffracts, none has a table of heights, or no path
    carries light of one.
    """
    made: list[_Factors] = []

    def table_of(request: TableRequest) -> DiffractionTable:
        table = request.cached(request.settings)
        if not any(each.table is table for each in made):
            made.append(_Factors(request, table))
        return table

    with providing(table_of):
        scene = load()
    bsdfs = _surfaces(scene, made)
    names = ", ".join(sorted({name for name, _ in bsdfs.values()}))
    if not bsdfs:
        raise DiffractionError(
            "the scene has no BSDF 'diffraction'; there is nothing to plan, render it as it is"
        )
    if not made:
        raise DiffractionError(
            f"the tables of {names} come from files and stay as they are; give the scene "
            "the height field, or its recipe, to have smaller ones planned"
        )
    with contextlib.ExitStack() as stack:
        for factors in made:
            for _, bsdf in bsdfs.values():
                if bsdf.table is factors.table:
                    stack.enter_context(factors.on(bsdf))
        view = sensor(scene)
        turns = _turns(scene, view)
        _render(scene, view, paths, made)
    found = [_light_of(each, turns) for each in made]
    if not any(each.share for each in found):
        raise DiffractionError(
            f"none of {paths} paths carries light of a surface that diffracts "
            f"({names}): the camera does not see it lit; check camera and lights, or raise paths"
        )
    return found


def _surfaces(scene: Any, made: list[_Factors]) -> dict[int, tuple[str, BSDF]]:
    """Return all BSDFs `diffraction` of a scene, with their names; note those of each table."""
    found: dict[int, tuple[str, BSDF]] = {}
    for shape in scene.shapes():
        for part in parts_of(shape.bsdf()):
            described = describe(part)
            if isinstance(described, Surface) and not (described.solved or described.transmits):
                heights = described.patch.source.get("name") or "heights without a name"
                name = own_id(part.id()) or f"a diffraction BSDF without id (of {heights})"
                found[id(part)] = name, part
                for each in made:
                    if each.table is part.table:
                        each.surfaces[name] = None
                        each.shapes.append(shape)
    return found


def _render(scene: Any, sensor: Any, paths: int, made: list[_Factors]) -> None:
    """Compute the derivative of the picture's brightness by all factors.

    Raises a DiffractionError if the picture is black.
    """
    pixels = int(np.prod(sensor.film().crop_size()))
    shrink(sensor, max(1.0, (pixels / _PIXELS) ** 0.5))
    spp = max(1, round(paths / int(np.prod(sensor.film().crop_size()))))
    match = re.search(r"max_depth = (-?\d+)", str(scene.integrator()))
    depth = int(match[1]) if match else -1
    depth = MOST_BOUNCES if depth < 0 else min(max(depth, 1), MOST_BOUNCES)
    integrator: Any = mi.load_dict({"type": "prb", "max_depth": depth})
    picture = np.array(integrator.render(scene, sensor, seed=0, spp=spp), np.float64)
    weights = _brightness(sensor.film(), picture.shape[-1])
    brightness = np.maximum(picture @ weights, 0.0)
    if not (lit := brightness > 0.0).any():
        raise DiffractionError(
            f"none of {paths} paths through the scene carries light; check its camera and emitters"
        )
    most = np.percentile(brightness[lit], BRIGHTEST)
    clipped = np.minimum(1.0, np.divide(most, brightness, out=np.ones(lit.shape), where=lit))
    gradient = clipped[..., None] * weights / (clipped * brightness).sum()
    integrator.render_backward(
        scene, [each.all for each in made], tensor(gradient),
        sensor=sensor, seed=1, spp=spp,
    )  # fmt: skip


def _brightness(film: Any, channels: int) -> Real:
    """Return the weights (channels,) of a film's channels in X + Y + Z; of bands all are alike."""
    kind = film.bitmap().pixel_format().name
    if not kind.startswith(("RGB", "XYZ", "Y")):
        return np.ones(channels)
    rgb = np.linalg.inv(linear_srgb(np.eye(3))).sum(axis=1)
    weights = rgb if kind.startswith("RGB") else np.ones(3 if kind.startswith("XYZ") else 1)
    return np.concatenate([weights, np.zeros(channels - len(weights))])


def _light_of(factors: _Factors, turns: dict[int, float]) -> TableLight:
    """Return the light of a table by the derivatives of its factors."""
    frequency, kappa, wavelength, whole = (
        np.maximum(np.array(dr.grad(part), np.float64), 0.0) for part in factors.all
    )
    seen = [turns[number] for shape in factors.shapes if (number := _number(shape)) in turns]
    return TableLight(
        factors.request, factors.table, tuple(sorted(factors.surfaces)), float(whole[0]),
        frequency.reshape(BINS, BINS), kappa, wavelength, max(seen, default=float("nan")),
    )  # fmt: skip


def _number(shape: Any) -> int:
    """Return the number of a shape among those that kernels know."""
    return int(np.array(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape)))[0])


def _turns(scene: Any, sensor: Any) -> dict[int, float]:
    """Return the median of how far ωi turns between two places of a pixel, by number of the shape.

    The turn is in direction cosines.
    """
    film, rng = sensor.film(), np.random.default_rng(0)
    pixels = np.floor(rng.random((_PAIRS, 2)) * np.array(film.crop_size(), float))
    places = np.repeat(pixels + np.array(film.crop_offset(), float), 2, axis=0)
    places = (places + rng.random(places.shape)) / np.array(film.size(), float)
    place = mi.Point2f(*(upload(mi.Float, axis) for axis in places.T))
    ray, _ = sensor.sample_ray(0.0, mi.Float(0.5), place, mi.Point2f(0.5), mi.Mask(True))
    si = scene.ray_intersect(mi.Ray3f(ray))
    shape = np.array(dr.reinterpret_array(mi.UInt32, si.shape)).reshape(-1, 2)
    wi = np.stack([np.array(si.wi.x), np.array(si.wi.y)], axis=-1).reshape(-1, 2, 2)
    turned = np.hypot(*(wi[:, 0] - wi[:, 1]).T)
    same = shape[:, 0] == shape[:, 1]
    return {
        int(number): float(np.median(turned[same & (shape[:, 0] == number)]))
        for number in np.unique(shape[same])
    }
