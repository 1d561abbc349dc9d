"""Maps on disk: PNG with axes, for the eye, and EXR, linear, for everything else."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np
import OpenEXR

from ...atomic import atomic_path
from . import picture
from .result import BrdfMap

#: The attribute that says what an EXR's map is of. One string: OpenEXR keeps numbers as floats.
ATTRIBUTE = "brdf_map"


def save_png(
    brdf_map: BrdfMap,
    path: str | os.PathLike[str],
    *,
    exposure: float | None = None,
    title: str = "BRDF",
    notes: str = "",
) -> None:
    """Write a picture with axes, a title and a caption.

    Parameters
    ----------
    exposure : stops; by default `brdf_map.exposure()`.
    title, notes : see `picture.figure`.

    Raises
    ------
    DiffractionError
        If it cannot be written; nothing half-written is left.
    """
    with atomic_path(path) as temporary:
        drawn = picture.figure(brdf_map, exposure, title=title, notes=notes)
        drawn.savefig(temporary, format="png")


def save_exr(
    brdf_map: BrdfMap, path: str | os.PathLike[str], *, notes: dict[str, Any] | None = None
) -> None:
    """Write linear numbers in 1/sr, in single precision, neither exposed nor clipped.

    Channels are R, G, B (linear sRGB, which may be negative) or, for a single wavelength, Y; A is
    the share of the pixel that the hemisphere covers, and the others are premultiplied with it.
    Bands are named as spectral EXR files name reflectances (Fichet, Pacanowski and Wilkie 2021),
    `T.550,0nm` for that middle. The first row is the largest y.

    Parameters
    ----------
    notes : more entries for the JSON attribute `brdf_map`.

    Raises
    ------
    DiffractionError
        If it cannot be written; nothing half-written is left.
    """
    channels = {"A": brdf_map.coverage}
    if brdf_map.xyz is None:
        channels["Y"] = brdf_map.luminance
    else:
        linear = brdf_map.linear
        channels |= {name: linear[..., n] for n, name in enumerate("RGB")}
        if brdf_map.spectrum is not None:
            wavelengths = brdf_map.bands.wavelengths()
            names = (f"T.{f'{w:.6g}'.replace('.', ',')}nm" for w in wavelengths)
            channels |= dict(zip(names, brdf_map.spectrum, strict=True))
    document = {
        "quantity": "f cosθo" if brdf_map.cosine else "f",
        "unit": "1/sr",
        "theta": brdf_map.light.theta,
        "phi": brdf_map.light.phi,
        "wavelength_range": [brdf_map.bands.low, brdf_map.bands.high],
        "step": brdf_map.bands.width,
        "illuminant": brdf_map.illuminant,
        "samples": brdf_map.samples,
        **(notes or {}),
    }
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        ATTRIBUTE: json.dumps(document),
    }
    if brdf_map.spectrum is not None:
        header["spectralLayoutVersion"] = "1.0"
    pixels = {name: np.ascontiguousarray(values[::-1]) for name, values in channels.items()}
    with atomic_path(path) as temporary:
        try:
            OpenEXR.File(header, pixels).write(str(temporary))
        except RuntimeError as error:  # what OpenEXR makes of a full disk
            raise OSError(None, f"OpenEXR: {' '.join(str(error).split())}") from error
