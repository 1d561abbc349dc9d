"""Window on a Mitsuba scene (extra `view`): orbit, pan, zoom, drag the light, path-trace."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl_window
import numpy as np
from imgui_bundle import imgui
from moderngl_window.integrations.imgui_bundle import ModernglWindowRenderer
from numpy.typing import NDArray
from PIL import Image

from ...atomic import atomic_path
from ...errors import DiffractionError
from ...optics.display import shown
from ..shader_comparison.path_traced import PathTracing
from .camera import Camera, Orbit, dragged
from .context import check_version
from .progressive import ProgressiveLight
from .renderer import Renderer
from .source import METHODS, THESIS_METHODS

TITLE = "mitsuba-diffraction"


HELP = (
    "left button: turn   right: drag the light\n"
    "middle, or shift and left: move   wheel: nearer\n"
    "S: screenshot   P: path-trace this view   R: reset   Esc: close"
)

_TURN = 0.006  # rotation per pixel, rad
_FRAMES = 30  # frames in the mean time that the panel shows
_AT_ONCE, _ENOUGH = 4, 2048  # frames of progressive light per picture, and in all


def _to_panel(event: str) -> Callable[..., None]:
    """Return a handler that passes an event on to the panel."""

    def handle(self: ViewerWindow, *values: Any) -> None:
        """Pass the event on, if the panel exists."""
        if hasattr(self, "panel"):  # a window may be resized before the panel is created
            getattr(self.panel, event)(*values)

    return handle


class ViewerWindow(moderngl_window.WindowConfig):
    """Window of the viewer; `show` sets the scene and options on a subclass."""

    gl_version = (3, 3)
    title = TITLE
    aspect_ratio = None
    vsync = False
    log_level = 30  # warnings

    mitsuba_scene: Any = None
    sensor = 0
    method = "fast"
    stops = 0.0
    view = "natural"
    folder = Path()
    frames = 0  # number of frames to close after; 0: never
    spp = 64

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        check_version(self.ctx)
        imgui.create_context()
        imgui.get_io().set_ini_filename("")  # leave no file behind
        self.panel = ModernglWindowRenderer(self.wnd)
        self.times: deque[float] = deque(maxlen=_FRAMES)
        self.drawn = 0
        self.message = ""
        self.renderer: Renderer | None = None
        self.tracing: PathTracing | None = None
        self.light: ProgressiveLight | None = None
        self.shadows = True  # progressive light with shadows, or at once a few lights without
        self._shown: tuple[Any, ...] = ()
        self._loading: Iterator[str] | None = self._load()

    def _load(self) -> Iterator[str]:
        """Load in steps; the window can be closed between them."""
        yield "reading the scene ..."
        self.renderer = Renderer(
            self.mitsuba_scene, sensor=self.sensor, context=self.ctx, view=self.view
        )
        yield f"tables of method {self.method} ..."
        self.renderer.texture_bytes(self.method)
        yield "lights, shadows and surroundings ..."
        self.renderer.stage()
        self._start()

    def _start(self) -> None:
        """Reset camera, surfaces and lights to the scene's own."""
        renderer = self._ready
        scene = renderer.scene
        self.orbit = Orbit.start(scene.camera, 0.5 * (scene.low + scene.high))
        first = scene.diffracting[0].described
        self.scale, self.largest_scale = first.height_scale.number, first.largest_scale
        self.table_width = self.width = first.coherence_width
        renderer.lights = list(scene.lighting.lights)
        self._dragged = False

    @property
    def _ready(self) -> Renderer:
        """Renderer, once it is loaded."""
        assert self.renderer is not None
        return self.renderer

    def on_render(self, now: float, since: float) -> None:
        """Draw one frame, or load one step."""
        if self._loading is not None:
            try:
                self._say(next(self._loading))
            except StopIteration:
                self._loading = None
            return
        if self.tracing is not None:
            self._trace()
        start = time.perf_counter()
        self._draw(self.wnd.fbo)
        self.ctx.finish()
        self.times.append(time.perf_counter() - start)
        self._panel()
        self.drawn += 1
        if self.frames and self.drawn >= self.frames:
            self.wnd.close()

    def _draw(self, frame: Any) -> None:
        """Draw the scene into a framebuffer."""
        if self.shadows:
            self._light(frame.size).show(frame, 2.0**self.stops)
            return
        camera = self._camera(frame.size)
        self._ready.draw(frame, self.method, camera, exposure=2.0**self.stops, **self._surface)

    def _camera(self, size: tuple[int, int]) -> Camera:
        """Return the orbit's camera with a picture of this size."""
        return replace(self._ready.camera, to_world=self.orbit.to_world, size=size)

    @property
    def _surface(self) -> dict[str, float | None]:
        """Height scale and coherence width of the surfaces, as set in the viewer."""
        return {"scale": self.scale, "coherence_width": None if self._baked else self.width}

    def _light(self, size: tuple[int, int]) -> ProgressiveLight:
        """Add a few frames of progressive light; restart it if anything has changed.

        The sequence of lights begins with the most representative ones, so a moving picture, which
        has only these, does not flicker.
        """
        renderer, camera = self._ready, self._camera(size)
        lights = tuple(renderer.lights) if self._dragged else ()
        source = self.method, size, tuple(light.place.tobytes() for light in lights)
        view = camera.to_world.tobytes(), *self._surface.values()
        if self.light is None or source != self._shown[0]:
            if self.light is not None:
                self.light.release()
            self.light = renderer.progressive(self.method, camera=camera, lights=lights)
        if (source, view) != self._shown:
            self.light.restart(camera, **self._surface)
        self._shown = source, view
        if self.light.frames < _ENOUGH:
            self.light.advance(_AT_ONCE)
        return self.light

    @property
    def _baked(self) -> bool:
        """Whether the method's table includes the coherence window."""
        return self.method in ("fast", "pq")

    @property
    def frame_ms(self) -> float:
        """Mean time of the last frames, ms."""
        return 1e3 * float(np.mean(self.times)) if self.times else 0.0

    def _panel(self) -> None:
        """Draw the panel and read its controls."""
        imgui.new_frame()
        imgui.set_next_window_pos((10, 10), imgui.Cond_.first_use_ever)
        imgui.begin(TITLE, flags=imgui.WindowFlags_.always_auto_resize)
        imgui.text(f"{self.frame_ms:.1f} ms a frame, {self._ready.driver}")
        changed, index = imgui.combo("method", METHODS.index(self.method), list(METHODS))
        if changed:
            self.choose(METHODS[index])
        _, self.stops = imgui.slider_float("exposure, stops", self.stops, -8.0, 8.0)
        if (most := self.largest_scale) is not None:
            _, self.scale = imgui.slider_float("height scale", self.scale, 0.05, most)
            if imgui.is_item_deactivated_after_edit():
                self._ready.energy_for(self.scale)
        if not self._baked:
            low = self.table_width
            _, self.width = imgui.slider_float("coherence, µm", self.width, low, 4.0 * low)
        _, self.shadows = imgui.checkbox("all light, with shadows", self.shadows)
        imgui.text(HELP)
        imgui.text(self.message)
        imgui.end()
        self._show_panel()

    def _say(self, text: str) -> None:
        """Show the panel with one line of text, on an empty picture."""
        self.wnd.fbo.clear(0.02, 0.02, 0.02)
        imgui.new_frame()
        imgui.begin(TITLE)
        imgui.text(text)
        imgui.end()
        self._show_panel()

    def _show_panel(self) -> None:
        """Render ImGui's current frame."""
        imgui.render()
        self.wnd.use()
        self.panel.render(imgui.get_draw_data())

    def choose(self, method: str) -> None:
        """Draw with another method, if it supports the surfaces."""
        try:
            self._ready.texture_bytes(method)
        except DiffractionError as error:
            self.message = str(error)
            return
        self.method, self.message = method, ""
        self.times.clear()
        if method in THESIS_METHODS:
            self.message = "a method of the thesis: slow, for comparison"

    def screenshot(self) -> Path:
        """Write the view without the panel as PNG, under the next free name."""
        target = self._ready.target(*self.wnd.fbo.size)
        try:
            self._draw(target.frame)
            picture = target.read()[..., :3]
        finally:
            target.release()
        path = write_screenshot(picture, self.folder, "view")
        self.message = f"written: {path}"
        return path

    def start_tracing(self) -> None:
        """Start path-tracing this view, one pass per frame."""
        renderer = self._ready
        width, height = self.wnd.fbo.size
        camera = self._camera((width, height))
        self.tracing = PathTracing(self.mitsuba_scene, camera, renderer.lights, self.spp)
        self.message = "path tracing ..."

    def _trace(self) -> None:
        """Render one pass of the path tracer; write the picture after the last one."""
        tracing = self.tracing
        assert tracing is not None
        tracing.advance()
        self.message = f"path tracing: {tracing.done} of {tracing.spp} samples"
        if tracing.finished:
            self.tracing = None
            encoded = shown(tracing.image * 2.0**self.stops, self.view)
            path = write_screenshot(encoded, self.folder, "view_path")
            self.message = f"written: {path} (direct light, {tracing.spp} samples)"

    on_mouse_position_event = _to_panel("mouse_position_event")
    on_mouse_press_event = _to_panel("mouse_press_event")
    on_mouse_release_event = _to_panel("mouse_release_event")
    on_unicode_char_entered = _to_panel("unicode_char_entered")
    on_resize = _to_panel("resize")

    def on_mouse_drag_event(self, x: int, y: int, dx: int, dy: int) -> None:
        """Orbit, pan, or drag the light."""
        self.panel.mouse_drag_event(x, y, dx, dy)
        if self._loading is not None or imgui.get_io().want_capture_mouse:
            return
        buttons = self.wnd.mouse_states
        if buttons.right:
            renderer = self._ready
            for n, light in enumerate(renderer.lights[:1]):
                renderer.lights[n] = dragged(light, self.orbit, _TURN * dx, -_TURN * dy)
                self._dragged = True
        elif buttons.middle or (buttons.left and self.wnd.modifiers.shift):
            height = self.wnd.size[1]
            self.orbit = self.orbit.panned(-dx / height, dy / height)
        elif buttons.left:
            self.orbit = self.orbit.turned(_TURN * dx, _TURN * dy)

    def on_mouse_scroll_event(self, x_offset: float, y_offset: float) -> None:
        """Zoom."""
        self.panel.mouse_scroll_event(x_offset, y_offset)
        if self._loading is None and not imgui.get_io().want_capture_mouse:
            self.orbit = self.orbit.zoomed(0.9**y_offset)

    def on_key_event(self, key: Any, action: Any, modifiers: Any) -> None:
        """Take a screenshot (S), path-trace (P) or reset (R)."""
        self.panel.key_event(key, action, modifiers)
        keys = self.wnd.keys
        if self._loading is not None or action != keys.ACTION_PRESS:
            return
        try:
            if key == keys.S:
                self.screenshot()
            elif key == keys.P and self.tracing is None:
                self.start_tracing()
            elif key == keys.R:
                self._start()
        except DiffractionError as error:
            self.message = str(error)  # a full disk need not close the window

    def on_close(self) -> None:
        """Free the graphics card's memory, even if the scene is only partly loaded."""
        self._loading = None
        if self.light is not None:
            self.light.release()
            self.light = None
        if self.renderer is not None:
            self.renderer.release()
            self.renderer = None


def show(
    scene: Any,
    *,
    sensor: int = 0,
    method: str = "fast",
    stops: float = 0.0,
    view: str = "natural",
    size: tuple[int, int] = (1280, 800),
    folder: Path = Path(),
    frames: int = 0,
    window: str = "pyglet",
) -> tuple[int, float]:
    """Open a window on a scene and wait until it is closed.

    sensor : index of the first camera.
    method, stops : first method, and exposure in stops.
    view : view of pictures, one of `optics.display.VIEWS`.
    size : size of the window, pixels.
    folder : folder of screenshots.
    frames : number of frames after which to close; 0 waits for the user.
    window : kind of window, as moderngl-window names it; "headless" needs no display.

    Returns the number of frames, and the mean time of the last ones in ms.

    Raises a DiffractionError if no window can be opened, or as `Renderer`.
    """
    settings = {
        "mitsuba_scene": scene, "sensor": sensor, "method": method, "stops": stops, "view": view,
        "folder": folder, "frames": frames, "window_size": size,
    }  # fmt: skip
    kind = type("SceneViewer", (ViewerWindow,), settings)
    arguments = ["--window", window]
    if window == "headless":
        arguments += ["--backend", "egl"]
    viewer = open_viewer(kind, arguments)
    moderngl_window.run_window_config_instance(viewer)
    return viewer.drawn, viewer.frame_ms


def open_viewer(kind: type[ViewerWindow], arguments: list[str]) -> ViewerWindow:
    """Create the window of a viewer, without showing it.

    arguments : arguments of moderngl-window's command line.

    Raises a DiffractionError if no window can be opened, or as `Renderer`.
    """
    try:
        viewer: ViewerWindow = moderngl_window.create_window_config_instance(kind, args=arguments)
    except DiffractionError:
        raise
    except Exception as error:  # exceptions differ by kind of window
        reason = " ".join(str(error).split()) or type(error).__name__
        raise DiffractionError(
            f"no window could be opened ({reason}); a display and OpenGL 3.3 are needed: over ssh "
            "use ssh -X, or render pictures with 'compare'"
        ) from error
    return viewer


def write_screenshot(picture: NDArray[np.floating], folder: Path, stem: str) -> Path:
    """Write a picture as `stem_000.png`, or under the next free number.

    picture : (height, width, 3) sRGB, clipped to 0 to 1.

    Raises a DiffractionError if the file cannot be written.
    """
    number = 0
    while (path := folder / f"{stem}_{number:03d}.png").exists():
        number += 1
    eight_bits = (np.clip(picture, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    with atomic_path(path) as temporary:
        Image.fromarray(eight_bits).save(temporary)
    return path
