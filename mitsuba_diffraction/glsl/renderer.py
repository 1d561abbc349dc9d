"""The realtime renderer: scenes of Mitsuba, drawn by shaders, without a window."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError, DiffractionWarning
from ..files.bound_cache import cached_bound
from ..files.cache import cached_colours
from ..geometry import sigma_of
from .camera import Camera
from .context import Bindings, check_version, compile_program, headless_context, set_uniforms
from .documents import DOCUMENTED, make_documented, pack_method
from .lights import Light
from .materials import Material, height_scale, pack_surface
from .packing import area_factor, pack_bounds, pack_colours, pack_powers, pack_responses
from .scene import VERTEX, RealtimeScene, load, read_scene
from .source import LIGHTS, METHODS
from .textures import Packed, Texture, Uniform

Image = NDArray[np.float32]


class Renderer:
    """Draws a scene of Mitsuba with a method of the shaders.

    Meshes, rectangles, spheres, disks and cylinders; diffraction over a diffuse BSDF, and diffuse
    ones; directional and point lights, and one radiance from everywhere. There are no shadows and
    no light between surfaces. All else is named in one warning, and in `scene.omissions`.

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
        self.scene: RealtimeScene = read_scene(load(scene), sensor)
        if self.scene.omissions:
            listed = "; ".join(dict.fromkeys(self.scene.omissions))
            warnings.warn(
                f"the realtime picture does not show: {listed}", DiffractionWarning, stacklevel=2
            )
        self.camera = self.scene.camera
        self.lights: list[Light] = list(self.scene.lighting.lights)
        self.sky = self.scene.lighting.sky
        self._own_context = context is None
        self.context = headless_context() if context is None else context
        check_version(self.context)
        self._buffers = [self.context.buffer(s.vertices.tobytes()) for s in self.scene.surfaces]
        self._surfaces = [
            Bindings(self.context, self._common(s.material)) for s in self.scene.surfaces
        ]
        self._methods: dict[str, _Prepared] = {}
        self._responses: Bindings | None = None
        self._lit_by: tuple[int, ...] = ()

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
        """Seconds a frame takes, the fastest of some, one sample a pixel; compiled beforehand."""
        width, height = size or self.camera.size
        target = self.target(width, height)
        camera = self.camera.resized(width, height)
        self.draw(target.frame, method, self.camera.resized(1, 1))
        self.context.finish()
        times = []
        for _ in range(frames):
            start = time.perf_counter()
            self.draw(target.frame, method, camera)
            self.context.finish()
            times.append(time.perf_counter() - start)
        target.release()
        return min(times)

    def fragment_time(self, method: str) -> float:
        """Seconds that a method's own function takes a fragment, the surface's shading apart.

        Looked up are the colours of a plane lit and seen from changing directions; the fastest of
        some pictures, each of them large enough for a hundredth of a second.
        """
        prepared = self._prepared(method)
        part = next(p for p, s in zip(prepared.parts, self.scene.surfaces, strict=True)
                    if s.material.bsdf is not None)  # fmt: skip
        definitions = part.tables.definitions
        program = compile_program(
            self.context, method, definitions, vertex="whole.vert", main="probe.frag"
        )
        array = self.context.vertex_array(program, [])
        self.context.enable_only(_moderngl().NOTHING)  # no depth test
        side = 32
        found: list[float] = []
        while len(found) < 3:
            u, v = np.meshgrid(*2 * [np.linspace(-0.7, 0.7, side)])
            places = np.stack([u, v, 1.8 - 0.5 * u, np.ones_like(u)], axis=-1).astype(np.float32)
            given = Bindings(self.context, Packed((Texture("places", places),)))
            target = self.target(side, side)
            target.frame.use()
            unit = given.use(program, part.tables.use(program))
            self._use_responses(program, unit)
            set_uniforms(program, {"light_colour": np.ones((LIGHTS, 3), np.float32)})
            start = time.perf_counter()
            array.render(vertices=3)
            self.context.finish()
            seconds = time.perf_counter() - start
            if seconds > 0.01 or side >= 1024:
                found.append(seconds / side**2)
            else:
                side *= 2
            given.release()
            target.release()
        array.release()
        program.release()
        return min(found)

    def texture_bytes(self, method: str) -> int:
        """Memory of a method's own textures."""
        return self._prepared(method).nbytes

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
        scale : height scale of all patches, instead of their own; see `bound_for`.
        coherence_width : µm, instead of their own; not for `lut` and `pq`, whose tables hold it.
        """
        moderngl = _moderngl()
        camera = camera or self.camera
        prepared = self._prepared(method)
        frame.use()
        frame.clear(0.0, 0.0, 0.0, 0.0)
        self.context.enable_only(moderngl.DEPTH_TEST)
        matrix = camera.view_projection(self.scene.low, self.scene.high)
        places = np.zeros((LIGHTS, 4), np.float32)
        colours = np.zeros((LIGHTS, 3), np.float32)
        for n, light in enumerate(self.lights):
            place = np.array(light.place, float)
            if place[3] == 0.0:
                place[:3] /= np.linalg.norm(place[:3])
            places[n], colours[n] = place, light.colour
        shared: dict[str, Uniform] = {
            "view_projection": tuple(matrix.T.ravel().tolist()),
            "eye": tuple(camera.eye.tolist()),
            "view_axis": (0.0, 0.0, 0.0),
            "lights": len(self.lights),
            "light_place": places,
            "light_colour": colours,
            "sky": tuple(float(x) for x in self.sky),
            "skies": int(np.any(self.sky != 0.0)),
            "displays": int(exposure is not None),
            "exposure": 1.0 if exposure is None else exposure,
        }
        for surface, own, part in zip(
            self.scene.surfaces, self._surfaces, prepared.parts, strict=True
        ):
            program, array = part.program, part.array
            set_uniforms(program, shared)
            unit = own.use(program)
            unit = part.tables.use(program, unit)
            self._use_responses(program, unit)
            if surface.material.bsdf is not None:
                factor = scale if scale is not None else height_scale(surface.material)
                set_uniforms(program, {"height_scale": factor})
                if coherence_width is not None:
                    set_uniforms(program, _window(part.tables, coherence_width))
            array.render(moderngl.TRIANGLES)

    def bound_for(self, scale: float) -> None:
        """Take the albedo's bound for another height scale: a second or so, where it is new."""
        for surface, own in zip(self.scene.surfaces, self._surfaces, strict=True):
            if "bounds" in own.textures:
                packed = pack_bounds([cached_bound(surface.material.table, scale)])
                own.textures["bounds"].write(packed.textures[0].data.tobytes())

    def release(self) -> None:
        """Free what lies in the graphics card's memory."""
        for prepared in self._methods.values():
            prepared.release()
        for thing in (*self._surfaces, *self._buffers):
            thing.release()
        if self._responses is not None:
            self._responses.release()
        if self._own_context:
            self.context.release()

    def _common(self, material: Material) -> Packed:
        packed = pack_surface(material)
        if material.bsdf is None:
            return packed | pack_bounds(None)
        if not material.bsdf.energy_conserving:
            return packed | pack_bounds(None)
        return packed | pack_bounds([cached_bound(material.table, height_scale(material))])

    def _prepared(self, method: str) -> _Prepared:
        if method not in self._methods:
            self._methods[method] = _Prepared(self, method)
        return self._methods[method]

    def _use_responses(self, program: Any, unit: int) -> None:
        """The lights' spectra, uploaded anew when other lights are set."""
        if "responses" not in program:
            return
        lit_by = tuple(id(light.spectrum) for light in self.lights)
        if self._responses is None or lit_by != self._lit_by:
            if self._responses is not None:
                self._responses.release()
            pairs = [(light.wavelengths, light.spectrum) for light in self.lights]
            none = (np.array([360.0, 830.0]), np.zeros(2))
            self._responses = Bindings(self.context, pack_responses(pairs or [none]))
            self._lit_by = lit_by
        self._responses.use(program, unit)

    def target(self, width: int, height: int) -> Target:
        """A framebuffer to draw into, to be released."""
        return Target(self.context, width, height)


class Target:
    """A picture in single precision, with depth.

    Attributes
    ----------
    frame : the framebuffer.
    """

    def __init__(self, context: Any, width: int, height: int) -> None:
        largest = context.info["GL_MAX_TEXTURE_SIZE"]
        if max(width, height) > largest:
            raise DiffractionError(
                f"a picture of {width} × {height} samples is too large for the driver, which "
                f"takes {largest}; lower the supersampling or the size"
            )
        self.colour = context.texture((width, height), 4, dtype="f4")
        self.depth = context.depth_renderbuffer((width, height))
        self.frame = context.framebuffer([self.colour], self.depth)

    def release(self) -> None:
        """Free it."""
        for thing in (self.frame, self.colour, self.depth):
            thing.release()


class _Part:
    """One surface's program, its vertices in it, and its tables."""

    def __init__(self, program: Any, array: Any, tables: Bindings) -> None:
        self.program, self.array, self.tables = program, array, tables


class _Prepared:
    """Programs and tables of one method for all surfaces of a scene."""

    def __init__(self, renderer: Renderer, method: str) -> None:
        surfaces = renderer.scene.surfaces
        packed: dict[int, Packed] = {}
        tables: dict[int, Bindings] = {}
        programs: dict[tuple[tuple[str, str], ...], Any] = {}
        self.parts: list[_Part] = []
        for surface in surfaces:
            if surface.material.bsdf is not None:
                key = id(surface.material.table)
                if key not in packed:
                    packed[key] = method_tables(method, surface.material)
        # what does not diffract is drawn by any of the programs
        first = next(iter(packed))
        for surface, own in zip(surfaces, renderer._surfaces, strict=True):
            key = first if surface.material.bsdf is None else id(surface.material.table)
            if key not in tables:
                tables[key] = Bindings(renderer.context, packed[key])
            definitions = {**own.definitions, **packed[key].definitions}
            names = tuple(sorted(definitions.items()))
            if names not in programs:
                programs[names] = compile_program(renderer.context, method, definitions)
            program = programs[names]
            buffer = renderer._buffers[surfaces.index(surface)]
            array = _vertex_array(renderer.context, program, buffer)
            self.parts.append(_Part(program, array, tables[key]))
        self.nbytes = sum(p.nbytes for p in packed.values())
        self._tables, self._programs = tables.values(), programs.values()

    def release(self) -> None:
        for part in self.parts:
            part.array.release()
        for thing in (*self._tables, *self._programs):
            thing.release()


def method_tables(method: str, material: Material) -> Packed:
    """What a method reads of a material's table.

    Raises
    ------
    DiffractionError
        If there is no such method, or the table does not suit it.
    """
    if method == "lut":
        return pack_colours(cached_colours(material.table))
    if method == "spectral":
        return pack_powers(material.table)
    if method in DOCUMENTED:
        heights = material.bsdf.heights()
        return pack_method(make_documented(method, heights, material.table))
    raise DiffractionError(f"method={method!r} is unknown; choose one of {', '.join(METHODS)}")


def _window(tables: Bindings, coherence_width: float) -> dict[str, Uniform]:
    """Uniforms of another coherence window."""
    sigma = sigma_of(coherence_width)
    factor = area_factor(sigma)
    exponents, own = tables.uniforms.get("exponents"), tables.uniforms["area_factor"]
    found: dict[str, Uniform] = {"sigma": sigma, "area_factor": factor}
    if isinstance(exponents, tuple) and isinstance(own, float):
        found["exponents"] = tuple(float(e) * factor / own for e in exponents)  # both ∝ σ²
    return found


def _vertex_array(context: Any, program: Any, buffer: Any) -> Any:
    """Those attributes of the vertices that the program reads."""
    used: Sequence[tuple[str, int]] = [(name, size) for name, size in VERTEX if name in program]
    layout = " ".join(f"{n}f" if name in program else f"{4 * n}x" for name, n in VERTEX)
    return context.vertex_array(program, [(buffer, layout, *(name for name, _ in used))])


def _moderngl() -> Any:
    import moderngl

    return moderngl
