"""Realtime renderer of Mitsuba scenes by shaders, without a window.

Light of all emitters with soft shadows is accumulated over frames, of which two kinds alternate.
The first draws one light with its shadows (`emitters`, `shadows`). The second looks up the
surroundings along each pixel's lobes (`surroundings`), and draws the background and emitted light.
The balance heuristic weights the two. Every frame samples another point of each pixel and of the
lens, so that edges become smooth with the light. On request, frames of the second kind add light
that surfaces send to each other (`bounces`).
"""

from __future__ import annotations

import itertools
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError, warn
from ...system import cores
from .camera import Camera
from .context import (
    Bindings,
    Resources,
    ShaderPass,
    Target,
    VertexBuffer,
    check_version,
    compile_program,
    enable_sides,
    headless_context,
    set_uniforms,
)
from .emitters import NO_LIGHT
from .lights import Lamp
from .packed_scene import PackedScene
from .packing import pack_responses
from .shadows import SIZE, ShadowMap
from .source import LIGHTS, fragment_parts
from .texels import Packed, Uniform

Image = NDArray[np.float32]
# steps of two numbers each for the pixel, the lens, the shadow map and the lobes: fractional parts
# of multiples of square roots of primes are independent (Richtmyer 1951); multiples of the golden
# ratio, (1 + √5)/2, are the most even, which matters most for lobes
_STEPS = np.append(np.sqrt([2.0, 3.0, 7.0, 11.0, 13.0, 17.0]), [0.5 + 1.25**0.5, 19.0**0.5]) % 1.0

#: Lamp of frames that look up the surroundings: spectra of daylight, to be multiplied by colours.
_WHITE = Lamp("surroundings", np.array([0.0, 0.0, 1.0, 0.0]), np.array([360.0, 830.0]), np.ones(2))

_SOFTWARE = re.compile("llvmpipe|softpipe|swr|SwiftShader", re.IGNORECASE)


class Renderer(Resources):
    """Renderer of one Mitsuba scene by shaders.

    Supported are meshes, rectangles, spheres, disks and cylinders; diffraction and solved orders
    over a diffuse BSDF; diffuse BSDFs, plastic and metal, smooth or rough; and bump maps. `render`
    and `draw` have directional and point lights and a smooth sky, without shadows. `progressive`
    has all emitters, shadows and the lens. Light between surfaces is left out. Unsupported parts of
    the scene are listed in a warning, and in `scene.omissions`.

    Raises a DiffractionError if OpenGL 3.3 is missing, nothing diffracts, or the camera is
    not a perspective one.

    Parameters
    ----------
    scene : a `mi.Scene` of the current variant, or an XML file.
    sensor : index of the camera.
    context : a moderngl context; by default one without a window, through EGL.
    """

    def __init__(self, scene: Any, *, sensor: int = 0, context: Any = None) -> None:
        self.packed = PackedScene(scene, sensor)
        self.scene = self.packed.scene
        self._warn([o for o in self.scene.omissions if o not in self.scene.of_light])
        self._of_light = list(self.scene.of_light)
        self.camera = self.scene.camera
        self.lights: list[Lamp] = list(self.scene.lighting.lights)
        self.sky = self.scene.lighting.sky
        self.context = self.own(headless_context()) if context is None else context
        check_version(self.context)
        self.buffers = [
            self.own(VertexBuffer(self.context, s.vertices)) for s in self.scene.surfaces
        ]
        self.bindings = [self.own(Bindings(self.context, s.packed)) for s in self.packed.surfaces]
        self._tables: dict[str, list[Bindings]] = {}
        self._programs: dict[object, Any] = {}
        self._arrays: dict[object, Any] = {}

    def _warn(self, omissions: Sequence[str]) -> None:
        """Warn of unsupported parts of the scene."""
        if omissions:
            listed = "; ".join(dict.fromkeys(omissions))
            warn(f"the realtime picture does not show: {listed}")

    @property
    def driver(self) -> str:
        """Name of the OpenGL driver."""
        return str(self.context.info["GL_RENDERER"])

    @property
    def clock(self) -> Callable[[], float]:
        """Clock to time the driver's pictures with, in seconds.

        The clock of a software rasteriser is the process time divided by the number of cores: like
        on a graphics card, other programs do not count.
        """
        if not _SOFTWARE.search(self.driver):
            return time.perf_counter
        number = cores()
        return lambda: time.process_time() / number

    def render(
        self, method: str = "fast", *, supersampling: int = 4, size: tuple[int, int] | None = None
    ) -> Image:
        """Render a picture (height, width, 4): linear sRGB and the coverage of each pixel.

        Parameters
        ----------
        method : one of `methods.METHODS`.
        supersampling : samples along either side of a pixel, averaged evenly.
        size : width and height; by default the camera's.
        """
        self._warn(self._of_light)
        self._of_light.clear()
        width, height = size or self.camera.size
        n = supersampling
        target = self.target(width * n, height * n)
        self.draw(target.frame, method, self.camera.resized(width, height))
        fine = target.read().reshape(height, n, width, n, 4)
        target.release()
        return np.ascontiguousarray(fine.mean(axis=(1, 3), dtype=np.float32))

    def texture_bytes(self, method: str) -> int:
        """Return the size of a method's textures."""
        return sum(packed.nbytes for packed in self.packed.tables(method))

    def draw(
        self,
        frame: Any,
        method: str,
        camera: Camera | None = None,
    ) -> None:
        """Draw into a framebuffer: linear sRGB and the coverage of each pixel.

        Parameters
        ----------
        frame : framebuffer of moderngl with a depth buffer.
        method : one of `methods.METHODS`.
        camera : by default the scene's camera.
        """
        definitions = {"LIGHTS_LIT": str(len(self.lights))}
        if np.any(self.sky != 0.0):
            definitions["SKY"] = ""
        uniforms: dict[str, Uniform] = {
            "sky": np.asarray(self.sky, np.float32), "surroundings_lit": (1.0, 1.0),
        }  # fmt: skip
        frame.clear()
        packed = Packed((), uniforms, definitions)
        self.draw_lights(method, frame, camera or self.camera, self.lights, packed)

    def progressive(
        self,
        method: str = "fast",
        *,
        size: tuple[int, int] | None = None,
        camera: Camera | None = None,
        lights: Sequence[Lamp] = (),
        shadow_size: int = SIZE,
        bounces: bool = False,
    ) -> ProgressiveLight:
        """Return a picture that accumulates frames of all direct light with shadows.

        Raises a DiffractionError if no emitter lights the scene, or as of `tables`.

        Parameters
        ----------
        method : one of `methods.METHODS`.
        size : width and height; by default the camera's.
        camera : by default the scene's camera.
        lights : lights to draw instead of the scene's emitters.
        shadow_size : texels a side of a shadow map.
        bounces : add light between surfaces (`bounces`), which takes seconds to trace; not with
            `lights`.
        """
        camera = camera or self.camera
        return ProgressiveLight(
            self, method, camera.resized(*(size or camera.size)), lights, shadow_size, bounces
        )

    def draw_lights(
        self, method: str, frame: Any, camera: Camera, lights: Sequence[Lamp], packed: Packed,
        shared: Sequence[Bindings] = (),
    ) -> None:  # fmt: skip
        """Draw some lights, or looked-up surroundings, into a framebuffer.

        Parameters
        ----------
        method, frame, camera : as in `draw`.
        lights : lights without extent.
        packed : further uniforms and definitions of the light.
        shared : further parts of all surfaces.
        """
        matrix = camera.view_projection(self.scene.low, self.scene.high)
        places = np.zeros((LIGHTS, 4), np.float32)
        colours = np.zeros((LIGHTS, 3), np.float32)
        for n, light in enumerate(lights):
            place = np.array(light.place, float)
            if place[3] == 0.0:
                place[:3] /= np.linalg.norm(place[:3])
            places[n], colours[n] = place, light.colour
        uniforms: dict[str, Uniform] = {
            "view_projection": tuple(matrix.T.ravel().tolist()),
            "eye": tuple(camera.eye.tolist()),
            "light_place": places,
            "light_colour": colours,
        }
        responses = pack_responses([(light.wavelengths, light.spectrum) for light in lights])
        of_light = Bindings(self.context, packed | Packed((), uniforms) | responses)
        parts_of = [self.bindings, self.tables(method)]
        if {"WEIGHTED", "LOOKED_UP"} & set(packed.definitions):
            parts_of.append(self.lobes)
        frame.use()
        for n, surface in enumerate(self.scene.surfaces):
            program = self.bound(method, (of_light, *shared, *(parts[n] for parts in parts_of)))
            if "pigment_in_light" in program:
                matrix = surface.material.pigment.under(lights[0].wavelengths, lights[0].spectrum)
                set_uniforms(program, {"pigment_in_light": tuple(matrix.ravel().tolist())})
            if (n, id(program)) not in self._arrays:
                self._arrays[n, id(program)] = self.own(self.buffers[n].array(program))
            enable_sides(self.context, surface.winding_from(np.append(camera.eye, 1.0)))
            self._arrays[n, id(program)].render()
        of_light.release()

    def tables(self, method: str) -> list[Bindings]:
        """Return a method's table of each surface, uploaded at the first call; empty without one.

        Raises a DiffractionError if the method is unknown, or does not support a table.
        """
        if method not in self._tables:
            self._tables[method] = self._by_surface(self.packed.tables(method))
        return self._tables[method]

    @cached_property
    def lobes(self) -> list[Bindings]:
        """Directions drawn from the lobes of each surface; empty of one without a table."""
        return self._by_surface(self.packed.lobes)

    def _by_surface(self, of_tables: Sequence[Packed]) -> list[Bindings]:
        """Upload a part of each table, and return the part of each surface's table."""
        bound = [self.own(Bindings(self.context, packed)) for packed in (*of_tables, Packed())]
        return [bound[-1 if s.table is None else s.table] for s in self.packed.surfaces]

    @cached_property
    def around(self) -> Bindings:
        """All that lobes look up of direct light (`PackedScene.around`)."""
        return self.own(Bindings(self.context, self.packed.around))

    @cached_property
    def bounces(self) -> Bindings:
        """Light between surfaces."""
        return self.own(Bindings(self.context, self.packed.bounces))

    def bound(self, method: str, parts: Sequence[Bindings]) -> Any:
        """Return the program of a surface, which is cached, with its parts bound.

        parts : of the light, the surface, its table and its surroundings.

        Raises a DiffractionError if the program does not compile.
        """
        definitions = dict[str, str]()
        for part in parts:
            definitions |= part.definitions
        key = method, frozenset(definitions.items())
        if key not in self._programs:
            stage = fragment_parts(method, definitions)
            program = compile_program(self.context, f"method {method}", stage)
            self._programs[key] = self.own(program)
        unit = 0
        for part in parts:
            unit = part.use(self._programs[key], unit)
        return self._programs[key]

    def target(self, width: int, height: int) -> Target:
        """Return a new framebuffer, which the caller releases."""
        return Target(self.context, width, height)


class ProgressiveLight(Resources):
    """Picture that accumulates frames, created by `Renderer.progressive`.

    lights : lights to draw instead of the scene's emitters and surroundings.
    shadow_size : texels a side of a shadow map.
    bounces : whether light between surfaces is added to light from the emitters.

    Raises a DiffractionError if no emitter lights the scene, or the environment is not finite.
    """

    def __init__(
        self, renderer: Renderer, method: str, camera: Camera, lights: Sequence[Lamp],
        shadow_size: int, bounces: bool,
    ) -> None:  # fmt: skip
        self._renderer, self._method, self._camera = renderer, method, camera
        packed, context = renderer.packed, renderer.context
        if packed.emitters is None:
            raise DiffractionError(NO_LIGHT)
        self._emitters = packed.emitters
        self._fixed = [replace(light, spectrum=len(lights) * light.spectrum) for light in lights]
        bounces = bounces and not lights
        self._looks_up = (packed.looks_up or bounces) and not lights
        self._around = [renderer.around, *([renderer.bounces] if bounces else [])]
        self._map = self.own(
            ShadowMap(context, packed.scene, renderer.buffers, camera, shadow_size)
        )
        # a frame, and the sum of each kind of frames
        self._frame, *self._sums = (self.own(Target(context, *camera.size)) for _ in range(3))
        self.restart()
        self._add = self.own(ShaderPass(context, "add.frag"))
        self._background: ShaderPass | None = None
        if self._emitters.environment is not None:
            files = ("library.glsl", "surroundings.glsl", "background.frag")
            shown = ShaderPass(context, *files, **renderer.around.definitions)
            self._background = self.own(shown)

    @property
    def frames(self) -> int:
        """Number of frames in the picture."""
        return sum(self._counts)

    def restart(self) -> None:
        """Start again."""
        for target in self._sums:
            target.frame.clear(0.0, 0.0, 0.0, 0.0)
        self._counts = [0, 0]
        self._drawn: Counter[tuple[str, bool]] = Counter()  # number of frames of each emitter
        self._lights: Iterator[Lamp] = (
            itertools.cycle(self._fixed) if self._fixed else self._emitters.lights()
        )

    def advance(self, frames: int = 1) -> None:
        """Add this many frames."""
        for _ in range(frames):
            kind = self.frames % 2 if self._looks_up else 0
            light = next(self._lights) if kind == 0 else _WHITE
            # one sequence per emitter, for a sky and its sun, too: random points would cause glints
            emitter = light.name, light.density != 0.0
            self._drawn[emitter] += 1
            numbers = (0.5 + self._drawn[emitter] * _STEPS) % 1.0
            camera = self._camera.sampled(numbers[:2] - 0.5, numbers[2:4])
            self._draw_behind(camera, bright=kind == 1)
            if kind == 0:
                marks = ("PIGMENT_IN_LIGHT", *(["WEIGHTED"] if self._looks_up else []))
                packed = Packed((), {"light_density": light.density}, dict.fromkeys(marks, ""))
                shared = [self._map.draw(light, numbers[4:6]), *self._around]
            else:
                drawn = {"sequence": tuple(numbers[6:8].tolist()), "surroundings_lit": (1.0, 1.0)}
                packed, shared = Packed((), drawn, {"LOOKED_UP": ""}), self._around
            frame = self._frame.frame
            self._renderer.draw_lights(self._method, frame, camera, [light], packed, shared)
            self._sums[kind].frame.use()
            blended: dict[str, Uniform] = {"first": True, "covers": 1.0}
            self._add.draw(blended, {"frame": self._frame.colour}, adding=True)
            self._counts[kind] += 1

    def _draw_behind(self, camera: Camera, bright: bool) -> None:
        """Clear the frame and, if `bright`, draw the background."""
        self._frame.frame.use()
        self._frame.frame.clear(0.0, 0.0, 0.0, 0.0)
        if bright and self._background is not None:
            scene, around = self._renderer.scene, self._renderer.around
            from_clip = np.linalg.inv(camera.view_projection(scene.low, scene.high))
            uniforms: dict[str, Uniform] = {
                **around.uniforms,
                "from_clip": tuple(from_clip.T.ravel().tolist()),
                "eye": tuple(camera.eye.tolist()),
                "picture_size": tuple(float(n) for n in camera.size),
            }
            self._background.draw(uniforms, around.textures)

    @property
    def image(self) -> NDArray[np.float32]:
        """Picture so far (height, width, 4): linear sRGB, and the coverage of each pixel."""
        sums = zip(self._sums, self._counts, strict=True)
        total = np.sum([target.read() / np.float32(max(count, 1)) for target, count in sums], 0)
        total[..., 3] /= np.float32(max(sum(count > 0 for count in self._counts), 1))
        return np.asarray(total, np.float32)
