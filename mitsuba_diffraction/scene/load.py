"""Variants set, and scenes loaded, with Mitsuba's errors in one line."""

from __future__ import annotations

import contextlib
import functools
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError, warn
from ..files import readable_file
from ..inputs import note_input
from ..llvm import require_llvm
from ..plugin import installed
from ..system import memory
from .bands import SensorBands, check_bands, put_bands, wider_tables
from .elements import check_attributes, has_texcoords, name_of, surfaces_within
from .mitsuba_errors import error_of
from .orbit import turn_cameras
from .parameters import SceneValues, files_of, scene_values

if TYPE_CHECKING:
    from .surfaces import Edit

# Arguments of Mitsuba's `parse_file`: a scene parameter of that name could not be passed.
_TAKEN = ("config", "filename")
# Least memory of a pixel: film, bitmap and one path of a wavefront.
_BYTES_PER_PIXEL = 128
# Dr.Jit's names of the backends that need a GPU
_GPUS = {"cuda": "CUDA", "metal": "Metal"}


def set_variant(name: str | None, threads: int = 0) -> str:
    """Set a Mitsuba variant that works here, and return its name.

    name : a variant; `None` takes cuda_ad_spectral where a GPU answers, else llvm_ad_spectral.
    threads : of Dr.Jit in an LLVM variant; 0 leaves them as they are.

    Raises a DiffractionError if there is no such variant, or no device or LLVM for it.
    """
    if name is None:
        name = "cuda" if dr.has_backend(dr.JitBackend.CUDA) else "llvm"
        name += "_ad_spectral"
    if name not in mi.variants():
        raise DiffractionError(
            f"there is no variant {name!r}; there are {', '.join(mi.variants())}"
        )
    backend = name.partition("_")[0]
    if backend in _GPUS and not dr.has_backend(getattr(dr.JitBackend, _GPUS[backend])):
        raise DiffractionError(
            f"variant {name}: no {_GPUS[backend]} device answers; use "
            f"{name.replace(backend, 'llvm', 1)}, or install the driver of the GPU"
        )
    if backend == "llvm":
        require_llvm()  # an unsuitable LLVM ends the process
    mi.set_variant(name)
    if backend == "llvm" and threads and dr.thread_count() != threads:
        dr.set_thread_count(threads)
    return name


def load_scene(
    file: Path,
    parameters: Mapping[str, Any],
    *,
    box_filter: bool = False,
    bands: SensorBands | None = None,
    say: Callable[[str], None] | None = None,
) -> Any:
    """Load an XML scene in the variant that is set.

    box_filter : give all films a box as reconstruction filter instead of their own.
    bands : give all films these bands in place of colours, and heights tables that cover them.
    say : called with a line for each change of surfaces: the shapes and the material that it names.

    Raises a DiffractionError if the file or anything that it refers to is missing or wrong.
    """
    readable_file(file)
    values = scene_values(file, parameters)
    known = files_of(file, values.parameters)
    for each in known:
        note_input(each)
    for name in _TAKEN:
        if name in values.parameters:
            raise DiffractionError(f"parameter {name!r}: Mitsuba reserves this name; rename it")
    serving = contextlib.nullcontext() if bands is None else wider_tables(bands.first)
    with serving, _read_by_mitsuba(file):
        _check_parameters_act(file, values)
        scene, edits = _instantiated(file, known, values, box_filter, bands)
    if not isinstance(scene, mi.Scene):
        raise DiffractionError(f"'{file}' is not a scene; its outermost element must be <scene>")
    # Found inside twosided, blendbsdf and the like, too
    shapes, surfaces = {}, {}
    for number, shape in enumerate(scene.shapes()):
        if within := surfaces_within(shape.bsdf()):
            name = name_of(shape, number)
            shapes[name], surfaces[name] = shape, within
            check_attributes(shape, name)
    _warn_of_missing_uv(shapes)
    if values.orbit:
        turn_cameras(scene.sensors(), shapes.values() or scene.shapes(), values.orbit)
    check_bands(scene.sensors(), surfaces, eye=bands is not None)
    for edit in edits:
        if say is not None:
            say(edit.line(scene))
    return scene


def check_values(file: Path, parameters: Mapping[str, Any]) -> None:
    """Refuse values that Mitsuba cannot parse, such as a fraction for a whole number.

    The variant is set, and the scene's parameters have these names.

    Raises a DiffractionError with the parameter's place in the scene.
    """
    values = scene_values(file, parameters)
    with _read_by_mitsuba(file):
        mi.parser.parse_file(mi.parser.ParserConfig(mi.variant()), str(file), **values.parameters)


def _check_parameters_act(file: Path, values: SceneValues) -> None:
    """Refuse values other than the defaults that only BSDFs read which surfaces on ids replace."""
    from .mesh_materials import split_meshes
    from .surfaces import effective, put_materials

    @functools.cache
    def read(without: str, covered: bool) -> list[str]:
        config = mi.parser.ParserConfig(mi.variant())
        # without `light`, its file's own parameters have no use
        config.unused_parameters = mi.LogLevel.Debug
        given = {name: v for name, v in values.parameters.items() if name != without}
        parsed = mi.parser.parse_file(config, str(file), **given)
        mi.parser.transform_resolve_references(config, parsed)
        split_meshes(parsed, values.materials)
        if covered:  # without `mesh` there is another one, of other materials
            ids = parsed.id_to_index
            put_materials(parsed, {k: v for k, v in values.materials.items() if k in ids})
        return effective(parsed)

    for name, value in values.parameters.items() if values.materials else ():
        if values.defaults.get(name) in (None, str(value)):
            continue
        # a value may be the default in other words: 0.0 for 0, the whole path of a file
        before, after = (read("", covered) != read(name, covered) for covered in (False, True))
        if before and not after:
            raise DiffractionError(
                f"{name}={value} changes nothing: the scene uses it in a BSDF that the "
                f"surface on {', '.join(values.materials)} replaces; give that surface the "
                f"parameter instead, e.g. cd,{name}={value}, or leave it out"
            )


def _instantiated(
    file: Path,
    known: Sequence[Path],
    values: SceneValues,
    box_filter: bool,
    bands: SensorBands | None,
) -> tuple[Any, list[Edit]]:
    """Parse a scene, insert meshes, materials and filters, and create Mitsuba's objects.

    Returns the scene, and the changes of its surfaces.

    known : files that the scene may include, by `files_of`.

    Raises a DiffractionError if Mitsuba reads other files than these.
    """
    from .additions import fit_meshes, put_box_filters, remove_dark_lights
    from .clamping import put_clamp
    from .mesh_materials import split_meshes
    from .nodes import check_nodes
    from .surfaces import put_materials, put_surface_parameters

    config = mi.parser.ParserConfig(mi.variant())
    # In threads Mitsuba 3.9 loads no faster, since its parser waits for each object; and Ctrl-C
    # reaches a plugin in Python on the main thread only
    config.parallel = False
    with tempfile.TemporaryDirectory() as folder:
        state = mi.parser.parse_file(config, str(file), **values.parameters)
        expected = {path.resolve() for path in known}
        for path in map(Path, map(str, state.files)):
            if path.resolve() not in expected:  # Mitsuba reads the XML differently than Python
                raise DiffractionError(
                    f"'{path}' is included by malformed XML; write <include filename='NAME'/>, "
                    "without entities of a document type"
                )
        mi.parser.transform_resolve_references(config, state)
        installed.check_plugins(state)
        installed.search_first()  # before the scene's folder
        _check_films(state)
        of_meshes = split_meshes(state, values.materials)
        fit_meshes(state, Path(folder))
        edits = put_materials(state, values.materials, of_meshes)
        edits += put_surface_parameters(state, values.surface)
        mi.parser.transform_all(config, state)
        check_nodes(state)
        remove_dark_lights(state)
        if values.clamp is not None:
            put_clamp(state, values.clamp)
        if box_filter:
            put_box_filters(state)
        if bands is not None:
            put_bands(state, bands)
        return mi.parser.instantiate(config, state), edits


@contextlib.contextmanager
def _read_by_mitsuba(scene: Path) -> Iterator[None]:
    """Resolve files that a scene names relative to it, and raise Mitsuba's errors as `error_of`."""
    before = mi.file_resolver()
    resolver = mi.FileResolver(before)
    resolver.prepend(str(scene.absolute().parent))
    mi.set_file_resolver(resolver)
    try:
        yield
    except (RuntimeError, UnicodeDecodeError) as error:
        raise error_of("cannot load the scene", error) from error
    finally:
        mi.set_file_resolver(before)


def _warn_of_missing_uv(shapes: Mapping[str, Any]) -> None:
    """Warn of meshes on which a patch has no direction: a BSDF itself cannot see its mesh."""
    lacking = [n for n, shape in shapes.items() if shape.is_mesh() and not has_texcoords(shape)]
    if lacking:
        warn(
            f"no texture coordinates on {'; '.join(lacking)}: the patch's direction is arbitrary "
            "there and turns from triangle to triangle; give the mesh directions with "
            "the command 'tangents', or unwrap it so that u runs the way the patch's x "
            "axis shall"
        )


def shrink(sensor: Any, factor: float = 2.0) -> None:
    """Divide the width and height of a sensor's film, its crop included, by a factor."""
    values = mi.traverse(sensor)
    for name in ("film.size", "film.crop_size", "film.crop_offset"):
        least = 0 if name.endswith("offset") else 1
        values[name] = [max(least, int(length / factor)) for length in values[name]]
    values.update()


def preview_samples(sensor: Any, preview: bool) -> int:
    """Return the scene's own samples per pixel; for a preview at most 16."""
    samples = int(sensor.sampler().sample_count())
    return min(samples, 16) if preview else samples


def sensor_of(scene: Any, index: int, preview: bool = False) -> Any:
    """Return a sensor of the scene, for a preview with half of its pixels along either side.

    Raises a DiffractionError if no sensor has that index.
    """
    sensors = scene.sensors()
    if not sensors:
        raise DiffractionError("the scene has no sensor; add a <sensor>")
    if not 0 <= index < len(sensors):
        raise DiffractionError(
            f"sensor {index}: the scene has {len(sensors)}, numbered from 0 to {len(sensors) - 1}"
        )
    if preview:
        shrink(sensors[index])
    return sensors[index]


def _check_films(state: Any) -> None:
    """Refuse films whose pictures would exceed the memory of this machine.

    state : `mi.parser.ParserState`; no surface is loaded yet, since that may take minutes.
    """
    for node in state.nodes:
        if node.type != mi.ObjectType.Film:
            continue
        width, height = (
            node.props.get(f"crop_{name}", node.props.get(name, default))
            for name, default in (("width", 768), ("height", 576))  # Mitsuba's
        )
        if not isinstance(width, int) or not isinstance(height, int):
            continue  # Mitsuba names the type that it expects
        if width * height == 0:
            raise DiffractionError(
                f"a picture of {width} x {height} pixels has none; give a width and a height of at "
                "least 1 (resx, resy of most scenes)"
            )
        needed = width * height * _BYTES_PER_PIXEL
        if needed > memory():
            raise DiffractionError(
                f"a picture of {width} x {height} pixels needs some {needed / 1e9:.3g} GB, and "
                f"this machine has {memory() / 1e9:.3g} GB; use fewer pixels (resx, resy of most "
                "scenes)"
            )
