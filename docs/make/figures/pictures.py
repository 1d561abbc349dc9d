"""Pictures of docs/images: patches and their light, BRDF maps, the snake of the README.

    python -m docs.make.figures.pictures -o docs/images \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import LightDirection, brdf_map, draw
from mitsuba_diffraction.analysis.pictures import patches_figure
from mitsuba_diffraction.analysis.timing import quiet_bsdf
from mitsuba_diffraction.heights.gratings import blazed, cd, dvd, elaphe_like, xenopeltis_like

from .pages import measured_options, measured_patch, option, program, run, write_figure, write_jpeg

LOOKALIKES = (elaphe_like, xenopeltis_like, cd, dvd)
LIGHTS = (LightDirection(0.0), LightDirection(45.0, 180.0))

_RESOLUTION = 300  # pixels of a map; drawn one to one
_DPI = 100


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
        # a periodic grating is one period, and the look-alikes are steep on purpose
        bsdf = quiet_bsdf(field, material="none")
        for row, light in enumerate(lights):
            left = 0.55 + (side + 0.25) * column
            bottom = 0.5 + (side + 0.45) * (rows - 1 - row)
            box = (left / width, bottom / height, side / width, side / height)
            axes = figure.add_axes(box)
            result = brdf_map(bsdf, light.theta, light.phi, resolution=resolution, step=step)
            stops = result.exposure()
            draw(axes, result, stops)
            shown = f"{stops:+g}".replace("-", "−")
            axes.tick_params(labelsize=7, labelbottom=row == rows - 1, labelleft=column == 0)
            axes.set_title(f"{field.name}, {light}; {shown} stops", fontsize=8)
            if row == rows - 1:
                axes.set_xlabel("x = sin θₒ cos φₒ", fontsize=8)
            if column == 0:
                axes.set_ylabel("y = sin θₒ sin φₒ", fontsize=8, labelpad=0)
    return figure


def _patches(args: argparse.Namespace) -> None:
    """Draw all look-alikes, below a measured patch if there is one."""
    fields = [*_measured(args), *(make() for make in LOOKALIKES)]
    write_figure(args.output / "patches.png", patches_figure(fields), 80)


def _maps(args: argparse.Namespace) -> None:
    """Draw maps of a measured patch, look-alikes of two snakes, a CD and a blazed grating."""
    from mitsuba_diffraction.scene import set_variant

    fields = [*_measured(args), elaphe_like(), xenopeltis_like(), cd(), blazed(2.5, 0.25)]
    set_variant(None)
    write_figure(args.output / "maps.png", maps_figure(fields), _DPI)


def _snake(args: argparse.Namespace) -> None:
    """Render the snake of the README in the sun."""
    values = {"light": "daylight.xml", "sun_azimuth": 120, "resx": 900, "resy": 563}
    defined = [part for key, value in values.items() for part in ("-D", f"{key}={value}")]
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder, "picture.png")
        run("render", args.scenes / "snake.xml", "-o", picture, "-s", args.spp, *defined)
        write_jpeg(picture, args.output / "snake.jpg")


def _measured(args: argparse.Namespace) -> list[HeightField]:
    patch = measured_patch(args)
    return [] if patch is None else [patch]


#: The figures by name, in the order in which they are made.
FIGURES: dict[str, Callable[[argparse.Namespace], None]] = {
    "patches": _patches,
    "maps": _maps,
    "snake": _snake,
}


@program(
    option("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs/images")),
    option(
        "--only", metavar="NAME", action="append", choices=tuple(FIGURES),
        help=f"one of {', '.join(FIGURES)}; may be given several times",
    ),
    *measured_options("height field to compare with, drawn first"),
    option("--scenes", metavar="FOLDER", type=Path, default=Path("scenes")),
    option("-s", "--spp", metavar="N", type=int, default=64, help="of renderings"),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Make the requested pictures."""
    args.output.mkdir(parents=True, exist_ok=True)
    for name in args.only or FIGURES:
        start = time.perf_counter()
        FIGURES[name](args)
        print(f"{name}: {time.perf_counter() - start:.1f} s")
