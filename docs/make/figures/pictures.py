"""Pictures of docs/images: patches and their light, BRDF maps, the snakes of the scenes.

    python -m docs.make.figures.pictures -o docs/images \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from mitsuba_diffraction.analysis.maps import LightDirection, brdf_map, draw
from mitsuba_diffraction.analysis.maps.picture import signed
from mitsuba_diffraction.analysis.pictures import patches_figure
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.cli import main as command
from mitsuba_diffraction.errors import DiffractionError, DiffractionWarning
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.gratings import blazed, cd, dvd, elaphe_like, xenopeltis_like

from .pages import exit_code, measured_options, measured_patch, write_jpeg

LOOKALIKES = (elaphe_like, xenopeltis_like, cd, dvd)
LIGHTS = (LightDirection(0.0), LightDirection(45.0, 180.0))
#: Names of the snakes' pictures and what is rendered: scene, azimuth of the sun in degrees.
SNAKES = {
    "snake": ("snake.xml", 120),
    "snake_other_light": ("snake.xml", 60),
    "xenopeltis": ("xenopeltis.xml", 120),
    "xenopeltis_other_light": ("xenopeltis.xml", 60),
}

_RESOLUTION = 300  # pixels of a map; drawn one to one
_DPI = 100
_SIZE = (900, 563)


def maps_figure(
    fields: Sequence[HeightField],
    lights: Sequence[LightDirection] = LIGHTS,
    *,
    resolution: int = _RESOLUTION,
    step: float = 5.0,
) -> Figure:
    """Draw a column for each patch and a row for each light, all with a reflectance of 1.

    A spectral variant of Mitsuba must be set. Each map has its own automatic exposure, stated
    above it.
    """
    side = 1.02 * resolution / _DPI
    rows, columns = len(lights), len(fields)
    figure = Figure(figsize=((side + 0.25) * columns + 0.45, (side + 0.45) * rows + 0.45))
    width, height = figure.get_size_inches()
    for column, field in enumerate(fields):
        bsdf = _perfect_reflector(field)
        for row, light in enumerate(lights):
            left = 0.55 + (side + 0.25) * column
            bottom = 0.5 + (side + 0.45) * (rows - 1 - row)
            box = (left / width, bottom / height, side / width, side / height)
            axes = figure.add_axes(box)
            result = brdf_map(bsdf, light.theta, light.phi, resolution=resolution, step=step)
            stops = result.exposure()
            draw(axes, result, stops)
            axes.tick_params(labelsize=7, labelbottom=row == rows - 1, labelleft=column == 0)
            axes.set_title(f"{field.name}, {light}; {signed(stops)} stops", fontsize=8)
            if row == rows - 1:
                axes.set_xlabel("x = sin θₒ cos φₒ", fontsize=8)
            if column == 0:
                axes.set_ylabel("y = sin θₒ sin φₒ", fontsize=8, labelpad=0)
    return figure


def _perfect_reflector(field: HeightField) -> Any:
    import mitsuba as mi

    from mitsuba_diffraction.plugin.dictionary import bsdf_dict

    with warnings.catch_warnings():
        # periodic gratings are given by one period, and steep look-alikes are what is wanted
        warnings.simplefilter("ignore", DiffractionWarning)
        return mi.load_dict(bsdf_dict(field, material="none"))


def render_snakes(
    folder: Path, scenes: Path, *, spp: int, size: tuple[int, int] = _SIZE
) -> list[Path]:
    """Render all `SNAKES` to JPEG files in `folder`."""
    written = []
    for name, (scene, azimuth) in SNAKES.items():
        file = scenes / scene
        if not file.is_file():
            raise DiffractionError(
                f"'{file}' does not exist; run this where the project's scenes are, or name their "
                "folder with --scenes"
            )
        output = folder / f"{name}.jpg"
        with tempfile.TemporaryDirectory() as temporary:
            png = Path(temporary, "picture.png")
            values = {
                "light": "daylight.xml",
                "sun_azimuth": azimuth,
                "resx": size[0],
                "resy": size[1],
            }
            defined = [part for key, value in values.items() for part in ("-D", f"{key}={value}")]
            with contextlib.redirect_stdout(io.StringIO()):  # it would name the temporary file
                code = command(["render", str(file), "-o", str(png), "-s", str(spp), *defined])
            if code != 0:
                raise DiffractionError(f"rendering '{file}' failed; see above")
            write_jpeg(png, output)
        written.append(output)
    return written


def _patches(args: argparse.Namespace) -> None:
    """Draw all look-alikes, below a measured patch if there is one."""
    fields = [*_measured(args), *(make() for make in LOOKALIKES)]
    with atomic_path(args.output / "patches.png") as path:
        patches_figure(fields).savefig(path, dpi=80, format="png")


def _maps(args: argparse.Namespace) -> None:
    """Draw maps of a measured patch, look-alikes of two snakes, a CD and a blazed grating."""
    from mitsuba_diffraction.scene.load import set_variant

    fields = [*_measured(args), elaphe_like(), xenopeltis_like(), cd(), blazed(2.5, 0.25)]
    set_variant(None)
    with atomic_path(args.output / "maps.png") as path:
        maps_figure(fields).savefig(path, dpi=_DPI, format="png")


def _snakes(args: argparse.Namespace) -> None:
    render_snakes(args.output, args.scenes, spp=args.spp)


def _measured(args: argparse.Namespace) -> list[HeightField]:
    patch = measured_patch(args)
    return [] if patch is None else [patch]


#: The figures by name, in the order in which they are made.
FIGURES: dict[str, Callable[[argparse.Namespace], None]] = {
    "patches": _patches,
    "maps": _maps,
    "snakes": _snakes,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Make the requested pictures, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.pictures")
    parser.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs/images"))
    parser.add_argument(
        "--only", metavar="NAME", action="append", choices=tuple(FIGURES),
        help=f"one of {', '.join(FIGURES)}; may be given several times",
    )  # fmt: skip
    for names, how in measured_options("height field to compare with, drawn first"):
        parser.add_argument(*names, **how)
    parser.add_argument("--scenes", metavar="FOLDER", type=Path, default=Path("scenes"))
    parser.add_argument("-s", "--spp", metavar="N", type=int, default=64, help="of renderings")
    args = parser.parse_args(argv)
    args.output.mkdir(parents=True, exist_ok=True)
    for name in args.only or FIGURES:
        start = time.perf_counter()
        code = exit_code(name, partial(FIGURES[name], args))
        if code != 0:
            return code
        print(f"{name}: {time.perf_counter() - start:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
