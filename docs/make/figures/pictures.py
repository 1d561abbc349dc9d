"""Pictures of docs/images: patches and their light, BRDF maps, the snake of the README.

    python -m docs.make.figures.pictures -o docs/images \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import LightDirection, brdf_map, contact_sheet
from mitsuba_diffraction.analysis.pictures import patches_figure
from mitsuba_diffraction.analysis.timing import quiet_bsdf
from mitsuba_diffraction.heights.gratings import blazed, cd, dvd, elaphe_like, xenopeltis_like
from mitsuba_diffraction.scene import set_variant

from .pages import measured_options, measured_patch, option, program, run, write_figure, write_jpeg

LOOKALIKES = (elaphe_like, xenopeltis_like, cd, dvd)
MAPPED = (elaphe_like, xenopeltis_like, cd, partial(blazed, 2.5, 0.25))
LIGHTS = (LightDirection(0.0), LightDirection(45.0, 180.0))


def _patches(args: argparse.Namespace) -> None:
    """Draw all look-alikes, below a measured patch if there is one."""
    fields = [*_measured(args), *(make() for make in LOOKALIKES)]
    write_figure(args.output / "patches.png", patches_figure(fields), 80)


def _maps(args: argparse.Namespace) -> None:
    """Draw maps of a measured patch, look-alikes of two snakes, a CD and a blazed grating.

    Each patch has a column with a reflectance of 1, and each light a row.
    """
    set_variant(None)
    fields = [*_measured(args), *(make() for make in MAPPED)]
    # a periodic grating is one period, and the look-alikes are steep on purpose
    bsdfs = {field.name: quiet_bsdf(field, material="none") for field in fields}
    maps = {
        f"{name}, {light}": brdf_map(bsdf, light.theta, light.phi, resolution=args.resolution)
        for light in LIGHTS
        for name, bsdf in bsdfs.items()
    }
    sheet = contact_sheet(
        list(maps.values()), list(maps), title="BRDF maps, reflectance 1", columns=len(fields)
    )
    write_figure(args.output / "maps.png", sheet)


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
    option("--resolution", metavar="N", type=int, default=300, help="of maps; drawn one to one"),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Make the requested pictures."""
    args.output.mkdir(parents=True, exist_ok=True)
    for name in args.only or FIGURES:
        start = time.perf_counter()
        FIGURES[name](args)
        print(f"{name}: {time.perf_counter() - start:.1f} s")
