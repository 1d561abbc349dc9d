"""Choosing a variant and loading a scene, with every error in one line."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, DiffractionWarning
from ..plugin.names import name_of
from ..plugin.textures import check_attributes
from .mitsuba_text import error_of
from .parameters import check_parameters

# mi.load_file's own arguments: a scene parameter of that name could not be passed.
_TAKEN = ("path", "parallel", "optimize")


def set_variant(name: str | None) -> str:
    """Set a Mitsuba variant that works here, and return its name.

    Parameters
    ----------
    name : a variant; `None` takes cuda_ad_spectral where a GPU answers, else llvm_ad_spectral.

    Raises
    ------
    DiffractionError
        If there is no such variant, or no device or LLVM for it.
    """
    import drjit as dr
    import mitsuba as mi

    has_gpu = (name is None or name.startswith("cuda")) and dr.has_backend(dr.JitBackend.CUDA)
    if name is None:
        name = "cuda_ad_spectral" if has_gpu else "llvm_ad_spectral"
    if name not in mi.variants():
        raise DiffractionError(
            f"--mode: there is no variant {name!r}; there are {', '.join(mi.variants())}"
        )
    if name.startswith("cuda") and not has_gpu:
        raise DiffractionError(
            f"--mode {name}: no CUDA device answers; use "
            f"{name.replace('cuda', 'llvm', 1)}, or install an NVIDIA driver"
        )
    if name.startswith("llvm"):
        from ..plugin.llvm import require_llvm  # an unsuitable LLVM ends the process

        require_llvm()
    mi.set_variant(name)
    return name


def load_scene(file: Path, parameters: Mapping[str, Any]) -> Any:
    """Load an XML scene in the variant that is set.

    Raises
    ------
    DiffractionError
        If the file or anything that it refers to is missing or wrong.
    """
    import mitsuba as mi

    from ..plugin import registration  # noqa: F401  registers the plugin

    if file.is_dir():
        raise DiffractionError(f"'{file}' is a folder, not a scene; name an XML file in it")
    if not file.exists():
        raise DiffractionError(f"'{file}' does not exist; check the path")
    check_parameters(file, parameters)
    for name in _TAKEN:
        if name in parameters:
            raise DiffractionError(f"-D {name}: Mitsuba reserves this name; rename the parameter")
    try:
        # In threads Mitsuba 3.9 loads no faster, since its parser waits for each object; and Ctrl-C
        # reaches a plugin in Python on the main thread only
        scene = mi.load_file(str(file), parallel=False, **parameters)
    except (RuntimeError, UnicodeDecodeError) as error:
        raise error_of("cannot load the scene", error) from error
    if not isinstance(scene, mi.Scene):
        raise DiffractionError(f"'{file}' is not a scene; its outermost element must be <scene>")
    # "Diffraction[" is found inside twosided, blendbsdf and the like, too
    surfaces = {
        number: shape
        for number, shape in enumerate(scene.shapes())
        if "Diffraction[" in str(shape.bsdf())
    }
    for number, shape in surfaces.items():
        check_attributes(shape, number)
    _warn_of_missing_uv(surfaces)
    return scene


def _warn_of_missing_uv(surfaces: Mapping[int, Any]) -> None:
    """Name the meshes on which a patch has no direction: a BSDF itself cannot see its mesh."""
    lacking = [
        name_of(shape, number)
        for number, shape in surfaces.items()
        if shape.is_mesh() and not shape.has_vertex_texcoords()
    ]
    if lacking:
        warnings.warn(
            f"no texture coordinates on {'; '.join(lacking)}: the patch's direction is arbitrary "
            "there and turns from triangle to triangle; give the mesh directions with "
            "'mitsuba-diffraction tangents', or unwrap it so that u runs the way the patch's x "
            "axis shall",
            DiffractionWarning,
            stacklevel=2,
        )


def shrink(sensor: Any) -> None:
    """Halve the width and height of a sensor's film, its crop included."""
    import mitsuba as mi

    values = mi.traverse(sensor)
    for name in ("film.size", "film.crop_size", "film.crop_offset"):
        least = 0 if name.endswith("offset") else 1
        values[name] = [max(least, length // 2) for length in values[name]]
    values.update()


def preview_samples(sensor: Any, preview: bool) -> int:
    """The scene's own samples per pixel; for a preview at most 16."""
    own = int(sensor.sampler().sample_count())
    return min(own, 16) if preview else own


def sensor_of(scene: Any, index: int) -> Any:
    """One of the scene's sensors.

    Raises
    ------
    DiffractionError
        If there is none with that index.
    """
    sensors = scene.sensors()
    if not sensors:
        raise DiffractionError("the scene has no sensor; add a <sensor>")
    if not 0 <= index < len(sensors):
        raise DiffractionError(
            f"--sensor {index}: the scene has {len(sensors)}, numbered from 0 to {len(sensors) - 1}"
        )
    return sensors[index]
