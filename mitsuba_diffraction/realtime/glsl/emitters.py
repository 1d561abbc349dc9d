"""All emitters of a scene as a sequence of lights without extent, for accumulation.

The direct light of a scene is an integral over all emitters. Each frame draws one light with its
shadows, and the mean over frames converges to all direct light with soft shadows (Haeberli and
Akeley 1990, *The accumulation buffer*, section 4.4).

An emitter e is chosen with a probability p_e proportional to its irradiance in the middle of the
scene, and a point on it with a density p:

- directions, points and spots are lights without extent;
- skies, suns and environment maps yield a direction, drawn about in proportion to their radiance,
  and the irradiance L/(p p_e), which is the same all over the scene;
- area lights yield a point, drawn evenly over their area, and the intensity L/(p p_e) along the
  normal, which is proportional to the cosine. The estimate is unbiased at every point of the scene.

The choice of the emitter follows the golden ratio, the points on one emitter the plastic number
(Roberts 2018): both sequences are evenly distributed. Within each block of lights, the next light
is the one that brings the mean so far nearest to the block's mean, by colour and by spherical
harmonics of the direction up to order 2, which determine nearly all reflection by matt surfaces
(Chen, Welling and Smola 2010, *Super-samples from kernel herding*; Ramamoorthi and Hanrahan 2001).
So the first few lights look like all of them.

Mirror images of lights with an extent cannot be drawn by lights without extent: surfaces look them
up along their lobes instead (`surroundings`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Real
from ...errors import DiffractionError
from ...scene.elements import name_of
from .lights import (
    Lamp,
    area_of,
    sampled_directions,
    sampled_positions,
    without_extent,
)
from .surroundings import Environment, is_flat

#: Refusal of a scene in the dark.
NO_LIGHT = "no emitter of the scene lights the surfaces that diffract; add one, or brighten it"

_BLOCK = 256  # lights that an emitter draws at a time
_FIRST = 2  # first number of an environment's sequence, from which on a few lights are even, too
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
_EVEN = 0.1  # share of choices independent of the irradiance in the middle, for lights elsewhere


class Emitters:
    """Emitters of a scene, and the sequence of lights that is drawn from them.

    middle : (3,) point whose irradiances determine the probabilities.

    Raises a DiffractionError if the irradiance of all emitters is 0.
    """

    def __init__(self, scene: Any, middle: Real) -> None:
        self.omissions: list[str] = []  # unsupported emitters, in a few words each
        self._emitters: list[Any] = []
        self._blocks: dict[tuple[int, int], list[Lamp]] = {}  # by emitter and number
        self._scene = scene  # keeps the shapes of area lights alive
        self._middle = middle
        self.environment = Environment.read(scene)
        irradiances = []
        for emitter in scene.emitters():
            lights = self._block(emitter, 0)
            # without cosines and cones
            some = [float(light.irradiance(middle).sum()) for light in lights[:64]]
            if not lights:
                self.omissions.append(f"{name_of(emitter)} ({emitter.class_name()})")
            elif (irradiance := np.maximum(some, 0.0).mean()) > 0.0:
                self._emitters.append(emitter)
                irradiances.append(irradiance)
        if not irradiances:
            raise DiffractionError(NO_LIGHT)
        shares = np.array(irradiances) / sum(irradiances)
        # (n,) probability of each emitter with light
        self.probabilities = (1.0 - _EVEN) * shares + _EVEN / len(shares)

    def lights(self) -> Iterator[Lamp]:
        """Yield lights without end; their mean converges to all direct light of the scene."""
        below = np.cumsum(self.probabilities)
        drawn = [0] * len(self._emitters)
        for block in itertools.count():
            places = (0.5 + np.arange(block * _BLOCK, (block + 1) * _BLOCK) * _GOLDEN) % 1.0
            choices = np.minimum(np.searchsorted(below, places, side="right"), len(drawn) - 1)
            lights = []
            for chosen in choices:
                number, inside = divmod(drawn[chosen], _BLOCK)
                same = self._block(self._emitters[chosen], number)
                light = same[inside % len(same)]
                share = float(self.probabilities[chosen])
                spectrum, density = light.spectrum / share, light.density * share
                lights.append(replace(light, spectrum=spectrum, density=density))
                drawn[chosen] += 1
            for number in _nearest_to_mean(np.stack([self._features(light) for light in lights])):
                yield lights[number]

    def share_of(self, emitter: Any) -> float:
        """Return the probability of lights of an emitter that lobes look up, too.

        The sun of a sky is excluded.
        """
        found = 0.0
        for share, each in zip(self.probabilities, self._emitters, strict=True):
            if each.ptr == emitter.ptr:
                found += share * np.mean([one.density != 0.0 for one in self._block(each, 0)])
        return float(found)

    def _block(self, emitter: Any, number: int) -> list[Lamp]:
        """Return a block of an emitter's lights, one of one without extent, none of other kinds.

        Lights are drawn by Mitsuba's sampling of the emitter.
        """
        if (emitter.ptr, number) in self._blocks:
            return self._blocks[emitter.ptr, number]
        start = number * _BLOCK
        name, normals, address = name_of(emitter), np.zeros((_BLOCK, 3)), 0
        if (fixed := without_extent(emitter, self._middle)) is not None:
            return [fixed]
        if emitter.class_name() == "AreaLight":
            values, places, normals, waves = sampled_positions(emitter, _BLOCK, start)
            points = np.pad(places, [(0, 0), (0, 1)], constant_values=1.0)
            shape = emitter.get_shape()
            densities = np.full(_BLOCK, 1.0 / area_of(shape) if is_flat(shape) else 0.0)
            address = int(shape.ptr)
        elif self.environment is not None and emitter.is_environment():
            values, directions, _, waves = sampled_directions(
                emitter, self._middle, _BLOCK, _FIRST + start
            )
            points = np.pad(directions, [(0, 0), (0, 1)])
            of_sky = ~self.environment.in_sun(directions)
            densities = of_sky * of_sky.mean() * self.environment.density(directions)
        else:
            return []
        self._blocks[emitter.ptr, number] = [
            Lamp(name, point, waves, value, normal, density=float(density), shape=address)
            for point, value, normal, density in zip(
                points, values, normals, densities, strict=True
            )
        ]
        return self._blocks[emitter.ptr, number]

    def _features(self, light: Lamp) -> Real:
        """Return the light's irradiance in the middle by colour and spherical harmonics, (27,)."""
        direction = light.place[:3] - light.place[3] * self._middle
        direction /= max(float(np.linalg.norm(direction)), 1e-12)
        x, y, z = direction
        colour = light.irradiance(self._middle) * emission(light, -direction)
        harmonics = [1.0, x, y, z, x * y, y * z, z * x, 0.5 * (x * x - y * y), z * z - 1.0 / 3.0]
        return np.outer(colour, harmonics).ravel()


def _nearest_to_mean(features: Real) -> list[int]:
    """Return an order of rows (n, m) in which the mean of the first few is near the mean of all."""
    mean, total = features.mean(axis=0), np.zeros(features.shape[1])
    left, order = list(range(len(features))), list[int]()
    while left:
        difference = total + features[left] - (len(order) + 1) * mean
        chosen = left.pop(int((difference**2).sum(axis=1).argmin()))
        total += features[chosen]
        order.append(chosen)
    return order


def emission(light: Lamp, direction: Real) -> float:
    """Return the share of its intensity that a light sends along a unit vector."""
    if not light.axis.any():
        return 1.0
    cosine = float(np.clip(light.axis @ direction, -1.0, 1.0))
    if light.cone is None:
        return max(cosine, 0.0)
    cutoff, beam = light.cone
    return float(np.clip((cutoff - np.arccos(cosine)) / max(cutoff - beam, 1e-6), 0.0, 1.0))
