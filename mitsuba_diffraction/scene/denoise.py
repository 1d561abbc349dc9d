"""Denoising of pictures by Intel's Open Image Denoise (extra `denoise`), on the processor.

The film's filter has to be a box (`load.load_scene`): wider ones spread noise over several pixels,
and the denoiser keeps such noise.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from ..extras import optional
from ..optics.colour import linear_srgb
from .pictures import colours_of

# samples per pixel of albedo and normals, which noise only at outlines and in depth of field
_SAMPLES = 64


def denoised(scene: Any, sensor: Any, picture: Any, spp: int, seed: int) -> Any:
    """Denoise a picture with the albedo and the normals of its scene.

    scene, sensor : scene and sensor that rendered the picture, of the variant that is set.
    picture : `mi.Bitmap` of the film.
    spp, seed : samples per pixel and seed of the picture.

    Returns a `mi.Bitmap` of linear sRGB. Raises a DiffractionError if pyoidn is not installed, or
    the picture holds no colours.
    """
    denoiser = optional("pyoidn")
    colours = colours_of(picture)
    if colours is None:
        raise DiffractionError("the film to be denoised holds no colours; give it the format rgb")
    rgb, single = mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32
    noisy = np.nan_to_num(np.array(colours.convert(rgb, single, False)), nan=0.0)
    kinds = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
    kinds.render(scene, sensor, seed=seed, spp=min(spp, _SAMPLES))
    guides = dict(sensor.film().bitmap().split())
    albedo, normal = (np.array(guides[name], np.float32) for name in ("albedo", "normal"))
    # the denoiser clips negative numbers, which saturated colours have in sRGB and none has in XYZ
    to_srgb = linear_srgb(np.eye(3))
    xyz = noisy @ np.linalg.inv(to_srgb).astype(np.float32)
    # in a spectral variant the wavelengths of a sample colour the albedo, and its noise would stay
    albedo = denoiser.denoise(np.clip(albedo, 0.0, 1.0)) @ np.linalg.inv(to_srgb)
    clean = denoiser.denoise(
        np.ascontiguousarray(xyz), np.ascontiguousarray(np.clip(albedo, 0.0, 1.0), np.float32),
        normal, hdr=True, clean_aux=True,
    )  # fmt: skip
    return mi.Bitmap((clean @ to_srgb).astype(np.float32), pixel_format=rgb)
