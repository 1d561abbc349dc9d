"""Comparison of the shaders with the path tracer: pictures, sheets, errors and times."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...atomic import make_folder
from ...errors import DiffractionError, warn
from ...progress import Progress, Stages, silent
from ...scene.passes import Stop, render_passes
from ...scene.pictures import write_exr
from ..glsl.renderer import Renderer
from ..glsl.timing import fragment_times
from .measures import dark_region, difference, exposure_of
from .path_traced import box_sensor, direct_light
from .report import write_sheet

_STEP = 8  # frames between two reports of progress

#: Only every `_SPARED`-th frame of methods other than `_QUICK` is drawn. Their difference from
#: `_QUICK` with the same lights and samples has little noise; it is added to the picture of all
#: frames by `_QUICK`.
_QUICK, _SPARED = "fast", 8
_IN_FRAME = 1 << 15  # samples that progressive light draws at once; fewer are not faster


@dataclass(frozen=True)
class Halves:
    """Two pictures with half of the samples each."""

    first: Any
    second: Any

    @property
    def mean(self) -> Any:
        """Picture of all samples."""
        return 0.5 * (self.first + self.second)

    def noise(self, exposure: float) -> dict[str, float]:
        """Estimate the ΔE2000 of the mean from a picture without noise: mean and 99 %."""
        halves = difference(self.first, self.second, exposure)
        # the difference of the halves is twice the error of their mean
        return {
            "delta_e_mean": 0.5 * halves.delta_e_mean,
            "delta_e_99": 0.5 * halves.delta_e_percentiles["99"],
        }


#: Picture in progressive light, samples along a side of a pixel, and seconds.
ProgressivePicture = tuple[Halves, int, float]


@dataclass
class Comparison:
    """Parameters of a comparison, and its folder of pictures.

    Attributes
    ----------
    scene : a `mi.Scene` of the current variant.
    name : name of the scene's file.
    variant : name of the current variant.
    folder : folder of pictures (EXR) and sheets (PNG), created with the first file.
    sensor : index of the camera.
    spp, full_spp : samples per pixel of the direct light and of full transport; 0 leaves it out.
    frames : frames of progressive light.
    supersampling : largest number of samples of the shaders along either side of a pixel.
    seed : seed of the random numbers.
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
    renderer: Renderer = field(init=False)
    _stages: Stages = field(init=False, repr=False)
    _progressive: dict[tuple[str, int, bool], ProgressivePicture] = field(
        init=False, repr=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        self.renderer = Renderer(self.scene, sensor=self.sensor)

    def run(self, methods: Sequence[str], *, leave_out: bool = False) -> dict[str, Any]:
        """Draw with these methods of the shaders, path-trace, and measure.

        leave_out : warn of methods that do not support the surfaces, instead of raising errors.

        Raises
        ------
        DiffractionError
            Before anything is rendered, if a method does not support the surfaces.
        KeyboardInterrupt
            If the rendering was interrupted.
        """
        supported = [name for name in dict.fromkeys(methods) if self._supports(name, leave_out)]
        camera, full = self.renderer.camera, None
        drawn = {each for method in supported for each in self._drawn(method)}
        # two halves of direct light, full transport, and the times of fragments
        self._stages = Stages(self.progress, 2 + bool(self.full_spp) + len(drawn) + 1)
        with Stop() as stop:
            direct = self._halves(direct_light(self.scene, camera), stop)
            if self.full_spp:
                sensor = box_sensor(camera)
                full = self._path_trace(self.scene, sensor, self.full_spp, self.seed, stop)
        exposure = exposure_of(direct.mean)
        make_folder(self.folder)
        self._write(direct.mean, "direct", self.spp)
        if full is not None:
            self._write(full, "full", self.full_spp)
        table = {method: self._compare(method, direct, full) for method in supported}
        self._stages.next()(0, 1, "timing fragments")
        for method, seconds in fragment_times(self.renderer, supported).items():
            table[method]["fragment_ns"] = 1e9 * seconds
        return {
            "scene": self.name, "variant": self.variant, "driver": self.renderer.driver,
            "size": list(camera.size), "spp": self.spp, "exposure": exposure,
            "not_shown": list(self.renderer.scene.omissions),
            "noise": direct.noise(exposure),
            "clipped": float((direct.mean * exposure > 1.0).any(axis=2).mean()),
            "frames": self.frames,
            "full_transport": None
            if full is None
            else difference(full, direct.mean, exposure_of(full)),
            "methods": table,
        }  # fmt: skip

    def _supports(self, method: str, leave_out: bool) -> bool:
        """Prepare a method's tables, and return whether it supports the surfaces."""
        self.progress(0, 0, f"preparing {method}")
        try:
            self.renderer.tables(method)
        except DiffractionError as error:
            if not leave_out:
                raise
            warn(f"left out: {error}")
            return False
        return True

    def _frames_of(self, method: str) -> int:
        """Return the number of frames that a method draws."""
        return self.frames if method == _QUICK else max(self.frames // _SPARED // 4 * 4, 4)

    def _drawn(self, method: str) -> set[tuple[str, int, bool]]:
        """Return the pictures of `_draw_progressive` for the comparison of a method."""
        frames = self._frames_of(method)
        drawn = {(method, frames, False), (_QUICK, frames, False), (_QUICK, self.frames, False)}
        return drawn | ({(method, frames, True)} if self.full_spp else set())

    def _compare(self, method: str, direct: Halves, full: Any) -> dict[str, Any]:
        """Compare all pixels in progressive light with direct light and with full transport."""
        frames = self._frames_of(method)
        picture, side, seconds = self._draw_progressive(method, frames)
        if method != _QUICK:
            many, few = (self._draw_progressive(_QUICK, n)[0] for n in (self.frames, frames))
            picture = Halves(
                many.first + (picture.first - few.first),
                many.second + (picture.second - few.second),
            )
        exposure = exposure_of(direct.mean)
        errors = difference(direct.mean, picture.mean, exposure)
        self._write(picture.mean, method, self.frames)
        beside_full: dict[str, Any] = {"full": None, "dark_region": None}
        if full is not None:
            bounced = self._draw_progressive(method, frames, bounces=True)[0].mean
            self._write(bounced, f"{method}_bounces", frames)
            beside_full["full"] = difference(full, bounced, exposure_of(full))
            beside_full["dark_region"] = dark_region(full, bounced)
        write_sheet(
            self.folder / f"{method}.png", direct.mean, picture.mean, full, method=method,
            errors=errors, exposure=exposure,
        )  # fmt: skip
        return {
            "direct": errors,
            **beside_full,
            "noise": picture.noise(exposure),
            "frames": frames,
            "samples": self.frames * side**2,
            "frame_ms": 1e3 * seconds / frames,
            "texture_bytes": self.renderer.texture_bytes(method),
        }

    def _draw_progressive(
        self, method: str, frames: int, bounces: bool = False
    ) -> ProgressivePicture:
        """Draw frames of progressive light; results are cached."""
        if (method, frames, bounces) in self._progressive:
            return self._progressive[method, frames, bounces]
        renderer = self.renderer
        width, height = renderer.camera.size
        side = min(self.supersampling, math.isqrt(max(_IN_FRAME // (width * height), 1)))
        size = side * width, side * height
        light = renderer.progressive(method, size=size, bounces=bounces)
        clock = renderer.clock
        light.advance(2)  # compiles
        light.restart()
        halves, start, progress = [], clock(), self._stages.next()
        for half in range(2):
            for done in range(0, frames // 2, _STEP):
                progress(half * frames // 2 + done, frames, f"lighting {method}")
                light.advance(min(_STEP, frames // 2 - done))
            parts = light.image[..., :3].reshape(height, side, width, side, 3)
            halves.append(parts.mean(axis=(1, 3), dtype=np.float64))
        seconds = clock() - start
        light.release()
        picture = Halves(halves[0], 2.0 * halves[1] - halves[0])
        self._progressive[method, frames, bounces] = picture, side, seconds
        return self._progressive[method, frames, bounces]

    def _halves(self, scene: Any, stop: Stop) -> Halves:
        """Path-trace a scene by its first sensor, in two halves of the samples."""
        sensor, seeds = scene.sensors()[0], (2 * self.seed, 2 * self.seed + 1)
        return Halves(*(self._path_trace(scene, sensor, self.spp // 2, s, stop) for s in seeds))

    def _path_trace(self, scene: Any, sensor: Any, spp: int, seed: int, stop: Stop) -> Any:
        """Path-trace a picture (height, width, 3)."""
        result = render_passes(
            scene, sensor, spp=spp, seed=seed, stop=stop,
            progress=self._stages.next(),
        )  # fmt: skip
        if result.interrupted:
            raise KeyboardInterrupt
        return np.array(result.bitmap, np.float32)[..., :3]

    def _write(self, image: Any, name: str, samples: int) -> None:
        """Write a picture as EXR, with scene, variant and samples per pixel."""
        import mitsuba as mi

        origin: dict[str, str | int] = {
            "scene": self.name, "variant": self.variant, "spp": samples,
        }  # fmt: skip
        bitmap = mi.Bitmap(np.ascontiguousarray(image, np.float32), mi.Bitmap.PixelFormat.RGB)
        write_exr(bitmap, self.folder / f"{name}.exr", origin)
