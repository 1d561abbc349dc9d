"""Packages of the extras, imported by the features that need them."""

from __future__ import annotations

import importlib
from importlib.metadata import requires
from typing import Any, NamedTuple

from .errors import DiffractionError

_NAME = "mitsuba_diffraction"


class _Need(NamedTuple):
    """Need for a package: a clause that states it, the extra that has it, and an alternative."""

    clause: str
    extra: str
    alternative: str = ""


_NEEDS = {
    "SurfaceTopography": _Need("instrument files need SurfaceTopography", "afm"),
    "distributed": _Need("workers need Dask", "cluster"),
    "flip_evaluator": _Need("FLIP needs flip-evaluator", "gl"),
    "h5py": _Need(
        "NetCDF files of version 4 need h5py",
        "solve",
        "write the classic format: format='NETCDF3_64BIT' in xarray, 'classic' in MATLAB",
    ),
    "imageio_ffmpeg": _Need(
        "films ending in .mp4 need imageio-ffmpeg", "film", "name a film ending in .webp or .gif"
    ),
    "moderngl": _Need("the shaders need moderngl", "gl"),
    "pxr": _Need("USD files need usd-core", "usd", "export the mesh as GLB, PLY or OBJ"),
    "pyoidn": _Need("denoising needs pyoidn", "denoise"),
    "trimesh": _Need("glTF files need trimesh", "gltf", "export the mesh as PLY or OBJ"),
}


def optional(module: str, subject: str = "") -> Any:
    """Import a module of a package that an extra has.

    subject : file or option at which the need arose, for the message.

    Raises a DiffractionError if it cannot be imported; the message names packages and extra.
    """
    need = _NEEDS[module.partition(".")[0]]
    try:
        return importlib.import_module(module)
    except ImportError as error:
        place = f"{subject}: " if subject else ""
        # pip needs no copy of this package
        marked = [line.partition(";")[::2] for line in requires(_NAME) or ()]
        marker = f"extra == '{need.extra}'"
        packages = " ".join(f"'{each.strip()}'" for each, when in marked if marker in when)
        alternative = f", or {need.alternative}" if need.alternative else ""
        raise DiffractionError(
            f"{place}{need.clause}, which is not installed: pip install "
            f"{packages} (extra {need.extra}){alternative}"
        ) from error
