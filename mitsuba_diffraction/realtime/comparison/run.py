"""A scene by shaders beside the path tracer: pictures, sheets, errors and times in a folder."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError, DiffractionWarning, warn
from ...progress import Progress, silent
from ...scene.passes import Stop, render_passes, write_exr
from ..glsl.context import clock_of
from ..glsl.renderer import Renderer
from ..glsl.scene import load
from ..glsl.source import THESIS_METHODS
from ..glsl.timing import fragment_times
from .measures import difference, exposure_of, regions
from .report import write_sheet
from .truth import box_sensor, direct_light, seen, with_lights

#: Samples along either side of a pixel for the slow methods, whose own errors are far larger.
_FEWER, _MOST = 2, 64
_DETAIL = 1024  # samples per pixel at most, under lights without extent, which are quiet
_STEP = 8  # frames between two looks at the clock

#: Of other methods than this one a part of the frames is drawn. What they differ by from this one's
#: in the same light, places and lobes has little noise, and is added to its picture of all frames.
_QUICK, _SPARED = "lut", 8
_IN_FRAME = 1 << 15  # samples that progressive light draws at once: fewer take about as long


class SameLights:
    """A scene for both renderers: direct light of directions and points alone.

    Lights with an extent are replaced by points and directions in both: the sun of a sky by its
    direction. The rest of the sky is left out of both.

    Parameters
    ----------
    scene : a `mi.Scene` of the variant that is set, or an XML file.
    sensor : index of the camera.
    name : what errors call the scene.

    Attributes
    ----------
    renderer : draws it by shaders.
    scene : for the path tracer; its one sensor averages evenly over each pixel.

    Raises
    ------
    DiffractionError
        If the scene has no light with a direction or place, or as of `glsl.Renderer`.
    """

    def __init__(self, scene: Any, *, sensor: int = 0, name: str = "the scene") -> None:
        scene = load(scene)
        self.renderer = Renderer(scene, sensor=sensor)
        if not self.renderer.lights:
            raise DiffractionError(
                f"{name} has no light with a direction or place to compare under; add a "
                "directional or point emitter, or a sky with a sun"
            )
        self.renderer.sky = np.zeros((4, 3))
        self.scene = with_lights(scene, self.renderer.camera, self.renderer.lights)
        self._sees = seen(self.scene, self.renderer.lights)
        known = {surface.shape.ptr: surface for surface in self.renderer.scene.surfaces}
        found = [known.get(shape.ptr) for shape in self.scene.shapes()]
        self._exact = np.array([s is not None and s.exact for s in found])
        self._diffracting = np.array([s is not None and s.material.bsdf is not None for s in found])

    def regions(self, drawn: NDArray[np.floating]) -> dict[str, NDArray[np.bool_]]:
        """Kinds of pixels (height, width) of a picture by `renderer`, see `measures.regions`."""
        return regions(self._sees, self._exact, self._diffracting, drawn[..., 3])


@dataclass(frozen=True)
class Halves:
    """A picture as two of half of its samples each."""

    first: Any
    second: Any

    @property
    def mean(self) -> Any:
        """The picture."""
        return 0.5 * (self.first + self.second)

    def noise(self, exposure: float, mask: Any = None) -> dict[str, float]:
        """ΔE2000 between a picture and one without noise, over some pixels: mean and 99 %."""
        apart = difference(self.first, self.second, mask, exposure)
        # two halves of the samples differ by twice what their mean is off
        return {
            "delta_e_mean": 0.5 * apart.delta_e_mean,
            "delta_e_99": 0.5 * apart.delta_e_percentiles["99"],
        }


@dataclass
class Comparison:
    """What is compared, and where the pictures go.

    Attributes
    ----------
    scene : a `mi.Scene` of the variant that is set.
    name : of its file.
    variant : that is set.
    folder : for pictures (EXR) and sheets (PNG); made when there is something to write.
    sensor : index of the camera.
    spp, full_spp : samples per pixel of the direct light and of full transport, which 0 leaves out.
    frames : of progressive light, in which methods that are not the thesis' are drawn.
    supersampling : the shaders' samples along either side of a pixel.
    seed : of the random numbers.
    progress : called as progress(done, total, text).
    """

    scene: Any
    name: str
    variant: str
    folder: Path
    sensor: int = 0
    spp: int = 1024
    full_spp: int = 64
    frames: int = 512
    supersampling: int = 8
    seed: int = 0
    progress: Progress = silent
    both: SameLights = field(init=False)
    _kept: dict[tuple[str, int], tuple[Halves, int, float]] = field(
        init=False, repr=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        self.both = SameLights(self.scene, sensor=self.sensor, name=f"'{self.name}'")

    def run(self, methods: Sequence[str], *, leave_out: bool = False) -> dict[str, Any]:
        """Draw with these methods of the shaders, path-trace, and measure.

        Parameters
        ----------
        leave_out : warn of methods that do not suit the surfaces, instead of raising their error.

        Raises
        ------
        DiffractionError
            Before anything is rendered, if a method does not suit the surfaces.
        KeyboardInterrupt
            If the rendering was interrupted: half a picture is no use here.
        """
        suited = [name for name in dict.fromkeys(methods) if self._suits(name, leave_out)]
        renderer, full = self.both.renderer, None
        with Stop() as stop:
            few = self._halves(self.both.scene, min(self.spp, _DETAIL), stop)
            truth = self._halves(direct_light(self.scene, renderer.camera), self.spp, stop)
            if self.full_spp:
                sensor = box_sensor(renderer.camera)
                full = self._traced(self.scene, sensor, self.full_spp, self.seed, stop)
        reference = few.mean
        exposure = exposure_of(reference)
        self._make_folder()
        self._write(truth.mean, "direct", self.spp)
        if full is not None:
            self._write(full, "full", self.full_spp)
        table, compared = self._drawn(suited, reference, exposure)
        for method in suited:
            if method not in THESIS_METHODS:
                table[method]["whole"] = self._whole(method, truth, full)
        return {
            "scene": self.name, "variant": self.variant, "driver": renderer.driver,
            "size": list(renderer.camera.size), "spp": self.spp, "exposure": exposure,
            "lights": [light.name for light in renderer.lights],
            "not_shown": list(renderer.scene.omissions),
            "noise_delta_e_mean": few.noise(exposure, compared)["delta_e_mean"],
            "whole_noise": truth.noise(exposure_of(truth.mean)),
            "clipped": float((truth.mean * exposure_of(truth.mean) > 1.0).any(axis=2).mean()),
            "frames": self.frames,
            "full_transport": None
            if full is None
            else difference(full, truth.mean, None, exposure_of(full)),
            "methods": table,
        }  # fmt: skip

    def _suits(self, method: str, leave_out: bool) -> bool:
        """Whether a method's tables can be made; they are kept for the drawing."""
        self.progress(0, 0, f"preparing {method}")
        try:
            self.both.renderer.prepared(method)
        except DiffractionError as error:
            if not leave_out:
                raise
            warn(f"left out: {error}")
            return False
        return True

    def _whole(self, method: str, truth: Halves, full: Any) -> dict[str, Any]:
        """All pixels in progressive light, against all direct light and against full transport."""
        frames = self.frames if method == _QUICK else max(self.frames // _SPARED // 4 * 4, 4)
        drawn, side, seconds = self._lit(method, frames)
        if method != _QUICK:
            many, few = (self._lit(_QUICK, n)[0] for n in (self.frames, frames))
            drawn = Halves(
                many.first + (drawn.first - few.first), many.second + (drawn.second - few.second)
            )
        exposure = exposure_of(truth.mean)
        found = difference(truth.mean, drawn.mean, None, exposure)
        self._write(drawn.mean, f"{method}_whole", self.frames)
        write_sheet(
            self.folder / f"{method}.png", truth.mean, drawn.mean, full, method=method,
            found=found, compared=None, exposure=exposure,
        )  # fmt: skip
        renderer = self.both.renderer
        fine = (side * renderer.camera.size[0], side * renderer.camera.size[1])
        return {
            "direct": found,
            "full": None if full is None else difference(full, drawn.mean, None, exposure_of(full)),
            "noise": drawn.noise(exposure),
            "frames": frames,
            "samples": self.frames * side**2,
            "frame_ms": 1e3 * seconds / frames,
            "plain_frame_ms": 1e3 * renderer.frame_time(method, size=fine, frames=3),
        }

    def _lit(self, method: str, frames: int) -> tuple[Halves, int, float]:
        """Progressive light, the samples along either side of a pixel, and the seconds."""
        if (method, frames) in self._kept:
            return self._kept[method, frames]
        renderer = self.both.renderer
        width, height = renderer.camera.size
        side = min(self.supersampling, math.isqrt(max(_IN_FRAME // (width * height), 1)))
        light = renderer.progressive(method, size=(side * width, side * height))
        clock = clock_of(renderer.driver)
        light.advance(2)  # compiles
        light.restart()
        halves, start = [], clock()
        for half in range(2):
            for done in range(0, frames // 2, _STEP):
                self.progress(half * frames // 2 + done, frames, f"lighting {method}")
                light.advance(min(_STEP, frames // 2 - done))
            parts = light.image[..., :3].reshape(height, side, width, side, 3)
            halves.append(parts.mean(axis=(1, 3), dtype=np.float64))
        seconds = clock() - start
        light.release()
        found = Halves(halves[0], 2.0 * halves[1] - halves[0]), side, seconds
        self._kept[method, frames] = found
        return found

    def _drawn(
        self, methods: Sequence[str], reference: Any, exposure: float
    ) -> tuple[dict[str, dict[str, Any]], Any]:
        """Errors, times and memory of all methods; pixels that both renderers see lit."""
        renderer, table = self.both.renderer, {}
        compared: Any = None
        for n, method in enumerate(methods):
            self.progress(n, len(methods), f"drawing with {method}")
            samples = min(self.supersampling, _FEWER if method in THESIS_METHODS else _MOST)
            with warnings.catch_warnings():  # its lights are those of both renderers
                warnings.simplefilter("ignore", DiffractionWarning)
                drawn = renderer.render(method, supersampling=samples)
            areas, picture = self.both.regions(drawn), drawn[..., :3]
            compared = areas["both"]
            errors = {
                name: difference(reference, picture, mask, exposure) for name, mask in areas.items()
            }
            seconds = renderer.frame_time(method, frames=1 if method in THESIS_METHODS else 3)
            self._write(picture, method, samples**2)
            if method in THESIS_METHODS:
                write_sheet(
                    self.folder / f"{method}.png", reference, picture, None, method=method,
                    found=errors["diffracting"], compared=compared, exposure=exposure,
                )  # fmt: skip
            table[method] = {
                "supersampling": samples,
                "frame_ms": 1e3 * seconds,
                "texture_bytes": renderer.texture_bytes(method),
                **errors,
            }
        self.progress(0, 1, "timing fragments")
        for method, times in fragment_times(renderer, tuple(table)).items():
            table[method]["fragment_ns"] = 1e9 * times["whole"]
            table[method]["look_up_ns"] = 1e9 * times["look_up"]
        return table, compared

    def _halves(self, scene: Any, spp: int, stop: Stop) -> Halves:
        """A path-traced picture of a scene with a sensor of its own."""
        seeds = (2 * self.seed, 2 * self.seed + 1)
        return Halves(*(self._traced(scene, scene.sensors()[0], spp // 2, s, stop) for s in seeds))

    def _traced(self, scene: Any, sensor: Any, spp: int, seed: int, stop: Stop) -> Any:
        """A path-traced picture (height, width, 3)."""
        result = render_passes(
            scene, sensor, spp=spp, seed=seed, variant=self.variant, stop=stop,
            progress=self.progress,
        )  # fmt: skip
        if result.interrupted:
            raise KeyboardInterrupt
        return np.array(result.bitmap, np.float32)[..., :3]

    def _make_folder(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DiffractionError(
                f"cannot make the folder '{self.folder}': {error.strerror}; choose another"
            ) from error

    def _write(self, image: Any, name: str, samples: int) -> None:
        import mitsuba as mi

        origin: dict[str, str | int] = {
            "scene": self.name, "variant": self.variant, "spp": samples,
        }  # fmt: skip
        bitmap = mi.Bitmap(np.ascontiguousarray(image, np.float32), mi.Bitmap.PixelFormat.RGB)
        write_exr(bitmap, self.folder / f"{name}.exr", origin)
