"""Light of a page: lights, a sequence that represents all emitters, and the surroundings.

The surroundings are an environment, and data to look light up along lobes.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import linear_srgb, response
from ...progress import Progress
from ..glsl.lights import Lamp
from ..glsl.packed_scene import PackedScene
from ..glsl.packing import WAVENUMBERS, pack_responses
from ..glsl.source import web_source
from ..glsl.texels import shortened
from .sections import Sections, converted, packed_array, packed_parts

#: Number of lights in the sequence; their mean is the scene's light.
SAMPLES = 256

_PACKING = "packing light"  # in progress
_FIRST, _LAST, _STEP = 380.0, 780.0, 5.0  # wavelengths of monochromatic light, nm
_MIN_COSINE = float(np.cos(np.radians(3.0)))  # lights within this angle of a direction move with it


def packed_light(packed: PackedScene, sections: Sections) -> dict[str, Any]:
    """Return the page's data of light, as JSON types.

    `own` are the scene's lights without extent, which light the picture while something moves.
    `samples` is the sequence; each light has the number of the light in `own` that it moves with
    (−1: none).
    """
    lighting, emitters = packed.scene.lighting, packed.emitters
    lights = lighting.lights
    sequence = list(itertools.islice(emitters.lights(), SAMPLES)) if emitters else []
    if len({(s.place.tobytes(), np.asarray(s.spectrum).tobytes()) for s in sequence}) == 1:
        sequence = sequence[:1]
    spectra = [np.asarray(light.spectrum, np.float32).ravel() for light in [*lights, *sequence]]
    values = np.stack(spectra) if spectra else None
    daylight = pack_responses([(np.array([360.0, 830.0]), np.ones(2))]).textures[0]
    return {
        "own": [_described(light, n) for n, light in enumerate(lights)],
        "samples": [
            _described(light, len(lights) + n)
            | {"of": _owner(light, lights), "density": light.density}
            for n, light in enumerate(sequence)
        ],
        "sky": lighting.sky.ravel().tolist(),
        "spectra": None if values is None else sections.add(packed_array(values)),
        "columns": 0 if values is None else values.shape[1],
        "channels": 3 if spectra and [*lights, *sequence][0].spectrum.ndim > 1 else 1,
        "daylight": sections.add(packed_array(daylight.data.reshape(-1, 4))),
        "wavenumbers": list(WAVENUMBERS),
        "monochrome": {"first": _FIRST, "step": _STEP, "colours": _monochrome().tolist()},
    }


def _described(light: Lamp, spectrum: int) -> dict[str, Any]:
    """Return a light as JSON types; `spectrum` is the number of its spectrum."""
    return {
        "name": light.name, "spectrum": spectrum, "cone": list(light.cone or (0.0, 0.0)),
        **{n: np.round(getattr(light, n), 7).tolist() for n in ("place", "colour", "axis")},
    }  # fmt: skip


def _owner(light: Lamp, lights: Sequence[Lamp]) -> int:
    """Return the number of the light in `own` with which a light moves, or −1."""
    for number, other in enumerate(lights):
        if not other.name.endswith(light.name) or light.place[3] != other.place[3]:
            continue
        a, b = (x.place[:3] / np.linalg.norm(x.place[:3]) for x in (light, other))
        if light.place[3] or float(a @ b) > _MIN_COSINE:
            return number
    return -1


def _monochrome() -> NDArray[np.float64]:
    """Return the most saturated displayable linear sRGB of each wavelength, largest channel 1."""
    lam = np.arange(_FIRST, _LAST + _STEP, _STEP)
    colours = np.maximum(linear_srgb(response(lam)), 0.0)
    return np.round(colours / colours.max(axis=1, keepdims=True), 4)


def packed_surroundings(
    packed: PackedScene, sections: Sections, bounces: bool, progress: Progress
) -> tuple[dict[str, Any] | None, dict[str, str]]:
    """Return the page's data of surroundings, as JSON types, and definitions for the shaders.

    bounces : whether light between surfaces is added.

    The data is None for a scene without light, and without `bounces` for a scene without
    environment and without shapes that emit light.
    """
    if packed.emitters is None or not (packed.looks_up or bounces):
        return None, {}
    progress(0, 3, _PACKING)
    parts = converted(packed.around, {"obstacles": _coarser})
    progress(1, 3, _PACKING)
    if bounces:
        parts |= packed.bounces
    progress(2, 3, _PACKING)
    # rounding adds no bias: shaders divide by the rounded densities
    digits: dict[str, Any] = {"lobe_places": np.float16, "lobe_densities": shortened}
    lobes = [converted(part, digits) for part in packed.lobes]
    background = None
    if packed.emitters.environment is not None:
        background = web_source(
            "library.glsl", "surroundings.glsl", "background.frag",
            definitions=packed.around.definitions,
        )  # fmt: skip
    return {
        "bounces": bounces,
        "parts": packed_parts(parts, sections),
        "lobes": [packed_parts(part, sections) for part in lobes],
        "background": background,
    }, {name: text for part in (parts, *lobes) for name, text in part.definitions.items()}


def _coarser(obstacles: NDArray[Any]) -> NDArray[np.uint8]:
    """Round distances to obstacles down to three binary digits, which take half the memory.

    Rays step by less than before, hence meet the same obstacles.
    """
    steps = obstacles.astype(np.int64)
    return (steps - steps % (1 << np.maximum(np.frexp(steps)[1] - 3, 0))).astype(np.uint8)
