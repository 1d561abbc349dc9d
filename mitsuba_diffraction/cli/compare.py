"""`mitsuba-diffraction compare`: the realtime picture of a scene against the path-traced one."""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import DiffractionError
from ..realtime.glsl.source import METHODS, THESIS_METHODS
from .arguments import whole_number
from .console import say_warning
from .output import check_writable
from .progress import Bar
from .report import plain, save_json
from .scene_options import add_scene_options, scene_parameters

if TYPE_CHECKING:
    from ..realtime.comparison import SameLights

#: Samples along either side of a pixel for the slow methods, whose own errors are far larger.
_FEWER = 2


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declare the sub-command."""
    parser = subparsers.add_parser(
        "compare",
        help="compare the realtime picture of a scene with the path-traced one",
        description=(
            "Render a scene by shaders and by path tracing, aligned to the pixel, and measure the "
            "difference where both see the same lit surface. Lights with an extent are replaced "
            "by points and directions in both: the sun of a sky by its direction. A second "
            "path-traced picture, of the scene as it is, shows what realtime leaves out."
        ),
    )
    add_scene_options(parser)
    parser.add_argument(
        "-o", "--output", metavar="FOLDER", type=Path,
        help="for pictures (EXR), sheets (PNG) and compare.json; default: the scene's name with "
        "_compare in the current folder",
    )  # fmt: skip
    parser.add_argument(
        "--method", nargs="+", metavar="NAME", choices=(*METHODS, "all"), default=["lut"],
        help=f"of the shaders: some of {', '.join(METHODS)}, or all; default: lut",
    )  # fmt: skip
    parser.add_argument(
        "-s", "--spp", metavar="N", type=whole_number(2), default=1024,
        help="samples per pixel of the path-traced direct light; default: 1024",
    )  # fmt: skip
    parser.add_argument(
        "--full-spp", metavar="N", type=whole_number(0), default=64,
        help="samples per pixel of full transport; 0 leaves it out; default: 64",
    )  # fmt: skip
    parser.add_argument(
        "--supersampling", metavar="N", type=whole_number(1), default=8,
        help="the shaders' samples along either side of a pixel (at most 2 of flss, nmm and pq); "
        "default: 8",
    )  # fmt: skip
    parser.add_argument(
        "--seed", metavar="N", type=whole_number(0), default=0,
        help="of the random numbers; default: 0",
    )  # fmt: skip
    parser.set_defaults(run=run, parser=parser)


def run(args: argparse.Namespace) -> int:
    """Compare, and return the exit code."""
    parameters = scene_parameters(args)
    folder = args.output or Path(f"{args.scene.stem}_compare")
    if folder.exists() and not folder.is_dir():
        raise DiffractionError(f"-o {folder}: it is a file; name a folder")
    check_writable(folder / "compare.json", make_folder=True)

    from ..realtime.comparison import SameLights, difference, exposure_of
    from ..realtime.comparison.table import markdown
    from ..scene.load import load_scene, sensor_of, set_variant
    from .console import warnings_as_ours

    start = time.perf_counter()
    variant = set_variant(args.mode)
    with warnings_as_ours(), Bar(args, unit=" spp", delay=0) as bar:
        bar(0, args.spp, "loading")
        scene = load_scene(args.scene, parameters)
        sensor_of(scene, args.sensor)
        both = SameLights(scene, sensor=args.sensor, name=f"'{args.scene}'")
        renderer = both.renderer
        halves, full = _path_traced(args, scene, both, variant, bar)
        reference = 0.5 * (halves[0] + halves[1])
        _make_folder(folder)
        _write(reference, folder / "direct.exr", args, variant, args.spp)
        if full is not None:
            _write(full, folder / "full.exr", args, variant, args.full_spp)
        pictures = _Pictures(args, variant, folder, both, reference, full, exposure_of(reference))
        table = _drawn(pictures, bar)
    noise = difference(halves[0], halves[1], pictures.compared, pictures.exposure)
    everywhere = np.ones(reference.shape[:2], bool)
    document = {
        "scene": str(args.scene), "parameters": parameters, "variant": variant,
        "driver": renderer.driver, "size": list(renderer.camera.size), "spp": args.spp,
        "exposure": pictures.exposure,
        "lights": [light.name for light in renderer.lights],
        "not_shown": list(renderer.scene.omissions),
        # two halves of the samples differ by twice what their mean is off
        "noise_delta_e_mean": 0.5 * noise.delta_e_mean,
        "full_transport": None
        if full is None
        else difference(full, reference, everywhere, pictures.exposure),
        "methods": table,
    }  # fmt: skip
    save_json(folder / "compare.json", document)
    print(markdown(plain(document)))
    print(f"{folder}: pictures, sheets and compare.json, {time.perf_counter() - start:.0f} s")
    return 0


@dataclass
class _Pictures:
    """What the methods' pictures are held against, and where they go.

    Attributes
    ----------
    both : the scene for both renderers.
    reference, full : (height, width, 3) path-traced under the shaders' lights, and as it is.
    compared : (height, width) pixels that both see lit, of the last method.
    """

    args: argparse.Namespace
    variant: str
    folder: Path
    both: SameLights
    reference: Any
    full: Any
    exposure: float
    compared: Any = None


def _path_traced(
    args: argparse.Namespace, scene: Any, both: SameLights, variant: str, bar: Bar
) -> tuple[list[Any], Any]:
    """Two halves of the samples of direct light, and full transport if it is asked for."""
    from ..realtime.comparison.truth import box_sensor
    from ..scene.passes import Stop

    direct, full = both.scene, None
    with Stop() as stop:
        halves = [
            _traced(direct, direct.sensors()[0], args.spp // 2, seed, variant, stop, bar)
            for seed in (2 * args.seed, 2 * args.seed + 1)
        ]
        if args.full_spp:
            sensor = box_sensor(both.renderer.camera)
            full = _traced(scene, sensor, args.full_spp, args.seed, variant, stop, bar)
    return halves, full


def _drawn(pictures: _Pictures, bar: Bar) -> dict[str, dict[str, Any]]:
    """Draw with all methods that were asked for, and measure them."""
    from ..realtime.glsl.timing import fragment_times

    args, table = pictures.args, {}
    every = "all" in args.method
    methods = METHODS if every else tuple(dict.fromkeys(args.method))
    for n, method in enumerate(methods):
        bar(n, len(methods), f"drawing with {method}")
        samples = min(args.supersampling, _FEWER if method in THESIS_METHODS else 64)
        try:
            drawn = pictures.both.renderer.render(method, supersampling=samples)
        except DiffractionError as error:
            if not every:
                raise
            say_warning(f"left out: {error}")  # it does not suit this surface
            continue
        table[method] = _compared(pictures, method, drawn, samples)
    bar(0, 1, "timing fragments")
    for method, times in fragment_times(pictures.both.renderer, tuple(table)).items():
        table[method]["fragment_ns"] = 1e9 * times["whole"]
        table[method]["look_up_ns"] = 1e9 * times["look_up"]
    return table


def _compared(pictures: _Pictures, method: str, drawn: Any, samples: int) -> dict[str, Any]:
    """Write a method's picture and sheet; its errors, time and memory."""
    from ..realtime.comparison import difference
    from ..realtime.comparison.sheet import write_sheet

    renderer, reference = pictures.both.renderer, pictures.reference
    folder, exposure = pictures.folder, pictures.exposure
    areas = pictures.both.regions(drawn)
    pictures.compared, other = areas["both"], drawn[..., :3]
    errors = {name: difference(reference, other, mask, exposure) for name, mask in areas.items()}
    seconds = renderer.frame_time(method, frames=1 if method in THESIS_METHODS else 3)
    _write(other, folder / f"{method}.exr", pictures.args, pictures.variant, samples**2)
    write_sheet(
        folder / f"{method}.png", reference, other, pictures.full, method=method,
        found=errors["diffracting"], compared=areas["both"], exposure=exposure,
    )  # fmt: skip
    return {
        "supersampling": samples,
        "frame_ms": 1e3 * seconds,
        "texture_bytes": renderer.texture_bytes(method),
        **errors,
    }


def _traced(scene: Any, sensor: Any, spp: int, seed: int, variant: str, stop: Any, bar: Bar) -> Any:
    """A path-traced picture (height, width, 3); half a picture is no use here."""
    from ..scene.passes import render_passes

    result = render_passes(
        scene, sensor, spp=spp, seed=seed, variant=variant, stop=stop, progress=bar
    )
    if result.interrupted:
        raise KeyboardInterrupt
    return np.array(result.bitmap, np.float32)[..., :3]


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DiffractionError(
            f"cannot make the folder '{folder}': {error.strerror}; choose another with -o"
        ) from error


def _write(image: Any, path: Path, args: argparse.Namespace, variant: str, samples: int) -> None:
    import mitsuba as mi

    from ..scene.pictures import write_exr

    origin: dict[str, str | int] = {"scene": str(args.scene), "variant": variant, "spp": samples}
    bitmap = mi.Bitmap(np.ascontiguousarray(image, np.float32), mi.Bitmap.PixelFormat.RGB)
    write_exr(bitmap, path, origin)
