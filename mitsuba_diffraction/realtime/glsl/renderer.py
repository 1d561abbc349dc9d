"""The realtime renderer: scenes of Mitsuba, drawn by shaders, without a window."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import warn
from ...tables.energy.grid import FINE
from .camera import Camera
from .context import (
    Bindings,
    Target,
    check_version,
    clock_of,
    headless_context,
    require_moderngl,
    set_uniforms,
)
from .lights import Light, light_definitions
from .materials import (
    conservation_at,
    height_scale,
    pack_conservation,
    pack_emission,
    pack_relief,
    pack_surface,
)
from .methods import Prepared, window
from .packing import pack_energy, pack_responses
from .progressive import Extra, ProgressiveLight, Stage
from .scene import RealtimeScene, load, read_scene
from .shadows import SIZE
from .source import LIGHTS
from .texels import Uniform

Image = NDArray[np.float32]


class Renderer:
    """Draws a scene of Mitsuba with a method of the shaders.

    Meshes, rectangles, spheres, disks and cylinders; diffraction over a diffuse BSDF, diffuse ones,
    plastic and metal, smooth or rough, and bumps. `render` and `draw` know directional and point
    lights, and a smooth sky, without shadows; `progressive` all emitters, with shadows, and the
    lens. There is no light between surfaces. All else is named in a warning, and in
    `scene.omissions`.

    Parameters
    ----------
    scene : a `mi.Scene` of the variant that is set, or an XML file.
    sensor : index of the camera.
    context : a moderngl context; by default one without a window, through EGL.

    Raises
    ------
    DiffractionError
        If there is no OpenGL 3.3, nothing diffracts, or the camera has no perspective.
    """

    def __init__(self, scene: Any, *, sensor: int = 0, context: Any = None) -> None:
        self.mitsuba_scene = load(scene)
        self.scene: RealtimeScene = read_scene(self.mitsuba_scene, sensor)
        self._warn([o for o in self.scene.omissions if o not in self.scene.of_light])
        self._of_light = list(self.scene.of_light)
        self.camera = self.scene.camera
        self.lights: list[Light] = list(self.scene.lighting.lights)
        self.sky = self.scene.lighting.sky
        self._own_context = context is None
        self.context = headless_context() if context is None else context
        check_version(self.context)
        self.buffers = [self.context.buffer(s.vertices.tobytes()) for s in self.scene.surfaces]
        self.bindings = [
            Bindings(
                self.context,
                pack_surface(s.material)
                | pack_relief(s.material)
                | pack_conservation(s.material)
                | pack_emission(s.radiance),
            )
            for s in self.scene.surfaces
        ]
        self._methods: dict[str, Prepared] = {}
        self._responses: Bindings | None = None
        self._stage: Stage | None = None
        self._lit_by: list[NDArray[np.float64]] = []

    def _warn(self, omissions: Sequence[str]) -> None:
        if omissions:
            listed = "; ".join(dict.fromkeys(omissions))
            warn(f"the realtime picture does not show: {listed}")

    @property
    def driver(self) -> str:
        """What draws."""
        return str(self.context.info["GL_RENDERER"])

    def render(
        self, method: str = "lut", *, supersampling: int = 4, size: tuple[int, int] | None = None
    ) -> Image:
        """A picture (height, width, 4): linear sRGB and the share of each pixel that is covered.

        Parameters
        ----------
        method : one of `source.METHODS`.
        supersampling : samples along either side of a pixel, averaged evenly.
        size : width and height; the scene's by default.
        """
        self._warn(self._of_light)
        self._of_light.clear()
        width, height = size or self.camera.size
        n = supersampling
        target = self.target(width * n, height * n)
        self.draw(target.frame, method, self.camera.resized(width, height))
        fine = np.frombuffer(target.frame.read(components=4, dtype="f4"), np.float32)
        target.release()
        fine = fine.reshape(height, n, width, n, 4)[::-1, ::-1]
        return np.ascontiguousarray(fine.mean(axis=(1, 3), dtype=np.float32))

    def frame_time(
        self, method: str, *, size: tuple[int, int] | None = None, frames: int = 1
    ) -> float:
        """Seconds a frame takes, the fastest of some, one sample a pixel; compiled beforehand.

        By the clock of `context.clock_of`.
        """
        width, height = size or self.camera.size
        target = self.target(width, height)
        camera = self.camera.resized(width, height)
        self.draw(target.frame, method, self.camera.resized(1, 1))
        self.context.finish()
        clock, times = clock_of(self.driver), []
        for _ in range(frames):
            start = clock()
            self.draw(target.frame, method, camera)
            self.context.finish()
            times.append(clock() - start)
        target.release()
        return min(times)

    def texture_bytes(self, method: str) -> int:
        """Memory of a method's own textures."""
        return self.prepared(method).nbytes

    def draw(
        self,
        frame: Any,
        method: str,
        camera: Camera | None = None,
        *,
        exposure: float | None = None,
        scale: float | None = None,
        coherence_width: float | None = None,
    ) -> None:
        """Draw into a framebuffer.

        Parameters
        ----------
        frame : of moderngl, with a depth buffer.
        method : one of `source.METHODS`.
        camera : the scene's by default.
        exposure : factor on the light, for display as sRGB; None leaves it linear.
        scale : height scale of all patches, instead of their own; see `energy_for`.
        coherence_width : µm, instead of their own; not for `lut` and `pq`, whose tables hold it.
        """
        self.draw_lights(
            frame, method, camera or self.camera, self.lights,
            light_definitions(
                len(self.lights), bool(np.any(self.sky != 0.0)), exposure is not None
            ),
            {"sky": np.asarray(self.sky, np.float32), "exposure": exposure or 1.0},
            scale=scale, coherence_width=coherence_width,
        )  # fmt: skip

    def progressive(
        self,
        method: str = "lut",
        *,
        size: tuple[int, int] | None = None,
        camera: Camera | None = None,
        lights: Sequence[Light] = (),
        shadow_size: int = SIZE,
    ) -> ProgressiveLight:
        """A picture of all emitters' direct light, with shadows, that gets better by frames.

        Parameters
        ----------
        method : one of `source.METHODS`.
        size : width and height; the camera's by default.
        camera : the scene's by default.
        lights : these alone, instead of all that the scene has.
        shadow_size : texels along either side of a shadow map.

        Raises
        ------
        DiffractionError
            If no emitter brings light, or as of `prepared`.
        """
        camera = camera or self.camera
        resized = camera.resized(*(size or camera.size))
        return ProgressiveLight(
            self, method, resized, self.stage(), lights=lights, shadow_size=shadow_size
        )

    def stage(self) -> Stage:
        """What progressive light needs of the scene, made when it is first wanted."""
        if self._stage is None:
            self._stage = Stage(self)
        return self._stage

    def draw_lights(
        self,
        frame: Any,
        method: str,
        camera: Camera,
        lights: Sequence[Light],
        definitions: dict[str, str],
        uniforms: dict[str, Uniform],
        extras: Sequence[Extra] | None = None,
        *,
        scale: float | None = None,
        coherence_width: float | None = None,
    ) -> None:
        """Draw some lights, or what the surroundings send, into a framebuffer.

        Parameters
        ----------
        frame, method, camera, scale, coherence_width : as of `draw`.
        lights : without extent.
        definitions, uniforms : what of them the shaders know.
        extras : what each surface's shader reads of them; without any the frame is cleared first.
        """
        moderngl = require_moderngl()
        own_definitions = [extra.definitions for extra in extras or ()]
        parts = self.prepared(method).parts(definitions, own_definitions)
        frame.use()
        if extras is None:
            frame.clear(0.0, 0.0, 0.0, 0.0)
        self.context.enable_only(moderngl.DEPTH_TEST)
        matrix = camera.view_projection(self.scene.low, self.scene.high)
        places = np.zeros((LIGHTS, 4), np.float32)
        colours = np.zeros((LIGHTS, 3), np.float32)
        for n, light in enumerate(lights):
            place = np.array(light.place, float)
            if place[3] == 0.0:
                place[:3] /= np.linalg.norm(place[:3])
            places[n], colours[n] = place, light.colour
        shared: dict[str, Uniform] = {
            "view_projection": tuple(matrix.T.ravel().tolist()),
            "eye": tuple(camera.eye.tolist()),
            "view_axis": (0.0, 0.0, 0.0),
            "light_place": places,
            "light_colour": colours,
            **uniforms,
        }
        for n, (surface, own, part) in enumerate(
            zip(self.scene.surfaces, self.bindings, parts, strict=True)
        ):
            program = part.program
            set_uniforms(program, shared)
            unit = part.tables.use(program, own.use(program))
            if extras is not None:
                unit = extras[n].use(program, unit)
            self.use_responses(program, unit, lights)
            if "pigment_in_light" in program:
                turned = surface.material.pigment.under(lights[0].wavelengths, lights[0].spectrum)
                set_uniforms(program, {"pigment_in_light": tuple(turned.ravel().tolist())})
            if surface.material.bsdf is not None:
                factor = scale if scale is not None else height_scale(surface.material)
                set_uniforms(program, {"height_scale": factor})
                if coherence_width is not None:
                    set_uniforms(program, window(part.tables, coherence_width))
            part.array.render(moderngl.TRIANGLES)

    def energy_for(self, scale: float) -> None:
        """Take what conserves energy at another height scale: a second or so, where it is new."""
        for surface, own in zip(self.scene.surfaces, self.bindings, strict=True):
            if {"energy", "beneath"}.isdisjoint(own.textures):
                continue
            ones = pack_energy([FINE.ones])
            packed = ones | conservation_at(surface.material.bsdf, [scale])
            for texture in packed.textures:
                if texture.name in own.textures:
                    own.textures[texture.name].write(texture.data.tobytes())

    def release(self) -> None:
        """Free what lies in the graphics card's memory."""
        for prepared in self._methods.values():
            prepared.release()
        for thing in (*self.bindings, *self.buffers):
            thing.release()
        for thing in (self._responses, self._stage):
            if thing is not None:
                thing.release()
        if self._own_context:
            self.context.release()

    def prepared(self, method: str) -> Prepared:
        """A method's tables and programs, uploaded when it is first wanted.

        Raises
        ------
        DiffractionError
            If there is no such method, or a table does not suit it.
        """
        if method not in self._methods:
            self._methods[method] = Prepared(
                self.context, self.scene, method, self.bindings, self.buffers
            )
        return self._methods[method]

    def use_responses(self, program: Any, unit: int, lights: Sequence[Light] | None = None) -> None:
        """The lights' spectra, uploaded anew when other lights are set."""
        if "responses" not in program:
            return
        pairs = [(light.wavelengths, light.spectrum) for light in lights or self.lights]
        spectra = [spectrum for _, spectrum in pairs]
        same = len(spectra) == len(self._lit_by) and all(
            one is other for one, other in zip(spectra, self._lit_by, strict=True)
        )
        if self._responses is None or not same:
            if self._responses is not None:
                self._responses.release()
            self._responses = Bindings(self.context, pack_responses(pairs))
            self._lit_by = spectra
        self._responses.use(program, unit)

    def target(self, width: int, height: int) -> Target:
        """A framebuffer to draw into, to be released."""
        return Target(self.context, width, height)
