"""BRDF maps of several patches beside each other, for two directions to the light.

    python -m docs.make.figures.maps -o docs/images/maps.png \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from mitsuba_diffraction.analysis.maps import Light, brdf_map, draw
from mitsuba_diffraction.analysis.maps.picture import signed
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionWarning
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.gratings import blazed, cd, elaphe_like, xenopeltis_like

from .program import add_measured, exit_code, measured_patch

LIGHTS = (Light(0.0), Light(45.0, 180.0))

_RESOLUTION = 300  # pixels of a map; drawn one to one
_DPI = 100


def default_patches(seed: int = 0) -> list[HeightField]:
    """Look-alikes of two snakes and a CD, and a blazed grating."""
    return [
        elaphe_like(seed=seed),
        xenopeltis_like(seed=seed),
        cd(seed=seed),
        blazed(period=2.5, depth=0.25),
    ]


def maps_figure(
    fields: Sequence[HeightField],
    lights: Sequence[Light] = LIGHTS,
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


def main(argv: Sequence[str] | None = None) -> int:
    """Write the figure, with a measured patch first where one is given."""
    from mitsuba_diffraction.scene.load import set_variant

    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.maps")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images/maps.png"))
    add_measured(parser, "height field to compare with, drawn first")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--resolution", type=int, default=_RESOLUTION)
    args = parser.parse_args(argv)

    def work() -> None:
        measured = measured_patch(args)
        fields = [] if measured is None else [measured]
        fields += default_patches(args.seed)
        set_variant(None)
        with atomic_path(args.output) as path:
            maps_figure(fields, resolution=args.resolution).savefig(path, dpi=_DPI)

    return exit_code("maps", work)


if __name__ == "__main__":
    sys.exit(main())
