"""All emitters of a scene as a sequence of lights without extent, for light that is accumulated.

The direct light of a scene is an integral over all its emitters. Each frame draws one light of it
with the shadows that it casts, and the mean over frames converges to all direct light with soft
shadows (Haeberli and Akeley 1990, *The accumulation buffer*, section 4.4).

Which light that is: an emitter e is chosen with a probability p_e in proportion to what it brings
to the middle of the scene, and a place on it with a density p:

- directions, points and spots are lights without extent themselves;
- skies, suns and environment maps give a direction, drawn in proportion to their radiance, and its
  irradiance L/(p p_e), the same all over the scene;
- area lights give a place, even over their area, and its intensity L/(p p_e) along the normal,
  which falls with the cosine. So the estimate is right at every place of the scene, not only where
  it is drawn from.

The choice follows the golden ratio, the places on one emitter the plastic number (Roberts 2018):
both fill what they are drawn from evenly. Of each block of lights, the next is the one that brings
the mean so far nearest to the block's, by colour and by spherical harmonics of the direction up to
order 2, which is nearly all of what a matt surface sees (Chen, Welling and Smola 2010,
*Super-samples from kernel herding*; Ramamoorthi and Hanrahan 2001). So the first few lights look
like all of them.

What no light without extent shows are mirror images of lights with an extent: those are looked up
along the lobes of surfaces instead (`surroundings`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...plugin.properties import name_of
from .lights import Light, sampled_directions, sampled_positions, spectra_along, without_extent
from .surroundings import Environment, is_flat

Array = NDArray[np.float64]

_BLOCK = 256  # samples that an emitter draws at once
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
_OF_SUN = 0.625  # share of a sky's lights that lead to its sun
_EVEN = 0.1  # share of the choices for all emitters alike: some light other places than the middle


class Emitters:
    """A scene's emitters, and the lights that are drawn from them.

    middle : (3,) where their contributions are weighed against each other.

    Raises a DiffractionError if no emitter brings light.
    """

    def __init__(self, scene: Any, middle: Array) -> None:
        self.omissions: list[str] = []  # emitters of other kinds, in a few words each
        self._drawn: list[_Drawn] = []
        self._scene = scene  # area lights look their shapes up in it
        self._middle = middle
        self.environment = Environment.of(scene)
        brought = []
        for emitter in scene.emitters():
            drawn = _Drawn(emitter, middle, self.environment)
            if drawn.kind == "":
                self.omissions.append(f"{name_of(emitter)} ({emitter.class_name()})")
            elif (brings := drawn.irradiance()) > 0.0:
                self._drawn.append(drawn)
                brought.append(brings)
        if not brought:
            raise DiffractionError(
                "no emitter of the scene brings light to what diffracts; add one, or brighten it"
            )
        shares = np.array(brought) / sum(brought)
        # (n,) of each emitter that is drawn from
        self.probabilities = (1.0 - _EVEN) * shares + _EVEN / len(shares)

    def lights(self) -> Iterator[Light]:
        """One after another without end; the mean over them is all of the scene's direct light."""
        below = np.cumsum(self.probabilities)
        taken = [0] * len(self._drawn)
        for block in itertools.count():
            places = (0.5 + np.arange(block * _BLOCK, (block + 1) * _BLOCK) * _GOLDEN) % 1.0
            choices = np.minimum(np.searchsorted(below, places, side="right"), len(taken) - 1)
            found = []
            for chosen in choices:
                light = self._drawn[chosen].light(taken[chosen])
                share = float(self.probabilities[chosen])
                density = light.density * (share if light.density > 0.0 else 1.0)
                found.append(replace(light, spectrum=light.spectrum / share, density=density))
                taken[chosen] += 1
            for number in _nearest_to_mean(np.stack([self._features(one) for one in found])):
                yield found[number]

    def share_of(self, emitter: Any) -> float:
        """With what probability a light is drawn from an emitter that lobes look up as well.

        Of a sky with a sun, that of the sky alone.
        """
        found = [d.looked_up() if d.stands_for(emitter) else 0.0 for d in self._drawn]
        return float(self.probabilities @ np.array(found))

    def _features(self, light: Light) -> Array:
        """What a light brings to the middle, by colour and spherical harmonics, (27,)."""
        direction = light.place[:3] - light.place[3] * self._middle
        x, y, z = direction / max(float(np.linalg.norm(direction)), 1e-12)
        harmonics = [1.0, x, y, z, x * y, y * z, z * x, 0.5 * (x * x - y * y), z * z - 1.0 / 3.0]
        return np.outer(_colour_at(light, self._middle), harmonics).ravel()


def _nearest_to_mean(features: Array) -> list[int]:
    """An order of rows (n, m) in which the mean of the first few is near the mean of all."""
    mean, total = features.mean(axis=0), np.zeros(features.shape[1])
    left, order = list(range(len(features))), list[int]()
    while left:
        off = total + features[left] - (len(order) + 1) * mean
        chosen = left.pop(int((off**2).sum(axis=1).argmin()))
        total += features[chosen]
        order.append(chosen)
    return order


class _Drawn:
    """One emitter, and the lights that stand for it."""

    def __init__(self, emitter: Any, middle: Array, environment: Environment | None) -> None:
        self._emitter, self._middle, self._environment = emitter, middle, environment
        self._fixed = without_extent(emitter, middle)
        self._blocks: dict[int, list[Light]] = {}
        self.kind = "fixed" if self._fixed is not None else _kind_of(emitter)

    def stands_for(self, emitter: Any) -> bool:
        """Whether this is the one."""
        return bool(self._emitter.ptr == emitter.ptr)

    def looked_up(self) -> float:
        """Share of its lights that lobes may meet as well."""
        return float(np.mean([self.light(number).density != 0.0 for number in range(_BLOCK)]))

    def light(self, number: int) -> Light:
        """The number-th of its sequence."""
        if self._fixed is not None:
            return self._fixed
        block, inside = divmod(number, _BLOCK)
        if block not in self._blocks:
            self._blocks[block] = self._block(block * _BLOCK)
        return self._blocks[block][inside]

    def irradiance(self) -> float:
        """In the middle, summed over the colours, if it faced and shone towards it everywhere."""
        lights = [self._fixed] if self._fixed is not None else [self.light(n) for n in range(64)]
        found = []
        for light in lights:
            away = light.place[:3] - self._middle
            square = max(float(away @ away), 1e-12) if light.place[3] else 1.0
            found.append(max(float(light.colour.sum()), 0.0) / square)
        return float(np.mean(found))

    def _block(self, start: int) -> list[Light]:
        name = name_of(self._emitter)
        if self.kind == "area":
            values, places, normals, waves = sampled_positions(self._emitter, _BLOCK, start)
            points = np.pad(places, [(0, 0), (0, 1)], constant_values=1.0)
            shape = self._emitter.get_shape()
            density = np.full(_BLOCK, 1.0 / _area(shape) if is_flat(shape) else 0.0)
            address = int(shape.ptr)
        else:
            values, places, density, waves = self._around(start)
            points, normals = np.pad(places, [(0, 0), (0, 1)]), np.zeros((_BLOCK, 3))
            address = 0
        return [
            Light(
                name, point, waves, value[:, 0] if value.shape[1] == 1 else value, normal,
                density=float(of_place), shape=address,
            )
            for point, value, normal, of_place in zip(points, values, normals, density, strict=True)
        ]  # fmt: skip

    def _around(self, start: int) -> tuple[Array, Array, Array, Array]:
        """Irradiances, directions, densities and wavelengths of a block of an environment.

        Five in eight lead to a sun, if there is one: it brings more than that of the light, but the
        sky, which brings all of it in the sun's shadow, needs more directions.
        """
        assert self._environment is not None
        sun, places, waves = self._of_sun(start)
        count = _BLOCK - len(sun)
        towards, densities = self._environment.drawn(start, count)
        found, waves = spectra_along(self._emitter, self._environment.beside_sun(towards))
        found = found * (_BLOCK / count / np.maximum(densities, 1e-12))[:, None, None]
        # the first few of a block lie all along it
        order = np.argsort(np.argsort(np.arange(_BLOCK) * _GOLDEN % 1.0))
        values, places = np.concatenate([found, sun]), np.concatenate([towards, places])
        return values[order], places[order], np.where(order < count, -1.0, 0.0), waves

    def _of_sun(self, start: int) -> tuple[Array, Array, Array]:
        """Irradiances and directions (n, 3) of a block's part, none without a sun; wavelengths."""
        assert self._environment is not None
        asked = 4 * _BLOCK if self._environment.sun.any() else 1
        values, places, _, waves = sampled_directions(self._emitter, self._middle, asked, 4 * start)
        inside = np.flatnonzero(self._environment.in_sun(places) & values.any(axis=(1, 2)))
        count = int(_OF_SUN * _BLOCK) if len(inside) else 0
        kept = inside[np.linspace(0, len(inside) - 1, count).astype(int)]
        total = values[inside].sum(axis=(0, 1, 2)) / asked
        share = _BLOCK * total / max(float(values[kept].sum()), 1e-30)
        return values[kept] * share, places[kept], waves


def _area(shape: Any) -> float:
    return float(np.array(shape.surface_area()).ravel()[0])


def _kind_of(emitter: Any) -> str:
    if emitter.class_name() == "AreaLight":
        return "area"
    return "environment" if emitter.is_environment() else ""


def _colour_at(light: Light, middle: Array) -> Array:
    """What a light brings to the middle, linear sRGB (3,)."""
    if light.place[3] == 0.0:
        return light.colour
    away = middle - light.place[:3]
    square = max(float(away @ away), 1e-12)
    return np.asarray(light.colour * (emission(light, away / square**0.5) / square))


def emission(light: Light, direction: Array) -> float:
    """Share of its intensity that a light without extent sends along a unit vector."""
    if not light.axis.any():
        return 1.0
    cosine = float(np.clip(light.axis @ direction, -1.0, 1.0))
    if light.cone is None:
        return max(cosine, 0.0)
    cutoff, beam = light.cone
    return float(np.clip((cutoff - np.arccos(cosine)) / max(cutoff - beam, 1e-6), 0.0, 1.0))
